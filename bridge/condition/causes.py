"""Causes before consequences: which trouble explains which others. Sans-IO, times in ms.

A cable cut at the box makes every node silent; when it is back, each drive has a fault of its bus. All of
these are one trouble, and what it explains stands below it. ``RULES`` says what explains what, where and
within which time; nothing else is left out of the first line, so that a second, independent fault keeps its
own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Final

from bridge.condition.plant_layout import PlantLayout
from bridge.condition.point_troubles import Rank, Trouble

Key = tuple[str, str]
"""Kind and place."""
Occurrence = tuple[Key, float]
"""One time that something went wrong: what, where, and when it began."""
BUS_FAULT: Final = "drive_fault of the bus"
"""The kind of a fault with which a drive answers a silent bus, as ``RULES`` has it."""
KEPT_MS: Final = 600_000.0
"""Time in ms for which a cause that is over can still explain new troubles."""


@dataclass(frozen=True, slots=True)
class Known:
    """A trouble with when it began, and when it was over (None: it is there), of the monotonic clock.
    ``owner`` is who commanded the drive last."""

    trouble: Trouble
    since_ms: float
    since_epoch_ms: float
    owner: str = ""
    until_ms: float | None = None
    until_epoch_ms: float | None = None
    is_or_longer: bool = False
    """It may have begun before the bridge did."""

    @property
    def key(self) -> Key:
        return self.trouble.kind, self.trouble.place

    @property
    def occurrence(self) -> Occurrence:
        return self.key, self.since_ms

    @property
    def kind(self) -> str:
        return BUS_FAULT if self.trouble.is_of_bus else self.trouble.kind


@dataclass(frozen=True, slots=True)
class TroubleLine:
    """One line of what is wrong. ``explains`` are its consequences; ``until_ms`` is when a cause was over of
    which only these are left. Times are in ms since 1970. ``rank`` is that of the worst of them all."""

    trouble: Trouble
    rank: Rank
    since_ms: float
    until_ms: float | None = None
    is_or_longer: bool = False
    explains: tuple[Known, ...] = ()

    @property
    def key(self) -> Key:
        return self.trouble.kind, self.trouble.place


Reach = Callable[[PlantLayout, Known, Known], bool]
"""Whether a cause can have a consequence where that is."""


def _anywhere(layout: PlantLayout, cause: Known, one: Known) -> bool:
    return True


def _below(layout: PlantLayout, cause: Known, one: Known) -> bool:
    """At the cause's bus or node, or what is on it."""
    return cause.trouble.place in layout.above(one.trouble.place)


def _of_owner(layout: PlantLayout, cause: Known, one: Known) -> bool:
    return one.owner == cause.owner


def _through_front(layout: PlantLayout, cause: Known, one: Known) -> bool:
    """At a drive that is commanded through a server that fails."""
    protocol = one.owner.partition(":")[0]
    return _SERVED_BY.get(protocol, protocol) in cause.trouble.fronts


_SERVED_BY: Final = {"local": "page"}
"""Front that serves the owners of a protocol, where its name differs."""


@dataclass(frozen=True, slots=True)
class CauseRule:
    """``passing`` ends with the cause, within ``settle_ms``; what lasts longer is a trouble of its own.
    ``leaves`` stays until somebody acknowledges it. Either begins at most ``before_ms`` before the cause was
    noticed, and ``after_ms`` after it was over."""

    cause: str
    reach: Reach
    passing: frozenset[str] = frozenset()
    leaves: frozenset[str] = frozenset()
    before_ms: float = 0.0
    after_ms: float = 0.0
    settle_ms: float = 0.0


_UNHEARD: Final = frozenset(("drive_lost", "drive_stale", "drive_not_as_configured"))
SILENT_NODE: Final = frozenset(("node_lost", "node_absent", "node_booting", *_UNHEARD))
"""Kinds of troubles that a silent node or bus explains, which may be found out later than they."""
_NOTICED_MS: Final = 5000.0
"""The longest time between two notices of one break: nodes are missed by their own supervision times."""
_BACK_MS: Final = 60_000.0
"""Longest time in ms for nodes to boot and to report their faults when their bus is back."""
_OF_BUS: Final = frozenset(("bus_silent", "bus_errors", "held", *SILENT_NODE))
_LEFT: Final = frozenset((BUS_FAULT,))
_OF_CONTROLLER: Final = frozenset(("controller_silent", "controllers_silent"))


def _rule_of_bus(kind: str) -> CauseRule:
    return CauseRule(kind, _below, _OF_BUS, _LEFT, _NOTICED_MS, _BACK_MS, _BACK_MS)


def _rule_of_node(kind: str, passing: frozenset[str] = _UNHEARD) -> CauseRule:
    return CauseRule(kind, _below, passing, _LEFT, _NOTICED_MS, _BACK_MS, _BACK_MS)


RULES: Final = (
    # While this box stood still it neither heard nor said anything: all that was noticed then may be its own.
    CauseRule(
        "box_slow",
        _anywhere,
        _OF_BUS | {"fronts_failing"},
        _LEFT | _OF_CONTROLLER,
        before_ms=500.0,
        after_ms=0.0,
        settle_ms=20_000.0,
    ),
    _rule_of_bus("bus_down"),
    _rule_of_bus("bus_off"),
    _rule_of_bus("bus_silent"),
    _rule_of_node("node_lost", _UNHEARD | {"node_booting"}),
    _rule_of_node("node_absent", _UNHEARD | {"node_booting"}),
    _rule_of_node("not_as_configured"),
    _rule_of_node("node_stopped"),
    _rule_of_node("node_disabled"),
    _rule_of_node("node_booting"),
    # A front that hangs is noticed later than its clients' silence.
    CauseRule("fronts_failing", _through_front, leaves=_OF_CONTROLLER, before_ms=10_000.0, after_ms=_BACK_MS),
    CauseRule(
        "controllers_silent", _of_owner, leaves=frozenset(("controller_silent",)), before_ms=_NOTICED_MS
    ),
)
"""Rules by which one trouble explains others; an earlier rule explains the causes of later ones, too."""
_PLACE: Final = {rule.cause: place for place, rule in enumerate(RULES)}


def explains(layout: PlantLayout, cause: Known, one: Known, now_ms: float) -> bool:
    """Whether ``one`` is a consequence of ``cause``."""
    place = _PLACE.get(cause.trouble.kind)
    if place is None or place >= _PLACE.get(one.trouble.kind, len(RULES)):
        return False
    rule = RULES[place]
    passes, stays = one.kind in rule.passing, one.kind in rule.leaves
    if not (passes or stays) or one.since_ms < cause.since_ms - rule.before_ms:
        return False
    if cause.until_ms is not None:
        is_settling = passes and now_ms <= cause.until_ms + rule.settle_ms
        if one.since_ms > cause.until_ms + rule.after_ms or not (stays or is_settling):
            return False
    return rule.reach(layout, cause, one)


class Causes:
    """Remembers causes that are over for as long as something of them is left."""

    def __init__(self, layout: PlantLayout) -> None:
        self._layout = layout
        self._causes: dict[Occurrence, Known] = {}
        """Known causes by occurrence, the furthest-reaching first: consequences of a first break are not
        those of the second."""

    def fold(self, found: Iterable[Known], now_ms: float, epoch_ms: float) -> list[TroubleLine]:
        """Troubles to be shown, each cause with those that it explains: the worst first, of the same rank the
        oldest. A cause that came twice and has left something each time is there twice."""
        present = {one.occurrence: one for one in found}
        self._remember(present, now_ms, epoch_ms)
        roots: dict[Occurrence, Known] = {}
        below: dict[Occurrence, list[Known]] = {}
        for one in present.values():
            cause = self.of(one, now_ms)
            if cause is None:
                roots[one.occurrence] = one
            else:
                below.setdefault(cause.occurrence, []).append(one)
        roots |= {place: cause for place, cause in self._causes.items() if place in below}
        self._forget(below, now_ms)
        shown = [_shown(one, below.get(place, ())) for place, one in roots.items()]
        return sorted(shown, key=lambda one: (one.rank, one.since_ms))

    def of(self, one: Known, now_ms: float) -> Known | None:
        """The first cause of ``one``, which nothing explains itself; None where nothing explains ``one``."""
        cause = None
        while (further := self._nearest(cause or one, now_ms)) is not None:
            cause = further
        return cause

    def _nearest(self, one: Known, now_ms: float) -> Known | None:
        causes = self._causes.values()
        return next((cause for cause in causes if explains(self._layout, cause, one, now_ms)), None)

    def _remember(self, present: Mapping[Occurrence, Known], now_ms: float, epoch_ms: float) -> None:
        causes = dict(self._causes)
        for place, one in self._causes.items():
            if one.until_ms is None and place not in present:
                causes[place] = replace(one, until_ms=now_ms, until_epoch_ms=epoch_ms)
        causes |= {place: one for place, one in present.items() if one.trouble.kind in _PLACE}
        self._causes = dict(sorted(causes.items(), key=lambda item: _PLACE[item[1].trouble.kind]))

    def _forget(self, below: Mapping[Occurrence, object], now_ms: float) -> None:
        for place, one in list(self._causes.items()):
            if one.until_ms is not None and now_ms > one.until_ms + KEPT_MS and place not in below:
                del self._causes[place]


def _shown(one: Known, explained: Iterable[Known]) -> TroubleLine:
    below = tuple(sorted(explained, key=lambda known: known.since_ms))
    rank = min((one.trouble.rank, *(known.trouble.rank for known in below)))
    return TroubleLine(one.trouble, rank, one.since_epoch_ms, one.until_epoch_ms, one.is_or_longer, below)
