"""``drivebridge certificates``: on the folders of a site, without a service."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from bridge.base.errors import OperationFailed
from bridge.cli.app import make_app
from bridge.config import OpcUaTable
from bridge.northbound.opcua.certificates.own_files import CERTIFICATE, own_folder
from bridge.northbound.opcua.certificates.server_identity import server_identity
from bridge.trust import TrustStore
from bridge.trust.files import thumbprint
from tests.support import sites
from tests.support.certificates import CLIENT, DAY, NOW, make

STRANGER = make()
PRINT = thumbprint(STRANGER.certificate)


@pytest.fixture
def site(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return sites.write(tmp_path, sites.bus(sites.node(sites.drive("fu1", "opcua", 1000, ""))), "[opcua]\n")


@pytest.fixture
def store(tmp_path: Path) -> TrustStore:
    made = TrustStore(tmp_path / "state" / "certificates")
    made.prepare()
    return made


def run(command: str, site: Path, *arguments: str) -> str:
    words = ["certificates", command, str(site), *arguments]
    result = CliRunner().invoke(make_app("certificates"), words, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def listed(site: Path) -> list[dict[str, Any]]:
    return json.loads(run("list", site, "--json"))


def test_a_refused_client_is_listed_with_its_reason_trusted_and_rejected_again(
    site: Path, store: TrustStore
) -> None:
    store.keep_rejected([STRANGER.certificate], "10.0.0.1", 0.0)
    (one,) = listed(site)
    assert (one["place"], one["thumbprint"], one["subject"]) == ("rejected", PRINT, "CN=client")
    assert (one["fault"], one["reason"]) == ("BadCertificateUntrusted", "it is not trusted")
    assert (one["since"], one["until"]) == (CLIENT.begins.isoformat(), CLIENT.ends.isoformat())
    assert run("trust", site, PRINT[:8]) == f"trusted: {PRINT}, CN=client\n"
    assert store.lists().trusts(STRANGER.certificate)
    (one,) = listed(site)
    assert (one["place"], one["fault"]) == ("trusted", None)
    assert run("reject", site, PRINT) == f"rejected: {PRINT}\n"
    assert not store.lists().trusts(STRANGER.certificate)
    assert "rejected" in run("list", site)


def test_a_certificate_in_a_file_is_trusted(site: Path, store: TrustStore, tmp_path: Path) -> None:
    file = tmp_path / "panel.der"
    file.write_bytes(STRANGER.der)
    run("trust", site, str(file))
    assert store.lists().trusts(STRANGER.certificate)


def test_one_that_has_run_out_says_so(site: Path, store: TrustStore) -> None:
    old = make(CLIENT.but(ends=NOW - DAY / 2))
    (store.trusted / "old.der").write_bytes(old.der)
    (one,) = listed(site)
    assert one["fault"] == "BadCertificateTimeInvalid"


@pytest.mark.parametrize(
    ("command", "argument", "said"),
    [
        ("trust", "0123456789ab", "no certificate in"),
        ("reject", "0123456789ab", "no certificate in"),
        ("trust", "SITE", "cannot be used"),
    ],
)
def test_what_is_not_there_is_an_error(
    site: Path, store: TrustStore, command: str, argument: str, said: str
) -> None:
    with pytest.raises(OperationFailed, match=said):
        run(command, site, str(site) if argument == "SITE" else argument)


@pytest.mark.parametrize("new_key", [False, True])
def test_the_own_certificate_is_renewed_for_the_same_application(
    site: Path, tmp_path: Path, new_key: bool
) -> None:
    settings, folder = OpcUaTable.model_validate({}), own_folder(tmp_path / "state")
    before = server_identity(settings, folder)
    run("renew", site, *(["--new-key"] if new_key else []))
    after = server_identity(settings, folder)
    assert after.application_uri == before.application_uri
    assert after.certificate != before.certificate
    is_same_key = after.private_key.public_key() == before.private_key.public_key()
    assert is_same_key is not new_key
    assert [one["place"] for one in listed(site)] == ["own"]


def test_where_nothing_can_be_renewed_it_says_what_to_do(site: Path, tmp_path: Path) -> None:
    with pytest.raises(OperationFailed, match="the service makes one when it starts"):
        run("renew", site)
    named = site.read_text().replace("[opcua]\n", '[opcua]\ncertificate = "c.pem"\nprivate_key = "k.pem"\n')
    site.write_text(named)
    with pytest.raises(OperationFailed, match=r"the site file names .*c\.pem"):
        run("renew", site)
    assert not (tmp_path / "state" / "certificates" / "own" / CERTIFICATE).exists()
