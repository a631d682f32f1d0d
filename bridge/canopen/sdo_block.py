"""SDO block transfer with CRC (CiA 301 §7.2.4.3.9–15), and the choice between it and segments."""

from __future__ import annotations

import binascii
from collections.abc import Generator
from dataclasses import dataclass
from typing import Final

from bridge.canopen import abort
from bridge.canopen.sdo_transfer import (
    MOST_BYTES,
    MUX,
    SEGMENT,
    U32,
    BlockAck,
    BlockSegment,
    BlockStart,
    Reply,
    SdoError,
    SdoExchange,
    Transfer,
    abort_request,
    announced_bytes,
    check_length,
    download,
    initiate_upload,
    upload,
    upload_segments,
)
from bridge.canopen.sdo_ways_back import BlockStage, WayBack, way_back

BLOCK_FROM_BYTES: Final = 112
"""Sixteen segments: for fewer, opening and closing a block transfer costs more frames than it saves."""
MOST_SEGMENTS: Final = 127
_LEAST_SEGMENTS: Final = 4
_MOST_REPEATS: Final = 3
"""The transfer is given up when a block has been repeated this often in a row and brings nothing new."""

_DOWNLOAD: Final = 0xC6  # with our CRC and the length
_DOWNLOAD_END: Final = 0xC1
_UPLOAD: Final = 0xA4  # with our CRC
_UPLOAD_START: Final = b"\xa3" + bytes(7)
_UPLOAD_ACK: Final = 0xA2
_UPLOAD_DONE: Final = b"\xa1" + bytes(7)
_CRC: Final = 0x04
_LAST: Final = 0x80


def crc16(data: bytes | bytearray) -> int:
    """CRC of a block transfer: x¹⁶ + x¹² + x⁵ + 1 from 0 (CiA 301 §7.2.4.3.16)."""
    return binascii.crc_hqx(data, 0)


@dataclass(frozen=True, slots=True)
class Learned:
    """Way in which a server breaks block transfer, and the error by which it showed."""

    way: WayBack
    failure: SdoError

    def __str__(self) -> str:
        return f"{self.way.says}: {self.failure}"


@dataclass(slots=True)
class BlockUse:
    """Lessons of a channel about its server: whether it is not asked for block transfer, and how many
    segments in a row arrive without loss."""

    is_avoided: bool = False
    """True once the server is not asked any more."""
    learned: Learned | None = None
    """Lesson by which that was found out here; None where it was known before."""
    segments: int = MOST_SEGMENTS

    def on_block(self, whole: bool) -> None:
        """Halve the block after a loss, double it after a block without one."""
        if whole:
            self.segments = min(MOST_SEGMENTS, self.segments * 2)
        else:
            self.segments = max(_LEAST_SEGMENTS, self.segments // 2)


@dataclass(slots=True)
class _Progress:
    """Stage of the block transfer under way."""

    stage: BlockStage = BlockStage.BEGIN


def read_object(index: int, sub: int, block: BlockUse) -> Transfer:
    """Read an object: by blocks if it is announced as long, and by segments where that breaks."""
    value, announced = yield from initiate_upload(index, sub)
    if value is not None:
        return value
    if block.is_avoided or announced is None or announced < BLOCK_FROM_BYTES:
        return (yield from upload_segments(index, sub, announced))
    progress = _Progress()
    try:
        return (yield from block_upload(index, sub, block, progress))
    except SdoError as error:
        failure, way = error, _way_back(progress, error)
    value = yield from _by_segments(upload(index, sub), failure)
    block.is_avoided, block.learned = True, Learned(way, failure)
    return value


def write_object(index: int, sub: int, data: bytes, block: BlockUse) -> Transfer:
    """Write an object: by blocks if it is long, and by segments where that breaks before the server can have
    taken the value."""
    if block.is_avoided or len(data) < BLOCK_FROM_BYTES:
        return (yield from download(index, sub, data))
    progress = _Progress()
    try:
        yield from block_download(index, sub, data, progress)
        return b""
    except SdoError as error:
        failure, way = error, _way_back(progress, error)
    yield from _by_segments(download(index, sub, data), failure)
    block.is_avoided, block.learned = True, Learned(way, failure)
    return b""


def _way_back(progress: _Progress, error: SdoError) -> WayBack:
    """Raises ``error`` where there is none."""
    way = way_back(progress.stage, error)
    if way is None:
        raise error
    return way


def _by_segments(transfer: Transfer, failure: SdoError) -> Transfer:
    """``transfer`` after a block transfer that ended in ``failure``, which is the more telling error where
    nothing is answered now. A server that has not aborted the block transfer itself is told first."""
    if not failure.by_server:
        yield SdoExchange((abort_request(failure.index, failure.sub, failure.code),), None)
    try:
        return (yield from transfer)
    except SdoError as error:
        if failure.was_answered and not error.was_answered:
            raise failure from None
        raise


def block_upload(index: int, sub: int, block: BlockUse, progress: _Progress) -> Transfer:
    """Read by blocks. The segmented upload that was initiated is aborted first."""
    mux = MUX.pack(index, sub)
    give_up = abort_request(index, sub, abort.GENERAL)
    request = bytes((_UPLOAD,)) + mux + bytes((block.segments, 0, 0, 0))
    reply = yield SdoExchange((give_up, request), BlockStart(mux))
    if reply[0] & 0xE1 != 0xC0:
        # An ordinary upload, which our request ruled out (pst = 0), or a repeated answer.
        raise SdoError(index, sub, abort.GENERAL, by_server=False)
    with_crc = bool(reply[0] & _CRC)
    announced = announced_bytes(index, sub, reply) if reply[0] & 2 else None
    progress.stage = BlockStage.BLOCKS
    data, last = yield from _upload_blocks(index, sub, announced, block)
    progress.stage = BlockStage.END_UPLOAD
    ack = bytes((_UPLOAD_ACK, last[0] & 0x7F, block.segments)) + bytes(5)
    end = yield SdoExchange((ack,), Reply(0xE1, 0xC1, before=last))
    if unused := end[0] >> 2 & 7:
        del data[-unused:]
    check_length(index, sub, len(data), announced)
    if with_crc and int.from_bytes(end[1:3], "little") != crc16(data):
        raise SdoError(index, sub, abort.CRC, by_server=False)
    yield SdoExchange((_UPLOAD_DONE,), None)
    return bytes(data)


def _upload_blocks(
    index: int, sub: int, announced: int | None, block: BlockUse
) -> Generator[SdoExchange, bytes, tuple[bytearray, bytes]]:
    """All data of an upload, padded to whole segments, and the frame of the last segment, which has not been
    acknowledged yet."""
    most = (MOST_BYTES if announced is None else announced) + SEGMENT
    data = bytearray()
    request, repeats = _UPLOAD_START, 0
    while True:
        size = block.segments
        frames = yield from _upload_block(request, size)
        data += b"".join(frame[1:] for frame in frames)
        if len(data) >= most:
            raise SdoError(index, sub, abort.LENGTH_TOO_HIGH, by_server=False)
        if frames and frames[-1][0] & _LAST:
            return data, frames[-1]
        repeats = 0 if frames else repeats + 1
        if repeats > _MOST_REPEATS:
            raise SdoError(index, sub, abort.SEQUENCE, by_server=False)
        block.on_block(whole=len(frames) == size)
        # The server goes on after the last segment that came in sequence.
        request = bytes((_UPLOAD_ACK, len(frames), block.segments)) + bytes(5)


def _upload_block(request: bytes, size: int) -> Generator[SdoExchange, bytes, list[bytes]]:
    """The segments of one block up to the first missing one.

    After a time-out the segments that came are acknowledged. If none came, ``request`` may have been lost and
    is repeated once, unless it was the start, which a server accepts only once.
    """
    frames: list[bytes] = []
    requests, repeated = (request,), request == _UPLOAD_START
    while True:
        due = len(frames) + 1
        try:
            frame = yield SdoExchange(requests, BlockSegment(due, size))
        except SdoError as error:
            if not error.by_server and frames:
                return frames
            if error.by_server or repeated:
                raise
            repeated = True
            continue
        requests = ()
        number = frame[0] & 0x7F
        if number == due:
            frames.append(frame)
        if number == size or frame[0] & _LAST:
            return frames


def block_download(
    index: int, sub: int, data: bytes, progress: _Progress
) -> Generator[SdoExchange, bytes, None]:
    """Write by blocks."""
    mux = MUX.pack(index, sub)
    request = bytes((_DOWNLOAD,)) + mux + U32.pack(len(data))
    reply = yield SdoExchange((request,), Reply(0xE3, 0xA0, mux))
    progress.stage = BlockStage.BLOCKS
    segments = [data[start : start + SEGMENT] for start in range(0, len(data), SEGMENT)]
    with_crc = bool(reply[0] & _CRC)
    size, done, repeats = reply[4], 0, 0
    while done < len(segments):
        if not 1 <= size <= MOST_SEGMENTS:
            raise SdoError(index, sub, abort.BLOCK_SIZE, by_server=False)
        part = segments[done : done + size]
        ack = yield from _download_block(part, done + len(part) == len(segments), with_crc)
        done += ack[1]
        size = ack[2]
        repeats = 0 if ack[1] else repeats + 1
        if repeats > _MOST_REPEATS:
            raise SdoError(index, sub, abort.SEQUENCE, by_server=False)
    command = _DOWNLOAD_END | (SEGMENT - len(segments[-1])) << 2
    crc = crc16(data) if with_crc else 0
    end = bytes((command,)) + crc.to_bytes(2, "little") + bytes(5)
    progress.stage = BlockStage.END_DOWNLOAD
    yield SdoExchange((end,), Reply(0xE3, 0xA1))


def _download_block(part: list[bytes], is_last: bool, with_crc: bool) -> Transfer:
    """Send one block; returns the server's acknowledge.

    After a time-out the last segment is repeated once: without it the server would go on waiting. If the
    acknowledge was lost instead, the block arrives twice, which only the CRC shows.
    """
    frames = [bytes((number,)) + segment.ljust(SEGMENT, b"\0") for number, segment in enumerate(part, 1)]
    if is_last:
        frames[-1] = bytes((frames[-1][0] | _LAST,)) + frames[-1][1:]
    try:
        return (yield SdoExchange(tuple(frames), BlockAck(len(frames))))
    except SdoError as error:
        if error.by_server or not with_crc:
            raise
    return (yield SdoExchange((frames[-1],), BlockAck(len(frames))))
