"""Number of bits that a frame takes on the wire (ISO 11898-1), stuff bits included. Sans-IO.

The exact number needs the frame's CRC and costs some 10 µs, so only one frame in ``_SAMPLE`` is
measured; for the others the share of stuff bits found there is assumed.
"""

from __future__ import annotations

from typing import Final

from bridge.canopen.frame import EXTENDED, REMOTE, Frame

UNSTUFFED_BITS: Final = 13
"""CRC delimiter, ACK slot and delimiter, end of frame, intermission."""
STUFFED_BITS: Final = 34
"""Start of frame to the end of the CRC without data, 11-bit identifier; 29-bit ones have 20 more."""
_EXTENDED_BITS: Final = 20
_SAMPLE: Final = 64
_CRC_15: Final = 0x4599
_FIRST_GUESS: Final = 1 / 12
"""Stuff bits for each bit that can be stuffed: process data has more zeros than chance would give."""


def longest_bits(length: int) -> int:
    """Bits of a frame with an 11-bit identifier and ``length`` bytes, with the most stuff bits possible and
    the pause after it (ISO 11898-1: after the first five bits one for every four)."""
    stuffable = STUFFED_BITS + 8 * length
    return stuffable + (stuffable - 1) // 4 + UNSTUFFED_BITS


def exact_bits(frame: Frame) -> int:
    """Bits of ``frame`` on the wire, interframe space of three bits included."""
    remote = bool(frame.can_id & REMOTE)
    data = b"" if remote else frame.data
    if frame.can_id & EXTENDED:
        identifier = frame.can_id & 0x1FFF_FFFF
        # SOF, 11 bits, SRR and IDE recessive, 18 bits, RTR, r1, r0
        head = (((identifier >> 18) << 2 | 3) << 18 | identifier & 0x3_FFFF) << 3 | remote << 2
        head_bits = 35
    else:
        # SOF, 11 bits, RTR, IDE, r0
        head, head_bits = (frame.can_id & 0x7FF) << 3 | remote << 2, 15
    bits = head << 4 | len(frame.data)
    length = head_bits + 4
    bits = bits << 8 * len(data) | int.from_bytes(data, "big")
    length += 8 * len(data)
    bits = bits << 15 | _crc(bits, length)
    length += 15
    return length + _stuff_bits(bits, length) + UNSTUFFED_BITS


def _crc(bits: int, length: int) -> int:
    crc = 0
    for place in range(length - 1, -1, -1):
        invert = (crc >> 14 ^ bits >> place) & 1
        crc = crc << 1 & 0x7FFF
        if invert:
            crc ^= _CRC_15
    return crc


def _stuff_bits(bits: int, length: int) -> int:
    """After five equal bits comes one of the other kind, which counts as the first of the next run."""
    stuffed, run, last = 0, 0, 2
    for place in range(length - 1, -1, -1):
        bit = bits >> place & 1
        run = run + 1 if bit == last else 1
        last = bit
        if run == 5:
            stuffed += 1
            last = bit ^ 1
            run = 1
    return stuffed


class WireBits:
    """Adds up the bits of frames. ``stuffing`` is the share measured so far."""

    def __init__(self) -> None:
        self.total = 0.0
        self._left = 1
        self._measured = 1000.0
        self._stuff = 1000.0 * _FIRST_GUESS

    @property
    def stuffing(self) -> float:
        return self._stuff / self._measured

    def sample(self, frame: Frame) -> None:
        """A frame of this bus: now and then one is measured."""
        self._left -= 1
        if not self._left:
            self._left = _SAMPLE
            self._measure(frame)

    def add(self, frame: Frame) -> None:
        """Count ``frame``."""
        self.sample(frame)
        self.add_many(1, 0 if frame.can_id & REMOTE else len(frame.data))
        if frame.can_id & EXTENDED:
            self.total += _EXTENDED_BITS * (1 + self.stuffing)

    def add_many(self, frames: int, data_bytes: int) -> None:
        """Count ``frames`` with 11-bit identifiers and ``data_bytes`` of data among them."""
        stuffable = STUFFED_BITS * frames + 8 * data_bytes
        self.total += stuffable * (1 + self.stuffing) + UNSTUFFED_BITS * frames

    def _measure(self, frame: Frame) -> None:
        plain = STUFFED_BITS + (0 if frame.can_id & REMOTE else 8 * len(frame.data))
        plain += _EXTENDED_BITS if frame.can_id & EXTENDED else 0
        # The past fades, so that a changed bus is seen within some hundred measured frames.
        self._measured = self._measured * 0.99 + plain
        self._stuff = self._stuff * 0.99 + exact_bits(frame) - plain - UNSTUFFED_BITS
