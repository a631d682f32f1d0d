"""The image against what drives really do: no value, set value or bit is good that is not so beyond its age,
and a setting that decides them is told when it has changed.

Written from the docs (mapping-file.md "[[meaning]]", points.md, ADR 12): what was last read more than 10 s
ago is *stale*, a value that no word carries is *disabled*, and a change is an event.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf, isnan
from typing import TYPE_CHECKING, Final

from bridge.canopen.frame import Frame
from bridge.command import Event, EventKind
from tests.plant import hoist
from tests.plant.field import FieldNode
from tests.plant.oracle import Oracle
from tests.plant.physics import Leaf, Physics, physics_of, posicon_of
from tests.plant.plan import FIRST_S
from tests.plant.sdo_answers import LATEST_S
from tests.plant.world import BEGIN_S, World
from tests.proof.drives import DRIVES

if TYPE_CHECKING:
    from tests.plant.plant import Plant

_AGE_S: Final = 0.7
"""Longest time for which a value that is no longer told may be good, with a TPDO each 0.3 s."""
FOUND_S: Final = 10.0 + 1.0 + LATEST_S
"""By then a change at the drive is found, or what depends on it is in doubt: 10 s (docs), what the bridge's
looks take, and an answer that was on its way."""
_ERROR_CONTROL: Final = range(0x700, 0x780)
_BOOT_UP: Final = b"\0"
_BOOT_S: Final = 20.0
"""Longest time in which a node is booted: of a NORD's objects each may take 0.4 s."""
_KEPT: Final = 40
_TURNS: Final = 4
"""A drive is looked at once in so many looks: what is wrong stays so."""
_JUST_S: Final = 1.0
_SHARE: Final = 0.01


@dataclass(slots=True)
class _Sample:
    at: float
    values: tuple[float | None, ...]


@dataclass(slots=True)
class _Subject:
    """One drive. ``age_s`` is how long its values may be good without a new telegram."""

    path: str
    physics: Physics
    age_s: float
    samples: deque[_Sample] = field(default_factory=lambda: deque[_Sample](maxlen=_KEPT))
    settings: dict[str, float] = field(default_factory=dict[str, float])
    changed: dict[str, float] = field(default_factory=dict[str, float])
    """When each setting last changed."""
    known: dict[str, float] = field(default_factory=dict[str, float])
    """The settings as the bridge has told them, or has read them when it began."""
    owed: dict[str, float] = field(default_factory=dict[str, float])
    """Since when each change is to be told."""
    false: set[str] = field(default_factory=set[str])
    """Set values that were not what the drive has, at the last look: a word may have been on its way."""
    booted_by: float = BEGIN_S + FIRST_S
    """By then the bridge has asked it, since one of both began anew."""
    has_given: bool = False
    """What the site file gives was what the drive has, and the bridge has said so since it began."""


class Truths:
    """Judge of the image's values. What is wrong goes to the oracle's violations."""

    def __init__(self, oracle: Oracle, good_number: Callable[[str], float | None], world: World) -> None:
        self._oracle = oracle
        self._world = world
        self._turn = 0
        self._good_number = good_number
        self._subjects: dict[str, _Subject] = {}
        self._given: dict[str, float] = {}
        self._disturbed_at = -inf
        self.is_quiet: Callable[[], bool] = lambda: True
        """Whether frames reach everybody."""

    def watch(self, path: str, physics: Physics, age_s: float = _AGE_S) -> Callable[[Frame], None]:
        """Watch this drive. What is returned is to be called with each of its telegrams, as it composes it,
        and with each sign of life of its node."""
        subject = self._subjects[path] = _Subject(path, physics, age_s)
        subject.settings = physics.settings()
        subject.known = dict(subject.settings)
        self._given.update({f"{path} {name}": value for name, value in subject.settings.items()})

        def on_frame(frame: Frame) -> None:
            if frame.can_id not in _ERROR_CONTROL:
                self._sample(subject, self._world.now)
            elif frame.data == _BOOT_UP:
                self._ask_anew(subject)

        return on_frame

    # what happens

    def disturbed(self, at: float) -> None:
        """The bridge stands still, begins, ends, or has no bus: what changed before may not be told."""
        self._disturbed_at = at
        for subject in self._subjects.values():
            self._forget(subject)

    def started(self) -> None:
        """Another process knows the site file, and reads what drives have by then."""
        for subject in self._subjects.values():
            subject.has_given = False
            self._ask_anew(subject)

    def _ask_anew(self, subject: _Subject) -> None:
        """Its node is booted by the bridge: what is read then is what it was, and no news."""
        subject.booted_by = self._world.now + _BOOT_S
        self._forget(subject)

    def _forget(self, subject: _Subject) -> None:
        subject.owed.clear()
        subject.known = dict(subject.settings)

    def told(self, event: Event) -> None:
        subject = self._subjects.get(event.source)
        if event.kind is not EventKind.CONFIGURATION or subject is None:
            return
        # It may be told before the drive's next telegram.
        self._take_settings(subject, self._world.now)
        message = event.message
        for name in subject.settings:
            # The mode is told by the object that says it, too: 6061h.
            if message.startswith("606" if name == "6060" else name):
                subject.known[name] = subject.settings[name]
                subject.owed.pop(name, None)

    def _sample(self, subject: _Subject, at: float) -> None:
        is_back = bool(subject.samples) and at > subject.samples[-1].at + subject.age_s
        self._take_settings(subject, at)
        if is_back:
            self._ask_anew(subject)
        if at < subject.booted_by:
            self._forget(subject)
        subject.samples.append(_Sample(at, subject.physics.values()))

    def _take_settings(self, subject: _Subject, at: float) -> None:
        settings = subject.physics.settings()
        if settings != subject.settings:
            for name, value in settings.items():
                if value != subject.settings[name]:
                    self._change(subject, name, value, at)
            subject.settings = settings

    def _change(self, subject: _Subject, name: str, value: float, at: float) -> None:
        subject.changed[name] = at
        if value == subject.known[name]:
            subject.owed.pop(name, None)
        else:
            subject.owed[name] = at

    # judging

    def look(self, now: float) -> None:
        """Judge what the image says of some drives: the others have their turn at the next looks."""
        self._turn += 1
        if now >= self._disturbed_at + _JUST_S:
            for subject in list(self._subjects.values())[self._turn % _TURNS :: _TURNS]:
                self._look(subject, now)

    def _look(self, subject: _Subject, now: float) -> None:
        path = subject.path
        recent = [one for one in subject.samples if one.at >= now - subject.age_s]
        if not self.is_quiet():
            self._forget(subject)
        if not recent:
            return
        good: set[str] = set()
        for place, leaf in enumerate(subject.physics.leaves):
            said = self._good_number(f"{path}/{leaf.name}")
            if said is None:
                continue
            good.update(subject.physics.key(name) for name in leaf.by)
            self._oracle.looks += 1
            values = [one.values[place] for one in recent]
            if self._is_judged(subject, leaf, said, values, now):
                self._judge(subject, leaf, said, values, now)
            else:
                subject.false.discard(leaf.name)
        for name, since in list(subject.owed.items()):
            if now > since + FOUND_S:
                del subject.owed[name]
                if name in good:
                    text = f"{path}: {name} was changed at {since - 1000.0:.3f} s, and no event says so"
                    self._oracle.wrong(now, text)

    def _is_judged(
        self, subject: _Subject, leaf: Leaf, said: float, values: list[float | None], now: float
    ) -> bool:
        # A set value of 0 may be a stop that does not reach the drive; what it does then, others judge.
        if not said and (leaf.is_bit or leaf.is_command):
            return False
        key = subject.physics.key
        if not leaf.at_once and any(now < subject.changed.get(key(name), -inf) + FOUND_S for name in leaf.by):
            return False
        return not any(value is not None and isnan(value) for value in values)

    def _judge(
        self, subject: _Subject, leaf: Leaf, said: float, values: list[float | None], now: float
    ) -> None:
        is_true = any(
            value is not None and abs(value - said) <= leaf.margin + _SHARE * abs(value) for value in values
        )
        if leaf.given:
            name = subject.physics.key(leaf.given)
            is_given = subject.settings[name] == self._given[f"{subject.path} {name}"]
            subject.has_given |= is_given and is_true
            if not subject.has_given:
                # Docs: a change while the bridge does not run is not seen where a drive does not tell it.
                return
        if is_true:
            subject.false.discard(leaf.name)
            return
        is_on_its_way = leaf.is_command and leaf.name not in subject.false
        subject.false.add(leaf.name)
        if not is_on_its_way:
            really = "no such value" if values[-1] is None else f"{values[-1]:g}"
            self._oracle.wrong(
                now, f"{subject.path}/{leaf.name} is said to be {said:g}, and the drive has {really}"
            )


def truths_of(plant: Plant) -> Truths:
    """Judge of what the image says of the plant's drives, told of each of their telegrams."""
    truths = Truths(plant.oracle, lambda name: plant.bridge.good_number(name), plant.world)
    truths.is_quiet = plant.is_quiet
    for drive in DRIVES:
        node = plant.node_of(drive)
        _watch(truths, node, drive.path, drive.tpdo, physics_of(node.device, drive), _AGE_S)
    node = plant.nodes_by_id[hoist.NODE_ID]
    hoist.commission(node)
    _watch(truths, node, hoist.PATH, hoist.TPDO, posicon_of(node.device), hoist.AGE_S)
    return truths


def _watch(truths: Truths, node: FieldNode, path: str, tpdo: int, physics: Physics, age_s: float) -> None:
    on_frame = truths.watch(path, physics, age_s)
    for can_id in (tpdo, _ERROR_CONTROL.start + node.device.node_id):
        node.composed.setdefault(can_id, []).append(on_frame)
