"""The server's own certificate and its key, in files."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from cryptography import x509
from cryptography.hazmat.primitives.asymmetric.rsa import RSAPrivateKey
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    load_der_private_key,
    load_pem_private_key,
)

from bridge.base.errors import Fault, FileFaults
from bridge.northbound.opcua.certificates.selfsigned import KEY_BITS, new_key, self_signed
from bridge.text import Text
from bridge.trust.files import fingerprint, write_whole

_log = logging.getLogger(__name__)

_PEM: Final = b"-----BEGIN"


class _NotRsa(ValueError):
    """A private key of another kind."""


@dataclass(frozen=True, slots=True)
class OwnCertificate:
    certificate: x509.Certificate
    private_key: RSAPrivateKey


def load_own(certificate: Path, private_key: Path) -> OwnCertificate:
    """The certificate and key that the site file names, PEM or DER. Raises ``FileFaults``."""
    faults: list[Fault] = []
    loaded = key = None
    try:
        loaded = read_certificate(certificate)
    except (OSError, ValueError) as error:
        faults.append(_fault(certificate, error, Text.of("certificate.x509_advice")))
    try:
        key = _read_key(private_key)
    except (OSError, ValueError, TypeError) as error:
        faults.append(_fault(private_key, error, Text.of("certificate.rsa_advice")))
    if loaded is None or key is None:
        raise FileFaults(faults)
    if key.key_size < KEY_BITS:
        said = Text.of("certificate.key_short", bits=key.key_size, least=KEY_BITS)
        raise FileFaults([Fault(str(private_key), 0, "", said)])
    if loaded.public_key() != key.public_key():
        said = Text.of("certificate.not_its_key", certificate=str(certificate))
        raise FileFaults([Fault(str(private_key), 0, "", said)])
    return OwnCertificate(loaded, key)


def new_own(certificate: Path, key: Path, application_uri: str, names: Sequence[str]) -> OwnCertificate:
    """A certificate of our own, put into ``certificate``, for the key in ``key``, which outlives it and is
    made where there is none. Both files are for this machine alone (mode 0600).

    Raises OSError, and ``FileFaults`` for a key that is none.
    """
    if not key.exists():
        write_whole(key, new_key()[1])
    try:
        private_key = _read_key(key)
    except (ValueError, TypeError) as error:
        raise FileFaults([_fault(key, error, Text.of("certificate.new_key_advice"))]) from error
    made = self_signed(private_key, application_uri, names)
    write_whole(certificate, made.public_bytes(Encoding.DER))
    _log.info("made an OPC UA certificate: %s, SHA-256 %s", certificate, fingerprint(made))
    return OwnCertificate(made, private_key)


def uris_of(certificate: x509.Certificate) -> list[str]:
    """Application URIs in the certificate."""
    try:
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName)
    except x509.ExtensionNotFound:
        return []
    return names.value.get_values_for_type(x509.UniformResourceIdentifier)


def read_certificate(path: Path) -> x509.Certificate:
    content = path.read_bytes()
    if _PEM in content:
        return x509.load_pem_x509_certificate(content)
    return x509.load_der_x509_certificate(content)


def _read_key(path: Path) -> RSAPrivateKey:
    content = path.read_bytes()
    load = load_pem_private_key if _PEM in content else load_der_private_key
    key = load(content, password=None)
    if not isinstance(key, RSAPrivateKey):
        raise _NotRsa
    return key


def reason(error: Exception) -> str:
    """The error as the end of a sentence, for the log."""
    if isinstance(error, OSError) and error.strerror:
        return error.strerror.lower()
    return str(error)


def _fault(path: Path, error: Exception, advice: Text) -> Fault:
    if isinstance(error, _NotRsa):
        said = Text.of("certificate.not_rsa")
    else:
        said = Text.of("certificate.unusable", why=reason(error))
    return Fault(str(path), 0, "", said, advice)
