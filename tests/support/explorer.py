"""Exhaustive exploration: breadth first through all sequences of events, each state visited once.

Two sequences that leave the same state behind have the same future, so only the first goes on. A state is
that of a ``Machine`` relative to its clock.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from itertools import pairwise
from typing import Any, Protocol

_OURS = ("bridge.command.", "tests.support.handshake_model")
_PLAIN = (int, float, str, bytes, tuple, Enum, type(None))

State = tuple[Hashable, ...]


class Parts:
    """The mutable state of ``root`` and of all objects of the command channel that it is made of.

    A state is what their attributes hold at the time ``at``: one that is taken later is brought back to that
    time, and what is left of it is that of any other. Tables (dicts) do not change while a drive is commanded
    and are left out; lists have to be empty. What is over counts for ``memory_s`` of the attribute, and after
    that no more. Numbers below ``epoch`` are no times. Attributes ``only_shown`` decide nothing; times in
    ``spent`` mean nothing when they are over.
    """

    def __init__(
        self,
        root: object,
        *,
        epoch: float,
        at: float,
        memory_s: Mapping[str, float] | None = None,
        only_shown: Sequence[str] = (),
        spent: Sequence[str] = (),
    ) -> None:
        self._only_shown = only_shown
        self._spent = spent
        self._epoch = epoch
        self._at = at
        self._memory_s = memory_s or {}
        self._fields: list[tuple[object, str]] = []
        self._lists: list[list[object]] = []
        self._walk(root, set())
        self._read, self._write = _accessors(self._fields)

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

    def take(self, now: float) -> State:
        """The state as it is; equal ones have the same future."""
        assert not any(self._lists), "an outcome was not told"
        state = self._read()
        if now == self._at:
            return state
        return tuple(
            self._brought_back(name, value, now) for (_, name), value in zip(self._fields, state, strict=True)
        )

    def _brought_back(self, name: str, value: Any, now: float) -> Any:
        if isinstance(value, tuple) and hasattr(value, "_fields"):
            parts = zip(value._fields, value, strict=True)
            return type(value)(*(self._brought_back(part, each, now) for part, each in parts))
        if type(value) is not float or not self._epoch <= value < float("inf"):
            return value
        if name in self._spent and value <= now:
            return None
        return round(self._at + max(value - now, -self._memory_s.get(name, 0.0)), 6)

    def put(self, state: State) -> None:
        """Be in ``state``, at the time ``at``."""
        self._write(state)


def _accessors(fields: Sequence[tuple[object, str]]) -> tuple[Callable[[], State], Callable[[State], None]]:
    """What reads all attributes at once, and what sets them. Each step does both, so they are compiled: a
    third of the time that going through the attributes by name takes."""
    places = {id(part): place for place, (part, _) in enumerate(fields)}
    scope: dict[str, Any] = {f"part_{place}": fields[place][0] for place in places.values()}
    attributes = "".join(f"part_{places[id(part)]}.{name}, " for part, name in fields)
    exec(f"def read(): return ({attributes})\ndef write(state): ({attributes}) = state", scope)
    return scope["read"], scope["write"]


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
