"""Troubles that the points of a bus, a node or a drive tell: each with its rank and its facts."""

from __future__ import annotations

import pytest

from bridge.condition.point_troubles import (
    ImageReader,
    Rank,
    Trouble,
    is_bridge_dead,
    of_bridge,
    of_bus,
    of_drive,
    of_meaning,
    of_node,
    silence_of,
)
from bridge.drive import Explained
from bridge.image import Image, Quality, Value
from bridge.text import Text
from tests.support import sites
from tests.support.condition import Watched

DRIVE, NODE, BUS = "conveyor/fu1", "conveyor", "bus/can0"
SITE = sites.site(sites.bus(sites.node(sites.drive("fu1", "lease", 1000))))


@pytest.fixture
def case() -> Watched:
    return Watched(SITE)


def kinds(troubles: list[Trouble]) -> list[tuple[Rank, str]]:
    return [(one.rank, one.kind) for one in troubles]


def bus(case: Watched, *, is_down: bool = False) -> list[Trouble]:
    return list(of_bus(ImageReader(case.image), "can0", is_down=is_down))


def node(case: Watched) -> list[Trouble]:
    return list(of_node(ImageReader(case.image), NODE))


def drive(case: Watched, *numbers: str) -> list[Trouble]:
    return list(of_drive(ImageReader(case.image), DRIVE, None, frozenset(numbers)))


def test_where_all_is_in_order_there_is_none(case: Watched) -> None:
    assert bus(case) == node(case) == drive(case) == []


@pytest.mark.parametrize(
    ("leaf", "value", "rank", "kind"),
    [
        ("duplicate_ids", "5", Rank.ALARM, "duplicate_ids"),
        ("second_master", True, Rank.ALARM, "second_master"),
        ("unexpected_nodes", "9", Rank.WARNING, "unexpected_nodes"),
        ("held_by", "conveyor", Rank.ALARM, "held"),
        ("state", 1, Rank.WARNING, "bus_errors"),
        ("state", 2, Rank.WARNING, "bus_errors"),
    ],
)
def test_a_bus(case: Watched, leaf: str, value: Value, rank: Rank, kind: str) -> None:
    case.set(f"{BUS}/{leaf}", value)
    assert kinds(bus(case)) == [(rank, kind)]


def test_a_bus_that_is_down_has_one_trouble_with_its_reason(case: Watched) -> None:
    case.set(f"{BUS}/last_error", "no acknowledge")
    case.set(f"{BUS}/duplicate_ids", "5")
    for state, kind in ((3, "bus_off"), (4, "bus_down")):
        case.set(f"{BUS}/state", state)
        (trouble,) = bus(case, is_down=True)
        assert (trouble.kind, trouble.facts) == (kind, (("why", "no acknowledge"),))


def test_a_bus_that_is_left_to_another_bridge_is_nobodys_trouble(case: Watched) -> None:
    case.set(f"{BUS}/passive", True)
    case.set(f"{BUS}/duplicate_ids", "5")
    assert bus(case, is_down=True) == bus(case) == []


@pytest.mark.parametrize(
    ("state", "found"),
    [
        ("absent", (Rank.ALARM, "node_absent")),
        ("lost", (Rank.ALARM, "node_lost")),
        ("config_error", (Rank.ALARM, "not_as_configured")),
        ("stopped", (Rank.WARNING, "node_stopped")),
        ("disabled", (Rank.WARNING, "node_disabled")),
    ],
)
def test_a_node(case: Watched, state: str, found: tuple[Rank, str]) -> None:
    name = f"{NODE}/node/state"
    point = case.image.points[case.image.index[name]]
    (code,) = (number for number, label in point.states if label == state)
    case.set(name, code)
    assert kinds(node(case)) == [found]


def test_a_drive_that_does_not_follow_is_a_danger_beside_all_else(case: Watched) -> None:
    case.set(f"{DRIVE}/supervision/follows", False)
    case.set(f"{DRIVE}/status/state", 4, Quality.STALE, "no TPDO")
    assert kinds(drive(case)) == [(Rank.DANGER, "ignores_stop"), (Rank.WARNING, "drive_stale")]


@pytest.mark.parametrize(
    ("quality", "found"),
    [
        (Quality.CONFIG_ERROR, (Rank.ALARM, "drive_not_as_configured")),
        (Quality.LOST, (Rank.ALARM, "drive_lost")),
        (Quality.DEAD, (Rank.ALARM, "drive_lost")),
        (Quality.STALE, (Rank.WARNING, "drive_stale")),
    ],
)
def test_a_drive_by_the_quality_of_its_state(
    case: Watched, quality: Quality, found: tuple[Rank, str]
) -> None:
    case.set(f"{DRIVE}/status/state", 4, quality, "because")
    (trouble,) = drive(case)
    assert (trouble.rank, trouble.kind) == found
    assert trouble.facts == (("why", "because"),)


def test_a_silent_controller_is_told_with_its_owner_and_time(case: Watched) -> None:
    case.set(f"{DRIVE}/supervision/watchdog_state", 3)
    case.set(f"{DRIVE}/supervision/owner", "modbus:10.0.0.1")
    case.set(f"{DRIVE}/supervision/fieldbus_timeout_ms", 200)
    (trouble,) = drive(case)
    assert (trouble.kind, dict(trouble.facts)) == (
        "controller_silent",
        {"owner": "modbus:10.0.0.1", "timeout_ms": 200},
    )


def test_after_a_trip_the_drives_own_fault_is_the_one_that_its_status_word_tells(case: Watched) -> None:
    case.set(f"{DRIVE}/supervision/watchdog_state", 3)
    case.set(f"{DRIVE}/status/drive_status_word", 8)
    case.set(f"{DRIVE}/status/emcy_code", 0x2310)
    asked: list[tuple[int, int]] = []

    def own(word: int, code: int) -> Explained:
        asked.append((word, code))
        return Explained("3.0", "overcurrent")

    found = list(of_drive(ImageReader(case.image), DRIVE, own))
    assert [one.kind for one in found] == ["controller_silent", "drive_fault"]
    assert asked == [(8, 0x2310)]


def test_a_fault_that_answers_a_silent_bus_is_marked(case: Watched) -> None:
    case.set(f"{DRIVE}/status/fault_text", "E010/10.2 gone")
    case.set(f"{DRIVE}/status/fault_number", "10.2")
    (trouble,) = drive(case, "10.2")
    assert trouble.is_of_bus
    (trouble,) = drive(case, "3.0")
    assert not trouble.is_of_bus
    assert dict(trouble.facts)["text"] == "E010/10.2 gone"


def test_a_bus_process_that_does_not_answer_is_told_by_the_bridges_own_points(case: Watched) -> None:
    reader = ImageReader(case.image)
    assert not is_bridge_dead(reader)
    own = [case.image.index[name] for name in reader.of_bridge]
    case.image.judge(own[1:], Quality.DEAD, 1.0, "x")
    assert not is_bridge_dead(reader)
    case.image.judge(own, Quality.DEAD, 1.0, "x")
    assert is_bridge_dead(reader)
    assert not is_bridge_dead(ImageReader(Image([])))


def test_a_point_that_is_not_there_or_has_no_value_is_none(case: Watched) -> None:
    reader = ImageReader(case.image)
    assert reader("nowhere/at/all") is None
    case.set(f"{DRIVE}/status/state", 4, Quality.DEAD)
    assert reader(f"{DRIVE}/status/state") is None
    assert reader.label(f"{DRIVE}/status/state") == ""


def test_how_a_node_was_lost_and_why_it_is_not_as_configured_are_told(case: Watched) -> None:
    name = f"{NODE}/node/state"
    codes = {label: number for number, label in case.image.points[case.image.index[name]].states}
    case.set(f"{NODE}/node/supervision_state", "no heartbeat")
    case.set(f"{NODE}/node/boot_status", "another vendor")
    case.set(name, codes["lost"])
    assert [one.facts for one in node(case)] == [(("how", "no heartbeat"),)]
    case.set(name, codes["config_error"])
    assert [one.facts for one in node(case)] == [(("why", "another vendor"),)]


def test_a_value_that_the_words_do_not_carry_is_a_warning_with_its_reason(case: Watched) -> None:
    reader = ImageReader(case.image)
    (main,) = (m for m in ("velocity", "frequency", "speed") if f"{DRIVE}/actual/{m}" in case.image.index)
    point = f"{DRIVE}/actual/{main}"
    assert list(of_meaning(reader, DRIVE, main)) == []
    case.set(point, 0.0, Quality.STALE, "no TPDO")
    assert list(of_meaning(reader, DRIVE, main)) == []
    case.set(point, 0.0, Quality.DISABLED, "")
    assert list(of_meaning(reader, DRIVE, main)) == []
    case.set(point, 0.0, Quality.DISABLED, "P1 is 2")
    facts = (("value", main), ("why", "P1 is 2"))
    assert list(of_meaning(reader, DRIVE, main)) == [Trouble(Rank.WARNING, "no_actual", DRIVE, facts)]


def test_a_bus_is_silent_where_none_of_several_nodes_answers() -> None:
    drive = sites.drive("fu1", "none", 0)
    nodes = sites.node(drive, name="a", node_id=2), sites.node(drive, name="b", node_id=3)
    case = Watched(sites.site(sites.bus(*nodes)))
    reader = ImageReader(case.image)
    codes = {label: number for number, label in case.image.points[case.image.index["a/node/state"]].states}

    def silent(a: str, b: str) -> list[Trouble]:
        case.set("a/node/state", codes[a])
        case.set("b/node/state", codes[b])
        return list(silence_of(reader, "can0", ("a", "b")))

    assert silent("lost", "absent") == [Trouble(Rank.ALARM, "bus_silent", BUS, (("nodes", 2),))]
    assert silent("lost", "operational") == []
    assert silent("disabled", "stopped") == []
    assert silent("lost", "disabled") == []
    case.set(f"{BUS}/state", 2)
    assert silent("lost", "disabled") == [Trouble(Rank.ALARM, "bus_silent", BUS, (("nodes", 1),))]


def test_fronts_that_fail_are_a_warning_of_the_bridge(case: Watched) -> None:
    assert list(of_bridge(ImageReader(case.image))) == []
    case.set("bridge/fronts_failing", "opcua")
    found = Trouble(Rank.WARNING, "fronts_failing", "bridge", (("fronts", "opcua"),))
    assert list(of_bridge(ImageReader(case.image))) == [found]
    ended = Text.of("front.has_ended")
    parts = tuple(Text.of("front.fails", front=one, how=ended) for one in ("modbus", "page"))
    case.say("bridge/fronts_failing", Text.of("front.failing", parts=parts))
    (trouble,) = of_bridge(ImageReader(case.image))
    assert trouble.fronts == {"modbus", "page"}
    assert str(dict(trouble.facts)["fronts"]) == "modbus: has ended; page: has ended"
