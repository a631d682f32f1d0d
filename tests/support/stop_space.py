"""Everything that can happen to the judge of a drive's stops, breadth first, each state visited once.

A state is the judge's own with what the rules remember, in ticks from now: two sequences that lead to the
same one have the same future, so only the first goes on.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from typing import Any, Final, NamedTuple

from bridge.command.stop_check import step as judge
from bridge.command.stop_check.event import (
    CutOff,
    Event,
    HandedOver,
    NodeOperational,
    NodeRestarted,
    NodeStopped,
    Sends,
    StatusChange,
    TelegramGap,
    TimePassed,
)
from bridge.command.stop_check.state import Bounds, Says, Sent, StopState, StopVerdict
from tests.support import stop_rules
from tests.support.stop_rules import LATE, LONGEST, OFF, RAMP, SILENCE, Memory, Told

BOUNDS: Final = Bounds(OFF, RAMP, SILENCE)
_KEPT: Final = {
    "since": -LONGEST - 1,
    "until": -LONGEST,
    "off_since": -RAMP,
    "stopping_since": -RAMP,
    "follows_since": -RAMP,
    "look_at": 0,
}
"""Oldest time of each attribute that makes a difference: longer ago is as long ago as anything."""
_PAUSE: Final = 1


class World(NamedTuple):
    """``heard_at`` is when the drive was heard last."""

    stop: StopState = StopState()
    heard_at: int | None = None
    memory: Memory = Memory()


class RecordedTable(dict[Any, Any]):
    """A table that knows which of its cells were looked up."""

    def __init__(self, table: Mapping[Any, Any]) -> None:
        super().__init__(table)
        self.reached: set[Any] = set()

    def __getitem__(self, cell: Any) -> Any:
        self.reached.add(cell)
        return super().__getitem__(cell)


class StopSpace:
    """``names`` are those of what may happen. ``pause`` is the longest regular one between two telegrams,
    None of a drive that sends changes alone."""

    def __init__(self, names: Collection[str], pause: int | None = _PAUSE) -> None:
        self.pause = pause
        self.states = 0
        self.steps = 0
        every: dict[str, Callable[[World], World]] = {
            **{f"sends {sent.name}": _bind(self._sends, sent) for sent in Sent},
            **{f"says {says.name}": _bind(self._says, says) for says in Says},
            "handed over": self._handed_over,
            "node operational": _bind(self._node, True),
            "node gone": _bind(self._node, False),
            "cut off": self._cut_off,
            "node stopped": self._node_stopped,
            "node restarted": self._restarted,
            "tick": _bind(self._tick, True),
            "tick, asked when it is due": _bind(self._tick_when_due, True),
            "tick without a telegram": _bind(self._tick_when_due, False),
            "heard after a pause": self._pause,
        }
        self.events = {name: every[name] for name in names}

    def explore(self, most: int) -> None:
        """Raises AssertionError with the shortest sequence that breaks a rule."""
        first = World()
        came_from: dict[World, tuple[World, str] | None] = {first: None}
        ahead = [first]
        for world in ahead:
            for name, happen in self.events.items():
                try:
                    then = happen(world)
                except AssertionError as error:
                    sequence = [*_way_to(world, came_from), name]
                    raise AssertionError(f"{error}\nafter: {', '.join(sequence)}") from error
                self.steps += 1
                if then not in came_from:
                    came_from[then] = (world, name)
                    ahead.append(then)
            assert len(ahead) <= most, "more states than expected"
        self.states = len(ahead)

    def _sends(self, world: World, sent: Sent) -> World:
        return self._step(world, Sends(sent), stop_rules.sends(world.memory, sent.name))

    def _handed_over(self, world: World) -> World:
        return self._step(world, HandedOver(0, BOUNDS), stop_rules.handed_over(world.memory))

    def _node(self, world: World, is_there: bool) -> World:
        if is_there is world.memory.is_there:
            return world
        return self._step(world, NodeOperational(is_there), stop_rules.node(world.memory, is_there=is_there))

    def _cut_off(self, world: World) -> World:
        """With what the rules remember of it: a drive that was known to stop before is not cut off."""
        then = self._step(world, CutOff(0, BOUNDS), None)
        memory = world.memory
        if then.stop.is_cut_off and not memory.is_cut_off:
            assert memory.is_there and memory.word != "ENABLES" and memory.outcome != "IGNORED"
            memory = stop_rules.handed_over(memory)
            memory = memory._replace(is_cut_off=True, is_deaf=False)
        elif then.stop != world.stop:
            memory = stop_rules.handed_over(memory)
        return self._checked(world, then._replace(memory=memory))

    def _node_stopped(self, world: World) -> World:
        memory = world.memory
        if memory.is_cut_off and memory.outcome != "IGNORED":
            memory = stop_rules.says(memory, "AT_REST")
        return self._step(world, NodeStopped(0), memory)

    def _restarted(self, world: World) -> World:
        return self._step(world, NodeRestarted(), stop_rules.restarted(world.memory))

    def _pause(self, world: World) -> World:
        then = self._step(world, TelegramGap(0), stop_rules.paused(world.memory))
        return then._replace(heard_at=0)

    def _says(self, world: World, says: Says) -> World:
        then = self._step(world, StatusChange(says, 0), stop_rules.says(world.memory, says.name))
        return then._replace(heard_at=0)

    def _tick(self, world: World, is_heard: bool) -> World:
        """The judge is asked."""
        memory = stop_rules.tick(world.memory, is_heard=is_heard)
        heard_at = 0 if is_heard else None if world.heard_at is None else world.heard_at - 1
        stop, verdicts = judge.step(_earlier(world.stop), TimePassed(0, heard_at, self.pause))
        assert not verdicts or memory.words, "what is over is not told"
        for verdict in verdicts[len(world.stop.untold) :]:
            memory = stop_rules.check_told(memory, _told(verdict))
        if heard_at is not None:
            heard_at = max(heard_at, _KEPT["since"] - (heard_at < stop.since))
        then = self._checked(world, World(_forgetful(stop), heard_at, memory))
        if self.pause is not None:
            stop_rules.check_looked(memory)
        return then

    def _tick_when_due(self, world: World, is_heard: bool) -> World:
        """The judge is asked if it has said that it wants to be."""
        then = self._tick(world, is_heard)
        due = judge.next_deadline(world.stop)
        if due is not None and due <= 1:
            return then
        assert is_heard or then.stop.last_stop is world.stop.last_stop, "nothing comes of a look before"
        memory = stop_rules.tick(world.memory, is_heard=is_heard)
        if self.pause is not None:
            stop_rules.check_looked(memory, late=LATE)
        return World(_forgetful(_earlier(world.stop)), then.heard_at, memory)

    def _step(self, world: World, event: Event, memory: Memory | None) -> World:
        stop, verdicts = judge.step(world.stop, event)
        assert not verdicts, "the bus has not been drained"
        then = World(_forgetful(stop), world.heard_at, world.memory if memory is None else memory)
        return then if memory is None else self._checked(world, then)

    def _checked(self, before: World, then: World) -> World:
        memory, stop = then.memory, then.stop
        for verdict in stop.untold[len(before.stop.untold) :]:
            memory = stop_rules.check_told(memory, _told(verdict))
        stop_rules.check_state(memory, stop.last_stop.name, follows=stop.follows, is_judged=stop.is_judged)
        return then._replace(memory=memory)


def _bind(happen: Callable[..., World], what: object) -> Callable[[World], World]:
    return lambda world: happen(world, what)


def _told(verdict: StopVerdict) -> Told:
    return Told(
        verdict.outcome.name,
        verdict.before.name,
        verdict.since,
        verdict.at,
        verdict.again,
        verdict.is_cut_off,
    )


def _earlier(stop: StopState) -> StopState:
    """The same a tick later: its times are one less."""
    return stop._replace(
        **{name: getattr(stop, name) - 1 for name in _KEPT},
        untold=tuple(_verdict_earlier(verdict) for verdict in stop.untold),
    )


def _verdict_earlier(verdict: StopVerdict) -> StopVerdict:
    return StopVerdict(
        verdict.outcome,
        verdict.before,
        verdict.since - 1,
        verdict.at - 1,
        verdict.again,
        verdict.is_cut_off,
        verdict.summed,
    )


def _forgetful(stop: StopState) -> StopState:
    return stop._replace(**{name: max(getattr(stop, name), kept) for name, kept in _KEPT.items()})


def _way_to(world: World, came_from: Mapping[World, tuple[World, str] | None]) -> Iterator[str]:
    names: list[str] = []
    before = came_from[world]
    while before is not None:
        names.append(before[1])
        before = came_from[before[0]]
    return reversed(names)
