"""SDO transfers as generators: expedited and segmented (CiA 301 §7.2.4.3.3–8).

A transfer yields frames to be sent and which answer belongs to them, and is sent that answer;
``sdo.SdoChannel`` handles everything else the server sends. An abort by the server and a time-out are thrown
into it as ``SdoError``, so that it can go on where the protocol allows.
"""

from __future__ import annotations

import struct
from collections.abc import Generator
from dataclasses import dataclass
from typing import ClassVar, Final

from bridge.canopen import abort
from bridge.canopen.width import Unsized

MUX: Final = struct.Struct("<HB")
U32: Final = struct.Struct("<I")
ABORT: Final = 0x80
SEGMENT: Final = 7
MOST_BYTES: Final = 1 << 19
"""Longest value accepted from a server; a longer one is the server's fault."""

_UPLOAD: Final = 0x40
_UPLOAD_SEGMENT: Final = 0x60
_DOWNLOAD: Final = 0x21
_EXPEDITED: Final = 0x23
_TOGGLE: Final = 0x10


_UNANSWERED: Final = frozenset((abort.TIMED_OUT, abort.BUSY, abort.GENERAL))
"""Abort codes that end a transfer on our side although no wrong answer has come."""


class SdoError(Exception):
    """A transfer failed. ``code`` is the abort code, also for a time-out on our side."""

    def __init__(self, index: int, sub: int, code: int, *, by_server: bool) -> None:
        self.index, self.sub, self.code, self.by_server = index, sub, code, by_server
        if by_server:
            who = "the node aborted"
        elif code == abort.BUSY:
            who = "not asked, too many transfers are waiting"
        else:
            who = "no valid answer"
        super().__init__(f"{index:04X}h:{sub:02X}: {who}: {abort.text(code)} ({code:08X}h)")

    @property
    def was_answered(self) -> bool:
        """The node has aborted, or has answered something else than the standard allows: it is there."""
        return self.by_server or self.code not in _UNANSWERED


@dataclass(frozen=True, slots=True)
class Reply:
    """An answer: ``data[0] & mask == command`` and, if it has one, the multiplexer.

    ``before`` is the answer before this one: the same frame once more is a repetition, not an answer.
    """

    mask: int
    command: int
    mux: bytes = b""
    before: bytes = b""

    def fits(self, data: bytes, unsent: int) -> bool:
        """Whether ``data`` is this answer, with ``unsent`` frames of the request still to be sent."""
        del unsent
        return (
            data[0] & self.mask == self.command
            and (not self.mux or data[1:4] == self.mux)
            and data != self.before
        )


@dataclass(frozen=True, slots=True)
class BlockStart:
    """The answer to the initiation of a block upload; some servers answer with an ordinary one."""

    mux: bytes

    def fits(self, data: bytes, unsent: int) -> bool:
        del unsent
        return data[1:4] == self.mux and (data[0] & 0xE1 == 0xC0 or data[0] & 0xE0 == 0x40)


@dataclass(frozen=True, slots=True)
class BlockSegment:
    """A segment of a block with a sequence number from ``low`` to ``high``."""

    mux: ClassVar[bytes] = b""
    low: int
    high: int

    def fits(self, data: bytes, unsent: int) -> bool:
        del unsent
        return self.low <= data[0] & 0x7F <= self.high


@dataclass(frozen=True, slots=True)
class BlockAck:
    """The acknowledge of a block of ``length`` segments: never of more than have been sent."""

    mux: ClassVar[bytes] = b""
    length: int

    def fits(self, data: bytes, unsent: int) -> bool:
        return data[0] & 0xE3 == 0xA2 and data[1] <= self.length - unsent


@dataclass(frozen=True, slots=True)
class SdoExchange:
    """Frames to be sent in order (none: just wait), and the answer that ends the exchange (None: the transfer
    goes on at once)."""

    requests: tuple[bytes, ...]
    reply: Reply | BlockStart | BlockSegment | BlockAck | None


Transfer = Generator[SdoExchange, bytes, bytes]
Result = bytes | SdoError


def abort_request(index: int, sub: int, code: int) -> bytes:
    return bytes((ABORT,)) + MUX.pack(index, sub) + U32.pack(code)


def announced_bytes(index: int, sub: int, reply: bytes) -> int:
    """The length in bytes 4…7 of ``reply``. Raises SdoError if it is more than is accepted."""
    announced: int = U32.unpack_from(reply, 4)[0]
    if announced > MOST_BYTES:
        raise SdoError(index, sub, abort.OUT_OF_MEMORY, by_server=False)
    return announced


def check_length(index: int, sub: int, length: int, announced: int | None) -> None:
    """Raises SdoError if the server has sent more or fewer bytes than it announced."""
    if announced is not None and length > announced:
        raise SdoError(index, sub, abort.LENGTH_TOO_HIGH, by_server=False)
    if announced is not None and length < announced:
        raise SdoError(index, sub, abort.LENGTH_TOO_LOW, by_server=False)


def expedited(data: bytes) -> bytes:
    """The value in an expedited initiation; without a length all four bytes, as ``Unsized``."""
    return data[4 : 8 - (data[0] >> 2 & 3)] if data[0] & 1 else Unsized(data[4:8])


def segment(data: bytes) -> bytes:
    """The part of a value in a segment."""
    return data[1 : 8 - (data[0] >> 1 & 7)]


def initiate_upload(index: int, sub: int) -> Generator[SdoExchange, bytes, tuple[bytes | None, int | None]]:
    """Ask for an object. Returns its value if the answer contains it, else the announced length."""
    mux = MUX.pack(index, sub)
    reply = yield SdoExchange((bytes((_UPLOAD,)) + mux + bytes(4),), Reply(0xE0, 0x40, mux))
    if reply[0] & 2:
        return expedited(reply), None
    return None, announced_bytes(index, sub, reply) if reply[0] & 1 else None


def upload(index: int, sub: int) -> Transfer:
    """Read an object: expedited or by segments, as the server answers."""
    value, announced = yield from initiate_upload(index, sub)
    return value if value is not None else (yield from upload_segments(index, sub, announced))


def upload_segments(index: int, sub: int, announced: int | None) -> Transfer:
    """The segments of an upload that has been initiated."""
    data = bytearray()
    toggle, reply = 0, b""
    most = MOST_BYTES if announced is None else announced
    while True:
        request = bytes((_UPLOAD_SEGMENT | toggle,)) + bytes(7)
        reply = yield SdoExchange((request,), Reply(0xE0, 0x00, before=reply))
        if reply[0] & _TOGGLE != toggle:
            raise SdoError(index, sub, abort.TOGGLE, by_server=False)
        part = segment(reply)
        data += part
        if len(data) > most:
            code = abort.OUT_OF_MEMORY if announced is None else abort.LENGTH_TOO_HIGH
            raise SdoError(index, sub, code, by_server=False)
        if reply[0] & 1:
            check_length(index, sub, len(data), announced)
            return bytes(data)
        if not part:  # or it could go on for ever
            raise SdoError(index, sub, abort.LENGTH_TOO_LOW, by_server=False)
        toggle ^= _TOGGLE


def download(index: int, sub: int, data: bytes) -> Transfer:
    """Write an object: expedited up to four bytes, else segmented. The result has no meaning."""
    mux = MUX.pack(index, sub)
    done = Reply(0xE0, 0x60, mux)
    if 0 < len(data) <= 4:
        command = _EXPEDITED | (4 - len(data)) << 2
        yield SdoExchange((bytes((command,)) + mux + data.ljust(4, b"\0"),), done)
        return b""
    yield SdoExchange((bytes((_DOWNLOAD,)) + mux + U32.pack(len(data)),), done)
    toggle, reply = 0, b""
    for start in range(0, max(len(data), 1), SEGMENT):
        part = data[start : start + SEGMENT]
        last = start + SEGMENT >= len(data)
        command = toggle | (SEGMENT - len(part)) << 1 | last
        request = bytes((command,)) + part.ljust(SEGMENT, b"\0")
        reply = yield SdoExchange((request,), Reply(0xE0, 0x20, before=reply))
        if reply[0] & _TOGGLE != toggle:
            raise SdoError(index, sub, abort.TOGGLE, by_server=False)
        toggle ^= _TOGGLE
    return b""
