"""Plays the habits of one simulated node on its frames."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from bridge.canopen.frame import REMOTE, Frame
from bridge.sim.core.habit import FrameKind, Rule

_ABORT: Final = 0x80
_REQUEST, _ANSWER, _ERROR_CONTROL, _EMCY = 0x600, 0x580, 0x700, 0x080
_TPDOS: Final = range(0x180, 0x580)
_DOWNLOAD, _UPLOAD, _BLOCK_UPLOAD, _BLOCK_DOWNLOAD = 1, 2, 5, 6
"""Command specifiers that begin a transfer (CiA 301 §7.2.4.3)."""


class HabitPlayer:
    """Stands between one node and the bus. Times are seconds of the node's clock."""

    def __init__(self, node_id: int, rules: Sequence[Rule]) -> None:
        self._node_id = node_id
        self._rules = [(rule, re.compile(rule.like)) for rule in rules]
        self._skipped = [0] * len(rules)
        self._held: list[tuple[float, Frame]] = []
        self._multiplexer = bytes(3)
        self._begins_block = False
        """The last transfer that was begun is a block download."""
        self._receives_block = False
        """True while a block is received: its segments look like commands."""

    def on_frame(self, frame: Frame, now: float) -> Frame | None:
        """Frame from the bus as the node gets it; None where it gets nothing."""
        if frame.can_id != _REQUEST + self._node_id or not frame.data:
            return frame
        self._follow(frame.data)
        for rule, data in self._matching("request", frame.data):
            if rule.silent:
                return None
            if rule.abort is not None:
                self._held.append((now, self._abort(_ANSWER, rule.abort)))
                return self._abort(_REQUEST, rule.abort)
            frame = frame._replace(data=_changed(rule, data))
        return frame

    def put(self, frames: Sequence[Frame], now: float) -> list[Frame]:
        """Take what the node sends; returns what the node has to be told, because a transfer was aborted."""
        told: list[Frame] = []
        for frame in frames:
            kind = self._kind(frame)
            delay_s = 0.0
            sent: Frame | None = frame
            for rule, data in self._matching(kind, frame.data) if kind else ():
                delay_s += rule.delay_ms / 1000
                if rule.silent:
                    sent = None
                    break
                if rule.abort is not None:
                    told.append(self._abort(_REQUEST, rule.abort))
                    sent = self._abort(_ANSWER, rule.abort)
                    break
                sent = frame._replace(data=_changed(rule, data))
            if sent is not None:
                self._held.append((now + delay_s, sent))
        self._held.sort(key=lambda one: one[0])
        return told

    def due(self, now: float) -> list[Frame]:
        """Frames to be sent by ``now``, in order."""
        frames = [frame for at, frame in self._held if at <= now]
        self._held = [(at, frame) for at, frame in self._held if at > now]
        return frames

    def next_deadline(self) -> float | None:
        return self._held[0][0] if self._held else None

    def clear(self) -> None:
        """The node was switched off."""
        self._held.clear()
        self._receives_block = False

    def _matching(self, kind: FrameKind, data: bytes) -> list[tuple[Rule, bytes]]:
        """The rules that apply, each with the bytes that those before it have left."""
        found: list[tuple[Rule, bytes]] = []
        for place, (rule, pattern) in enumerate(self._rules):
            if rule.frames != kind or not pattern.match(data.hex(" ").upper()):
                continue
            if self._skipped[place] < rule.skip:
                self._skipped[place] += 1
                continue
            found.append((rule, data))
            data = _changed(rule, data)
        return found

    def _kind(self, frame: Frame) -> FrameKind | None:
        if frame.can_id & REMOTE:
            return None
        base = frame.can_id - self._node_id
        if base == _ANSWER:
            self._follow_answer(frame.data)
            return "answer"
        if base == _ERROR_CONTROL:
            return "error_control"
        if base == _EMCY:
            return "emcy"
        return "tpdo" if frame.can_id in _TPDOS else None

    def _follow(self, data: bytes) -> None:
        """Remember the object that the transfer is about: an abort has to name it."""
        if data[0] == _ABORT:
            self._receives_block = False
        if self._receives_block or len(data) < 4:
            return
        command = data[0] >> 5
        begins = command in (_DOWNLOAD, _UPLOAD)
        begins |= command == _BLOCK_UPLOAD and not data[0] & 0x03
        begins |= command == _BLOCK_DOWNLOAD and not data[0] & 0x01
        if begins:
            self._multiplexer = data[1:4]
            self._begins_block = command == _BLOCK_DOWNLOAD

    def _follow_answer(self, data: bytes) -> None:
        if self._begins_block and data[:1] in (b"\xa0", b"\xa4") and data[1:4] == self._multiplexer:
            self._receives_block = True
        elif data[:1] in (b"\xa1", b"\x80"):
            self._receives_block = False

    def _abort(self, base: int, code: int) -> Frame:
        self._receives_block = False
        data = bytes((_ABORT,)) + self._multiplexer + code.to_bytes(4, "little")
        return Frame(base + self._node_id, data)


def _changed(rule: Rule, data: bytes) -> bytes:
    if rule.data:
        given = rule.data.split()
        first = [data[at : at + 1].hex() or "00" if text == ".." else text for at, text in enumerate(given)]
        data = bytes.fromhex("".join(first)) + data[len(given) :]
    return data if rule.size is None else data[: rule.size].ljust(rule.size, b"\0")
