"""Files of certificates and revocation lists, PEM or DER, in folders that people and tools fill."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path
from typing import Final

from cryptography import x509
from cryptography.exceptions import UnsupportedAlgorithm
from cryptography.hazmat.primitives.hashes import SHA1, SHA256
from cryptography.hazmat.primitives.serialization import Encoding

from bridge.trust.chain import MOST_IN_CHAIN

MOST_BYTES: Final = 1 << 20
"""Largest file that is read; a revocation list may be long."""
_CERTIFICATE: Final = b"-----BEGIN"
_CRL: Final = b"-----BEGIN X509 CRL"
_EXTRA: Final = "extradata"

MALFORMED: Final = (ValueError, TypeError, OverflowError, x509.InvalidVersion, UnsupportedAlgorithm)
"""Errors of cryptography for a file that is none, or one that is broken in any of its parts."""

Content = x509.Certificate | x509.CertificateRevocationList


def read_limited(path: Path) -> bytes:
    """Content of the file. Raises OSError, and ValueError for one that is larger than any of these."""
    with path.open("rb") as file:
        content = file.read(MOST_BYTES + 1)
    if len(content) > MOST_BYTES:
        raise ValueError(f"more than {MOST_BYTES} bytes")
    return content


def parse(content: bytes) -> Content:
    """A certificate, or a revocation list, whose names can be read. Raises one of ``MALFORMED``."""
    found = _parsed(content)
    # Names are parsed when they are looked at: in a list, one that is malformed would keep everybody out.
    found.issuer.public_bytes()
    if isinstance(found, x509.Certificate):
        found.subject.public_bytes()
    return found


def _parsed(content: bytes) -> Content:
    if _CRL in content:
        return x509.load_pem_x509_crl(content)
    if _CERTIFICATE in content:
        return x509.load_pem_x509_certificate(content)
    try:
        return x509.load_der_x509_certificate(content)
    except MALFORMED as error:
        with contextlib.suppress(*MALFORMED):
            return x509.load_der_x509_crl(content)
        raise error


def certificates_in(content: bytes) -> list[x509.Certificate]:
    """Certificates in DER, one behind the other as in a channel's header (OPC 10000-6 §6.2.6), the first the
    peer's own; at most as many as a chain may have. Raises one of ``MALFORMED``."""
    found: list[x509.Certificate] = []
    while content and len(found) < MOST_IN_CHAIN:
        certificate = _first(content)
        found.append(certificate)
        content = content[len(der(certificate)) :]
    return found


def _first(content: bytes) -> x509.Certificate:
    try:
        return x509.load_der_x509_certificate(content)
    except ValueError as error:
        if _EXTRA not in str(error).lower():
            raise
    # Two bytes of tag and form, and two of length: a certificate has between 256 and 65535 bytes.
    end = 4 + int.from_bytes(content[2:4])
    return x509.load_der_x509_certificate(content[:end])


def der(certificate: x509.Certificate) -> bytes:
    return certificate.public_bytes(Encoding.DER)


def thumbprint(certificate: x509.Certificate) -> str:
    """SHA-1 in hex, by which OPC UA's tools name certificates (OPC 10000-6 §6.2.2). It is a name: nothing is
    trusted because of it."""
    return certificate.fingerprint(SHA1()).hex()


def fingerprint(certificate: x509.Certificate) -> str:
    """SHA-256 in hex, for people to compare."""
    return certificate.fingerprint(SHA256()).hex()


def write_whole(path: Path, content: bytes, mode: int = 0o600) -> None:
    """Write the file whole or not at all, for the owner of the folder, who need not be who writes. Raises
    OSError."""
    new = path.with_name(f"{path.name}.new")
    with contextlib.suppress(FileNotFoundError):
        new.unlink()
    handle = os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, mode)
    with os.fdopen(handle, "wb") as file:
        owner = path.parent.stat()
        with contextlib.suppress(PermissionError):
            os.fchown(file.fileno(), owner.st_uid, owner.st_gid)
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    new.replace(path)
