"""The trust list as the file that clients read and write (OPC 10000-12 §7.8, OPC 10000-20 §4.2). Sans-IO."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import count
from typing import Any, Final

from asyncua.common.utils import Buffer
from asyncua.ua import ua_binary
from asyncua.ua.ua_binary import struct_to_binary
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding

from bridge.trust.files import MALFORMED
from bridge.trust.store import MOST_FILES
from bridge.uaserver.library import ServiceError, StatusCodes, get, make, ua

_decode: Final[Any] = get(ua_binary, "struct_from_binary")
MOST_BYTES: Final = 1 << 20
"""Largest trust list that a client may write."""
_MOST_OPEN: Final = 10
_IDLE_S: Final = 60.0
"""A file that its client does not use is closed: it may be in the way of another's."""
_READ: Final = 1
_WRITE_ANEW: Final = 6
"""Modes of Open: read, and write with what was there erased. A part of a list is not written."""


@dataclass(frozen=True, slots=True)
class TrustListContents:
    """Contents of the folders, each in DER; None where a client has not sent that one."""

    trusted: tuple[x509.Certificate, ...] | None
    trusted_crls: tuple[x509.CertificateRevocationList, ...] | None
    issuers: tuple[x509.Certificate, ...] | None
    issuer_crls: tuple[x509.CertificateRevocationList, ...] | None


_FIELDS: Final = (
    (ua.TrustListMasks.TrustedCertificates, "TrustedCertificates", "trusted"),
    (ua.TrustListMasks.TrustedCrls, "TrustedCrls", "trusted_crls"),
    (ua.TrustListMasks.IssuerCertificates, "IssuerCertificates", "issuers"),
    (ua.TrustListMasks.IssuerCrls, "IssuerCrls", "issuer_crls"),
)


def encoded(lists: TrustListContents, masks: int) -> bytes:
    """TrustListDataType with those of the lists that ``masks`` names."""
    fields: dict[str, Any] = {"SpecifiedLists": 0}
    for mask, name, attribute in _FIELDS:
        held: Sequence[Any] = getattr(lists, attribute) if masks & mask else ()
        fields["SpecifiedLists"] |= masks & mask
        fields[name] = [one.public_bytes(Encoding.DER) for one in held]
    return bytes(struct_to_binary(make(ua.TrustListDataType, **fields)))


def decoded(content: bytes) -> TrustListContents:
    """Raises ServiceError for what is no trust list, and for a certificate or list in it that is none."""
    try:
        found: object = _decode(ua.TrustListDataType, Buffer(content))
    except Exception:  # noqa: BLE001 - asyncua's decoder raises whatever it meets
        raise ServiceError(StatusCodes.BadCertificateInvalid) from None
    masks = int(get(found, "SpecifiedLists"))
    parts: dict[str, Any] = {}
    for mask, name, attribute in _FIELDS:
        load = x509.load_der_x509_crl if name.endswith("Crls") else x509.load_der_x509_certificate
        if len(get(found, name) or ()) > MOST_FILES:
            raise ServiceError(StatusCodes.BadEncodingLimitsExceeded)
        try:
            held = tuple(load(one) for one in get(found, name) or ())
        except MALFORMED:
            raise ServiceError(StatusCodes.BadCertificateInvalid) from None
        parts[attribute] = held if masks & mask else None
    return TrustListContents(**parts)


@dataclass(slots=True)
class _OpenFile:
    """``owner`` is the session's name; ``used_at`` is monotonic."""

    owner: str
    is_written: bool
    used_at: float
    content: bytearray = field(default_factory=bytearray)
    position: int = 0


class TrustListFiles:
    """Files that clients have open. A handle is only for the session that has it."""

    def __init__(self) -> None:
        self._open: dict[int, _OpenFile] = {}
        self._handles = count(1)

    def __len__(self) -> int:
        return len(self._open)

    @property
    def is_written(self) -> bool:
        return any(one.is_written for one in self._open.values())

    def open(self, owner: str, mode: int, content: bytes, now: float) -> int:
        """Handle of another file, with ``content`` to be read. Raises ServiceError for other modes, beside
        one that is written, and for too many."""
        self.drop_idle(now)
        if mode not in (_READ, _WRITE_ANEW):
            raise ServiceError(StatusCodes.BadNotSupported)
        if self.is_written:
            raise ServiceError(StatusCodes.BadNotReadable if mode == _READ else StatusCodes.BadNotWritable)
        if len(self._open) >= _MOST_OPEN:
            raise ServiceError(StatusCodes.BadResourceUnavailable)
        handle = next(self._handles)
        made = self._open[handle] = _OpenFile(owner, mode == _WRITE_ANEW, now)
        if not made.is_written:
            made.content += content
        return handle

    def drop_idle(self, now: float) -> None:
        for handle in [number for number, one in self._open.items() if now - one.used_at > _IDLE_S]:
            del self._open[handle]

    def leave(self, owner: str) -> None:
        """The session has ended, or its connection has: what it had open is closed, and does not count."""
        for handle in [number for number, one in self._open.items() if one.owner == owner]:
            del self._open[handle]

    def read(self, owner: str, handle: int, length: int, now: float) -> bytes:
        one = self._of(owner, handle, now)
        if one.is_written:
            raise ServiceError(StatusCodes.BadInvalidState)
        if length < 0:
            raise ServiceError(StatusCodes.BadInvalidArgument)
        part = bytes(one.content[one.position : one.position + length])
        one.position += len(part)
        return part

    def write(self, owner: str, handle: int, data: bytes, now: float) -> None:
        one = self._of(owner, handle, now)
        if not one.is_written:
            raise ServiceError(StatusCodes.BadInvalidState)
        if one.position + len(data) > MOST_BYTES:
            raise ServiceError(StatusCodes.BadEncodingLimitsExceeded)
        one.content[one.position : one.position + len(data)] = data
        one.position += len(data)

    def position(self, owner: str, handle: int, now: float) -> int:
        return self._of(owner, handle, now).position

    def seek(self, owner: str, handle: int, position: int, now: float) -> None:
        one = self._of(owner, handle, now)
        one.position = min(position, len(one.content))

    def close(self, owner: str, handle: int, now: float) -> bytes | None:
        """Content of one that was written, None of one that was read."""
        one = self._of(owner, handle, now)
        del self._open[handle]
        return bytes(one.content) if one.is_written else None

    def _of(self, owner: str, handle: int, now: float) -> _OpenFile:
        found = self._open.get(handle)
        if found is None or found.owner != owner:
            raise ServiceError(StatusCodes.BadInvalidArgument)
        found.used_at = now
        return found
