"""What the bridge says of the whole: as bad as the worst in it, in order when everything is, and one cause in
place of all that follows from it.

Written from the docs (points.md, "What is wrong"). Where the bridge stands still, ends, begins or gives way,
or something else happens meanwhile, what it says of the whole may have another reason, and is not judged.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf
from typing import Final, Protocol

from tests.plant.oracle import Oracle, Track
from tests.plant.world import BEGIN_S
from tests.proof.block import BLOCK
from tests.proof.drives import DRIVES
from tests.proof.families import LENZE
from tests.proof.settings import PLANT

ALARM: Final = 2
DANGER: Final = 3
_ALL: Final = "bridge/condition"
_CAUSE: Final = "bus_silent"
_SHOWN_S: Final = 1.2
"""What is so is shown by then: it is judged twice a second, and seen between two of the oracle's looks."""
_PASSES_S: Final = 2.0
"""By then a consequence has its cause: nodes are missed one after the other, and a drive that is back says
that it has a fault before it says which."""
_AFTER_S: Final = 8.0
"""So long after a cut its consequences are looked at; by then all are acknowledged."""
_BOOTED_S: Final = 8.0
_ORDER_S: Final = 7.0
"""So long after the last step everything is in order again, where nothing wants an acknowledge."""
_INTRUDER_S: Final = 600.0
"""An intruder is shown for so long."""
_TIMEOUT_S: Final = PLANT.fieldbus_timeout_ms / 1000
_MISSED_S: Final = max(PLANT.heartbeat_ms, *(drive.family.lost_after_ms for drive in DRIVES)) / 1000
_LENZES: Final = frozenset(drive.path for drive in DRIVES if drive.family is LENZE)
"""Their manual does not print the number of a bus time-out, so nobody knows it for what it is."""


class Reader(Protocol):
    """Who reads what the bridge says."""

    def good_number(self, name: str) -> float | None: ...

    def text(self, name: str) -> str: ...


@dataclass(frozen=True, slots=True)
class _Trouble:
    """From ``since`` to ``until`` these places are at least as bad as ``least``, if it still ``is_so`` then
    and the bridge was not disturbed since ``began``."""

    places: tuple[str, ...]
    least: int
    began: float
    since: float
    until: float
    text: str
    is_so: Callable[[], bool]


class Summaries:
    """Judge of conditions and troubles. What is wrong goes to the oracle's violations."""

    def __init__(self, oracle: Oracle, bus: str) -> None:
        self._oracle = oracle
        self._bus = f"bus/{bus}/condition"
        self._nodes = [*dict.fromkeys(drive.node for drive in DRIVES), BLOCK.node]
        self._troubles: list[_Trouble] = []
        self._disturbed_at = -inf
        self._busy_until = BEGIN_S + _BOOTED_S
        self._intruder_at = -inf
        self._cut: tuple[float, float] | None = None
        """Begin and end of a cut beside which nothing else happens."""
        self._lines: dict[tuple[str, str], float] = {}
        """Troubles by kind and place, with the time since when they stand by themselves."""

    # what happens

    def disturbed(self, at: float) -> None:
        """The bridge stands still, ends, begins, gives way or has no bus."""
        self._disturbed_at = at
        self._cut = None

    def busy(self, until: float) -> None:
        """Something happens until then."""
        self._busy_until = max(self._busy_until, until)
        self._cut = None

    def intruded(self, at: float) -> None:
        self._intruder_at = at

    def wrong(
        self,
        node: str | None,
        least: int,
        began: float,
        since: float,
        until: float,
        text: str,
        is_so: Callable[[], bool] = lambda: True,
    ) -> None:
        """Something is wrong at this node, or on the bus, which has to be shown from ``since`` to
        ``until``."""
        places = (*((f"{node}/node/condition",) if node else ()), self._bus, _ALL)
        self._troubles.append(_Trouble(places, least, began, since + _SHOWN_S, until, text, is_so))

    def cut(self, at: float, seconds: float, is_so: Callable[[], bool]) -> None:
        """Nodes and bridge do not hear each other for so long."""
        was_calm = at > self._busy_until + _ORDER_S and at > self._disturbed_at + _ORDER_S
        until = at + seconds
        self.wrong(None, ALARM, at, at + _MISSED_S, until, "no node is heard", is_so)
        self.busy(until)
        self._cut = (at, until) if was_calm and not self._lines else None

    def silenced(self, node: str, at: float, seconds: float, is_so: Callable[[], bool]) -> None:
        """A node says nothing for so long."""
        self.wrong(node, ALARM, at, at + _MISSED_S, at + seconds, f"{node} says nothing", is_so)

    # judging

    def look(self, now: float, bridge: Reader) -> None:
        """Judge what the bridge says now; it is there, and does not stand still."""
        if self._disturbed_at > now - _SHOWN_S:
            return
        self._oracle.looks += 1
        conditions = self._conditions(bridge)
        if conditions is None:
            return
        self._look_at_whole(now, conditions)
        self._troubles = [one for one in self._troubles if one.until > now]
        for one in self._troubles:
            if one.since <= now and self._disturbed_at < one.began - _SHOWN_S and one.is_so():
                self._look_at(one, now, conditions)
        for track in self._oracle.tracks.values():
            if self._has_tripped(track, now):
                self._look_at_trip(track, now, conditions)
        self._look_at_order(now, conditions)
        if self._cut is not None and now > self._cut[0] + _MISSED_S:
            self._look_at_cut(self._cut, now, bridge.text("bridge/troubles"))

    def _conditions(self, bridge: Reader) -> dict[str, int] | None:
        names = (_ALL, self._bus, *(f"{node}/node/condition" for node in self._nodes))
        found: dict[str, int] = {}
        for name in names:
            number = bridge.good_number(name)
            if number is None:
                return None
            found[name] = int(number)
        return found

    def _look_at_whole(self, now: float, conditions: dict[str, int]) -> None:
        worst = max(conditions[f"{node}/node/condition"] for node in self._nodes)
        if not worst <= conditions[self._bus] <= conditions[_ALL]:
            self._oracle.wrong(now, f"a whole is said to be better than the worst in it: {conditions}")

    def _look_at(self, one: _Trouble, now: float, conditions: dict[str, int]) -> None:
        for place in one.places:
            if conditions[place] < one.least:
                text = f"{place} is said to be {conditions[place]}, and {one.text}"
                self._oracle.wrong(now, f"{text} since {one.began - BEGIN_S:.3f} s")

    def _has_tripped(self, track: Track, now: float) -> bool:
        """Its controller was silent for too long while it ran, and is so still."""
        since = track.last_at
        is_gone = max(track.left_at, track.released_at, track.shared_until, track.intruded_at) >= since
        return (
            track.drive.reaction != "hold"
            and now - since > _TIMEOUT_S + _SHOWN_S + 1.0
            and track.enabled_at >= since > max(self._disturbed_at + _SHOWN_S, track.since)
            and not (is_gone or track.is_strangers)
        )

    def _look_at_trip(self, track: Track, now: float, conditions: dict[str, int]) -> None:
        text = f"the controller of {track.drive.path} is silent"
        trouble = self._at(track.drive.node, track.last_at, text)
        self._look_at(trouble, now, conditions)

    def _at(self, node: str, began: float, text: str) -> _Trouble:
        places = (f"{node}/node/condition", self._bus, _ALL)
        return _Trouble(places, ALARM, began, began, inf, text, lambda: True)

    def _look_at_order(self, now: float, conditions: dict[str, int]) -> None:
        since = max(self._busy_until, self._disturbed_at) + _ORDER_S
        if now < max(since, self._intruder_at + _INTRUDER_S) or not self._all_run(now):
            return
        if any(conditions.values()):
            self._oracle.wrong(now, f"everything is in order, and is said to be {conditions}")

    def _all_run(self, now: float) -> bool:
        """Each drive has been enabled for a while, and is told to be: one that hears nothing may run on."""
        for track in self._oracle.tracks.values():
            mask, value = track.drive.family.enabled
            latest = [word for at, word in track.said if at > now - _PASSES_S]
            is_told = track.enabled_at > now - _PASSES_S
            if not (latest and is_told) or any(word & mask != value for word in latest):
                return False
        return True

    def _look_at_cut(self, cut: tuple[float, float], now: float, text: str) -> None:
        began, until = cut
        lines = _lines_of(text)
        self._lines = {line: self._lines.get(line, now) for line in lines if _is_explained(line)}
        if now > until + _AFTER_S:
            self._cut, self._lines = None, {}
            return
        for line, since in self._lines.items():
            if now - since > _PASSES_S:
                self._oracle.wrong(now, f"a cut bus explains all, and {line} stands beside it")
        is_told = any(kind == _CAUSE for kind, _ in lines)
        if began + _MISSED_S + _SHOWN_S < now < until and not is_told:
            self._oracle.wrong(now, f"the bus is cut, and is not said to be silent: {sorted(lines)}")


def _is_explained(line: tuple[str, str]) -> bool:
    """Whether a cut bus has to be its cause."""
    kind, place = line
    return kind != _CAUSE and not (kind == "drive_fault" and place in _LENZES)


def _lines_of(text: str) -> Sequence[tuple[str, str]]:
    """Kind and place of each trouble that stands by itself."""
    return [(line["kind"], line["place"]) for line in json.loads(text or "[]")]
