"""The watchdog's own table (BU 2500 §7.1.1, and the rules for a bridge), written down a second time: each
event in each state, and each after each other."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import product
from typing import Final

import pytest

from bridge.command import Action, Code, Do, Identity, Request, Role, Source, TakeControl
from bridge.command.leg.event import BridgeGap
from bridge.command.leg.outlook import watchdog_state
from tests.support.leg import PLC, Leg, settings_of

TIMEOUT_S: Final = 1.0
READY, RUN, NOT_VALID = 0x047E, 0x047F, 0x007F
"""NORD's: the last one has bit 10, control data valid, at 0."""

NEXT: Final[Mapping[str, Mapping[str, str]]] = {
    "off": {},
    "idle": {"telegram": "running", "acknowledge": "running"},
    "running": {
        "timer expires": "tripped",
        "owner releases": "idle",
        "owner changes": "idle",
        "bridge hung": "idle",
    },
    "tripped": {"acknowledge": "running"},
}
"""Where an event is not named, the state stays. A trip outlives its owner, and a bridge that hung."""

NUMBERS: Final[Mapping[str, int]] = {"off": 0, "idle": 1, "running": 2, "tripped": 3}
"""Modbus, input register 14."""


class Watched(Leg):
    """Commanded by Modbus: whoever writes while nobody owns the drive does from then on."""

    def __init__(self, state: str) -> None:
        timeout_ms = 0 if state == "off" else round(1000 * TIMEOUT_S)
        super().__init__(settings_of("nord/sk-tu4-cao", fieldbus_timeout_ms=timeout_ms))
        self._engineers = 0
        if state in ("running", "tripped"):
            self.writes(READY)
            self.writes(RUN)
            assert self.enables
        if state == "tripped":
            self.trips()
        assert self.watchdog == state

    @property
    def watchdog(self) -> str:
        return watchdog_state(self.settings, self.state).label

    def of_owner(self, action: Action) -> None:
        self.happens(Request(self.state.owner.identity or PLC, "n/d", Do(action)))
        assert self.outcome.ok

    def telegram(self) -> None:
        self.of_owner(Action.KEEP_ALIVE)

    def acknowledge(self) -> None:
        self.of_owner(Action.RESET_FAULT)

    def invalid(self) -> None:
        before = self.state
        self.writes(NOT_VALID)
        assert self.outcome.code in (Code.NOT_VALID, Code.NOT_ALLOWED)
        assert self.state == before

    def expires(self) -> None:
        self.waits(TIMEOUT_S)

    def releases(self) -> None:
        self.of_owner(Action.RELEASE_CONTROL)

    def changes(self) -> None:
        self._engineers += 1
        who = Identity(Source.MODBUS, f"10.0.0.{self._engineers}", Role.ENGINEER)
        self.happens(Request(who, "n/d", TakeControl()))
        assert self.state.owner.identity == who

    def hung(self) -> None:
        self.happens(BridgeGap())


EVENTS: Final[Mapping[str, Callable[[Watched], None]]] = {
    "telegram": Watched.telegram,
    "invalid telegram": Watched.invalid,
    "timer expires": Watched.expires,
    "acknowledge": Watched.acknowledge,
    "owner releases": Watched.releases,
    "owner changes": Watched.changes,
    "bridge hung": Watched.hung,
}


@pytest.mark.parametrize("state", NUMBERS)
def test_each_state_has_its_number(state: str) -> None:
    watched = Watched(state)
    assert watchdog_state(watched.settings, watched.state) == NUMBERS[state]


@pytest.mark.landing(196)
@pytest.mark.parametrize("state", NEXT)
@pytest.mark.parametrize(("first", "second"), list(product(EVENTS, EVENTS)))
def test_each_event_leads_where_the_table_says_also_after_each_other(
    state: str, first: str, second: str
) -> None:
    watched = Watched(state)
    for event in (first, second):
        EVENTS[event](watched)
        state = NEXT[state].get(event, state)
        assert watched.watchdog == state
        if event in ("telegram", "acknowledge"):
            deadline = watched.state.timer.deadline
            assert deadline == (None if state == "off" else pytest.approx(watched.now + TIMEOUT_S))
        elif event != "invalid telegram" and not (event == "timer expires" and state == "off"):
            assert not watched.enables, "whoever goes or falls silent leaves a drive that stands"
        if state == "tripped":
            assert not watched.enables
