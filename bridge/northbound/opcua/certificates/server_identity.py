"""Identity of the server: its application URI and its certificate. They are the installation's, and stay when
the machine gets another name: every client would have to trust it anew."""

from __future__ import annotations

import logging
import socket
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from urllib.parse import quote

from cryptography import x509
from cryptography.hazmat.primitives.asymmetric.rsa import RSAPrivateKey

from bridge.base.errors import Fault, FileFaults, Unavailable
from bridge.config import OpcUaTable
from bridge.northbound.opcua.certificates.own_certificate import (
    OwnCertificate,
    load_own,
    new_own,
    reason,
    uris_of,
)
from bridge.northbound.opcua.certificates.own_files import CERTIFICATE, KEY, URI, load_pair, put_pair
from bridge.northbound.opcua.certificates.ownnames import addresses_of, missing_in, names_of, reached_by
from bridge.northbound.opcua.certificates.selfsigned import generate_key, self_signed
from bridge.text import Text
from bridge.trust.files import write_whole

_log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class ServerIdentity:
    application_uri: str
    certificate: x509.Certificate
    private_key: RSAPrivateKey


def server_identity(settings: OpcUaTable, folder: Path) -> ServerIdentity:
    """The identity that the site file names, or else the one that is kept in ``folder``, made where there is
    none yet. A certificate that is there is never overwritten.

    Raises ``FileFaults`` for a certificate or key that cannot be used and for a URI that is not that of the
    certificate, ``Unavailable`` where the folder cannot be read or written.
    """
    certificate, key = settings.certificate, settings.private_key
    if bool(certificate) is not bool(key):
        missing = "private_key" if certificate else "certificate"
        said, advice = Text.of("toml.missing"), Text.of("certificate.pair_advice")
        raise FileFaults([Fault("site file", 0, f"opcua.{missing}", said, advice)])
    try:
        if certificate and key:
            own, file = load_own(Path(certificate), Path(key)), certificate
        else:
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            own, file = _kept_or_new(settings, folder), str(folder / CERTIFICATE)
    except OSError as error:
        hint = "the folder is state_dir of the site file and must be writable for the service"
        raise Unavailable(f"{error.filename or folder}: {reason(error)} ({hint})") from error
    _look_at(own.certificate, file, settings)
    return ServerIdentity(_uri_of(own.certificate, file, settings, folder), own.certificate, own.private_key)


def _kept_or_new(settings: OpcUaTable, folder: Path) -> OwnCertificate:
    """The files in the folder, made where there are none. Raises OSError and FileFaults."""
    certificate, key = folder / CERTIFICATE, folder / KEY
    if certificate.exists():
        try:
            return load_pair(folder)
        except FileFaults as error:
            advice = Text.of("certificate.take_away_advice", certificate=CERTIFICATE, key=KEY)
            raise FileFaults([replace(fault, advice=advice) for fault in error.faults]) from None
    uri = settings.application_uri or _kept_uri(folder) or _first_uri()
    own = new_own(certificate, key, uri, names_of(settings.listen, reached_by(settings)))
    if not settings.application_uri:
        write_whole(folder / URI, f"{uri}\n".encode())
    return own


def renew(settings: OpcUaTable, folder: Path, *, new_key: bool) -> ServerIdentity:
    """A new certificate for the same application, in place of the one in ``folder``; by default for the same
    key. Clients have to trust it anew. Raises OSError and ``FileFaults``."""
    former = load_pair(folder)
    uri = _uri_of(former.certificate, str(folder / CERTIFICATE), settings, folder)
    key = generate_key() if new_key else former.private_key
    made = self_signed(key, uri, names_of(settings.listen, reached_by(settings)))
    put_pair(folder, OwnCertificate(made, key))
    return ServerIdentity(uri, made, key)


def _first_uri() -> str:
    return f"urn:{quote(socket.gethostname())}:drivebridge"


def _kept_uri(folder: Path) -> str:
    """The former application URI, where a certificate was taken away to be renewed."""
    try:
        return (folder / URI).read_text(encoding="utf-8", errors="replace").strip()
    except FileNotFoundError:
        return ""


def _uri_of(certificate: x509.Certificate, file: str, settings: OpcUaTable, folder: Path) -> str:
    """Application URI of the server, that of the certificate: clients compare the two (Part 4 §6.1.3). Raises
    FileFaults where the site file names another one."""
    held, wanted = uris_of(certificate), settings.application_uri
    if wanted and held and wanted not in held:
        said = Text.of("certificate.other_uri", wanted=wanted, file=file, held=held[0])
        advice = Text.of("certificate.other_uri_advice", file=file)
        raise FileFaults([Fault("site file", 0, "opcua.application_uri", said, advice)])
    return wanted or (held[0] if held else _kept_uri(folder) or _first_uri())


def _look_at(certificate: x509.Certificate, file: str, settings: OpcUaTable) -> None:
    """Log what clients may object to in a certificate that is used as it is."""
    renew = "take it away and the bridge makes a new one with the same key, which clients have to trust anew"
    if settings.certificate:
        renew = "renew it"
    elif certificate.not_valid_after_utc <= datetime.now(UTC):
        _log.warning(
            "%s was valid until %s, and clients may refuse it: %s",
            file,
            f"{certificate.not_valid_after_utc:%Y-%m-%d}",
            renew,
        )
    # Of a certificate that the site file names its owner knows by which addresses it is reached.
    addresses = [] if settings.certificate else addresses_of(settings.listen)
    missing = missing_in(certificate, [*reached_by(settings), *addresses])
    if missing:
        what = "does not name %s, and clients that compare names refuse it: %s"
        _log.warning(f"%s {what}", file, ", ".join(missing), renew)
