"""Troubles that are over."""

from __future__ import annotations

from bridge.condition.causes import TroubleLine
from bridge.condition.point_troubles import Rank, Trouble
from bridge.condition.recent import KEPT_MS, Recent


def shown(kind: str, place: str) -> TroubleLine:
    return TroubleLine(Trouble(Rank.ALARM, kind, place), Rank.ALARM, 0.0)


FAN, LIFT = shown("node_lost", "fan"), shown("drive_fault", "lift")


def see(recent: Recent, now_ms: float, *troubles: TroubleLine) -> None:
    recent.see(troubles, (), now_ms, now_ms)


def test_what_comes_and_goes_is_told_once_with_how_often() -> None:
    recent = Recent()
    for turn in range(3):
        see(recent, turn * 2000.0, FAN)
        assert recent.shown == [], "it is there: the troubles tell it"
        see(recent, turn * 2000.0 + 1000.0)
    assert [(one.shown, one.until_ms, one.times) for one in recent.shown] == [(FAN, 5000.0, 3)]


def test_the_latest_is_first_and_ten_minutes_end_it() -> None:
    recent = Recent()
    see(recent, 0.0, FAN, LIFT)
    see(recent, 1000.0, FAN)
    see(recent, 2000.0)
    assert [one.shown for one in recent.shown] == [FAN, LIFT]
    see(recent, 1000.0 + KEPT_MS)
    assert [one.shown for one in recent.shown] == [FAN]
    see(recent, 2000.0 + KEPT_MS)
    assert recent.shown == []


def test_what_a_cause_explains_meanwhile_has_not_ended() -> None:
    recent = Recent()
    see(recent, 0.0, FAN)
    recent.see((), {FAN.key}, 1000.0, 1000.0)
    see(recent, 2000.0)
    assert recent.shown == []


def test_a_plant_that_flaps_for_hours_is_bounded() -> None:
    recent = Recent()
    for number in range(1000):
        see(recent, float(number), shown("node_lost", str(number)))
    see(recent, 1000.0)
    assert len(recent.shown) == 50
