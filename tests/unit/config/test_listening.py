"""Listening to a network: only clients that prove their identity are let in, or the site file says
otherwise."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.config import load_site
from bridge.lint import Severity, lint
from tests.support import sites

BEYOND = (
    "tcp/192.168.1.10:7447",
    "tcp/0.0.0.0:7447",
    "tcp/[::]:7447",
    "tcp/box.example:7447",
    "udp/10.0.0.1:7447",
    "tls/192.168.1.10:7447",
    "tls/192.168.1.10:7447#listen_certificate_file=/c.pem;enable_mtls=false",
    "quic/192.168.1.10:7447",
    "tcp/127.0.0.1.example:7447",
    "tcp/localhost.example:7447",
    "vsock/-1:1234",
)
LOCAL = (
    "tcp/127.0.0.1:7447",
    "tcp/127.0.0.12:7447",
    "tcp/localhost:7447",
    "tcp/[::1]:7447",
    "tcp/127.0.0.1:7447#so_sndbuf=65536",
    "unixsock-stream//run/drivebridge/z.sock",
    "tls/192.168.1.10:7447#listen_certificate_file=/c.pem;enable_mtls=true",
    "quic/192.168.1.10:7447#enable_mtls=true;root_ca_certificate_file=/ca.pem",
)
SECURED = ('user = "bridge"\npassword_file = "/etc/users"', "no_security = true", 'mode = "client"')


def site(folder: Path, *places: str, more: str = "") -> Path:
    listen = ", ".join(f'"{place}"' for place in places)
    zenoh = f"[zenoh]\nlisten = [{listen}]\n{more}\n"
    return sites.write(folder, sites.bus(sites.node(sites.drive("fu1", "none", 0))), zenoh)


@pytest.mark.parametrize("place", BEYOND)
def test_listening_beyond_loopback_needs_more(tmp_path: Path, place: str) -> None:
    with pytest.raises(FileFaults) as caught:
        load_site(site(tmp_path, "tcp/127.0.0.1:7447", place))
    [fault] = caught.value.faults
    assert "zenoh.listen[1]" in str(fault)
    for word in (place, "password_file", "enable_mtls", "no_security"):
        assert word in str(fault)
    for more in SECURED:
        load_site(site(tmp_path, place, more=more))


@pytest.mark.parametrize("place", LOCAL)
def test_loopback_and_certificates_need_no_more(tmp_path: Path, place: str) -> None:
    loaded = load_site(site(tmp_path, place))
    assert loaded.zenoh is not None
    assert place in loaded.zenoh.listen


def test_controllers_are_users_who_have_to_prove_it(tmp_path: Path) -> None:
    names = 'controllers = ["plc"]'
    for places in ((), ("tcp/127.0.0.1:7447",), ("tls/10.0.0.1:1#enable_mtls=true", "tcp/127.0.0.1:7447")):
        with pytest.raises(FileFaults, match="clients need not authenticate"):
            load_site(site(tmp_path, *places, more=names))
    load_site(site(tmp_path, "tls/10.0.0.1:1#enable_mtls=true", more=names))
    load_site(site(tmp_path, "tcp/10.0.0.1:1", more=f"{names}\n{SECURED[0]}"))
    for wrong in ("plc/1", "a b", "anonymous", ""):
        with pytest.raises(FileFaults, match="a user's name"):
            load_site(site(tmp_path, more=f'controllers = ["{wrong}"]\n{SECURED[0]}'))


def test_no_security_is_warned_of(tmp_path: Path) -> None:
    path = site(tmp_path, BEYOND[0], more="no_security = true")
    verdict = lint(load_site(path), {sites.FAMILY: sites.family(sites.FAMILY)}, path, {})
    told = [str(finding.fault) for finding in verdict.of(Severity.WARNING)]
    assert any("zenoh.no_security" in line and "under any name" in line for line in told), told
