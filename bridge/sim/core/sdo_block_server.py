"""Block transfer of an SDO server (CiA 301 §7.2.4.3.9–15), written from the standard, not from our client."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from bridge.sim.core.sdo_abort import AbortCode, SdoAbort

_SEGMENT_SIZE: Final = 7
_MAX_SEGMENTS: Final = 127
_POLYNOMIAL: Final = 0x1021


def checksum(data: bytes) -> int:
    """x¹⁶ + x¹² + x⁵ + 1, most significant bit first, from 0 (§7.2.4.3.16)."""
    remainder = 0
    for byte in data:
        remainder ^= byte << 8
        for _ in range(8):
            carry = remainder & 0x8000
            remainder = remainder << 1 & 0xFFFF
            if carry:
                remainder ^= _POLYNOMIAL
    return remainder


def checked_size(segments: int) -> int:
    """A block size as the client asks for it."""
    if not 1 <= segments <= _MAX_SEGMENTS:
        raise SdoAbort(AbortCode.BLOCK_SIZE)
    return segments


@dataclass(slots=True)
class BlockUpload:
    """The server sends. ``sent`` segments from ``place`` on wait for their acknowledge."""

    index: int
    sub: int
    data: bytes
    size: int
    with_crc: bool
    place: int = 0
    sent: int = 0
    ended: bool = False

    def answer(self, request: bytes) -> list[bytes]:
        """The client's command: start (3), acknowledge (2) or end (1)."""
        match request[0] & 0x03:
            case 3 if not self.sent and not self.ended:
                return self._block()
            case 2 if self.sent:
                return self._acknowledged(request[1], checked_size(request[2]))
            case 1 if self.ended:
                return []
            case _:
                raise SdoAbort(AbortCode.COMMAND_UNKNOWN)

    def _block(self) -> list[bytes]:
        frames: list[bytes] = []
        at = self.place
        for number in range(1, self.size + 1):
            part = self.data[at : at + _SEGMENT_SIZE]
            at += _SEGMENT_SIZE
            last = at >= len(self.data)
            frames.append(bytes([last << 7 | number]) + part.ljust(_SEGMENT_SIZE, b"\0"))
            if last:
                break
        self.sent = len(frames)
        return frames

    def _acknowledged(self, segments: int, size: int) -> list[bytes]:
        if segments > self.sent:
            raise SdoAbort(AbortCode.SEQUENCE_NUMBER)
        self.place += segments * _SEGMENT_SIZE
        self.size = size
        self.sent = 0
        if self.place < len(self.data):
            return self._block()
        self.ended = True
        unused = self.place - len(self.data)
        crc = checksum(self.data) if self.with_crc else 0
        return [bytes([0xC1 | unused << 2]) + crc.to_bytes(2, "little") + bytes(5)]


@dataclass(slots=True)
class BlockDownload:
    """The server receives. ``in_blocks`` until the last segment has come in sequence."""

    index: int
    sub: int
    max_size: int
    announced: int | None
    size: int
    with_crc: bool
    data: bytearray = field(default_factory=bytearray)
    received: int = 0
    in_blocks: bool = True

    def on_segment(self, segment: bytes) -> list[bytes]:
        """The answer to a segment: none before the block is over."""
        number, last = segment[0] & 0x7F, bool(segment[0] & 0x80)
        if number == self.received + 1 and number <= self.size:
            self.received = number
            self.data += segment[1:]
            self.in_blocks = not last
            if len(self.data) >= self.max_size + _SEGMENT_SIZE:
                raise SdoAbort(AbortCode.LENGTH_TOO_HIGH)
        if number != self.size and not last:
            return []
        received, self.received = self.received, 0
        return [bytes([0xA2, received, self.size]) + bytes(5)]

    def on_end(self, request: bytes) -> bytes:
        """The whole value."""
        if self.in_blocks or request[0] & 0x03 != 1:
            raise SdoAbort(AbortCode.COMMAND_UNKNOWN)
        value = bytes(self.data[: len(self.data) - (request[0] >> 2 & 7)])
        if self.announced is not None and len(value) != self.announced:
            raise SdoAbort(AbortCode.LENGTH_MISMATCH)
        if self.with_crc and int.from_bytes(request[1:3], "little") != checksum(value):
            raise SdoAbort(AbortCode.CRC)
        return value
