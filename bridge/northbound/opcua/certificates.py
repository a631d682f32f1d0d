"""The server's own certificate, and the client certificates it trusts."""

from __future__ import annotations

import contextlib
import logging
import os
import socket
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from cryptography import x509
from cryptography.hazmat.primitives.asymmetric.rsa import RSAPrivateKey
from cryptography.hazmat.primitives.hashes import SHA256
from cryptography.hazmat.primitives.serialization import (
    Encoding,
    load_der_private_key,
    load_pem_private_key,
)

from bridge.config import OpcUaTable
from bridge.errors import Fault, FileFaults, Unavailable
from bridge.northbound.opcua.selfsigned import KEY_BITS, new_key, self_signed

_log = logging.getLogger(__name__)

_PEM: Final = b"-----BEGIN"


@dataclass(frozen=True, slots=True)
class OwnCertificate:
    certificate: x509.Certificate
    private_key: RSAPrivateKey


def application_uri() -> str:
    return f"urn:{socket.gethostname()}:drivebridge"


def configured_or_own(settings: OpcUaTable, folder: Path, uri: str) -> OwnCertificate:
    """The certificate that the site file names, or else the bridge's own in ``folder``. Raises ``FileFaults``
    and ``Unavailable``."""
    certificate, key = settings.certificate, settings.private_key
    if certificate and key:
        return load_own(Path(certificate), Path(key))
    if certificate or key:
        missing = "private_key" if certificate else "certificate"
        fault = Fault("site file", 0, f"opcua.{missing}", "is missing", "certificate and key go together")
        raise FileFaults([fault])
    return own_or_new(folder, uri)


def load_own(certificate: Path, private_key: Path) -> OwnCertificate:
    """The certificate and key that the site file names, PEM or DER. Raises ``FileFaults``."""
    faults: list[Fault] = []
    loaded = key = None
    try:
        loaded = read_certificate(certificate)
    except (OSError, ValueError) as error:
        faults.append(_fault(certificate, error, "a certificate (X.509) in PEM or DER"))
    try:
        key = _read_key(private_key)
    except (OSError, ValueError, TypeError) as error:
        faults.append(_fault(private_key, error, "an RSA key without a password in PEM or DER"))
    if loaded is None or key is None:
        raise FileFaults(faults)
    if key.key_size < KEY_BITS:
        message = f"has {key.key_size} bits; OPC UA's policies ask for at least {KEY_BITS}"
        raise FileFaults([Fault(str(private_key), 0, "", message)])
    if loaded.public_key() != key.public_key():
        raise FileFaults([Fault(str(private_key), 0, "", f"is not the key of {certificate}")])
    return OwnCertificate(loaded, key)


def own_or_new(folder: Path, application_uri: str) -> OwnCertificate:
    """The bridge's own certificate in ``folder``, made where there is none that still fits.

    The key is made for this machine alone (mode 0600) and outlives a new certificate.
    Raises ``Unavailable`` where the folder or a file in it cannot be read or written, ``FileFaults``
    where the key in it is none.
    """
    certificate, key = folder / "own_certificate.der", folder / "own_key.pem"
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if not key.exists():
            _write_private(key, new_key()[1])
            certificate.unlink(missing_ok=True)
        if certificate.exists():
            own = load_own(certificate, key)
            if _fits(own.certificate, application_uri):
                return own
            _log.warning("%s does not fit %s any more: a new one is made", certificate, application_uri)
        private_key = _read_key(key)
        new = self_signed(private_key, application_uri)
        _write_private(certificate, new.public_bytes(Encoding.DER))
        _log.info("made an OPC UA certificate: %s, SHA-256 %s", certificate, fingerprint(new))
        return OwnCertificate(new, private_key)
    except OSError as error:
        hint = "the folder is state_dir of the site file and must be writable for the service"
        raise Unavailable(f"{error.filename or folder}: {_reason(error)} ({hint})") from error
    except (ValueError, TypeError) as error:
        hint = "delete it and a new one is made; clients must trust that one anew"
        raise FileFaults([Fault(str(key), 0, "", f"cannot be used: {error}", hint)]) from error


def _fits(certificate: x509.Certificate, application_uri: str) -> bool:
    now = datetime.now(UTC)
    in_time = certificate.not_valid_before_utc <= now < certificate.not_valid_after_utc
    return in_time and application_uri in _uris(certificate)


def _uris(certificate: x509.Certificate) -> list[str]:
    try:
        names = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName)
    except x509.ExtensionNotFound:
        return []
    return names.value.get_values_for_type(x509.UniformResourceIdentifier)


def _write_private(path: Path, content: bytes) -> None:
    """Whole or not at all, and never readable for others, not even for a moment."""
    new = path.with_name(f"{path.name}.new")
    with contextlib.suppress(FileNotFoundError):
        new.unlink()
    handle = os.open(new, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
    with os.fdopen(handle, "wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    new.replace(path)


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
        raise ValueError("not an RSA key")
    return key


def fingerprint(certificate: x509.Certificate) -> str:
    return certificate.fingerprint(SHA256()).hex()


def _reason(error: Exception) -> str:
    if isinstance(error, OSError) and error.strerror:
        return error.strerror.lower()
    return str(error)


def _fault(path: Path, error: Exception, hint: str) -> Fault:
    return Fault(str(path), 0, "", f"cannot be used: {_reason(error)}", hint)


class TrustedCertificates:
    """The client certificates in a folder; exactly these are trusted, nothing that they signed.

    The folder is read again when an unknown certificate comes and the folder has changed, so trusting
    a client takes a copied file and no restart.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._changed = 0
        self._known: frozenset[bytes] = frozenset()
        self._read()

    def _read(self) -> None:
        try:
            self._changed = self._folder.stat().st_mtime_ns
            files = sorted(path for path in self._folder.iterdir() if path.is_file())
        except OSError as error:
            hint = "trusted_dir is a folder with the certificates of the clients"
            raise FileFaults([Fault(str(self._folder), 0, "", _reason(error), hint)]) from error
        known: set[bytes] = set()
        for path in files:
            try:
                known.add(read_certificate(path).public_bytes(Encoding.DER))
            except (OSError, ValueError) as error:
                _log.warning("%s is not a certificate and is left out: %s", path, _reason(error))
        self._known = frozenset(known)

    def refusal(self, certificate: x509.Certificate) -> str | None:
        """Why this certificate is not trusted, or None if it is."""
        content = certificate.public_bytes(Encoding.DER)
        if content not in self._known:
            with contextlib.suppress(OSError, FileFaults):
                if self._folder.stat().st_mtime_ns != self._changed:
                    self._read()
        if content not in self._known:
            return f"it is not in {self._folder}"
        now = datetime.now(UTC)
        if not certificate.not_valid_before_utc <= now < certificate.not_valid_after_utc:
            return "it is not valid today"
        return None
