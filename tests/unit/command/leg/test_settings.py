"""What the site file and the family say, as the leg of a drive goes by it."""

from __future__ import annotations

import pytest

from bridge.command.drive_link import NodeState
from bridge.command.leg.outlook import next_deadline, watchdog_state
from bridge.config import REACTIONS
from bridge.drive import DriveState
from bridge.mapping import load_family
from tests.support.leg import Leg, settings_of
from tests.support.leg_words import ALL, POSITION, LegWords
from tests.support.rig import Rig

A_MOMENT_S = 1e-6


@pytest.mark.parametrize("words", ALL, ids=lambda words: words.mapping)
def test_what_is_sent_has_a_word_for_each_of_the_rpdo(words: LegWords):
    leg = Leg(settings_of(words.mapping))
    assert leg.setpoints == (0,) * (len(load_family(words.mapping).process.rpdo) - 1)


def test_a_drive_without_a_time_out_is_not_watched():
    leg = Leg(settings_of("nord/sk-tu4-cao", control="none", fieldbus_timeout_ms=None))
    assert watchdog_state(leg.settings, leg.state).label == "off"


@pytest.mark.parametrize(("then_silence_ms", "silent_at"), [(500, 101.5), (3000, 104.0)])
@pytest.mark.parametrize("on_expiry", [name for name, rule in REACTIONS.items() if rule.sends_stop])
def test_silence_comes_so_long_after_the_trip(on_expiry: str, then_silence_ms: int, silent_at: float):
    given = {"fieldbus_timeout_ms": 1000, "on_expiry": on_expiry, "then_silence_ms": then_silence_ms}
    leg = Leg(settings_of("nord/sk-tu4-cao", **given))
    leg.writes(0x047E)
    leg.trips()
    assert next_deadline(leg.state) == silent_at
    leg.waits(silent_at - leg.now - A_MOMENT_S)
    assert not leg.state.sent.silent
    leg.waits(A_MOMENT_S)
    assert leg.state.sent.silent


def test_a_position_goes_to_its_own_words_with_its_own_bit():
    """CiA 402-2, profile position: 607Ah is 32 bits, low word first; bit 4 hands it over."""
    leg = Leg(settings_of(POSITION.mapping))
    leg.says(DriveState.READY)
    leg.writes(POSITION.shut_down)
    leg.writes(POSITION.enable, position=0x0002_0001)
    assert leg.state.sent.words == (POSITION.enable, 0x0001, 0x0002)
    leg.says(DriveState.OPERATION_ENABLED)
    assert leg.state.sent.words == (POSITION.enable | POSITION.handshake, 0x0001, 0x0002)


@pytest.mark.parametrize(("answer", "is_acknowledged"), [(0x0800, False), (0x1000, True), (0x2000, False)])
def test_that_it_is_taken_is_bit_12_of_the_status_word(answer: int, is_acknowledged: bool):
    """CiA 402-2, profile position: 6041h, "set-point acknowledge"."""
    rig = Rig(words=POSITION)
    rig.node(NodeState.OPERATIONAL)
    rig.drive_says(POSITION.ready)
    rig.write(POSITION.shut_down)
    rig.write(POSITION.enable, position=5000)
    rig.drive_says(POSITION.enabled)
    assert rig.sent == POSITION.enable | POSITION.handshake
    rig.drive_says(POSITION.enabled | answer)
    assert (rig.sent == POSITION.enable) is is_acknowledged
