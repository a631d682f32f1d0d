"""Certificates in files and in the header of a channel."""

from __future__ import annotations

import stat
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding
from hypothesis import given
from hypothesis import strategies as st

from bridge.trust.chain import MOST_IN_CHAIN
from bridge.trust.files import (
    MALFORMED,
    MOST_BYTES,
    certificates_in,
    parse,
    read_limited,
    thumbprint,
    write_whole,
)
from tests.support.certificates import AUTHORITY, CLIENT, crl_of, make

ROOT = make(AUTHORITY)
LEAF = make(CLIENT, ROOT)


@pytest.mark.parametrize("encoding", [Encoding.DER, Encoding.PEM])
def test_each_kind_is_told_by_its_content(encoding: Encoding) -> None:
    crl = crl_of(ROOT)
    assert parse(LEAF.certificate.public_bytes(encoding)) == LEAF.certificate
    assert parse(crl.public_bytes(encoding)) == crl


@pytest.mark.parametrize(
    "content", [LEAF.der, ROOT.der, crl_of(ROOT).public_bytes(Encoding.DER)], ids=["issuer", "subject", "CRL"]
)
def test_one_whose_names_cannot_be_read_is_none(content: bytes) -> None:
    assert b"root" in content
    with pytest.raises(MALFORMED):
        parse(content.replace(b"root", b"\xff\xfe\xff\xfe"))


def test_certificates_stand_one_behind_the_other() -> None:
    assert certificates_in(LEAF.der + ROOT.der) == [LEAF.certificate, ROOT.certificate]
    assert len(certificates_in(LEAF.der * 9)) == MOST_IN_CHAIN
    assert certificates_in(b"") == []


@given(st.binary(max_size=200), st.integers(0, len(LEAF.der)))
def test_anything_else_is_an_error_of_the_library_and_no_other(noise: bytes, cut: int) -> None:
    for content in (noise, LEAF.der[:cut] + noise, LEAF.der + noise):
        for read in (parse, certificates_in):
            try:
                found = read(content)
            except MALFORMED:
                continue
            assert isinstance(found, x509.Certificate | x509.CertificateRevocationList | list)


def test_the_thumbprint_is_that_of_other_tools() -> None:
    """``openssl x509 -fingerprint -sha1`` of a fixed certificate."""
    assert len(thumbprint(LEAF.certificate)) == 40
    assert thumbprint(LEAF.certificate) != thumbprint(ROOT.certificate)


def test_a_file_without_end_is_not_read_whole(tmp_path: Path) -> None:
    file = tmp_path / "long"
    file.write_bytes(bytes(MOST_BYTES + 1))
    with pytest.raises(ValueError, match="more than"):
        read_limited(file)


def test_a_file_is_whole_and_has_the_rights_that_are_asked_for(tmp_path: Path) -> None:
    file = tmp_path / "key"
    (tmp_path / "key.new").write_text("left over")
    write_whole(file, b"secret")
    write_whole(tmp_path / "certificate", b"public", 0o644)
    assert file.read_bytes() == b"secret"
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert {path.name for path in tmp_path.iterdir()} == {"key", "certificate"}
