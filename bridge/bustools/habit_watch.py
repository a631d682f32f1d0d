"""Habits of the nodes of a bus, by what a listener hears: ``bridge.canopen.habits``. Sans-IO."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from bridge.canopen import cobid
from bridge.canopen.frame import EXTENDED, REMOTE, Frame
from bridge.canopen.habits import HabitCounter, Odd

_SDO_BYTES: Final = 8
_EMCY_BYTES: Final = 8
_HEARTBEAT_BYTES: Final = 1
_LONGEST_WAIT_S: Final = 5.0
"""Age of a request in seconds after which an answer does not belong to it."""
_ABORT: Final = 0x80


class HabitWatch:
    """Watch on the habits of all nodes. ``timeout_s`` is the site's SDO time-out of a node, ``tpdo_bytes``
    the length of a TPDO by its COB-ID, None where nobody knows it."""

    def __init__(self, timeout_s: Callable[[int], float], tpdo_bytes: Callable[[int], int | None]) -> None:
        self._timeout_s = timeout_s
        self._tpdo_bytes = tpdo_bytes
        self._counters: dict[int, HabitCounter] = {}
        self._asked_at: dict[int, float] = {}

    def on_frame(self, frame: Frame, node_id: int) -> None:
        """A frame that is about ``node_id``, 0 for none."""
        if not node_id or frame.can_id & (REMOTE | EXTENDED):
            return
        has = len(frame.data)
        tpdo_bytes = self._tpdo_bytes(frame.can_id)
        if tpdo_bytes is not None:
            self._compare(node_id, Odd.TPDO_LENGTH_BY_FILE, has, tpdo_bytes)
            return
        match frame.can_id - node_id:
            case cobid.SDO_REQUEST:
                if frame.data[:1] != bytes((_ABORT,)):
                    self._asked_at.setdefault(node_id, frame.time)
            case cobid.SDO_REPLY:
                self._compare(node_id, Odd.SDO_LENGTH, has, _SDO_BYTES)
                self._time(node_id, frame.time)
            case cobid.ERROR_CONTROL:
                self._compare(node_id, Odd.HEARTBEAT_LENGTH, has, _HEARTBEAT_BYTES)
            case cobid.EMCY:
                self._compare(node_id, Odd.EMCY_LENGTH, has, _EMCY_BYTES)
            case _:
                pass

    def habits(self) -> dict[int, list[str]]:
        """Habits by node id, of the nodes that have any."""
        said = {
            node_id: list(map(str, counter.said())) for node_id, counter in sorted(self._counters.items())
        }
        return {node_id: habits for node_id, habits in said.items() if habits}

    def _compare(self, node_id: int, odd: Odd, has: int, due: int) -> None:
        if has != due:
            self._counters.setdefault(node_id, HabitCounter()).note(odd, has, due)

    def _time(self, node_id: int, now: float) -> None:
        asked_at = self._asked_at.pop(node_id, None)
        if asked_at is None:
            return
        took_s, timeout_s = now - asked_at, self._timeout_s(node_id)
        if timeout_s < took_s < _LONGEST_WAIT_S:
            counter = self._counters.setdefault(node_id, HabitCounter())
            counter.note(Odd.SDO_LATE, round(1000 * took_s), round(1000 * timeout_s))
