"""Exhaustive exploration: breadth first through all sequences of events, each state visited once.

Two sequences that leave the same state behind have the same future, so only the first goes on. A state is
that of a ``Machine`` relative to its clock.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from itertools import pairwise
from typing import Any, Protocol

_OURS = "bridge.command."
_PLAIN = (int, float, str, bytes, tuple, Enum, type(None))


class Parts:
    """The mutable state of ``root`` and of all objects of ``bridge.command`` that it is made of.

    Tables (dicts) do not change while a drive is commanded and are left out; lists have to be empty. Times
    are kept relative to the clock; how long ago something was counts up to ``memory_s`` of the attribute.
    Attributes ``only_shown`` decide nothing; times in ``spent`` mean nothing when they are over.
    """

    def __init__(
        self,
        root: object,
        epoch: float,
        *,
        memory_s: Mapping[str, float],
        only_shown: Sequence[str] = (),
        spent: Sequence[str] = (),
    ) -> None:
        self._only_shown = only_shown
        self._spent = spent
        self._epoch = epoch
        self._memory_s = memory_s
        self._fields: list[tuple[object, str]] = []
        self._lists: list[list[object]] = []
        self._walk(root, set())

    def _walk(self, part: object, seen: set[int]) -> None:
        if id(part) in seen:
            return
        seen.add(id(part))
        for name in _attributes(part):
            value = getattr(part, name)
            if name in self._only_shown or callable(value):
                continue
            if isinstance(value, list):
                self._lists.append(value)
            elif isinstance(value, _PLAIN) or _is_frozen(value):
                self._fields.append((part, name))
            elif type(value).__module__.startswith(_OURS):
                self._walk(value, seen)

    def take(self, now: float) -> tuple[Hashable, ...]:
        """The state as it is; equal ones have the same future."""
        assert not any(self._lists), "an outcome was not told"
        state: list[Hashable] = [getattr(part, name) for part, name in self._fields]
        for place, value in enumerate(state):
            if type(value) is float and self._epoch <= value < float("inf"):
                state[place] = self._relative(self._fields[place][1], value, now)
        return tuple(state)

    def _relative(self, name: str, value: float, now: float) -> Hashable:
        if name in self._spent and value <= now:
            return None
        return ("at", round(max(value - now, -self._memory_s.get(name, 0.0)), 6))

    def put(self, state: tuple[Hashable, ...], now: float) -> None:
        """Be in ``state`` at ``now``."""
        for (part, name), value in zip(self._fields, state, strict=True):
            is_time = type(value) is tuple and len(value) == 2 and value[0] == "at"
            setattr(part, name, now + value[1] if is_time else value)


def _attributes(part: object) -> Iterator[str]:
    slots = [name for kind in type(part).__mro__ for name in getattr(kind, "__slots__", ())]
    yield from slots or vars(part)


def _is_frozen(value: object) -> bool:
    parameters = getattr(type(value), "__dataclass_params__", None)
    return bool(parameters and parameters.frozen)


class Machine(Protocol):
    """What is explored. ``events`` may happen in any state; ``happen`` lets one happen, checks what must hold
    and gives the transitions that were made."""

    events: Sequence[str]

    def take(self) -> Hashable: ...
    def put(self, state: Any) -> None: ...
    def happen(self, event: str) -> tuple[Hashable, ...]: ...


@dataclass(slots=True)
class Map:
    """Everything that was found: ``edges[state]`` has what each event makes of it, with its transitions."""

    edges: list[list[tuple[tuple[Hashable, ...], int]]] = field(default_factory=list)
    steps: int = 0
    depth: int = 0
    """Length of the longest way to a state that there is no shorter one to."""

    def transitions(self) -> set[Hashable]:
        return {t for state in self.edges for made, _ in state for t in made}

    def pairs(self) -> set[tuple[Hashable, Hashable]]:
        """Each transition with each that some sequence of events makes directly after it."""
        last: list[set[Hashable]] = [set() for _ in self.edges]
        todo = deque(range(len(self.edges)))
        pairs: set[tuple[Hashable, Hashable]] = set()
        while todo:
            state = todo.popleft()
            for made, after in self.edges[state]:
                pairs |= {(before, made[0]) for before in last[state]} if made else set()
                pairs |= set(pairwise(made))
                brought = {made[-1]} if made else last[state]
                if not brought <= last[after]:
                    last[after] |= brought
                    todo.append(after)
        return pairs


def explore(machine: Machine, most: int) -> Map:
    """Every state that ``machine`` can come to from the present one; fails where there are over ``most``.

    A check that fails does so with the shortest sequence of events that leads there.
    """
    first = machine.take()
    numbers = {first: 0}
    states = [first]
    ways: list[tuple[int, str] | None] = [None]
    depths = [0]
    found = Map()
    number = 0
    while number < len(states):
        assert len(states) <= most, f"more than {most} states"
        edges: list[tuple[tuple[Hashable, ...], int]] = []
        for event in machine.events:
            machine.put(states[number])
            try:
                made = machine.happen(event)
            except AssertionError as error:
                raise AssertionError(f"{error}\nafter {_way(ways, number)}, {event}") from error
            after = machine.take()
            where = numbers.setdefault(after, len(states))
            if where == len(states):
                states.append(after)
                ways.append((number, event))
                depths.append(depths[number] + 1)
            edges.append((made, where))
            found.steps += 1
        found.edges.append(edges)
        number += 1
    found.depth = max(depths)
    return found


def _way(ways: Sequence[tuple[int, str] | None], number: int) -> str:
    events: list[str] = []
    way = ways[number]
    while way is not None:
        number, event = way
        events.append(event)
        way = ways[number]
    return ", ".join(reversed(events)) or "nothing"
