"""SDO answers of a node as somebody on the bus has them: in time, late, refused, about another object, or
none."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from bridge.canopen.frame import Frame
from tests.plant.world import World

LATE: Final = ("0.05", "0.1", "0.2", "0.3", "0.4")
"""Seconds that each answer takes: below the bridge's time-out of 0.5 s."""
WRONG: Final = ("aborts", "another index", "silent")
LATEST_S: Final = 0.5
_BASES: Final = (0x580, 0x5C0, 0x2C0, 0x3C0, 0x4C0)
"""Of the first channel, of a second one as Lenze has it, and of those of a NORD interface (BU 2500 §6.4)."""
_INITIATES: Final = (0x40, 0x60)
"""Answers that name their object: upload, and download (CiA 301 §7.2.4.3)."""
_ABORT: Final = 0x80
_GENERAL_ERROR: Final = 0x0800_0000


class SdoAnswers:
    """What becomes of a node's answers: ``how`` is one of ``LATE`` or ``WRONG``, empty where they are in
    order."""

    def __init__(self, world: World, node_id: int, send: Callable[[Frame], None]) -> None:
        self._world = world
        self._send = send
        self.can_ids: Final = frozenset(base + node_id for base in _BASES)
        self.how = ""
        self.until = 0.0
        """When they are in order again."""

    def on_answer(self, frame: Frame) -> None:
        how, data = self.how, frame.data
        names_object = data[0] & 0xE0 in _INITIATES
        if how == "silent":
            return
        if how == "aborts":
            self._send(
                Frame(frame.can_id, bytes([_ABORT, *data[1:4]]) + _GENERAL_ERROR.to_bytes(4, "little"))
            )
        elif how == "another index" and names_object:
            # The next object's, with another value.
            self._send(
                Frame(frame.can_id, bytes([data[0], data[1] ^ 1, *data[2:4], data[4] ^ 0xFF, *data[5:]]))
            )
        elif how in LATE:
            self._world.after(float(how), lambda: self._send(frame))
        else:
            self._send(frame)
