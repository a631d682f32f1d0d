"""Troubles of a plant, by its points alone."""

from __future__ import annotations

import pytest

from bridge.image import Quality, Value
from tests.support import sites
from tests.support.condition import Watched

DRIVE, NODE, BUS = "conveyor/fu1", "conveyor", "bus/can0"
_SITE = sites.site(
    sites.bus(sites.node(sites.drive("fu1", "lease", 1000), sites.drive("fu2", "lease", 1000)))
)


def case_of() -> Watched:
    return Watched(_SITE)


def test_a_plant_in_order_has_none() -> None:
    assert case_of().kinds() == []


@pytest.mark.parametrize(
    ("name", "value", "kind", "rank"),
    [
        (f"{BUS}/state", 4, "bus_down", "alarm"),
        (f"{BUS}/state", 3, "bus_off", "alarm"),
        (f"{BUS}/state", 2, "bus_errors", "warning"),
        (f"{BUS}/duplicate_ids", "5", "duplicate_ids", "alarm"),
        (f"{BUS}/second_master", True, "second_master", "alarm"),
        (f"{BUS}/unexpected_nodes", "12", "unexpected_nodes", "warning"),
        (f"{BUS}/held_by", "lift", "held", "alarm"),
        (f"{BUS}/intruders", 3, "intruder", "alarm"),
        (f"{NODE}/node/state", 0, "node_absent", "alarm"),
        (f"{NODE}/node/state", 3, "node_lost", "alarm"),
        (f"{NODE}/node/state", 4, "node_stopped", "warning"),
        (f"{NODE}/node/state", 5, "node_disabled", "warning"),
        (f"{NODE}/node/state", 6, "not_as_configured", "alarm"),
        (f"{DRIVE}/supervision/follows", False, "ignores_stop", "danger"),
        (f"{DRIVE}/supervision/watchdog_state", 3, "controller_silent", "alarm"),
        (f"{DRIVE}/status/fault_text", "E010", "drive_fault", "alarm"),
        ("bridge/fronts_failing", "opcua: its key", "fronts_failing", "warning"),
        ("bridge/audit_lost", 7, "log_lost", "warning"),
    ],
)
def test_each_is_told_with_its_place_and_when_it_began(name: str, value: Value, kind: str, rank: str) -> None:
    case = case_of()
    case.later()
    case.set(name, value)
    (trouble,) = case.later(500.0)
    place = name.rpartition("/")[0]
    assert place.startswith(trouble["place"])
    assert (trouble["kind"], trouble["rank"]) == (kind, rank)
    assert trouble["since"] == case.now_ms
    assert "or_longer" not in trouble
    (still,) = case.later(500.0)
    assert still == trouble, "it goes on, and has begun when it began"


@pytest.mark.parametrize(
    ("quality", "kind"),
    [
        (Quality.LOST, "drive_lost"),
        (Quality.DEAD, "drive_lost"),
        (Quality.STALE, "drive_stale"),
        (Quality.CONFIG_ERROR, "drive_not_as_configured"),
    ],
)
def test_a_drive_that_is_not_heard_as_it_should_be(quality: Quality, kind: str) -> None:
    case = case_of()
    case.set(f"{DRIVE}/status/state", 4, quality, "why")
    (trouble,) = case.later()
    assert (trouble["kind"], trouble["place"], trouble["facts"]) == (kind, DRIVE, {"why": "why"})


def test_what_follows_from_another_trouble_stands_below_it() -> None:
    case = case_of()
    case.set(f"{BUS}/state", 4)
    case.set(f"{NODE}/node/state", 3)
    for drive in case.layout.drives:
        case.set(f"{drive}/status/state", 4, Quality.LOST)
    (down,) = case.later()
    assert (down["kind"], down["place"]) == ("bus_down", BUS)
    assert {(one["kind"], one["place"]) for one in down["explains"]} == {
        ("node_lost", NODE),
        *(("drive_lost", drive) for drive in case.layout.drives),
    }


def test_lines_lost_before_the_bridge_began_are_a_trouble_and_old_intruders_are_not() -> None:
    case = case_of()
    case.set("bridge/audit_lost", 3)
    case.set(f"{BUS}/intruders", 3)
    case.begin()
    (trouble,) = case.beat()
    assert (trouble["kind"], trouble["or_longer"]) == ("log_lost", True)
    assert case.later(11 * 60_000.0) == [], "nothing was lost for ten minutes"


def test_a_node_that_boots_for_ever_is_a_trouble_after_ten_seconds() -> None:
    case = case_of()
    case.later()
    began_ms = case.now_ms
    case.set(f"{NODE}/node/state", 1)
    case.set(f"{NODE}/node/boot_status", "reads 1018h")
    for drive in case.layout.drives:
        case.set(f"{drive}/status/state", 0, Quality.WAITING)
    case.beat()
    assert case.later(9000.0) == []
    assert case.troubles.waiting == 2, "nothing is wrong yet, nor is all in order"
    (trouble,) = case.later(1500.0)
    assert (trouble["kind"], trouble["place"], trouble["rank"]) == ("node_booting", NODE, "warning")
    assert trouble["facts"] == {"why": "reads 1018h"}
    assert trouble["since"] == began_ms
    assert case.troubles.waiting == 0, "the trouble says it"
    case.set(f"{NODE}/node/state", 2)
    assert case.later() == []
    case.set(f"{NODE}/node/state", 1)
    case.beat()
    assert case.later(9000.0) == [], "it boots anew"


def test_nodes_that_wait_for_a_mandatory_one_do_not_boot_for_ever() -> None:
    case = case_of()
    case.set(f"{BUS}/held_by", "lift")
    case.set(f"{NODE}/node/state", 1)
    case.set(f"{DRIVE}/status/state", 0, Quality.WAITING)
    case.later()
    assert case.kinds() == [("held", BUS)]
    assert case.troubles.waiting == 0


def test_a_drive_that_says_nothing_yet_is_counted_as_waiting() -> None:
    case = case_of()
    assert case.troubles.waiting == 0
    case.set(f"{DRIVE}/status/state", 0, Quality.WAITING)
    assert (case.beat(), case.troubles.waiting) == ([], 1)
    case.set(f"{DRIVE}/supervision/watchdog_state", 3)
    case.beat()
    assert case.troubles.waiting == 0


def test_the_worst_comes_first() -> None:
    case = case_of()
    case.set(f"{BUS}/state", 1)
    case.set(f"{DRIVE}/status/fault_text", "E010")
    case.set("conveyor/fu2/supervision/follows", False)
    assert [kind for kind, _ in case.kinds()] == ["ignores_stop", "drive_fault", "bus_errors"]


def test_a_fault_is_told_with_its_cause_and_what_to_do() -> None:
    case = case_of()
    facts = {"text": "E010 bus", "number": "E010/10.3", "cause": "silence", "remedy": "speak"}
    for leaf, text in facts.items():
        case.set(f"{DRIVE}/status/fault_{leaf}", text)
    (trouble,) = case.later()
    assert trouble["facts"] == facts


def test_a_drive_with_a_fault_of_its_own_has_it_beside_a_silent_controller() -> None:
    """After a trip the points show the bridge's fault; what the drive sent says more (BU 2500 §6.5.3)."""
    case = case_of()
    case.set(f"{DRIVE}/supervision/watchdog_state", 3)
    case.set(f"{DRIVE}/status/fault_text", "E010/10.3")
    case.set(f"{DRIVE}/status/drive_status_word", 0x0631)
    assert case.kinds() == [("controller_silent", DRIVE)], "the drive itself has none"
    case.set(f"{DRIVE}/status/drive_status_word", 0x0638)
    case.set(f"{DRIVE}/status/emcy_code", 0x2310)
    _, fault = case.later()
    assert (fault["kind"], fault["place"]) == ("drive_fault", DRIVE)
    assert fault["facts"]["number"] == "2310h"
    assert "10.3" not in fault["facts"]["text"]
    case.set(f"{DRIVE}/status/emcy_code", 0)
    assert case.later()[1]["facts"]["text"] == "fault"


def test_what_was_there_when_the_bridge_began_may_be_older() -> None:
    case = case_of()
    case.set(f"{DRIVE}/status/fault_text", "E010")
    assert case.later(100.0)[0]["or_longer"] is True


@pytest.mark.parametrize("name", ["bridge/audit_lost", f"{BUS}/intruders"])
def test_what_only_happens_is_shown_for_ten_minutes(name: str) -> None:
    case = case_of()
    case.set(name, 5)
    assert case.kinds()
    assert case.later(580_000.0)
    case.set(name, 6)
    assert case.later(10_000.0)
    assert case.later(590_000.0), "it has happened again"
    assert not case.later(20_000.0)
