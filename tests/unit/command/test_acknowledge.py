"""An acknowledge is an edge of the owner's own words, whatever the bridge has sent in between
(docs/explanation/dead-man-chain.md)."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import product

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.command import Action, EventKind
from bridge.command.drive_link import NodeState
from tests.support.nightly import examples
from tests.support.rig import (
    ACKNOWLEDGE,
    ENABLE,
    ENABLED,
    ENGINEER,
    FAULT,
    OPERATOR,
    OTHER_PLC,
    PLC,
    READY,
    SHUT_DOWN,
    Rig,
)

_BIT = 0x0080
CONSTANT = (ACKNOWLEDGE, ACKNOWLEDGE | 1)
"""The bit is 1 in whatever this program writes."""


def _gap(rig: Rig) -> None:
    rig.channel.on_bridge_gap(rig.now)


def _bus_gone(rig: Rig) -> None:
    rig.channel.start_anew(rig.now)


def _node_back(rig: Rig) -> None:
    rig.node(NodeState.LOST)
    rig.node(NodeState.OPERATIONAL)


def _time_out(rig: Rig) -> None:
    rig.submit(Action.SET_TIMEOUT, PLC, timeout_ms=300)


IN_BETWEEN: dict[str, Callable[[Rig], object]] = {
    "silence, a trip where one is due": lambda rig: rig.wait(0.25),
    "a moment": lambda rig: rig.wait(0.01),
    "stop by somebody else": lambda rig: rig.submit(Action.STOP, OPERATOR),
    "quick stop by somebody else": lambda rig: rig.submit(Action.QUICK_STOP, OPERATOR),
    "disable voltage by somebody else": lambda rig: rig.submit(Action.DISABLE_VOLTAGE, ENGINEER),
    "own stop": lambda rig: rig.submit(Action.STOP, PLC),
    "start": lambda rig: rig.submit(Action.START, PLC, direction=1),
    "keep-alive": lambda rig: rig.submit(Action.KEEP_ALIVE, PLC),
    "setpoint": lambda rig: rig.write(None, 0x1000),
    "release": lambda rig: rig.submit(Action.RELEASE_CONTROL, PLC),
    "take control": lambda rig: rig.submit(Action.TAKE_CONTROL, PLC, ttl_ms=1000),
    "another takes over": lambda rig: rig.submit(Action.TAKE_CONTROL, OTHER_PLC, ttl_ms=1000),
    "another writes the same": lambda rig: rig.submit(
        Action.WRITE, OTHER_PLC, values={"control_word": ACKNOWLEDGE}
    ),
    "a word that is not valid": lambda rig: rig.submit(Action.WRITE, PLC, values={"control_word": 0x007E}),
    "a setpoint that is no word": lambda rig: rig.submit(
        Action.WRITE, PLC, values={"control_word": SHUT_DOWN, "setpoint_1": 70_000}
    ),
    "another time-out": _time_out,
    "the bridge hung": _gap,
    "the bus was gone": _bus_gone,
    "the node was lost": _node_back,
    "the drive is in fault": lambda rig: rig.drive_says(FAULT),
    "the drive is ready": lambda rig: rig.drive_says(READY),
    "the drive is enabled": lambda rig: rig.drive_says(ENABLED),
}
_PROFILES: tuple[dict[str, object], ...] = (
    {"on_expiry": "disable_voltage"},
    {"on_expiry": "hold"},
    {"on_expiry": "stop", "then_silence_ms": 100},
    {"control": "lease"},
    {"fieldbus_timeout_ms": 0},
    {"telegram_downtime_s": -0.1},
)


def _write(word: int, rig: Rig) -> None:
    rig.submit(Action.WRITE, values={"control_word": word})


class _Watch:
    """Sees the acknowledge bit rise on the bus, or a trip be acknowledged, and when."""

    def __init__(self, rig: Rig) -> None:
        self.rig = rig
        self.sent = rig.sent

    def happens(self, what: Callable[[Rig], object]) -> bool:
        """Whether what happened acknowledged anything, here or at the drive."""
        was_tripped = self.rig.channel.is_tripped
        what(self.rig)
        self.rig.channel.on_time(self.rig.now)
        rises = bool(self.rig.sent & ~self.sent & _BIT)
        self.sent = self.rig.sent
        return rises or (was_tripped and not self.rig.channel.is_tripped)


@settings(max_examples=examples(400), deadline=None, derandomize=True)
@given(
    profile=st.sampled_from(_PROFILES),
    begins_low=st.booleans(),
    steps=st.lists(st.sampled_from(sorted(IN_BETWEEN)), max_size=12),
    words=st.lists(st.sampled_from(CONSTANT), min_size=13, max_size=13),
)
def test_a_constant_bit_acknowledges_nothing(
    profile: dict[str, object], begins_low: bool, steps: list[str], words: list[int]
):
    rig = Rig(**profile)
    rig.node(NodeState.OPERATIONAL)
    rig.drive_says(READY)
    rig.submit(Action.TAKE_CONTROL, PLC, ttl_ms=1000)
    if begins_low:
        rig.write(SHUT_DOWN)
        rig.write(ACKNOWLEDGE)  # the one edge there is
    watch = _Watch(rig)
    for step, word in zip(steps, words, strict=False):
        assert not watch.happens(IN_BETWEEN[step]), step
        rig.submit(Action.TAKE_CONTROL, PLC, ttl_ms=1000)
        assert not watch.happens(partial(_write, word)), f"{word:04X}h after: {step}"


@pytest.mark.landing(81)
@pytest.mark.parametrize(("first", "second"), list(product(IN_BETWEEN, repeat=2)))
def test_after_a_trip_a_constant_bit_leaves_it_and_an_edge_does_not(first: str, second: str):
    rig = Rig()
    rig.run()
    rig.write(ACKNOWLEDGE)
    rig.wait(0.25)
    assert rig.watchdog == "tripped"
    for step in (first, second):
        IN_BETWEEN[step](rig)
        rig.write(ACKNOWLEDGE)
    assert rig.watchdog == "tripped"
    rig.ask(Action.TAKE_CONTROL, PLC)
    rig.write(SHUT_DOWN, identity=rig.channel.owner or PLC)
    rig.write(ACKNOWLEDGE, identity=rig.channel.owner or PLC)
    assert rig.watchdog == "running"
    assert rig.sent & _BIT


class TestNewOwner:
    def test_a_first_word_with_the_bit_is_no_edge(self):
        rig = Rig()
        rig.run()
        rig.wait(0.25)
        rig.write(ACKNOWLEDGE, identity=OTHER_PLC)
        assert rig.channel.owner == OTHER_PLC
        assert rig.watchdog == "tripped"
        rig.write(SHUT_DOWN, identity=OTHER_PLC)
        rig.write(ACKNOWLEDGE, identity=OTHER_PLC)
        assert rig.watchdog == "running"

    def test_nor_does_it_acknowledge_a_fault_of_the_drive(self):
        rig = Rig()
        rig.node(NodeState.OPERATIONAL)
        rig.drive_says(FAULT)
        assert rig.write(ACKNOWLEDGE).ok
        assert not rig.sent & _BIT
        rig.write(SHUT_DOWN)
        rig.write(ACKNOWLEDGE)
        assert rig.sent & _BIT


class TestServedWord:
    def test_the_bit_is_served_as_the_owner_wrote_it_so_that_bits_beside_it_can_be_written(self):
        rig = Rig()
        rig.run()
        rig.write(ACKNOWLEDGE)
        rig.ask(Action.STOP, OPERATOR)
        assert not rig.sent & _BIT
        assert rig.channel.control_word & _BIT

    def test_a_bit_that_stays_1_stays_on_the_bus_until_a_stop_and_comes_back_with_an_edge(self):
        rig = Rig()
        rig.run()
        rig.write(ACKNOWLEDGE)
        assert rig.sent == ACKNOWLEDGE
        rig.write(ACKNOWLEDGE)
        assert rig.sent == ACKNOWLEDGE
        rig.ask(Action.STOP, OPERATOR)
        rig.write(ACKNOWLEDGE)
        assert rig.sent == SHUT_DOWN, "it never fell: that would be an edge"
        rig.write(SHUT_DOWN)
        rig.write(ACKNOWLEDGE)
        assert rig.sent == ACKNOWLEDGE

    def test_it_is_gone_with_the_owner(self):
        rig = Rig()
        rig.run()
        rig.write(ACKNOWLEDGE)
        rig.ask(Action.RELEASE_CONTROL)
        assert not rig.channel.control_word & _BIT


def test_of_a_drive_without_a_fault_it_stops_nothing(running: Rig):
    """It is an edge for the drive, and a telegram."""
    assert running.ask(Action.RESET_FAULT).forwarded
    assert running.sent == ENABLE | _BIT
    running.wait(0.1)
    assert running.sent == ENABLE


class TestRegister:
    """Modbus holding register 11: what each telegram says of it goes with the request."""

    def rig(self) -> Rig:
        rig = Rig()
        rig.run()
        return rig

    def test_a_1_after_a_telegram_without_one_acknowledges_again_and_again(self):
        rig = self.rig()
        for _ in range(3):
            rig.wait(0.25)
            assert rig.watchdog == "tripped"
            rig.ask(Action.RESET_FAULT, pressed=True)
            assert rig.watchdog == "running"
            assert rig.told(EventKind.WATCHDOG)[-1] == f"acknowledged by {PLC}; the drive stays stopped"
            rig.ask(Action.KEEP_ALIVE, pressed=False)

    def test_a_1_that_is_no_edge_is_told_as_not_forwarded(self):
        rig = self.rig()
        (outcome,) = rig.submit(Action.RESET_FAULT, pressed=True)
        assert outcome.forwarded
        (outcome,) = rig.submit(Action.RESET_FAULT, pressed=True)
        assert (outcome.ok, outcome.forwarded) == (True, False)
        assert "no edge" in outcome.message

    @pytest.mark.parametrize("between", IN_BETWEEN)
    def test_a_1_in_each_telegram_acknowledges_once(self, between: str):
        rig = self.rig()
        rig.ask(Action.RESET_FAULT, pressed=True)
        rig.wait(0.25)
        IN_BETWEEN[between](rig)
        if not PLC.is_same(rig.channel.owner):
            rig.ask(Action.TAKE_CONTROL)
        was = rig.watchdog
        watch = _Watch(rig)
        assert not watch.happens(lambda rig: rig.submit(Action.RESET_FAULT, PLC, pressed=True))
        assert rig.watchdog == ("running" if was == "idle" else was), "and it is a telegram all the same"

    def test_a_method_is_an_order_each_time(self):
        rig = self.rig()
        for _ in range(2):
            rig.wait(0.25)
            rig.ask(Action.RESET_FAULT)
            assert rig.watchdog == "running"


def test_a_register_that_is_written_on_and_on_acknowledges_once_and_is_a_sign_of_life(running: Rig) -> None:
    for _ in range(8):
        running.ask(Action.RESET_FAULT, pressed=True)
        running.wait(0.15)
    assert not running.channel.is_tripped
    running.wait(0.25)
    assert running.channel.is_tripped
