"""Control and status words of NORD's family, from its mapping file (BU 2500 §6.5)."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.drive import ControlWords, DriveState, StatusWords
from bridge.mapping.model import pattern_bits
from tests.support.rig import NORD

CONTROL = ControlWords(NORD.control_word)
STATUS = StatusWords(NORD.status_word)
WORDS = st.integers(0, 0xFFFF)


def matches(word: int, pattern: str) -> bool:
    mask, value = pattern_bits(pattern)
    return word & mask == value


class TestControlWord:
    @pytest.mark.parametrize(
        ("word", "pattern"),
        [
            (CONTROL.ready, "XXXXX110"),  # shut down
            (CONTROL.run, "X1111111"),  # enable operation
            (CONTROL.stop(0x047F), "XXXXX110"),
            (CONTROL.quick_stop(0x047F), "XXXXX01X"),
            (CONTROL.disable_voltage(0x047F), "XXXXXX0X"),
            (CONTROL.stopped, "XXXXXX0X"),
        ],
    )
    def test_commands_are_those_of_the_manual(self, word: int, pattern: str):
        assert matches(word, pattern)

    def test_the_manuals_own_words(self):
        assert CONTROL.ready == 0x047E
        assert CONTROL.run == 0x047F
        assert CONTROL.forward == 1 << 11
        assert CONTROL.reverse == 1 << 12
        assert CONTROL.acknowledge_mask == 1 << 7

    @pytest.mark.parametrize("word", [0x047F, 0x0C7F, 0x147F, 0x447F, 0x044F])
    def test_these_enable(self, word: int):
        assert CONTROL.enables(word)

    @pytest.mark.parametrize("word", [0x0400, 0x047E, 0x047B, 0x0474, 0x0477, 0x047D])
    def test_these_do_not(self, word: int):
        assert not CONTROL.enables(word)

    @given(WORDS)
    def test_a_word_is_valid_by_bit_10_alone(self, word: int):
        assert CONTROL.is_valid(word) is bool(word & 0x0400)

    def test_bit_7_acknowledges(self):
        assert CONTROL.acknowledge_mask == 0x0080

    @given(WORDS, st.sampled_from([CONTROL.stop, CONTROL.quick_stop, CONTROL.disable_voltage]))
    def test_a_stop_is_valid_enables_nothing_and_acknowledges_nothing(self, word: int, command):
        stopped = command(word)
        assert not CONTROL.enables(stopped)
        assert CONTROL.is_valid(stopped)
        assert not stopped & CONTROL.acknowledge_mask

    @given(WORDS, st.sampled_from([CONTROL.stop, CONTROL.quick_stop, CONTROL.disable_voltage]))
    def test_a_stop_only_takes_away(self, word: int, command):
        """It lifts no other stop, and keeps parameter set and functions."""
        stopped = command(word)
        assert stopped & ~word & ~0x0400 == 0
        assert stopped & 0xFB70 == word & 0xFB70

    def test_bit_0_1_and_2_are_what_the_stops_are_about(self):
        assert CONTROL.stop(0xFFFF) & 0x000F == 0b1110
        assert CONTROL.quick_stop(0xFFFF) & 0x000F == 0b1011
        assert CONTROL.disable_voltage(0xFFFF) & 0x0002 == 0


class TestStatusWord:
    @pytest.mark.parametrize(
        ("pattern", "state"),
        [
            ("0XX0000", DriveState.NOT_READY),
            ("1XX0000", DriveState.SWITCH_ON_INHIBITED),
            ("0110001", DriveState.READY),
            ("0110011", DriveState.SWITCHED_ON),
            ("0110111", DriveState.OPERATION_ENABLED),
            ("0XX1000", DriveState.FAULT),
            ("0XX1111", DriveState.FAULT_REACTION_ACTIVE),
            ("0010111", DriveState.QUICK_STOP_ACTIVE),
        ],
    )
    def test_every_word_of_a_pattern_is_its_state(self, pattern: str, state: DriveState):
        """BU 2500 §6.5.3, "Auscodierte Zustände", bits 6 … 0; the others are "don't care"."""
        words = [word for word in range(0x80) if matches(word, pattern)]
        assert len(words) == 2 ** pattern.count("X")
        for word in words:
            for others in (0x0000, 0x0B00, 0xFF80):
                assert STATUS.state(word | others) is state

    def test_every_other_word_is_unknown(self):
        known = sum(2 ** state.pattern.count("X") for state in NORD.status_word.state)
        unknown = [word for word in range(0x80) if STATUS.state(word) is DriveState.UNKNOWN]
        assert len(unknown) == 0x80 - known

    def test_the_typical_answer_to_047e(self):
        assert STATUS.state(0x0B31) is DriveState.READY

    @given(WORDS)
    def test_a_word_shown_as_a_fault_is_one_and_keeps_its_other_bits(self, word: int):
        served = STATUS.as_fault(word)
        assert STATUS.state(served) is DriveState.FAULT
        assert served & ~0b1001111 == word & ~0b1001111

    def test_states_are_numbered_as_modbus_serves_them(self):
        assert [state.label for state in DriveState] == [
            "not_ready",
            "switch_on_inhibited",
            "ready",
            "switched_on",
            "operation_enabled",
            "quick_stop_active",
            "fault_reaction_active",
            "fault",
            "unknown",
        ]
        assert [int(state) for state in DriveState] == [*range(8), 255]


@pytest.mark.parametrize(
    ("code", "text"),
    [
        (0x0000, "no fault"),
        (0x2310, "3.0 overcurrent of the inverter"),
        (0x30FF, "voltage"),
        (0xAB21, "unknown code"),
    ],
)
def test_an_emergency_code_has_its_own_text_or_that_of_its_group(code: int, text: str):
    assert str(NORD.emcy.text(code)) == text
