"""Watch for what should not be on the bus: other NMT masters, foreign nodes, node ids used twice."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from bridge.base.nmt_texts import text_of_command
from bridge.base.ratelimit import Pauses
from bridge.canopen import cobid
from bridge.canopen.duplicate import DuplicateSign, StateChanges, TooManyHeartbeats
from bridge.canopen.frame import Frame
from bridge.command import BusSide, Event, EventKind
from bridge.master.mastership import BusMastership
from bridge.text import Text

_NODES: Final = range(1, 128)
_FORGET_S: Final = 60.0
"""Time in seconds after the last sign until a point is back, and for which nothing is told twice."""


class BusWatch:
    """Reports each finding as an event, at most once a minute, and as a point of the bus."""

    def __init__(
        self,
        bus: str,
        own_id: int | None,
        mastership: BusMastership,
        known: dict[int, str],
        side: BusSide,
    ) -> None:
        """``own_id`` is the bridge's own node id where it produces a heartbeat; where the bridge does not act
        by its ``mastership``, another one is the NMT master. ``known`` has the names of the configured nodes,
        by id."""
        self._bus = bus
        self._own_id = own_id
        self._mastership = mastership
        self._known = known
        self._image = side.image
        self._events = side.events
        self._master_at = float("-inf")
        self._strangers: dict[int, float] = {}
        self._duplicates: dict[int, float] = {}
        self._pauses = Pauses()

    def routes(self) -> dict[int, Callable[[Frame], None]]:
        """Handlers of NMT commands, and of the error control messages of every node that is not
        configured."""
        routes: dict[int, Callable[[Frame], None]] = {cobid.NMT: self._on_nmt}
        for node_id in _NODES:
            if node_id not in self._known and node_id != self._own_id:
                routes[cobid.ERROR_CONTROL + node_id] = self._on_stranger
        return routes

    def _on_nmt(self, frame: Frame) -> None:
        """Report an NMT command that we did not send: our own do not come back."""
        if not self._mastership.acts():
            return
        self._master_at = frame.time
        self._tell(
            "master",
            Text.of("bus.second_master", command=text_of_command(frame.data)),
            frame.time,
            700,
        )

    def _on_stranger(self, frame: Frame) -> None:
        node_id = frame.can_id - cobid.ERROR_CONTROL
        self._strangers[node_id] = frame.time
        starts = frame.data == b"\0"
        self._tell(
            f"stranger {node_id}",
            Text.of("bus.stranger_starts" if starts else "bus.stranger", id=node_id),
            frame.time,
            500,
        )

    def on_own_id(self, now: float) -> None:
        """Note that somebody else uses the bridge's own id; whoever holds this watch reports it."""
        if self._own_id is not None:
            self._duplicates[self._own_id] = now

    def on_duplicate(self, node_id: int, sign: DuplicateSign, now: float) -> None:
        """Report a configured node id that behaves as if two devices had it."""
        self._duplicates[node_id] = now
        name = self._known.get(node_id, "unknown")
        self._tell(
            f"duplicate {node_id}",
            Text.of("bus.id_used_twice", id=node_id, name=name, sign=_said(sign)),
            now,
            700,
        )

    def _tell(self, key: str, said: Text, now: float, severity: int) -> None:
        if self._pauses.take(now, key) is not None:
            self._events.report(Event(now, EventKind.BUS, self._bus, severity, said))

    def refresh(self, now: float) -> None:
        """Update the points of the bus."""
        top = f"bus/{self._bus}"
        self._image.put(f"{top}/second_master", now - self._master_at < _FORGET_S, now)
        self._image.put(f"{top}/unexpected_nodes", _listed(self._strangers, now), now)
        self._image.put(f"{top}/duplicate_ids", _listed(self._duplicates, now), now)


def _said(sign: DuplicateSign) -> Text:
    match sign:
        case StateChanges(changes, messages):
            return Text.of("duplicate.state_changes", changes=changes, messages=messages)
        case TooManyHeartbeats(count, took_s, expected_s):
            return Text.of("duplicate.heartbeats", count=count, took_s=took_s, expected_s=expected_s)
        case _:
            return Text.of("duplicate.answered_twice", requests=sign.requests)


def _listed(seen: dict[int, float], now: float) -> str:
    """Node ids seen within the last minute; the others are forgotten."""
    for node_id in [node_id for node_id, at in seen.items() if now - at >= _FORGET_S]:
        del seen[node_id]
    return ", ".join(str(node_id) for node_id in sorted(seen))
