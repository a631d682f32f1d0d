"""Checks before a bus is opened: files and folders of the site."""

from __future__ import annotations

import errno
import os
import tempfile
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import Encoding

from bridge.base.errors import BridgeError, FileFaults, Unavailable
from bridge.config import load_site
from bridge.northbound.opcua.certificates.selfsigned import new_key, self_signed
from bridge.service.preflight import check_files
from tests.support import sites

KEY, KEY_PEM = new_key()
OTHER_PEM = new_key()[1]


def certificate(begins_days: int, ends_days: int) -> bytes:
    """One that is valid from then to then, counted from today."""
    now = datetime.now(UTC)
    name = x509.Name([])
    builder = x509.CertificateBuilder(name, name, KEY.public_key(), x509.random_serial_number())
    builder = builder.not_valid_before(now + timedelta(days=begins_days))
    return (
        builder.not_valid_after(now + timedelta(days=ends_days))
        .sign(KEY, SHA256())
        .public_bytes(Encoding.PEM)
    )


def check(folder: Path, keys: str = "") -> None:
    node = sites.node(sites.drive("fu1", "opcua", 1000))
    path = sites.write(folder, sites.bus(node), f"[opcua]\n{keys}")
    check_files(load_site(path), path, fronts=True)


def told(folder: Path, keys: str) -> BridgeError:
    with pytest.raises(BridgeError) as raised:
        check(folder, keys)
    return raised.value


GOOD = certificate(-1, 1)
PAIR = 'certificate = "c.pem"\nprivate_key = "k.pem"\n'


@pytest.mark.landing(9)
@pytest.mark.parametrize(
    ("contents", "keys", "expected"),
    [
        ((None, KEY_PEM), PAIR, "opcua.certificate: c.pem cannot be used: no such file"),
        ((b"", KEY_PEM), PAIR, "opcua.certificate: c.pem cannot be used: "),
        ((GOOD, None), PAIR, "opcua.private_key: k.pem cannot be used: no such file"),
        ((GOOD, b"-----BEGIN"), PAIR, "opcua.private_key: k.pem cannot be used: "),
        ((GOOD, OTHER_PEM), PAIR, "opcua.private_key: k.pem is not the key of c.pem"),
        ((certificate(-9, -1), KEY_PEM), PAIR, "opcua.certificate: c.pem was valid until "),
        ((GOOD, KEY_PEM), 'certificate = "c.pem"\n', "opcua.private_key: is missing"),
        ((GOOD, KEY_PEM), f'{PAIR}trusted_dir = "t"', "opcua.trusted_dir: t no such file"),
        (
            (GOOD, KEY_PEM),
            f'{PAIR}[[opcua.user]]\nname = "a"\nrole = "operator"\npassword_hash = "secret"\n',
            "opcua.user[0].password_hash: is not an Argon2 hash",
        ),
    ],
)
def test_what_cannot_be_used_is_named_with_file_line_and_key(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    contents: tuple[bytes | None, bytes | None],
    keys: str,
    expected: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    for name, content in zip(("c.pem", "k.pem"), contents, strict=True):
        if content is not None:
            Path(name).write_bytes(content)
    error = told(tmp_path, keys)
    assert isinstance(error, FileFaults)
    assert error.exit_code == 2
    [fault] = error.faults
    assert f"{fault.key}: {fault.message}".startswith(expected)
    line = Path("site.toml").read_text("utf-8").splitlines()[fault.line - 1]
    assert line.startswith(fault.key.rpartition(".")[2]) or line == "[opcua]"
    assert fault.file == str(tmp_path / "site.toml")


@pytest.mark.parametrize(
    ("contents", "expected"),
    [
        ((None, KEY_PEM), "page.certificate: c.pem cannot be used: no such file"),
        ((b"", KEY_PEM), "page.certificate: c.pem cannot be used: it holds no certificate"),
        ((GOOD, None), "page.private_key: k.pem cannot be used: no such file"),
        ((GOOD, b"-----BEGIN"), "page.private_key: k.pem cannot be used: it holds no private key"),
        ((GOOD, OTHER_PEM), "page.private_key: k.pem is not the key of c.pem"),
        ((certificate(-9, -1), KEY_PEM), "page.certificate: c.pem was valid until "),
        ((certificate(1, 9), KEY_PEM), ""),
        ((GOOD, KEY_PEM), ""),
    ],
)
def test_the_page_s_certificate_is_looked_at_too(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    contents: tuple[bytes | None, bytes | None],
    expected: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    for name, content in zip(("c.pem", "k.pem"), contents, strict=True):
        if content is not None:
            Path(name).write_bytes(content)
    node = sites.node(sites.drive("fu1", "none", 0))
    path = sites.write(tmp_path, sites.bus(node), f"[page]\n{PAIR}")
    if not expected:
        check_files(load_site(path), path, fronts=True)
        return
    with pytest.raises(FileFaults) as raised:
        check_files(load_site(path), path, fronts=True)
    [fault] = raised.value.faults
    assert f"{fault.key}: {fault.message}".startswith(expected)
    line = path.read_text("utf-8").splitlines()[fault.line - 1]
    assert line.startswith(fault.key.rpartition(".")[2])


@pytest.mark.parametrize("begins", [-1, 1], ids=["valid", "of a box whose clock is not set yet"])
def test_a_certificate_that_fits_is_taken(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, begins: int
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("c.pem").write_bytes(certificate(begins, 9))
    Path("k.pem").write_bytes(KEY_PEM)
    check(tmp_path, PAIR)


def test_without_one_the_bridge_s_own_is_made_before_the_bus_is_opened(tmp_path: Path) -> None:
    check(tmp_path)
    made = tmp_path / "state" / "certificates" / "own" / "own_certificate.der"
    uris = x509.load_der_x509_certificate(made.read_bytes()).extensions.get_extension_for_class(
        x509.SubjectAlternativeName
    )
    assert uris.value.get_values_for_type(x509.UniformResourceIdentifier)


def test_our_own_certificate_says_what_opcua_asks_for() -> None:
    made = self_signed(KEY, "urn:box:drivebridge", ["box"])
    assert made.public_key() == KEY.public_key()
    usage = made.extensions.get_extension_for_class(x509.KeyUsage).value
    assert usage.digital_signature
    assert usage.key_encipherment
    assert usage.data_encipherment
    assert usage.content_commitment
    made.verify_directly_issued_by(made)


def test_a_state_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("a file", "utf-8")
    error = told(tmp_path, "")
    assert isinstance(error, Unavailable)
    assert error.exit_code == 3
    assert str(error).startswith(f"site.state_dir = '{tmp_path}/state': ")


@pytest.mark.landing(2)
@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT])
def test_a_full_disk_is_told_and_stops_only_who_needs_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, number: int
) -> None:
    check(tmp_path)
    caplog.clear()

    def full(*_: object, **__: object) -> None:
        raise OSError(number, os.strerror(number))

    monkeypatch.setattr(tempfile, "TemporaryFile", full)
    check(tmp_path)
    [record] = caplog.records
    assert "audit log and EEPROM counts are not kept" in record.message
    # Without a certificate of its own yet, OPC UA cannot be served at all.
    for file in (tmp_path / "state" / "certificates" / "own").iterdir():
        file.unlink()
    monkeypatch.setattr(os, "open", full)
    error = told(tmp_path, "")
    assert isinstance(error, Unavailable)
    assert "state_dir" in str(error)
