"""What may be written to a drive's command group, and that a refused write changes nothing."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.command import Code
from bridge.command.drive_link import NodeState
from bridge.command.messages.telegram import Refusal
from bridge.image import Value
from bridge.text import Text
from tests.support.rig import ENABLE, ENABLED, HALF_SPEED, PLC, SHUT_DOWN, Rig


@pytest.fixture
def rig() -> Rig:
    rig = Rig()
    rig.node(NodeState.OPERATIONAL)
    rig.write(SHUT_DOWN)
    return rig


def test_the_manuals_example(rig: Rig):
    """BU 2500 §6.8 with P105 = 50 Hz: 2000h is 25 Hz, 1000h is 12.5 Hz."""
    assert rig.write(ENABLE, frequency=25.0).forwarded
    assert rig.channel.output.words == (0x047F, 0x2000, 0, 0, 0)
    rig.write(SHUT_DOWN)
    assert rig.sent == 0x047E
    rig.write(ENABLE, frequency=12.5)
    assert rig.channel.output.words == (0x047F, 0x1000, 0, 0, 0)


@pytest.mark.parametrize(
    ("frequency", "word"),
    [(50.0, 0x4000), (-50.0, 0xC000), (0, 0), (99.996, 0x7FFF), (-100.0, 0x8000), (0.0016, 1), (0.0015, 0)],
)
def test_a_frequency_is_a_share_of_p105(rig: Rig, frequency: float, word: int):
    assert rig.write(frequency=frequency).ok
    assert rig.channel.setpoints[0] == word


@pytest.mark.parametrize("frequency", [100.0, -100.01, math.nan, math.inf, -math.inf, 10**400, "25", True])
def test_a_frequency_has_a_range(rig: Rig, frequency: Value):
    outcome = rig.write(frequency=frequency)
    assert outcome.code is Code.OUT_OF_RANGE
    assert outcome.message.startswith("frequency takes ")
    assert rig.channel.setpoints == (0, 0, 0, 0)


def test_a_range_is_told_with_its_unit(rig: Rig):
    assert rig.write(frequency=120).message == "frequency takes -100…99.9969, not 120 Hz"


@pytest.mark.parametrize(("value", "word"), [(0, 0), (0xFFFF, 0xFFFF), (5.0, 5)])
def test_a_word_is_a_number_of_16_bits(rig: Rig, value: Value, word: int):
    assert rig.write(setpoint_2=value).ok
    assert rig.channel.setpoints[1] == word


@pytest.mark.parametrize(
    "value",
    [0x1_0000, -1, -100, -0x8000, -0x8001, 1.5, "1", True, math.nan, math.inf, 10**400, 1e300, [1], {}],
)
@pytest.mark.parametrize("leaf", ["control_word", "setpoint_1"])
def test_a_word_is_16_bits_and_whole(rig: Rig, leaf: str, value: Value):
    outcome = rig.write(**{leaf: value})
    assert outcome.code is Code.OUT_OF_RANGE
    assert outcome.message.startswith(f"{leaf} takes ")


def test_what_is_not_there_is_told_with_what_is(rig: Rig):
    outcome = rig.write(velocity=3)
    assert outcome.code is Code.UNKNOWN_POINT
    assert outcome.message == (
        "conveyor/fu1/command has no 'velocity'; "
        "it has control_word, setpoint_1, setpoint_2, setpoint_3, setpoint_4, "
        "frequency, digital_outputs, position"
    )


def test_a_scale_that_is_not_known_is_no_reason_to_guess(rig: Rig):
    rig.channel.meanings.scales.clear()
    outcome = rig.write(frequency=25)
    assert outcome.code is Code.NOT_CONFIGURED
    assert "P105" in outcome.message


def test_a_setpoint_and_its_raw_word_must_agree(rig: Rig):
    assert rig.write(ENABLE, 0x2000, frequency=25.0).ok
    assert rig.write(ENABLE, 0x2000, frequency=26.0).code is Code.OUT_OF_RANGE


def test_a_stop_is_not_refused_for_what_somebody_has_changed_in_the_drive(rig: Rig):
    """P105 at the keypad: what was right with its old value is out of range, or another word."""
    assert rig.write(ENABLE, 0x4000, frequency=50.0).ok
    rig.channel.meanings.on_scale("P105", 20.0)
    assert rig.write(ENABLE, frequency=50.0).code is Code.OUT_OF_RANGE
    assert rig.write(SHUT_DOWN, 0x4000, frequency=50.0).ok
    assert rig.sent == SHUT_DOWN


@pytest.mark.parametrize(
    "wrong", [{"frequency": "50"}, {"setpoint_1": 70_000}, {"setpoint_1": 0.5}, {"speed": 1}]
)
def test_a_stop_with_what_no_drive_would_take_is_refused(rig: Rig, wrong: dict[str, Value]):
    assert not rig.write(SHUT_DOWN, **wrong).ok


@given(
    p105=st.floats(-1e6, 1e6).filter(bool),
    values=st.fixed_dictionaries(
        {"frequency": st.floats() | st.integers()}, optional={"setpoint_1": st.integers(0, 0xFFFF)}
    ),
)
def test_whatever_the_drive_scales_with_a_stop_is_taken(p105: float, values: dict[str, Value]):
    rig = Rig()
    rig.node(NodeState.OPERATIONAL)
    rig.write(SHUT_DOWN)
    rig.write(ENABLE, frequency=25.0)
    rig.channel.meanings.on_scale("P105", p105)
    assert rig.write(SHUT_DOWN, **values).ok
    assert rig.sent == SHUT_DOWN


def test_what_is_not_written_stays(rig: Rig):
    rig.write(SHUT_DOWN, 1, 2, 3)
    rig.write(None, 7)
    assert rig.channel.setpoints == (7, 2, 3, 0)
    assert rig.channel.control_word == SHUT_DOWN


_WRONG = st.fixed_dictionaries(
    {},
    optional={
        "control_word": st.one_of(st.integers(), st.floats(), st.text(max_size=3)),
        "setpoint_1": st.one_of(st.integers(), st.floats(), st.booleans()),
        "frequency": st.one_of(st.floats(), st.integers(), st.text(max_size=3)),
        "nothing": st.integers(),
    },
)


def test_a_refusal_says_why_also_to_whoever_only_prints_it(rig: Rig):
    with pytest.raises(Refusal, match=r"^control_word takes 0…65535, not -1$"):
        rig.channel.leg_settings.decode({"control_word": -1}, (0, 0, 0, 0), 0, True)


@given(values=_WRONG)
def test_a_refused_telegram_changes_nothing(values: dict[str, Value]):
    rig = Rig()
    rig.run()
    rig.wait(0.1)
    channel = rig.channel
    before = (channel.output, channel.control_word, channel.setpoints, channel.owner)
    outcome = rig.write(**values)
    if not outcome.ok:
        assert not outcome.forwarded
        assert before == (channel.output, channel.control_word, channel.setpoints, PLC)
        assert channel.left_ms(rig.now) == 100
        assert channel.refused_writes == 1
    else:
        assert channel.left_ms(rig.now) == 200


def test_half_a_telegram_is_not_applied(rig: Rig):
    rig.run()
    rig.write(ENABLE, HALF_SPEED, setpoint_2=99_999)
    assert rig.write(SHUT_DOWN, 1, 70_000).code is Code.OUT_OF_RANGE
    assert rig.sent == ENABLE
    assert rig.sent_setpoints == (HALF_SPEED, 0, 0, 0)


@pytest.mark.parametrize("values", [{"setpoint_1": 7}, {"frequency": 25.0}])
def test_a_word_that_the_node_does_not_take_is_refused_raw_and_scaled(rig: Rig, values: dict[str, Value]):
    rig.channel.unserved["command/setpoint_1"] = Text.of("boot.pdo_without_it", pdo="RPDO1")
    (leaf,) = values
    outcome = rig.write(**values)
    assert outcome.code is Code.NOT_CONFIGURED
    assert outcome.message.startswith(f"{leaf}: ")
    assert rig.write(setpoint_2=7).ok, "the others are taken"


class TestAnotherParameterSet:
    """A control word that switches it (BU 2500 §6.5.1, bits 14 and 15). In set 2 the frequency comes with the
    second setpoint, in the scale of that set."""

    SET_2 = 0x4000

    @pytest.fixture
    def rig(self) -> Rig:
        rig = Rig()
        rig.run()
        codes = {"command/setpoint_1": (1, 0, 0, 0), "command/setpoint_2": (0, 1, 0, 0)}
        rig.channel.meanings.on_codes({**rig.channel.meanings.codes, **codes})
        rig.channel.meanings.on_scale("P105", 50.0)
        rig.write(ENABLE, frequency=25.0)
        return rig

    def test_a_value_keeps_its_size_in_its_unit(self, rig: Rig):
        rig.channel.meanings.on_scale("P105", 100.0, 2)
        assert rig.write(ENABLE | self.SET_2).ok
        assert rig.sent_setpoints == (0, HALF_SPEED // 2, 0, 0)

    def test_what_the_telegram_itself_writes_is_not_overwritten_by_it(self, rig: Rig):
        rig.channel.meanings.on_scale("P105", 100.0, 2)
        assert rig.write(SHUT_DOWN | self.SET_2, setpoint_2=7).ok
        assert rig.channel.setpoints == (0, 7, 0, 0)

    def test_a_value_whose_word_the_telegram_writes_is_not_brought_over(self, rig: Rig):
        rig.channel.meanings.on_scale("P105", 100.0, 2)
        assert rig.write(ENABLE | self.SET_2, 0).ok
        assert rig.sent_setpoints == (0, 0, 0, 0)

    def test_where_its_scale_is_not_known_a_drive_that_is_to_run_is_not_switched(self, rig: Rig):
        outcome = rig.write(ENABLE | self.SET_2)
        assert outcome.code is Code.NOT_CONFIGURED
        assert outcome.message == (
            "what setpoint_1 means in parameter set 2 is not known: write it with the switch"
        )
        assert rig.write(SHUT_DOWN | self.SET_2).ok
        assert rig.channel.setpoints == (0, 0, 0, 0), "and one that is to stop gets zero"

    def test_a_drive_that_is_in_another_one_takes_no_scaled_value_for_something_else(self, rig: Rig):
        rig.channel.meanings.on_scale("P105", 100.0, 2)
        rig.drive_says(ENABLED | self.SET_2)
        assert rig.write(ENABLE, frequency=10.0).code is Code.NOT_READY
        assert rig.write(ENABLE, 0x1000).ok, "a raw word is the same in each"
        assert rig.write(SHUT_DOWN, frequency=10.0).ok
        assert rig.channel.setpoints == (0, 0, 0, 0)


class TestBits:
    """A name with a number behind a dot is one bit; all else of the word stays."""

    def test_a_bit_of_the_control_word_is_changed_in_the_owners_word(self, rig: Rig):
        rig.write(ENABLE, setpoint_1=HALF_SPEED)
        assert rig.write(**{"control_word.11": True}).ok
        assert rig.sent == ENABLE | 1 << 11
        assert rig.channel.setpoints[0] == HALF_SPEED
        assert rig.write(**{"control_word.11": False}).ok
        assert rig.sent == ENABLE

    def test_several_are_one_telegram(self, rig: Rig):
        assert rig.write(**{"control_word.0": True, "control_word.3": True, "setpoint_1": 5}).ok
        assert rig.channel.output.words[:2] == (SHUT_DOWN | 1 | 1 << 3, 5)

    def test_they_are_written_over_the_word_beside_them(self, rig: Rig):
        assert rig.write(**{"control_word.11": True, "control_word": ENABLE}).ok
        assert rig.sent == ENABLE | 1 << 11

    def test_a_stop_by_one_bit_is_a_stop(self, rig: Rig):
        rig.write(ENABLE)
        assert rig.write(**{"control_word.3": False}).ok
        assert rig.sent == ENABLE & ~(1 << 3)

    def test_a_bit_of_a_setpoint_and_of_a_value_with_bits(self, rig: Rig):
        rig.write(setpoint_2=0x0101)
        assert rig.write(**{"setpoint_2.1": True, "digital_outputs.1": True}).ok
        assert rig.channel.setpoints[1] == 0x0103
        assert rig.channel.setpoints[3] == 2
        assert rig.write(**{"digital_outputs.0": True}).ok
        assert rig.channel.setpoints[3] == 3

    @pytest.mark.parametrize(
        ("leaf", "value"),
        [
            ("control_word.16", True),
            ("control_word.-1", True),
            ("control_word.x", True),
            ("control_word.1.2", True),
            ("control_word.3", 2),
            ("control_word.3", "on"),
            ("frequency.3", True),
            ("nothing.3", True),
        ],
    )
    def test_what_is_no_bit_changes_nothing(self, rig: Rig, leaf: str, value: Value):
        before = rig.channel.output
        assert rig.write(**{"setpoint_1": 7, leaf: value}).code is Code.OUT_OF_RANGE
        assert rig.channel.output == before

    def test_a_bit_that_acknowledges_is_the_edge_that_the_word_would_be(self, rig: Rig):
        rig.run()
        rig.wait(10.0)
        assert rig.watchdog == "tripped"
        rig.write(SHUT_DOWN)
        rig.write(**{"control_word.11": True})
        assert rig.watchdog == "tripped", "bits beside it are no edge"
        rig.write(**{"control_word.7": True})
        assert rig.watchdog != "tripped"
