"""Objects of a family's own supervision: where they are, what a site asks of them, what they will hold."""

from __future__ import annotations

import pytest

from bridge.config import BusTable, NodeTable
from bridge.mapping import Family
from bridge.mapping.own_places import (
    LIFE_TIME_FACTOR,
    OwnWant,
    ends_own_watch,
    impossible,
    offline,
    place_of,
    places,
    settable,
    suggested_ms,
    wanted,
)
from bridge.text import render
from tests.support import sites

NORD = sites.family(sites.FAMILY)
LENZE = sites.family("lenze/8400-motec")
STOEBER = sites.family("stoeber/5000")
TIMES = {"deadman_ms": 100, "heartbeat_ms": 200}
BUS = BusTable.model_validate({"name": "can0", "interface": "virtual", **TIMES})


def node(family: Family = NORD, **more: object) -> NodeTable:
    drives = [{"slot": family.slot[0].name}]
    return NodeTable.model_validate({"name": "n", "id": 5, "mapping": "x", "drive": drives, **more})


def test_each_object_is_there_once_and_guarding_needs_two() -> None:
    found = [place.key for place in places(NORD)]
    assert len(set(found)) == len(found)
    assert LIFE_TIME_FACTOR in found
    assert (0x100C, 0) in found
    assert len(places(NORD, link=True)) == len(found) + 1, "P120 watches the link alone"


def test_a_setting_is_shown_with_its_text() -> None:
    place = place_of(NORD, next(one for one in NORD.own_supervision if one.name == "P120"))
    number, text = next(iter(place.states.items()))
    assert place.shown(number) == f"P120 is {number} ({text})"
    assert place.shown(12345) == "P120 is 12345"


@pytest.mark.parametrize(
    ("family", "name"), [(NORD, "P151"), (LENZE, "RPDO1"), (STOEBER, None)], ids=["nord", "lenze", "stoeber"]
)
def test_which_time_a_site_may_set(family: Family, name: str | None) -> None:
    entry = settable(family)
    assert (entry and entry.name) == name


def test_a_time_is_asked_for_before_its_reaction() -> None:
    assert wanted(NORD, BUS, node()) == []
    first, *rest = wanted(NORD, BUS, node(own_timeout_ms=300))
    entry = settable(NORD)
    assert entry is not None
    assert first.value * entry.unit_ms == 300
    assert all(want.only_if for want in rest)
    assert wanted(STOEBER, BUS, node(STOEBER, own_timeout_ms=300)) == []


def test_a_want_with_conditions_is_met_by_whatever_is_none_of_them() -> None:
    place = places(NORD)[0]
    assert OwnWant(place, 300).met_by(300)
    assert not OwnWant(place, 300).met_by(299)
    assert OwnWant(place, 2, (0, 1)).met_by(5)
    assert not OwnWant(place, 2, (0, 1)).met_by(1)


def test_a_time_that_the_family_cannot_have_is_told() -> None:
    assert impossible(NORD, 300) == ""
    assert "does not fit" in render(impossible(NORD, 10_000_000))
    guarded = render(impossible(STOEBER, 300))
    assert guarded.startswith("cannot be set in ")
    assert "life guarding alone" in guarded


def test_what_a_drive_will_hold_is_the_factory_s_until_somebody_writes_it() -> None:
    entry = settable(NORD)
    assert entry is not None
    key = place_of(NORD, entry).key
    slot = NORD.slot[0]
    assert offline(NORD, {}, BUS, node(), slot)[key] == entry.factory
    assert offline(NORD, {key: 250}, BUS, node(), slot)[key] == 250
    enforced = node(own_timeout_ms=300, enforce=True)
    assert offline(NORD, {key: 250}, BUS, enforced, slot)[key] * entry.unit_ms == 300
    asked = node(own_timeout_ms=300)
    assert offline(NORD, {key: 250}, BUS, asked, slot)[key] == 250, "it is only said, not enforced"


def test_guarding_is_what_the_site_file_says() -> None:
    """CiA 301: 100Ch × 100Dh."""
    guarded = node(supervision="guarding", supervision_ms=200, life_time_factor=3)
    found = offline(NORD, {}, BUS, guarded, NORD.slot[0])
    assert (found[0x100C, 0], found[LIFE_TIME_FACTOR]) == (200, 3)
    found = offline(NORD, {}, BUS, node(), NORD.slot[0])
    assert (found[0x100C, 0], found[LIFE_TIME_FACTOR]) == (0, 0)


def test_what_ends_a_watch_over_process_data() -> None:
    entry = settable(NORD)
    assert entry is not None
    key = place_of(NORD, entry).key
    assert ends_own_watch(NORD, key, entry.off[0])
    assert not ends_own_watch(NORD, key, 300)
    assert not ends_own_watch(NORD, (0x1017, 0), 0)


def test_a_suggested_time_outlives_a_pause_of_the_bridge() -> None:
    """Three lives of the dead-man time and of the heartbeat, and 300 ms."""
    assert suggested_ms(NORD, BUS, node(own_timeout_ms=250)) == 250
    assert suggested_ms(NORD, BUS, node()) >= 600
    assert suggested_ms(STOEBER, BUS, node(STOEBER)) == 0
