"""An answer says *forwarded* only where the bus says what was asked (shared design, watchdog)."""

from __future__ import annotations

from typing import Any

import pytest

from bridge.command import Action, Code, Outcome
from tests.support.outcomes import in_english
from tests.support.rig import ACKNOWLEDGE, ENABLED, OPERATOR, Rig

BURST_S = 0.1
# BU 2500 §6.5.1: from 047Fh with bit 0, bit 2 or bit 1 at 0, and what is weaker with it.
NORD_STOPS = {Action.STOP: 0x047E, Action.QUICK_STOP: 0x047B, Action.DISABLE_VOLTAGE: 0x047D}


def silent(**settings: Any) -> Rig:
    """A drive that ran until its owner fell silent, and that gets nothing any more."""
    rig = Rig(**{"on_expiry": "silence", **settings})
    rig.run()
    rig.wait(1.0)
    assert rig.silent
    return rig


def stop(rig: Rig, action: Action = Action.STOP) -> Outcome:
    return rig.ask(action, OPERATOR)


@pytest.mark.parametrize("action", NORD_STOPS)
@pytest.mark.parametrize("settings", [{}, {"on_expiry": "stop", "then_silence_ms": 300}])
def test_a_stop_by_anybody_breaks_the_silence_once(action: Action, settings: dict[str, Any]) -> None:
    rig = silent(**settings)
    assert stop(rig, action) == Outcome(Code.OK)
    asked = NORD_STOPS[action] & (0x047E if settings else 0x047F)
    assert (rig.silent, rig.sent & asked) == (False, rig.sent)
    assert not rig.enables
    rig.wait(BURST_S - 0.001)
    assert not rig.silent
    rig.wait(0.002)
    assert rig.silent, "so that the drive's own supervision trips"


def test_the_stop_that_breaks_the_silence_is_the_one_that_was_asked_for() -> None:
    """A ramp is no coasting motor."""
    rig = silent()
    stop(rig)
    assert rig.sent == 0x047E


def test_who_asks_again_and_again_does_not_keep_the_drives_supervision_from_tripping() -> None:
    rig = silent()
    last = stop(rig)
    spoken_s = 0.0
    for _ in range(100):
        rig.wait(0.01)
        spoken_s += 0.0 if rig.silent else 0.01
        last = stop(rig)
    assert spoken_s <= BURST_S
    assert in_english(last) == Outcome(
        Code.OK,
        "sent in this silence already; nothing is sent, so that the drive's own supervision stops it",
        forwarded=False,
    )
    assert stop(rig, Action.DISABLE_VOLTAGE).forwarded, "another stop is"
    assert not rig.silent


def test_after_a_trip_that_is_acknowledged_the_next_silence_is_broken_anew() -> None:
    rig = silent()
    stop(rig)
    rig.wait(1.0)
    rig.write(ACKNOWLEDGE & ~0x80)
    rig.write(ACKNOWLEDGE)
    rig.drive_says(ENABLED)
    rig.wait(1.0)
    assert rig.silent
    assert stop(rig).forwarded
    assert not rig.silent


def test_a_stop_that_comes_as_the_silence_begins_breaks_it() -> None:
    """The round that would have ended the RPDOs has not come yet."""
    rig = Rig(on_expiry="stop", then_silence_ms=300)
    rig.run()
    rig.wait(0.2)
    assert not rig.silent
    rig.now += 0.5
    assert stop(rig).forwarded
    assert not rig.silent


def test_a_stop_where_silence_would_not_stop_the_drive_is_there_already() -> None:
    rig = silent()
    rig.channel.on_own_watch("nobody knows", rig.now)
    assert not rig.silent
    for _ in range(3):
        assert stop(rig).forwarded
        rig.wait(BURST_S)
        assert not rig.silent
    rig.channel.on_own_watch("", rig.now)
    rig.wait(BURST_S)
    assert rig.silent


def test_a_setpoint_that_the_drive_does_not_get_is_not_told_as_forwarded() -> None:
    """Tripped: the words are taken and kept."""
    rig = silent()
    stop(rig)
    taken = rig.write(0x047E, 0x2000)
    assert (taken.ok, taken.forwarded) == (True, False)


NOBODY_SENDS = "on can0 the bridge leaves the bus to another bridge"


@pytest.mark.parametrize("ignores", [False, True])
def test_what_no_words_reach_is_told_as_not_forwarded_with_the_reason(*, ignores: bool) -> None:
    settings: dict[str, Any] = {"telegram_downtime_s": -0.1} if ignores else {}
    rig = Rig(**settings)
    rig.run()
    rig.channel.on_sending(NOBODY_SENDS, rig.now)
    not_sent = Outcome(Code.OK, NOBODY_SENDS, forwarded=False)
    assert [stop(rig, action) for action in NORD_STOPS] == [not_sent] * 3
    assert rig.write(0x047E) == not_sent
    assert rig.ask(Action.RESET_FAULT) == not_sent
    rig.channel.on_sending("", rig.now)
    assert stop(rig) == Outcome(Code.OK)


def test_a_drive_that_no_words_reach_is_not_started() -> None:
    """With every error ignored it may be enabled though its node is lost."""
    rig = Rig(telegram_downtime_s=-0.1)
    rig.run()
    stop(rig)
    rig.channel.on_sending(NOBODY_SENDS, rig.now)
    assert rig.ask(Action.START) == Outcome(Code.NOT_READY, NOBODY_SENDS, forwarded=False)


def test_an_acknowledge_that_no_words_carry_says_both() -> None:
    rig = Rig()
    rig.run()
    rig.wait(1.0)
    rig.channel.on_sending(NOBODY_SENDS, rig.now)
    rig.write(ACKNOWLEDGE & ~0x80)
    acknowledged = rig.write(ACKNOWLEDGE)
    assert acknowledged.message == f"acknowledged; the drive stays stopped; {NOBODY_SENDS}"
    assert not acknowledged.forwarded
