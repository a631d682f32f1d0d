"""What was wrong and is over."""

from __future__ import annotations

from typing import Any

from bridge.northbound.page.recent import KEPT_MS, Recent

FAN: dict[str, Any] = {"kind": "node_lost", "place": "fan", "since": 0}
LIFT: dict[str, Any] = {"kind": "drive_fault", "place": "lift", "since": 0}


def test_what_comes_and_goes_is_told_once_with_how_often() -> None:
    recent = Recent()
    for turn in range(3):
        recent.see([FAN], turn * 2000.0)
        assert recent.shown == [], "it is there: the troubles tell it"
        recent.see([], turn * 2000.0 + 1000.0)
    assert recent.shown == [{**FAN, "until": 5000, "times": 3}]


def test_the_latest_is_first_and_ten_minutes_end_it() -> None:
    recent = Recent()
    recent.see([FAN, LIFT], 0.0)
    recent.see([FAN], 1000.0)
    recent.see([], 2000.0)
    assert [one["place"] for one in recent.shown] == ["fan", "lift"]
    recent.see([], 1000.0 + KEPT_MS)
    assert [one["place"] for one in recent.shown] == ["fan"]
    recent.see([], 2000.0 + KEPT_MS)
    assert recent.shown == []


def test_a_plant_that_flaps_for_hours_is_bounded() -> None:
    recent = Recent()
    for number in range(1000):
        recent.see([{**FAN, "place": str(number)}], float(number))
    recent.see([], 1000.0)
    assert len(recent.shown) == 50
