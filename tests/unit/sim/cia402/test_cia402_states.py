"""The CiA 402 automaton: every transition, and what each command does in each state."""

from __future__ import annotations

import pytest

from bridge.sim.cia402.cia402_states import (
    TRANSITIONS,
    Automaton,
    Cia402Command,
    Cia402State,
    StopRamp,
    command_of,
)

WORDS = {
    Cia402Command.SHUTDOWN: 0x0006,
    Cia402Command.SWITCH_ON: 0x0007,
    Cia402Command.ENABLE_OPERATION: 0x000F,
    Cia402Command.DISABLE_VOLTAGE: 0x0000,
    Cia402Command.QUICK_STOP: 0x0002,
}
OPTIONS = {0x605A: 2, 0x605B: 0, 0x605C: 1, 0x605D: 1, 0x605E: 2}
WAY = {
    Cia402State.SWITCH_ON_DISABLED: [],
    Cia402State.READY: [0x06],
    Cia402State.SWITCHED_ON: [0x06, 0x07],
    Cia402State.ENABLED: [0x06, 0x07, 0x0F],
    Cia402State.QUICK_STOP_ACTIVE: [0x06, 0x07, 0x0F, 0x02],
}


def automaton(state: Cia402State, *, standstill: bool = True, **options: int) -> Automaton:
    changed = {**OPTIONS, **{int(name[1:], 16): value for name, value in options.items()}}
    one = Automaton(lambda: changed)
    one.power_on()
    one.initialised()
    for word in WAY[state]:
        one.on_control_word(word, standstill=standstill)
    assert one.state is state
    return one


@pytest.mark.parametrize("value", range(16))
def test_each_word_is_one_command(value: int) -> None:
    """Command coding: voltage off wins over the quick stop, that over the others."""
    if not value & 2:
        expected = Cia402Command.DISABLE_VOLTAGE
    elif not value & 4:
        expected = Cia402Command.QUICK_STOP
    else:
        expected = {
            6: Cia402Command.SHUTDOWN,
            7: Cia402Command.SWITCH_ON,
            15: Cia402Command.ENABLE_OPERATION,
        }.get(value, Cia402Command.SHUTDOWN)
    assert command_of(value) is expected


TABLE = [
    # state, word, transition numbers, state after; standing still, option codes as delivered
    (Cia402State.SWITCH_ON_DISABLED, 0x06, [2], Cia402State.READY),
    (Cia402State.SWITCH_ON_DISABLED, 0x07, [], Cia402State.SWITCH_ON_DISABLED),
    (Cia402State.SWITCH_ON_DISABLED, 0x0F, [], Cia402State.SWITCH_ON_DISABLED),
    (Cia402State.SWITCH_ON_DISABLED, 0x02, [], Cia402State.SWITCH_ON_DISABLED),
    (Cia402State.SWITCH_ON_DISABLED, 0x00, [], Cia402State.SWITCH_ON_DISABLED),
    (Cia402State.READY, 0x06, [], Cia402State.READY),
    (Cia402State.READY, 0x07, [3], Cia402State.SWITCHED_ON),
    (Cia402State.READY, 0x0F, [3, 4], Cia402State.ENABLED),
    (Cia402State.READY, 0x02, [7], Cia402State.SWITCH_ON_DISABLED),
    (Cia402State.READY, 0x00, [7], Cia402State.SWITCH_ON_DISABLED),
    (Cia402State.SWITCHED_ON, 0x0F, [4], Cia402State.ENABLED),
    (Cia402State.SWITCHED_ON, 0x06, [6], Cia402State.READY),
    (Cia402State.SWITCHED_ON, 0x07, [], Cia402State.SWITCHED_ON),
    (Cia402State.SWITCHED_ON, 0x02, [10], Cia402State.SWITCH_ON_DISABLED),
    (Cia402State.SWITCHED_ON, 0x00, [10], Cia402State.SWITCH_ON_DISABLED),
    (Cia402State.ENABLED, 0x07, [5], Cia402State.SWITCHED_ON),
    (Cia402State.ENABLED, 0x06, [8], Cia402State.READY),
    (Cia402State.ENABLED, 0x00, [9], Cia402State.SWITCH_ON_DISABLED),
    (Cia402State.ENABLED, 0x02, [11], Cia402State.QUICK_STOP_ACTIVE),
    (Cia402State.ENABLED, 0x0F, [], Cia402State.ENABLED),
]


@pytest.mark.parametrize(("state", "word", "numbers", "after"), TABLE)
def test_commands_in_states(state: Cia402State, word: int, numbers: list[int], after: Cia402State) -> None:
    one = automaton(state)
    before = len(one.taken)
    one.on_control_word(word, standstill=True)
    assert (one.taken[before:], one.state) == (numbers, after)


def test_the_tables_agree() -> None:
    """Each transition that a command brings about is in the table of this test."""
    assert {number for number, _ in TRANSITIONS.values()} == {2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 16}
    tested = {number for _, _, numbers, _ in TABLE for number in numbers}
    assert tested | {12, 16} == {number for number, _ in TRANSITIONS.values()}


def test_0_and_1_come_with_the_power() -> None:
    one = Automaton(lambda: OPTIONS)
    one.power_on()
    assert (one.state, one.taken) == (Cia402State.NOT_READY, [0])
    one.on_control_word(0x0F, standstill=True)
    assert one.state is Cia402State.NOT_READY, "no command before it is initialised"
    one.initialised()
    assert (one.state, one.taken) == (Cia402State.SWITCH_ON_DISABLED, [0, 1])


@pytest.mark.parametrize(
    ("word", "number", "after"), [(0x07, 5, Cia402State.SWITCHED_ON), (0x06, 8, Cia402State.READY)]
)
def test_5_and_8_wait_for_the_ramp(word: int, number: int, after: Cia402State) -> None:
    one = automaton(Cia402State.ENABLED, x605B=1, x605C=1)
    one.on_control_word(word, standstill=False)
    assert (one.state, one.ramp) == (Cia402State.ENABLED, StopRamp.SLOW_DOWN)
    one.settle(standstill=False)
    assert one.state is Cia402State.ENABLED
    one.settle(standstill=True)
    assert (one.state, one.taken[-1]) == (after, number)


@pytest.mark.parametrize(("word", "after"), [(0x07, Cia402State.SWITCHED_ON), (0x06, Cia402State.READY)])
def test_with_option_0_5_and_8_let_the_motor_coast(word: int, after: Cia402State) -> None:
    one = automaton(Cia402State.ENABLED, x605B=0, x605C=0)
    one.on_control_word(word, standstill=False)
    assert (one.state, one.ramp) == (after, StopRamp.COAST)


def test_enabling_again_ends_a_ramp() -> None:
    one = automaton(Cia402State.ENABLED)
    one.on_control_word(0x07, standstill=False)
    assert one.ramp is StopRamp.SLOW_DOWN
    one.on_control_word(0x0F, standstill=False)
    assert (one.state, one.ramp) == (Cia402State.ENABLED, None)


@pytest.mark.parametrize(
    ("option", "ramp"),
    [(1, StopRamp.SLOW_DOWN), (2, StopRamp.QUICK), (3, StopRamp.QUICK), (4, StopRamp.QUICK)],
)
def test_12_by_itself_when_the_quick_stop_is_done(option: int, ramp: StopRamp) -> None:
    one = automaton(Cia402State.QUICK_STOP_ACTIVE, standstill=False, x605A=option)
    assert one.ramp is ramp
    one.on_control_word(0x0F, standstill=False)
    assert one.state is Cia402State.QUICK_STOP_ACTIVE, "16 is for 605Ah = 5 … 8"
    one.on_control_word(0x02, standstill=True)
    assert (one.state, one.taken[-1]) == (Cia402State.SWITCH_ON_DISABLED, 12)


def test_12_by_voltage_off_during_the_quick_stop() -> None:
    one = automaton(Cia402State.QUICK_STOP_ACTIVE, standstill=False)
    one.on_control_word(0x00, standstill=False)
    assert (one.state, one.taken[-1]) == (Cia402State.SWITCH_ON_DISABLED, 12)


def test_a_quick_stop_of_option_0_is_voltage_off() -> None:
    one = automaton(Cia402State.ENABLED, x605A=0)
    one.on_control_word(0x02, standstill=False)
    assert (one.state, one.taken[-2:]) == (Cia402State.SWITCH_ON_DISABLED, [11, 12])


@pytest.mark.parametrize(
    ("option", "ramp"),
    [(5, StopRamp.SLOW_DOWN), (6, StopRamp.QUICK), (7, StopRamp.QUICK), (8, StopRamp.QUICK)],
)
def test_options_5_to_8_stay_and_know_16(option: int, ramp: StopRamp) -> None:
    one = automaton(Cia402State.QUICK_STOP_ACTIVE, x605A=option)
    assert one.ramp is ramp
    one.settle(standstill=True)
    assert one.state is Cia402State.QUICK_STOP_ACTIVE
    one.on_control_word(0x0F, standstill=True)
    assert (one.state, one.taken[-1]) == (Cia402State.ENABLED, 16)
    one.on_control_word(0x02, standstill=True)
    one.on_control_word(0x00, standstill=True)
    assert (one.state, one.taken[-1]) == (Cia402State.SWITCH_ON_DISABLED, 12)


@pytest.mark.parametrize("state", list(WAY))
def test_13_14_15_a_fault_from_every_state(state: Cia402State) -> None:
    one = automaton(state)
    one.fault(lasting=False)
    assert (one.state, one.taken[-1]) == (Cia402State.FAULT_REACTION, 13)
    one.on_control_word(0x8F, standstill=False)
    assert one.state is Cia402State.FAULT_REACTION, "no reset before the reaction is over"
    one.on_control_word(0x06, standstill=True)
    assert (one.state, one.taken[-1]) == (Cia402State.FAULT, 14)
    one.on_control_word(0x0F, standstill=True)
    assert one.state is Cia402State.FAULT
    assert one.on_control_word(0x80, standstill=True)
    assert (one.state, one.taken[-1]) == (Cia402State.SWITCH_ON_DISABLED, 15)


def test_the_reset_is_an_edge() -> None:
    one = automaton(Cia402State.READY)
    one.on_control_word(0x86, standstill=True)
    one.fault(lasting=False)
    assert not one.on_control_word(0x86, standstill=True)
    assert one.state is Cia402State.FAULT
    assert not one.on_control_word(0x06, standstill=True)
    assert one.on_control_word(0x86, standstill=True)
    assert one.state is Cia402State.READY, "the same word's shutdown counts after it"


def test_a_lasting_cause_blocks_the_reset() -> None:
    one = automaton(Cia402State.READY)
    one.fault(lasting=True)
    assert not one.on_control_word(0x80, standstill=True)
    one.cause_gone()
    one.on_control_word(0x00, standstill=True)
    assert one.on_control_word(0x80, standstill=True)


@pytest.mark.parametrize(("option", "ramp"), [(1, StopRamp.SLOW_DOWN), (2, StopRamp.QUICK)])
def test_halt_keeps_it_enabled(option: int, ramp: StopRamp) -> None:
    one = automaton(Cia402State.ENABLED, x605D=option)
    one.on_control_word(0x010F, standstill=True)
    assert (one.state, one.ramp) == (Cia402State.ENABLED, ramp)
    one.on_control_word(0x000F, standstill=True)
    assert one.ramp is None


def test_a_fault_reaction_of_option_0_coasts() -> None:
    one = automaton(Cia402State.ENABLED, x605E=0)
    one.fault(lasting=False)
    one.settle(standstill=False)
    assert one.state is Cia402State.FAULT
