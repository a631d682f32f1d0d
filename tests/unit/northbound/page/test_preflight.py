"""Certificate and key of the page: files that cannot be used are named at their keys of the site file."""

from __future__ import annotations

import datetime
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import NameOID

from bridge.base.errors import FileFaults
from bridge.config import PageTable
from bridge.northbound.page.preflight import check_page
from bridge.text import render

NOW = datetime.datetime.now(datetime.UTC)
DAY = datetime.timedelta(1)


def pair(folder: Path, name: str, ends: datetime.datetime = NOW + DAY) -> tuple[Path, Path]:
    key = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, name)])
    built = x509.CertificateBuilder().subject_name(subject).issuer_name(subject).public_key(key.public_key())
    built = built.serial_number(1).not_valid_before(NOW - 9 * DAY).not_valid_after(ends)
    files = folder / f"{name}.crt", folder / f"{name}.key"
    files[0].write_bytes(built.sign(key, hashes.SHA256()).public_bytes(serialization.Encoding.PEM))
    kind = serialization.PrivateFormat.PKCS8, serialization.NoEncryption()
    files[1].write_bytes(key.private_bytes(serialization.Encoding.PEM, *kind))
    return files


def told(folder: Path, certificate: Path, key: Path, language: str = "en") -> str:
    """The fault, at the line of its key; empty where there is none."""
    site = folder / "site.toml"
    site.write_text(f'[page]\ncertificate = "{certificate}"\nprivate_key = "{key}"\n')
    table = PageTable.model_construct(certificate=str(certificate), private_key=str(key))
    try:
        check_page(table, site)
    except FileFaults as error:
        (fault,) = error.faults
        assert fault.file == str(site)
        assert site.read_text().splitlines()[fault.line - 1].startswith(fault.key.removeprefix("page."))
        return f"{fault.key}: {render(fault.said, language).removeprefix(f'{folder}/')}"
    return ""


def test_a_pair_that_fits_is_no_fault_and_without_one_nothing_is_looked_at(tmp_path: Path) -> None:
    assert told(tmp_path, *pair(tmp_path, "a")) == ""
    check_page(PageTable.model_construct(certificate=None, private_key=None), tmp_path / "none.toml")


def test_the_key_of_another_certificate_is_named(tmp_path: Path) -> None:
    (certificate, _), (_, key) = pair(tmp_path, "a"), pair(tmp_path, "b")
    assert told(tmp_path, certificate, key) == f"page.private_key: b.key is not the key of {certificate}"


def test_one_that_has_run_out_is_named(tmp_path: Path) -> None:
    ended = NOW - DAY
    found = told(tmp_path, *pair(tmp_path, "a", ended))
    assert found == f"page.certificate: a.crt was valid until {ended:%Y-%m-%d}"
    found = told(tmp_path, *pair(tmp_path, "a", ended), "de")
    assert found == f"page.certificate: a.crt war gültig bis {ended:%Y-%m-%d}"


@pytest.mark.parametrize("which", ["certificate", "key"])
@pytest.mark.parametrize("content", [None, b"nonsense"])
def test_what_cannot_be_used_is_named(tmp_path: Path, which: str, content: bytes | None) -> None:
    certificate, key = pair(tmp_path, "a")
    spoilt = certificate if which == "certificate" else key
    if content is None:
        spoilt.unlink()
        why = "cannot be used: no such file or directory"
    else:
        spoilt.write_bytes(content)
        lacks = "certificate" if which == "certificate" else "private key without a password"
        why = f"cannot be used: it holds no {lacks}"
    place = "page.certificate: a.crt" if which == "certificate" else "page.private_key: a.key"
    assert told(tmp_path, certificate, key) == f"{place} {why}"
