"""Files of the server's own certificate: where they are, and how the pair is replaced."""

from __future__ import annotations

import contextlib
from datetime import datetime
from pathlib import Path
from typing import Final

from cryptography.hazmat.primitives.serialization import Encoding, NoEncryption, PrivateFormat

from bridge.base.errors import FileFaults, Unavailable
from bridge.config import OpcUaTable
from bridge.northbound.opcua.certificates.own_certificate import (
    OwnCertificate,
    load_own,
    read_certificate,
    reason,
)
from bridge.trust.files import write_whole
from bridge.trust.store import OWN

CERTIFICATE: Final = "own_certificate.der"
KEY: Final = "own_key.pem"
URI: Final = "application_uri"
"""Files in the folder of the server."""
_NEXT_KEY: Final = "own_key.next.pem"
"""Key that belongs to the certificate, where a replacement has not come to its end."""
CERTIFICATES: Final = "certificates"
"""Folder in ``state_dir`` of all certificates."""
_FORMER: Final = "opcua"
"""Folder in ``state_dir`` that had the three files before there was one for all protocols."""


def own_folder(state_dir: Path) -> Path:
    """Folder of the server's own files in ``state_dir``, with those of an older version moved there: nothing
    that a client has trusted may change. Raises ``Unavailable``."""
    folder, former = state_dir / CERTIFICATES / OWN, state_dir / _FORMER
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        # The certificate last: as long as it is missing, the move goes on at the next start.
        for name in (KEY, URI, CERTIFICATE):
            if (former / name).exists() and not (folder / name).exists():
                (former / name).rename(folder / name)
    except OSError as error:
        hint = "the folder is state_dir of the site file and must be writable for the service"
        raise Unavailable(f"{error.filename or folder}: {reason(error)} ({hint})") from error
    with contextlib.suppress(OSError):
        former.rmdir()
    return folder


def own_pair(settings: OpcUaTable, folder: Path) -> tuple[Path, Path]:
    """Files of the certificate and of its key: those of the site file, or in ``folder``."""
    if settings.certificate and settings.private_key:
        return Path(settings.certificate), Path(settings.private_key)
    return folder / CERTIFICATE, folder / KEY


def load_pair(folder: Path) -> OwnCertificate:
    """The pair in ``folder``, also where its replacement was interrupted. Raises ``FileFaults``."""
    certificate, key, following = folder / CERTIFICATE, folder / KEY, folder / _NEXT_KEY
    try:
        return load_own(certificate, key)
    except FileFaults:
        if not following.exists():
            raise
        found = load_own(certificate, following)
        following.replace(key)
        return found


def put_pair(folder: Path, own: OwnCertificate) -> None:
    """Replace the pair in ``folder``. Wherever it is interrupted, one of the two pairs is there. Raises
    OSError."""
    pem = own.private_key.private_bytes(Encoding.PEM, PrivateFormat.PKCS8, NoEncryption())
    write_whole(folder / _NEXT_KEY, pem)
    write_whole(folder / CERTIFICATE, own.certificate.public_bytes(Encoding.DER))
    (folder / _NEXT_KEY).replace(folder / KEY)


def expires_at(settings: OpcUaTable, state_dir: Path) -> datetime | None:
    """End of the validity of the server's own certificate, UTC; None where there is none that can be read."""
    certificate, _ = own_pair(settings, state_dir / CERTIFICATES / OWN)
    try:
        return read_certificate(certificate).not_valid_after_utc
    except (OSError, ValueError):
        return None
