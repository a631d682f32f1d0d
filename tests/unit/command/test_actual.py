"""What TPDOs bring, in the image at once: words, values, and how good each of them is."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.command import Action, Drive
from bridge.command.drive_link import FurtherTpdo, NodeState
from bridge.command.stop_check.state import LastStop
from bridge.image import Quality, Reading, Value
from tests.support import sites
from tests.support.node_states import hand_over, node_goes
from tests.support.rig import ENABLED, FAULT, HALF_SPEED, INHIBITED, READY
from tests.unit.command.test_follow_data import CSP, SITE, Axis
from tests.unit.command.test_plant import Hall

TARGET_REACHED = 0x0400
"""Bit 10 of the status word: no state depends on it."""
GOOD, STALE, LOST, WAITING = Quality.GOOD, Quality.STALE, Quality.LOST, Quality.WAITING
SILENT = "no process data from the drive"


@pytest.fixture
def running() -> Hall:
    hall = Hall()
    hall.run()
    return hall


# words and values


def test_a_bit_that_means_no_state_is_shown_at_once(running: Hall) -> None:
    """Whatever stands in the other words."""
    word = ENABLED | TARGET_REACHED
    running.pdo(ENABLED, word)
    running.now += 0.01
    running.pdo(word, ENABLED)
    assert running.read("status/status_word") == Reading(word, GOOD, running.now, "")
    assert running.read("status/drive_status_word").value == word
    assert running.read("actual/value_1").value == ENABLED


def words_of(count: int) -> st.SearchStrategy[list[int]]:
    return st.lists(st.integers(0, 0xFFFF), min_size=count, max_size=count)


@pytest.fixture(scope="module")
def scaled() -> Hall:
    hall = Hall()
    hall.run()
    hall.drive.channel.meanings.on_scale("P112", 10.0)
    hall.drive.compile()
    return hall


@given(words=words_of(3))
def test_each_word_is_shown_as_it_is_and_as_a_value(scaled: Hall, words: list[int]) -> None:
    """BU 2500 §6.6: 4000h is 100 % (P105 = 50 Hz, P112 = 10 A), and words are two's complements."""
    scaled.now += 0.001
    scaled.pdo(ENABLED, *words)
    signed = [word - 65536 if word > 32767 else word for word in words]
    assert [scaled.value(f"actual/value_{place}") for place in (1, 2, 3)] == words
    assert scaled.value("actual/frequency") == pytest.approx(50 * signed[0] / 16384)
    assert scaled.value("actual/current") == pytest.approx(10 * signed[1] / 16384)


@pytest.mark.parametrize(
    ("mapping", "count"),
    [
        ("nord/sk-54xe-rj45", 5),
        ("nord/sk-tu3-cao", 3),
        ("nord/sk-tu3-cao-pdo1", 1),
        ("nord/sk-tu3-cao-pdo4", 0),
    ],
)
def test_a_variant_shows_the_words_that_its_pdos_carry(mapping: str, count: int) -> None:
    """Of all the words that interfaces of its maker have."""
    node = sites.node(sites.drive("drive", "modbus", 0, ""), mapping=mapping)
    plant = sites.plant_of(sites.site(sites.bus(node)), mapping)
    (drive,) = plant.drives.values()
    node_goes(plant, plant.nodes["conveyor"], NodeState.OPERATIONAL, 100.0)
    drive.on_process_data([READY, 11, 12, 13, 14, 15], 100.0)
    raw = [point.name for point in plant.image.points if "/actual/value_" in point.name]
    assert [plant.image.read(name) for name in raw] == [
        Reading(11 + place, GOOD, 100.0, "") for place in range(count)
    ]


def test_before_the_first_tpdo_all_words_are_0() -> None:
    assert set(Hall().drive.words) == {0}


# how good they are


class Spread(Axis):
    """The position's low word comes by TPDO2, its high word by TPDO3; both every 100 ms, as TPDO1."""

    def boot(self) -> None:
        self.low = FurtherTpdo("TPDO2", frozenset((1,)), 0.1)
        self.tpdo2 = self.low
        self.high = FurtherTpdo("TPDO3", frozenset((2,)), 0.1)
        self.drive.on_pdos({}, [self.low, self.high], self.now, deadline_s=0.1, rpdo_type=255)
        node_goes(self.plant, self.plant.nodes["axis"], NodeState.OPERATIONAL, self.now)

    def comes(self, pdo: FurtherTpdo, word: int) -> None:
        (place,) = pdo.places
        self.drive.words[place] = word
        self.drive.on_further_data(pdo, self.now)

    def look(self, seconds: float) -> None:
        self.now = 100.0 + seconds
        self.plant.refresh(self.now)

    def read(self, leaf: str) -> tuple[Quality, str]:
        reading = self.plant.image.read(f"axis/drive/{leaf}")
        return reading.quality, reading.reason

    def position(self) -> Value:
        return self.plant.image.read("axis/drive/actual/position").value


LOW, HIGH, BOTH = "actual/value_1", "actual/value_2", "actual/position"


@pytest.fixture
def spread() -> Spread:
    axis = Spread()
    axis.says(0x0231)
    return axis


def test_each_value_waits_for_the_tpdos_that_bring_it(spread: Spread) -> None:
    status = "status/status_word"
    assert [spread.read(leaf)[0] for leaf in (status, LOW, HIGH, BOTH)] == [GOOD, WAITING, WAITING, WAITING]
    spread.comes(spread.low, 7)
    assert [spread.read(leaf)[0] for leaf in (LOW, HIGH, BOTH)] == [GOOD, WAITING, WAITING]
    assert spread.read(BOTH)[1] == "no TPDO3 from the drive"
    spread.comes(spread.high, 1)
    assert [spread.read(leaf) for leaf in (LOW, HIGH, BOTH)] == [(GOOD, "")] * 3
    assert spread.position() == 0x1_0007
    spread.comes(spread.low, 8)
    assert spread.position() == 0x1_0008, "at once"


def test_what_never_came_is_told_before_what_is_late(spread: Spread) -> None:
    spread.comes(spread.low, 7)
    spread.look(0.05)
    spread.says(0x0233)
    spread.look(0.12)
    assert spread.read(LOW) == (STALE, "no TPDO2 from the drive")
    assert spread.read(HIGH) == spread.read(BOTH) == (WAITING, "no TPDO3 from the drive")


@pytest.mark.parametrize("late", ["low", "high"])
def test_a_late_tpdo_makes_its_own_values_stale(spread: Spread, late: str) -> None:
    spread.comes(spread.low, 7)
    spread.comes(spread.high, 1)
    spread.look(0.05)
    spread.says(0x0233)
    spread.comes(spread.high if late == "low" else spread.low, 2)
    spread.look(0.099)
    assert spread.read(BOTH) == (GOOD, "")
    spread.look(0.1)
    name, stale, fresh = ("TPDO2", LOW, HIGH) if late == "low" else ("TPDO3", HIGH, LOW)
    assert spread.read(stale) == spread.read(BOTH) == (STALE, f"no {name} from the drive")
    assert spread.read(fresh) == (GOOD, "")
    spread.comes(spread.low if late == "low" else spread.high, 3)
    assert spread.read(stale) == spread.read(BOTH) == (GOOD, "")


def test_a_silent_drive_is_the_reason_where_all_are_late(spread: Spread) -> None:
    spread.comes(spread.low, 7)
    spread.look(0.3)
    assert spread.read("status/state") == (STALE, SILENT)
    assert spread.read(LOW) == (STALE, SILENT)
    assert spread.read(HIGH) == (WAITING, "no TPDO3 from the drive")


def test_after_a_while_in_which_a_node_was_not_heard_its_values_are_waited_for(spread: Spread) -> None:
    """The next one of each TPDO may bring another value."""
    spread.comes(spread.low, 7)
    spread.comes(spread.high, 1)
    spread.plant.nodes["axis"].on_heard_again()
    spread.look(0.01)
    assert spread.read(LOW)[0] is STALE
    spread.comes(spread.low, 7)
    assert spread.read(LOW)[0] is GOOD
    assert spread.read(HIGH) == spread.read(BOTH) == (STALE, "no TPDO3 from the drive")


def test_what_never_came_is_not_called_late_after_such_a_while(spread: Spread) -> None:
    spread.plant.nodes["axis"].on_heard_again()
    spread.look(0.01)
    assert spread.read(LOW)[0] is WAITING


def test_a_drive_is_sent_the_position_at_which_it_stands(spread: Spread) -> None:
    """Before it is enabled; both of its words."""
    spread.comes(spread.low, 7)
    spread.comes(spread.high, 1)
    assert spread.sent[1:] == (7, 1)
    spread.comes(spread.low, 8)
    spread.comes(spread.high, 2)
    assert spread.sent[1:] == (8, 2)


@pytest.mark.parametrize(("word", "mode"), [(0xFFFF, -1), (0xFF80, -128), (0x0001, 1)])
def test_a_mode_that_the_drive_tells_has_its_sign(spread: Spread, word: int, mode: int) -> None:
    """IEC 61800-7-201: 6061h is an INTEGER8, negative in the maker's own modes of operation."""
    drive, events = spread.drive, spread.plant.events
    drive.on_process_data((READY, 0, 0, 8), spread.now)
    events.take()
    drive.on_process_data((READY, 0, 0, word), spread.now)
    (event,) = events.take()
    assert event.message.startswith(f"6061 of parameter set 1 is {mode}, it was 8: ")


def test_a_position_that_comes_with_the_status_word_is_followed_as_well() -> None:
    plant = sites.plant_of(SITE, CSP)
    drive = plant.drives["axis/drive"]
    node_goes(plant, plant.nodes["axis"], NodeState.OPERATIONAL, 100.0)
    drive.on_process_data((0x0231, 7, 1, *drive.words[3:]), 100.0)
    assert drive.channel.output.words[1:] == (7, 1)


def test_what_a_node_does_not_carry_is_a_configuration_error_until_it_does(running: Hall) -> None:
    drive: Drive = running.drive
    why = "not in its TPDOs"
    drive.on_pdos({"actual/value_1": why}, (), 100.0, deadline_s=0.1, rpdo_type=255)
    for leaf in ("actual/value_1", "actual/frequency"):
        assert (running.read(leaf).quality, running.read(leaf).reason) == (Quality.CONFIG_ERROR, why)
    assert running.read("actual/value_2").quality is GOOD
    drive.on_pdos({}, (), 100.0, deadline_s=0.1, rpdo_type=255)
    assert running.read("actual/frequency").quality is GOOD


# what the drive's stop makes of them


def stopped(deadline_s: float = 0.1) -> Hall:
    hall = Hall()
    hall.run()
    hall.drive.channel.link.pdo_deadline_s = deadline_s
    hall.submit(Action.DISABLE_VOLTAGE)
    hand_over(hall.plant, hall.drive, hall.now)
    return hall


def last_stop(hall: Hall) -> LastStop:
    return hall.drive.stop_check.last_stop


@pytest.mark.parametrize("word", [READY, INHIBITED, FAULT])
def test_a_tpdo_after_a_stop_shows_that_it_is_followed(word: int) -> None:
    hall = stopped()
    assert hall.value("supervision/last_stop") == LastStop.FORWARDED
    hall.now += 0.02
    hall.pdo(word, 0)
    hall.at(hall.now)
    assert hall.value("supervision/last_stop") == LastStop.FOLLOWED


def said(hall: Hall) -> None:
    hall.pdo(ENABLED, HALF_SPEED)


def unchanged(hall: Hall) -> None:
    hall.drive.on_unchanged_data(hall.now)


@pytest.mark.parametrize("says", [said, unchanged])
def test_a_drive_that_was_not_heard_for_a_while_has_its_time_to_stop_from_then_on(
    says: Callable[[Hall], None],
) -> None:
    """It may not have heard the stop either."""
    hall = stopped()
    bound_s = 3 * 0.1 + hall.drive.rpdo_period_ms / 1000 + hall.drive.family.stopping.off_ms / 1000
    hall.now += bound_s + 0.01
    says(hall)
    hall.at(hall.now)
    assert last_stop(hall) is LastStop.FORWARDED
    for _ in range(round(bound_s / 0.05) + 1):
        hall.now += 0.05
        says(hall)
        hall.at(hall.now)
    assert last_stop(hall) is LastStop.IGNORED


def test_what_a_drive_says_again_counts_when_its_node_is_back() -> None:
    """Nothing has changed but that it is heard: it stands, as it was told."""
    hall = Hall()
    hall.drive.channel.link.pdo_deadline_s = 0.1
    node_goes(hall.plant, hall.node, NodeState.OPERATIONAL, hall.now)
    hall.pdo(READY)
    node_goes(hall.plant, hall.node, NodeState.LOST, 100.1)
    node_goes(hall.plant, hall.node, NodeState.OPERATIONAL, 100.2)
    hand_over(hall.plant, hall.drive, 100.2)
    hall.now = 100.25
    unchanged(hall)
    hall.at(100.25)
    assert last_stop(hall) is LastStop.FOLLOWED
