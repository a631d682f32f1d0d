"""One SDO server channel: expedited, segmented and block transfer (CiA 301 §7.2.4.3, BU 2500 §6.6)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from bridge.sim.core.dictionary import ServedObjects
from bridge.sim.core.sdo_abort import AbortCode, SdoAbort
from bridge.sim.core.sdo_block_server import BlockDownload, BlockUpload, checked_size

_REQUEST_SIZE: Final = 8
_SEGMENT_SIZE: Final = 7
_TOGGLE: Final = 0x10
_ABORT: Final = 0x80
_CONTINUES: Final = {5: (1, 2, 3), 6: (1, 3)}
"""Low bits of the block commands that carry no index."""


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


class SimulatedSdoServer:
    """Answers each request with the frames that CiA 301 asks for: usually one, in a block none or many.

    With ``block_segments`` 0 block transfer is not offered; its commands are answered as unknown.
    """

    def __init__(self, objects: ServedObjects, block_segments: int = 0) -> None:
        self._objects = objects
        self._block_segments = block_segments
        self._transfer: _Upload | _Download | BlockUpload | BlockDownload | None = None

    def reset(self) -> None:
        self._transfer = None

    def only_reads(self, data: bytes) -> bool:
        """True for a request of an upload, which changes no object."""
        receives = isinstance(self._transfer, BlockDownload) and self._transfer.in_blocks
        return not receives and data[:1] != b"" and data[0] >> 5 in (2, 3)

    def on_request(self, data: bytes) -> list[bytes]:
        """The answers to ``data``; a transfer under way is given up by a new one."""
        if len(data) != _REQUEST_SIZE:
            return []  # not an SDO (CiA 301: always eight bytes); a real server ignores it
        transfer = self._transfer
        receives = isinstance(transfer, BlockDownload) and transfer.in_blocks
        command = data[0] >> 5
        if data[0] == _ABORT or (command == 4 and not receives):
            self._transfer = None
            return []
        index, sub = int.from_bytes(data[1:3], "little"), data[3]
        continues = command in (0, 3) or (command in (5, 6) and data[0] & 0x03 in _CONTINUES[command])
        if receives or continues:  # these have no index: the abort names that of the transfer
            index, sub = (transfer.index, transfer.sub) if transfer else (0, 0)
        try:
            if isinstance(transfer, BlockDownload) and transfer.in_blocks:
                return transfer.on_segment(data)
            return self._answer(command, data, index, sub)
        except SdoAbort as abort:
            self._transfer = None
            return [bytes([_ABORT]) + _multiplexor(index, sub) + abort.code.to_bytes(4, "little")]

    def _answer(self, command: int, data: bytes, index: int, sub: int) -> list[bytes]:
        match command:
            case 0:
                return [self._download_segment(data)]
            case 1:
                return [self._initiate_download(data, index, sub)]
            case 2:
                return [self._initiate_upload(index, sub)]
            case 3:
                return [self._upload_segment(data)]
            case 5 if self._block_segments:
                return self._block_upload(data, index, sub)
            case 6 if self._block_segments:
                return [self._block_download(data, index, sub)]
            case _:
                raise SdoAbort(AbortCode.COMMAND_UNKNOWN)

    def _block_upload(self, data: bytes, index: int, sub: int) -> list[bytes]:
        if data[0] & 0x03:
            transfer = self._transfer
            if not isinstance(transfer, BlockUpload):
                raise SdoAbort(AbortCode.COMMAND_UNKNOWN)
            answers = transfer.answer(data)
            if not answers:
                self._transfer = None
            return answers
        size = checked_size(data[4])
        value = self._objects.find(index, sub).upload()
        if not value or len(value) <= data[5]:  # the client would rather have these by segments
            return [self._initiate_upload(index, sub)]
        self._transfer = BlockUpload(index, sub, value, size, bool(data[0] & 0x04))
        return [b"\xc6" + _multiplexor(index, sub) + len(value).to_bytes(4, "little")]

    def _block_download(self, data: bytes, index: int, sub: int) -> bytes:
        if data[0] & 0x01:
            transfer = self._transfer
            if not isinstance(transfer, BlockDownload):
                raise SdoAbort(AbortCode.COMMAND_UNKNOWN)
            self._objects.find(transfer.index, transfer.sub).download(transfer.on_end(data))
            self._transfer = None
            return b"\xa1" + bytes(7)
        entry = self._objects.find(index, sub)
        entry.check_writable()
        announced = int.from_bytes(data[4:8], "little") if data[0] & 0x02 else None
        if announced is not None and announced > entry.max_size:
            raise SdoAbort(AbortCode.LENGTH_TOO_HIGH)
        segments, with_crc = self._block_segments, bool(data[0] & 0x04)
        self._transfer = BlockDownload(index, sub, entry.max_size, announced, segments, with_crc)
        return b"\xa4" + _multiplexor(index, sub) + bytes([segments, 0, 0, 0])

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
