"""What the bridge sends when the controller falls silent (shared design, watchdog, "Reactions")."""

from __future__ import annotations

from typing import get_args

import pytest

from bridge.command import Action, EventKind, Identity
from bridge.command.drive_link import NodeState
from bridge.config import REACTIONS, Reaction
from tests.support.leg_words import NORD_TU4
from tests.support.rig import (
    ACKNOWLEDGE,
    ENABLE,
    ENABLED,
    HALF_SPEED,
    INHIBITED,
    OPERATOR,
    PLC,
    QUICK_STOPPING,
    READY,
    SHUT_DOWN,
    Rig,
)

STOPPING = [name for name, rule in REACTIONS.items() if rule.sends_stop]


def tripped(on_expiry: str, **settings: object) -> Rig:
    rig = Rig(on_expiry=on_expiry, **settings)
    rig.run()
    rig.wait(0.2)
    assert rig.watchdog == "tripped"
    return rig


def test_disable_voltage_clears_bit_1():
    rig = tripped("disable_voltage")
    assert rig.sent == 0x0474
    assert not rig.silent


def test_quick_stop_clears_bit_2_and_disables_voltage_when_the_drive_stands():
    rig = tripped("quick_stop")
    assert rig.sent == 0x047B
    rig.drive_says(ENABLED)
    rig.drive_says(QUICK_STOPPING)
    assert rig.sent == 0x047B
    rig.drive_says(INHIBITED)
    assert rig.sent == 0x0470
    rig.drive_says(READY)
    assert rig.sent == 0x0470


def test_a_quick_stop_of_a_drive_that_stands_already_ends_with_its_next_word():
    rig = Rig(on_expiry="quick_stop")
    rig.node(NodeState.OPERATIONAL)
    rig.drive_says(READY)
    rig.write(SHUT_DOWN)
    rig.wait(0.2)
    assert rig.sent == 0x047A
    rig.drive_says(READY)
    assert rig.sent == 0x0470


def test_stop_clears_bit_0_alone():
    assert tripped("stop").sent == SHUT_DOWN


def test_silence_sends_nothing_from_the_same_moment_on():
    rig = tripped("silence")
    assert rig.silent
    rig.write(SHUT_DOWN)
    assert rig.silent
    rig.write(ACKNOWLEDGE)
    assert not rig.silent
    assert not rig.enables


def test_hold_goes_on_with_the_last_telegram_and_reports():
    rig = tripped("hold")
    assert rig.sent == ENABLE
    assert rig.sent_setpoints[0] == HALF_SPEED
    assert rig.channel.current_fault == 10.3


@pytest.mark.parametrize("on_expiry", sorted(set(get_args(Reaction)) - {"hold"}))
def test_setpoints_go_to_zero(on_expiry: str):
    rig = tripped(on_expiry)
    assert rig.sent_setpoints == (0, 0, 0, 0)
    assert rig.channel.setpoints == (0, 0, 0, 0)


@pytest.mark.parametrize("on_expiry", STOPPING)
def test_then_silence_ends_the_sending_after_its_time(on_expiry: str):
    rig = tripped(on_expiry, then_silence_ms=500)
    rig.wait(0.499)
    assert not rig.silent
    rig.wait(0.001)
    assert rig.silent


def test_a_frame_with_an_older_time_stamp_does_not_end_the_silence():
    rig = tripped("disable_voltage", then_silence_ms=500)
    rig.wait(0.5)
    rig.channel.on_status_word(INHIBITED, rig.now - 0.01)
    assert rig.silent


def test_then_silence_ends_with_the_acknowledge():
    rig = tripped("stop", then_silence_ms=500)
    rig.wait(1)
    rig.ask(Action.RESET_FAULT)
    assert not rig.silent


def test_parameter_set_and_direction_stay_as_they_were():
    rig = Rig()
    rig.node(NodeState.OPERATIONAL)
    rig.write(0x4C7E)
    rig.write(0x4C7F)
    rig.wait(0.2)
    assert rig.sent == 0x4C74


def test_an_acknowledge_bit_that_was_high_falls():
    rig = Rig()
    rig.node(NodeState.OPERATIONAL)
    rig.write(ACKNOWLEDGE)
    rig.wait(0.2)
    assert not rig.sent & 0x0080


@pytest.mark.parametrize(("on_expiry", "word"), [("stop", SHUT_DOWN), ("quick_stop", 0x047B)])
def test_an_acknowledge_turns_no_ramp_into_coasting(on_expiry: str, word: int):
    rig = tripped(on_expiry)
    rig.ask(Action.RESET_FAULT)
    rig.wait(0.1)
    assert rig.sent == word


@pytest.mark.parametrize(
    ("on_expiry", "word"), [("stop", SHUT_DOWN), ("quick_stop", 0x047B), ("disable_voltage", 0x0474)]
)
@pytest.mark.parametrize("written", [SHUT_DOWN, ENABLE, 0x0474])
def test_what_was_written_while_tripped_does_not_follow_an_acknowledge(
    on_expiry: str, word: int, written: int
):
    rig = tripped(on_expiry)
    rig.write(written, HALF_SPEED)
    rig.ask(Action.RESET_FAULT)
    rig.wait(0.1)
    assert rig.channel.output.words == (word, 0, 0, 0, 0)
    assert (rig.channel.control_word, rig.channel.setpoints) == (word, (0, 0, 0, 0))
    rig.write(SHUT_DOWN)
    rig.write(ENABLE)
    assert rig.enables
    assert rig.sent_setpoints == (0, 0, 0, 0)


class TestHold:
    def test_new_telegrams_do_not_reach_the_drive(self):
        rig = tripped("hold")
        assert not rig.write(ENABLE, 0x3000).forwarded
        assert rig.sent_setpoints[0] == HALF_SPEED

    def test_a_stop_of_the_owner_does(self):
        rig = tripped("hold")
        assert rig.write(SHUT_DOWN).forwarded
        assert rig.sent == SHUT_DOWN
        assert not rig.write(ENABLE, HALF_SPEED).forwarded
        assert not rig.enables

    @pytest.mark.parametrize("action", [Action.STOP, Action.QUICK_STOP, Action.DISABLE_VOLTAGE])
    def test_a_stop_of_any_operator_does(self, action: Action):
        rig = tripped("hold")
        assert rig.ask(action, OPERATOR).ok
        assert not rig.enables
        assert rig.sent_setpoints == (0, 0, 0, 0)

    def test_a_release_stops_the_drive(self):
        rig = tripped("hold")
        rig.write(ENABLE)
        rig.ask(Action.RELEASE_CONTROL)
        assert not rig.enables

    def test_the_acknowledge_stops_the_drive_on_its_ramp(self):
        rig = tripped("hold")
        rig.write(0x04FF)
        assert rig.sent == ACKNOWLEDGE
        assert not rig.enables

    def test_a_lost_node_comes_back_stopped(self):
        rig = tripped("hold")
        rig.node(NodeState.LOST)
        assert not rig.enables
        rig.node(NodeState.OPERATIONAL)
        assert not rig.enables


@pytest.mark.parametrize("action", [Action.QUICK_STOP, Action.DISABLE_VOLTAGE])
@pytest.mark.parametrize("who", [PLC, OPERATOR])
def test_a_stronger_stop_is_sent_while_the_drive_ramps_down(action: Action, who: Identity):
    rig = tripped("stop")
    assert rig.ask(action, who).forwarded
    strong = rig.sent
    stops = NORD_TU4.quick_stop if action is Action.QUICK_STOP else NORD_TU4.disable_voltage
    assert stops.fit(strong)
    rig.drive_says(ENABLED)
    assert rig.sent == strong
    assert rig.ask(Action.STOP, who).ok
    assert rig.sent == strong, "a weaker stop lifts it not"
    assert rig.watchdog == "tripped"


def test_a_weaker_stop_changes_nothing_of_the_reaction():
    rig = tripped("disable_voltage")
    before = rig.channel.output
    assert rig.ask(Action.STOP, OPERATOR).ok
    assert rig.channel.output == before


def test_silence_that_would_not_stop_the_drive_is_disable_voltage():
    rig = Rig(on_expiry="silence")
    rig.channel.on_own_watch("P151 is 0 (off)", rig.now)
    rig.run()
    rig.wait(0.2)
    assert not rig.silent
    assert rig.sent == 0x0474
    assert rig.sent_setpoints[0] == 0
    (trip,) = (message for message in rig.told(EventKind.WATCHDOG) if "was silent" in message)
    assert ": disable voltage, " in trip


@pytest.mark.parametrize("on_expiry", STOPPING)
def test_then_silence_that_would_not_stop_the_drive_is_disable_voltage(on_expiry: str):
    rig = Rig(on_expiry=on_expiry, then_silence_ms=500)
    rig.channel.on_own_watch("P151 is 0 (off)", rig.now)
    rig.run()
    rig.wait(0.2)
    first = rig.sent
    rig.wait(0.49)
    assert rig.sent == first
    rig.wait(0.02)
    assert not rig.silent
    assert rig.sent & 0x0002 == 0, "bit 1: disable voltage"


@pytest.mark.parametrize("on_expiry", ["silence", "stop"])
def test_a_drive_that_goes_on_in_the_silence_is_stopped_when_that_is_known(on_expiry: str):
    rig = tripped(on_expiry, then_silence_ms=50)
    rig.wait(0.1)
    assert rig.silent
    rig.channel.on_own_watch("P151 was changed", rig.now)
    assert not rig.silent
    assert not rig.enables
    assert rig.sent & 0x0002 == 0


def test_that_silence_would_not_stop_the_drive_is_told_once_and_only_where_it_matters():
    for on_expiry, then_silence_ms, count in (
        ("silence", 0, 1),
        ("stop", 100, 1),
        ("stop", 0, 0),
        ("hold", 100, 0),
    ):
        rig = Rig(on_expiry=on_expiry, then_silence_ms=then_silence_ms)
        for _ in range(2):
            rig.channel.on_own_watch("P151 is 0 (off)", rig.now)
        assert sum("P151 is 0 (off)" in message for message in rig.told(EventKind.WATCHDOG)) == count
        rig.channel.on_own_watch("", rig.now)
        rig.channel.on_own_watch("P513 is -1", rig.now)
        assert sum("P513 is -1" in message for message in rig.told(EventKind.WATCHDOG)) == count
