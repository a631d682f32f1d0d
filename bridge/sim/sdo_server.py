"""One SDO server channel: expedited and segmented transfer (CiA 301 §7.2.4.3, BU 2500 §6.6)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from bridge.sim.abort import AbortCode, SdoAbort
from bridge.sim.dictionary import ObjectAccess

_REQUEST_SIZE: Final = 8
_SEGMENT_SIZE: Final = 7
_TOGGLE: Final = 0x10


@dataclass(slots=True)
class _Upload:
    index: int
    sub: int
    rest: bytes
    toggle: int = 0


@dataclass(slots=True)
class _Download:
    index: int
    sub: int
    max_size: int
    announced: int | None
    data: bytes = b""
    toggle: int = 0


class SdoServer:
    """Answers each request with one frame, or with none where CiA 301 wants none.

    Block transfer is not offered; its commands are answered as unknown.
    """

    def __init__(self, objects: ObjectAccess) -> None:
        self._objects = objects
        self._transfer: _Upload | _Download | None = None

    def reset(self) -> None:
        self._transfer = None

    def on_request(self, data: bytes) -> bytes | None:
        if len(data) != _REQUEST_SIZE:
            return None  # not an SDO (CiA 301: always eight bytes); a real server does not see it
        command = data[0] >> 5
        if command == 4:
            self._transfer = None
            return None
        index, sub = int.from_bytes(data[1:3], "little"), data[3]
        transfer = self._transfer
        if command in (0, 3):  # a segment carries no index: the abort names that of the transfer
            index, sub = (transfer.index, transfer.sub) if transfer else (0, 0)
        try:
            return self._answer(command, data, index, sub)
        except SdoAbort as abort:
            self._transfer = None
            return bytes([0x80]) + _multiplexor(index, sub) + abort.code.to_bytes(4, "little")

    def _answer(self, command: int, data: bytes, index: int, sub: int) -> bytes:
        match command:
            case 0:
                return self._download_segment(data)
            case 1:
                return self._initiate_download(data, index, sub)
            case 2:
                return self._initiate_upload(index, sub)
            case 3:
                return self._upload_segment(data)
            case _:
                raise SdoAbort(AbortCode.COMMAND_UNKNOWN)

    def _initiate_upload(self, index: int, sub: int) -> bytes:
        value = self._objects.find(index, sub).upload()
        if 0 < len(value) <= 4:
            self._transfer = None
            head = 0x43 | (4 - len(value)) << 2
            return bytes([head]) + _multiplexor(index, sub) + value.ljust(4, b"\0")
        self._transfer = _Upload(index, sub, value)
        return b"\x41" + _multiplexor(index, sub) + len(value).to_bytes(4, "little")

    def _upload_segment(self, data: bytes) -> bytes:
        transfer = self._transfer
        if not isinstance(transfer, _Upload):
            raise SdoAbort(AbortCode.COMMAND_UNKNOWN)
        if data[0] & _TOGGLE != transfer.toggle:
            raise SdoAbort(AbortCode.TOGGLE_BIT)
        segment, transfer.rest = transfer.rest[:_SEGMENT_SIZE], transfer.rest[_SEGMENT_SIZE:]
        head = transfer.toggle | (_SEGMENT_SIZE - len(segment)) << 1 | (not transfer.rest)
        transfer.toggle ^= _TOGGLE
        if not transfer.rest:
            self._transfer = None
        return bytes([head]) + segment.ljust(_SEGMENT_SIZE, b"\0")

    def _initiate_download(self, data: bytes, index: int, sub: int) -> bytes:
        entry = self._objects.find(index, sub)
        entry.check_writable()
        expedited, sized = bool(data[0] & 2), bool(data[0] & 1)
        if expedited:
            # Without a stated length the device takes as many bytes as the object has.
            length = 4 - (data[0] >> 2 & 3) if sized else min(entry.max_size, 4)
            entry.download(data[4 : 4 + length])
            self._transfer = None
        else:
            announced = int.from_bytes(data[4:8], "little") if sized else None
            if announced is not None and announced > entry.max_size:
                raise SdoAbort(AbortCode.LENGTH_TOO_HIGH)
            self._transfer = _Download(index, sub, entry.max_size, announced)
        return b"\x60" + _multiplexor(index, sub) + bytes(4)

    def _download_segment(self, data: bytes) -> bytes:
        transfer = self._transfer
        if not isinstance(transfer, _Download):
            raise SdoAbort(AbortCode.COMMAND_UNKNOWN)
        if data[0] & _TOGGLE != transfer.toggle:
            raise SdoAbort(AbortCode.TOGGLE_BIT)
        transfer.data += data[1 : 1 + _SEGMENT_SIZE - (data[0] >> 1 & 7)]
        if len(transfer.data) > transfer.max_size:
            raise SdoAbort(AbortCode.LENGTH_TOO_HIGH)
        answer = bytes([0x20 | transfer.toggle]) + bytes(7)
        transfer.toggle ^= _TOGGLE
        if data[0] & 1:
            if transfer.announced is not None and transfer.announced != len(transfer.data):
                raise SdoAbort(AbortCode.LENGTH_MISMATCH)
            self._objects.find(transfer.index, transfer.sub).download(transfer.data)
            self._transfer = None
        return answer


def _multiplexor(index: int, sub: int) -> bytes:
    return index.to_bytes(2, "little") + bytes([sub])
