"""Faults that somebody injects, and what people are told first: one cause with what it explains."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.condition.causes import KEPT_MS
from bridge.condition.point_troubles import Rank
from bridge.image import Quality
from bridge.text import Text
from tests.support import sites
from tests.support.condition import Watched
from tests.support.nightly import examples

BUS = "bus/can0"
NODES = ("belt", "press", "hoist")
DRIVES = tuple(f"{node}/{slot}" for node in NODES for slot in ("fu1", "fu2"))
_DRIVES = sites.drive("fu1", "lease", 1000) + sites.drive("fu2", "lease", 1000)
_SITE = sites.site(
    sites.bus(*(sites.node(_DRIVES, name=name, node_id=5 + place) for place, name in enumerate(NODES)))
)
_OPERATIONAL, _BOOTING, _LOST = 2, 1, 3


@pytest.fixture
def plant() -> Watched:
    plant = Watched(_SITE)
    plant.later(3_600_000.0)
    return plant


def top(plant: Watched, ms: float = 500.0) -> list[tuple[str, str]]:
    return [(one["kind"], one["place"]) for one in plant.later(ms)]


def below(plant: Watched) -> set[tuple[str, str]]:
    """Kind and place of the troubles that the only one explains."""
    (one,) = plant.beat()
    return {(known["kind"], known["place"]) for known in one.get("explains", [])}


def lose(plant: Watched, node: str) -> None:
    plant.set(f"{node}/node/state", _LOST)
    for drive in DRIVES:
        if drive.startswith(node):
            plant.set(f"{drive}/status/state", 4, Quality.LOST, "the node is lost")


def come_back(plant: Watched, node: str) -> None:
    plant.set(f"{node}/node/state", _OPERATIONAL)
    for drive in DRIVES:
        if drive.startswith(node):
            plant.set(f"{drive}/status/state", 4)


def fault(plant: Watched, drive: str, number: str) -> None:
    plant.set(f"{drive}/status/fault_text", f"{number} something")
    plant.set(f"{drive}/status/fault_number", number)


def acknowledge(plant: Watched, drive: str) -> None:
    fault(plant, drive, "")
    plant.set(f"{drive}/status/fault_text", "")
    plant.set(f"{drive}/supervision/watchdog_state", 1)


def own(plant: Watched, drive: str, owner: str) -> None:
    plant.set(f"{drive}/supervision/owner", owner)


def trip(plant: Watched, drive: str) -> None:
    plant.set(f"{drive}/supervision/watchdog_state", 3)


def hang(plant: Watched, ms: int, times: int = 1) -> None:
    """``times`` counts this one, too."""
    plant.now_ms += ms
    plant.set("bridge/hangs", times)
    plant.set("bridge/last_hang_ms", ms)


def cut_at_the_box(plant: Watched) -> None:
    """Nodes are missed one after the other, and nobody acknowledges what the controller sends."""
    plant.set(f"{BUS}/state", 2)
    for node in NODES:
        lose(plant, node)
        plant.later(200.0)


EVERY_NODE = {("node_lost", node) for node in NODES} | {("drive_lost", drive) for drive in DRIVES}


def test_a_cable_cut_at_the_box_is_one_trouble(plant: Watched) -> None:
    cut_at_the_box(plant)
    assert top(plant) == [("bus_silent", BUS)]
    assert below(plant) == EVERY_NODE | {("bus_errors", BUS)}


def test_a_bus_without_supply_from_the_start_is_one_trouble() -> None:
    plant = Watched(_SITE)
    plant.begin()
    for node in NODES:
        plant.set(f"{node}/node/state", 0)
    for drive in DRIVES:
        plant.set(f"{drive}/status/state", 0, Quality.WAITING)
    assert top(plant) == [], "the bridge looks for them first"
    assert plant.troubles.waiting == len(DRIVES)
    (silent,) = plant.later(3000.0)
    assert (silent["kind"], silent["or_longer"]) == ("bus_silent", True)
    assert below(plant) == {("node_absent", node) for node in NODES}
    assert plant.troubles.waiting == 0


@pytest.mark.parametrize(("state", "kind"), [(3, "bus_off"), (4, "bus_down")])
def test_a_bus_that_is_off_or_pulled_is_one_trouble(plant: Watched, state: int, kind: str) -> None:
    plant.set(f"{BUS}/state", state)
    for node in NODES:
        lose(plant, node)
    assert top(plant) == [(kind, BUS)]
    assert below(plant) == EVERY_NODE


def test_the_cable_of_one_node_is_that_node(plant: Watched) -> None:
    lose(plant, "press")
    assert top(plant) == [("node_lost", "press")]
    assert below(plant) == {("drive_lost", "press/fu1"), ("drive_lost", "press/fu2")}


@pytest.mark.parametrize("number", ["E010/10.2", "E010/10.3"])
def test_what_a_returning_bus_leaves_behind_says_so(plant: Watched, number: str) -> None:
    cut_at_the_box(plant)
    began = plant.later(500.0)[0]["since"]
    plant.set(f"{BUS}/state", 0)
    for node in NODES:
        plant.set(f"{node}/node/state", _BOOTING)
    assert top(plant) == [("bus_silent", BUS)], "its nodes boot"
    for node in NODES:
        come_back(plant, node)
    for drive in DRIVES[:4]:
        fault(plant, drive, number)
    (left,) = plant.later(5000.0)
    assert (left["kind"], left["since"]) == ("bus_silent", began)
    assert left["until"] > began, "the bus itself is back"
    assert below(plant) == {("drive_fault", drive) for drive in DRIVES[:4]}
    (left,) = plant.later(KEPT_MS + 60_000.0)
    assert left["kind"] == "bus_silent", "until somebody acknowledges"
    for drive in DRIVES:
        acknowledge(plant, drive)
    assert top(plant) == []
    assert [(one["kind"], one["until"]) for one in plant.recent] == [("bus_silent", left["until"])]


def test_what_a_first_break_left_is_not_of_the_second(plant: Watched) -> None:
    cut_at_the_box(plant)
    plant.later(500.0)
    plant.set(f"{BUS}/state", 0)
    for node in NODES:
        come_back(plant, node)
    fault(plant, DRIVES[0], "E010/10.3")
    plant.later(120_000.0)
    cut_at_the_box(plant)
    assert top(plant) == [("bus_silent", BUS)]
    assert ("drive_fault", DRIVES[0]) not in below(plant), "a drive that is not heard tells no fault"
    for node in NODES:
        come_back(plant, node)
    plant.set(f"{BUS}/state", 0)
    assert top(plant) == [("bus_silent", BUS)]
    assert below(plant) == {("drive_fault", DRIVES[0])}


@pytest.mark.landing(2)
@pytest.mark.parametrize("is_over", [False, True])
def test_what_each_of_two_standstills_left_stands_below_its_own(plant: Watched, *, is_over: bool) -> None:
    for place, drive in enumerate(DRIVES[:2]):
        if place:
            plant.later(60_000.0)
        hang(plant, 400, place + 1)
        fault(plant, drive, "E010/10.3")
        plant.later(500.0)
    shown = plant.later(10_000.0) if is_over else plant.beat()
    assert [one["kind"] for one in shown] == ["box_slow", "box_slow"]
    assert [[known["place"] for known in one["explains"]] for one in shown] == [[one] for one in DRIVES[:2]]
    assert all(known["since"] >= one["since"] for one in shown for known in one["explains"])
    acknowledge(plant, DRIVES[0])
    plant.later(10_000.0)
    assert below(plant) == {("drive_fault", DRIVES[1])}


def test_a_starved_box_blames_itself(plant: Watched) -> None:
    for drive in DRIVES[:3]:
        own(plant, drive, "modbus:plc1")
    plant.later()
    began = plant.now_ms
    hang(plant, 600)
    for node in NODES:
        lose(plant, node)
    for drive in DRIVES[:3]:
        trip(plant, drive)
    plant.set(f"{BUS}/state", 1)
    (slow,) = plant.beat()
    assert (slow["kind"], slow["place"], slow["facts"]) == ("box_slow", "bridge", {"ms": 600})
    assert slow["since"] == began
    assert slow["rank"] == "alarm", "as bad as the worst that came of it"
    assert {("controller_silent", drive) for drive in DRIVES[:3]} <= below(plant)
    assert {("bus_silent", BUS), *EVERY_NODE} <= below(plant)


def test_a_node_that_stays_away_after_a_standstill_is_a_trouble_of_its_own(plant: Watched) -> None:
    hang(plant, 600)
    lose(plant, "press")
    assert top(plant) == [("box_slow", "bridge")]
    assert top(plant, 15_000.0) == [("box_slow", "bridge")], "it may still boot"
    assert top(plant, 60_000.0) == [("node_lost", "press")]


def test_a_controller_that_falls_silent_after_a_standstill_is_its_own_trouble(plant: Watched) -> None:
    hang(plant, 150)
    plant.later(5000.0)
    trip(plant, DRIVES[0])
    assert top(plant) == [("controller_silent", DRIVES[0])]


def test_a_standstill_without_consequences_is_told_and_passes(plant: Watched) -> None:
    hang(plant, 600)
    assert top(plant) == [("box_slow", "bridge")]
    assert top(plant, 15_000.0) == []
    assert [one["kind"] for one in plant.recent] == ["box_slow"]


def test_a_dead_controller_is_one_trouble_however_many_drives_it_has(plant: Watched) -> None:
    for drive in DRIVES[:4]:
        own(plant, drive, "modbus:plc1")
    own(plant, DRIVES[4], "modbus:plc2")
    plant.later()
    for drive in DRIVES[:4]:
        trip(plant, drive)
        own(plant, drive, "")
        plant.later(100.0)
    (silent,) = plant.later(500.0)
    assert (silent["kind"], silent["facts"]) == ("controllers_silent", {"owner": "modbus:plc1", "drives": 4})
    assert below(plant) == {("controller_silent", drive) for drive in DRIVES[:4]}
    trip(plant, DRIVES[4])
    assert top(plant) == [("controllers_silent", DRIVES[0]), ("controller_silent", DRIVES[4])]


def test_drives_that_lost_the_same_controller_at_other_times_are_two_troubles(plant: Watched) -> None:
    for drive in DRIVES[:2]:
        own(plant, drive, "zenoh:line")
    plant.later()
    trip(plant, DRIVES[0])
    plant.later(60_000.0)
    trip(plant, DRIVES[1])
    assert {kind for kind, _ in top(plant)} == {"controller_silent"}


def failing(*fronts: str) -> Text:
    how = Text.of("front.ended_by_itself", how="SIGKILL")
    return Text.of("front.failing", parts=tuple(Text.of("front.fails", front=one, how=how) for one in fronts))


@pytest.mark.parametrize(("front", "owner"), [("opcua", "opcua:scada"), ("page", "local:anna#12ab")])
def test_a_dead_front_explains_the_silence_of_whom_it_serves(plant: Watched, front: str, owner: str) -> None:
    own(plant, DRIVES[0], owner)
    own(plant, DRIVES[1], "modbus:plc1")
    plant.later()
    trip(plant, DRIVES[0])
    plant.later(2000.0)
    plant.say("bridge/fronts_failing", failing("zenoh", front))
    assert top(plant) == [("fronts_failing", "bridge")]
    assert below(plant) == {("controller_silent", DRIVES[0])}
    trip(plant, DRIVES[1])
    assert top(plant) == [("fronts_failing", "bridge"), ("controller_silent", DRIVES[1])]


INDEPENDENT = [
    lambda plant: fault(plant, "belt/fu1", "E003/3.0"),
    lambda plant: plant.set(f"{BUS}/intruders", 7),
    lambda plant: plant.set(f"{BUS}/second_master", True),
    lambda plant: plant.set("belt/fu1/supervision/follows", False),
    lambda plant: plant.set("bridge/audit_lost", 7),
    lambda plant: plant.set(f"{BUS}/duplicate_ids", "5"),
    lambda plant: trip(plant, "belt/fu1"),
]


@pytest.mark.parametrize("second", range(len(INDEPENDENT)))
def test_a_second_fault_beside_a_silent_bus_is_not_swallowed(plant: Watched, second: int) -> None:
    cut_at_the_box(plant)
    plant.later(500.0)
    INDEPENDENT[second](plant)
    if second == 0:
        come_back(plant, "belt")
    kinds = top(plant)
    assert len(kinds) == 2 or second == 0, kinds
    assert any(kind not in ("bus_silent", "node_lost") for kind, _ in kinds)


def test_a_node_that_was_lost_long_before_is_not_the_bus(plant: Watched) -> None:
    lose(plant, "hoist")
    plant.later(3_600_000.0)
    for node in NODES[:2]:
        lose(plant, node)
    assert set(top(plant)) == {("bus_silent", BUS), ("node_lost", "hoist")}


def test_a_fault_of_the_bus_long_after_it_was_back_is_its_own(plant: Watched) -> None:
    cut_at_the_box(plant)
    plant.later(500.0)
    plant.set(f"{BUS}/state", 0)
    for node in NODES:
        come_back(plant, node)
    plant.later(300_000.0)
    fault(plant, DRIVES[0], "E010/10.3")
    assert top(plant) == [("drive_fault", DRIVES[0])]


def test_one_node_alone_on_a_bus_may_have_its_own_cable_cut() -> None:
    plant = Watched(sites.site(sites.bus(sites.node(_DRIVES, name="belt"))))
    plant.later()
    lose(plant, "belt")
    assert top(plant) == [("node_lost", "belt")]
    plant.set(f"{BUS}/state", 2)
    assert top(plant) == [("bus_silent", BUS)], "nobody acknowledges what the controller sends"


# a whole is as bad as its worst part

_ACTS = {
    "lose": lambda plant, place: lose(plant, place),
    "back": lambda plant, place: come_back(plant, place),
    "fault": lambda plant, place: fault(plant, f"{place}/fu1", "E003/3.0"),
    "bus fault": lambda plant, place: fault(plant, f"{place}/fu2", "E010/10.3"),
    "trip": lambda plant, place: trip(plant, f"{place}/fu1"),
    "deaf": lambda plant, place: plant.set(f"{place}/fu2/supervision/follows", False),
    "intruder": lambda plant, place: plant.set(f"{BUS}/intruders", round(plant.now_ms)),
    "bus": lambda plant, place: plant.set(f"{BUS}/state", NODES.index(place) + 1),
    "hang": lambda plant, place: hang(plant, 300),
    "unproven": lambda plant, place: plant.set(
        f"{place}/fu1/supervision/worst_case_bridge_ms", 0, Quality.CONFIG_ERROR, "the drive runs on"
    ),
    "later": lambda plant, place: plant.later(30_000.0),
}


@settings(max_examples=examples(60), deadline=None)
@given(st.lists(st.tuples(st.sampled_from(sorted(_ACTS)), st.sampled_from(NODES)), max_size=8))
def test_no_place_is_said_to_be_better_than_its_worst_part(acts: list[tuple[str, str]]) -> None:
    plant = Watched(_SITE)
    for act, place in acts:
        _ACTS[act](plant, place)
        plant.later(100.0)
    shown, ranks = plant.beat(), plant.troubles.ranks
    said = [(one["place"], one["rank"]) for top in shown for one in (top, *top.get("explains", []))]
    for place, rank in said:
        for container in ("", *plant.layout.above(place)):
            assert ranks[container] <= Rank[rank.upper()], (container, place)
    for one in shown:
        assert all(
            Rank[one["rank"].upper()] <= Rank[known["rank"].upper()] for known in one.get("explains", [])
        )
    if shown:
        assert Rank[shown[0]["rank"].upper()] == ranks[""], "the first sentence is about the worst"
    assert (
        set(ranks) == {"", *(above for place, _ in said for above in plant.layout.above(place))} or not said
    )


def test_a_drive_that_would_run_on_is_a_warning() -> None:
    plant = Watched(_SITE)
    name = "belt/fu1/supervision/worst_case_bridge_ms"
    plant.set(name, 0, Quality.CONFIG_ERROR, "the drive runs on: P513 is 0 (off)")
    (trouble,) = plant.later()
    assert (trouble["rank"], trouble["kind"], trouble["place"]) == ("warning", "stop_unproven", "belt/fu1")
    assert {"", BUS, "belt", "belt/fu1"} == plant.troubles.ranks.keys()
