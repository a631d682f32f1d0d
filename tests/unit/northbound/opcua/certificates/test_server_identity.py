"""The server's identity is the installation's: it stays when the machine gets another name, and what is there
is never overwritten."""

from __future__ import annotations

import ipaddress
import logging
import socket
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import Encoding

from bridge.base.errors import FileFaults, Unavailable
from bridge.config import OpcUaTable
from bridge.northbound.opcua.certificates import selfsigned
from bridge.northbound.opcua.certificates.own_certificate import load_own
from bridge.northbound.opcua.certificates.ownnames import missing_in, names_of
from bridge.northbound.opcua.certificates.selfsigned import self_signed
from bridge.northbound.opcua.certificates.server_identity import (
    CERTIFICATE,
    KEY,
    ServerIdentity,
    server_identity,
)

LOCAL = "127.0.0.1:4840"
FOREIGN = "urn:somebody:else"


def opcua(**more: object) -> OpcUaTable:
    return OpcUaTable.model_validate({"listen": LOCAL, **more})


@pytest.fixture
def host(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Names of the machine, the last one now."""
    names = ["hall-3"]
    monkeypatch.setattr(socket, "gethostname", lambda: names[-1])
    return names


def files(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def named(identity: ServerIdentity) -> set[str]:
    found = identity.certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    addresses = found.get_values_for_type(x509.IPAddress)
    return {*found.get_values_for_type(x509.DNSName), *map(str, addresses)}


def test_another_host_name_changes_nothing(tmp_path: Path, host: list[str]) -> None:
    first = server_identity(opcua(), tmp_path)
    assert first.application_uri == "urn:hall-3:drivebridge"
    before = files(tmp_path)
    host.append("9f31c2aa0b17")
    again = server_identity(opcua(), tmp_path)
    assert (again.application_uri, again.certificate) == (first.application_uri, first.certificate)
    assert files(tmp_path) == before


def test_a_certificate_that_was_taken_away_comes_back_with_the_same_uri_and_key(
    tmp_path: Path, host: list[str]
) -> None:
    first = server_identity(opcua(), tmp_path)
    (tmp_path / CERTIFICATE).unlink()
    host.append("another")
    again = server_identity(opcua(names=["hall.example"]), tmp_path)
    assert again.certificate != first.certificate
    assert again.application_uri == first.application_uri
    assert again.private_key.public_key() == first.private_key.public_key()
    assert "hall.example" in named(again)


def test_the_uri_of_the_site_file_is_taken_where_nothing_is_kept(tmp_path: Path, host: list[str]) -> None:
    for name in ("container-1", "container-2"):
        host.append(name)
        made = server_identity(opcua(application_uri="urn:plant:hall-3"), tmp_path / name)
        assert made.application_uri == "urn:plant:hall-3"


def foreign(folder: Path, uri: str, *, days: int = 100) -> None:
    """A certificate that somebody else has put in the place of ours, with its key."""
    key, pem = selfsigned.new_key()
    made = self_signed(key, uri, ["localhost"])
    begin = datetime.now(UTC) - timedelta(days=200)
    builder = x509.CertificateBuilder(made.issuer, made.subject, key.public_key(), made.serial_number)
    builder = builder.not_valid_before(begin).not_valid_after(begin + timedelta(days=200 + days))
    for extension in made.extensions:
        builder = builder.add_extension(extension.value, extension.critical)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / CERTIFICATE).write_bytes(builder.sign(key, SHA256()).public_bytes(Encoding.DER))
    (folder / KEY).write_bytes(pem)


def test_a_foreign_certificate_is_used_as_it_is(tmp_path: Path, host: list[str]) -> None:
    foreign(tmp_path, FOREIGN)
    before = files(tmp_path)
    assert server_identity(opcua(), tmp_path).application_uri == FOREIGN
    assert files(tmp_path) == before


def test_an_expired_one_is_used_on_and_told(
    tmp_path: Path, host: list[str], caplog: pytest.LogCaptureFixture
) -> None:
    """The other protocols must not end with it, and clients may take it."""
    foreign(tmp_path, FOREIGN, days=-1)
    before = files(tmp_path)
    with caplog.at_level(logging.WARNING):
        assert server_identity(opcua(), tmp_path).application_uri == FOREIGN
    assert files(tmp_path) == before
    assert "was valid until" in caplog.text
    assert CERTIFICATE in caplog.text


def test_a_uri_that_is_not_the_certificates_is_a_fault_of_the_site_file(tmp_path: Path) -> None:
    foreign(tmp_path, FOREIGN)
    before = files(tmp_path)
    with pytest.raises(FileFaults) as raised:
        server_identity(opcua(application_uri="urn:plant:hall-3"), tmp_path)
    (fault,) = raised.value.faults
    assert fault.key == "opcua.application_uri"
    assert FOREIGN in fault.message
    assert files(tmp_path) == before


@pytest.mark.landing(2)
@pytest.mark.parametrize("damaged", [CERTIFICATE, KEY])
def test_what_is_damaged_is_named_and_stays(tmp_path: Path, damaged: str) -> None:
    server_identity(opcua(), tmp_path)
    (tmp_path / damaged).write_bytes(b"-----BEGIN")
    before = files(tmp_path)
    with pytest.raises(FileFaults) as raised:
        server_identity(opcua(), tmp_path)
    assert damaged in raised.value.faults[0].file
    assert "trust anew" in (raised.value.faults[0].hint or "")
    assert files(tmp_path) == before


def test_a_certificate_whose_key_is_gone_is_not_replaced(tmp_path: Path) -> None:
    server_identity(opcua(), tmp_path)
    (tmp_path / KEY).unlink()
    before = files(tmp_path)
    with pytest.raises(FileFaults, match=KEY):
        server_identity(opcua(), tmp_path)
    assert files(tmp_path) == before


def test_the_key_is_for_the_service_alone(tmp_path: Path) -> None:
    server_identity(opcua(), tmp_path / "opcua")
    assert (tmp_path / "opcua" / KEY).stat().st_mode & 0o777 == 0o600
    assert (tmp_path / "opcua").stat().st_mode & 0o777 == 0o700


def test_a_state_folder_that_is_a_file_is_named(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("")
    with pytest.raises(Unavailable, match="state"):
        server_identity(opcua(), tmp_path / "state" / "opcua")


def test_a_certificate_of_the_site_file_says_the_uri(tmp_path: Path, host: list[str]) -> None:
    foreign(tmp_path / "given", FOREIGN)
    given = {
        "certificate": str(tmp_path / "given" / CERTIFICATE),
        "private_key": str(tmp_path / "given" / KEY),
    }
    own = load_own(tmp_path / "given" / CERTIFICATE, tmp_path / "given" / KEY)
    found = server_identity(opcua(**given), tmp_path / "state")
    assert (found.application_uri, found.certificate) == (FOREIGN, own.certificate)
    assert not (tmp_path / "state").exists()
    with pytest.raises(FileFaults, match="application_uri"):
        server_identity(opcua(application_uri="urn:x:y", **given), tmp_path / "state")


# names


def test_all_of_them_are_in_the_certificate(tmp_path: Path, host: list[str]) -> None:
    settings = opcua(listen="0.0.0.0:4840", names=["bridge.example", "2001:db8::1"])
    made = server_identity(settings, tmp_path)
    wanted = names_of(settings.listen, settings.names)
    assert missing_in(made.certificate, wanted) == []
    assert named(made) == set(wanted)


def test_a_host_name_that_no_certificate_can_have_is_left_out(tmp_path: Path, host: list[str]) -> None:
    host.append("halle-süd")
    assert "localhost" in named(server_identity(opcua(), tmp_path))


def test_names_that_came_later_are_told(
    tmp_path: Path, host: list[str], caplog: pytest.LogCaptureFixture
) -> None:
    server_identity(opcua(), tmp_path)
    with caplog.at_level(logging.WARNING):
        server_identity(opcua(names=["bridge.example", "localhost"]), tmp_path)
    assert "does not name bridge.example, and" in caplog.text


def test_an_address_that_came_later_is_told(
    tmp_path: Path, host: list[str], caplog: pytest.LogCaptureFixture
) -> None:
    """A box that was first started at a desk."""
    server_identity(opcua(), tmp_path)
    with caplog.at_level(logging.WARNING):
        server_identity(opcua(listen="192.168.10.1:4840"), tmp_path)
    assert "does not name 192.168.10.1, and" in caplog.text
    caplog.clear()
    with caplog.at_level(logging.WARNING):
        server_identity(opcua(), tmp_path)
    assert not caplog.text


@pytest.mark.parametrize(
    ("key", "value"),
    [("names", ["halle süd"]), ("names", [""]), ("application_uri", "hall 3"), ("names", ["a..b"])],
)
def test_what_is_none_is_a_fault_of_the_site_file(key: str, value: object) -> None:
    with pytest.raises(ValueError, match=r"must be a (host name|URI)"):
        opcua(**{key: value})


def test_addresses_are_written_in_one_way() -> None:
    (name,) = opcua(names=["2001:DB8:0::1"]).names
    assert ipaddress.ip_address(name).compressed == name == "2001:db8::1"
