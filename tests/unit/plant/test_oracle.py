"""The plant's oracle: it names what is wrong, and takes a good bridge for a good one."""

from __future__ import annotations

import pytest

from tests.plant.oracle import ALIVE, START, Oracle
from tests.proof.board import NUMBERS
from tests.proof.drives import DRIVES, Drive
from tests.proof.settings import PLANT

DRIVE = DRIVES[0]
FAMILY = DRIVE.family
TIMEOUT_S = PLANT.fieldbus_timeout_ms / 1000
WORST_S = TIMEOUT_S + 0.2
DEAD_S = PLANT.deadman_ms / 1000


def rpdo(word: int, setpoint: int = FAMILY.setpoint) -> bytes:
    size = FAMILY.control_bytes
    return word.to_bytes(size, "little") + setpoint.to_bytes(2, "little")


class Scene:
    """A drive that its controller has enabled, at 1010 s."""

    def __init__(self) -> None:
        self.oracle = Oracle([DRIVE])
        self.oracle.published(DRIVE, WORST_S * 1000, 1000)
        self.tell(1009.8, FAMILY.ready)
        self.tell(1009.9, FAMILY.run)
        self.sees(1010.0)

    def tell(self, at: float, word: int) -> None:
        self.oracle.telegram(DRIVE, at, word)

    def sees(self, at: float, word: int = FAMILY.run, setpoint: int = FAMILY.setpoint) -> str:
        """What is wrong with this RPDO."""
        before = len(self.oracle.violations)
        self.oracle.frame(at, DRIVE.rpdo, rpdo(word, setpoint), of_bridge=True)
        return " ".join(self.oracle.violations[before:])

    def enables_again(self, at: float) -> None:
        for word in (FAMILY.ready, FAMILY.acknowledge, FAMILY.ready, FAMILY.run):
            self.tell(at, word)


@pytest.fixture
def scene() -> Scene:
    found = Scene()
    assert not found.oracle.violations
    return found


def test_who_has_not_been_asked_does_not_move() -> None:
    oracle = Oracle([DRIVE])
    oracle.telegram(DRIVE, 1001.0, FAMILY.run)
    oracle.frame(1001.1, DRIVE.rpdo, rpdo(FAMILY.run), of_bridge=True)
    (text,) = oracle.violations
    assert "has not asked for it since the bridge has just started" in text


def test_a_silent_controller_has_its_time(scene: Scene) -> None:
    assert not scene.sees(1009.9 + WORST_S)
    assert "after its controller's last telegram" in scene.sees(1009.9 + WORST_S + 0.1)


def test_a_trip_is_to_be_acknowledged(scene: Scene) -> None:
    late = 1010.0 + TIMEOUT_S + 0.5
    scene.tell(late, FAMILY.ready)
    scene.tell(late + 0.1, FAMILY.run)
    assert "its controller was silent" in scene.sees(late + 0.2)
    scene.enables_again(late + 0.3)
    assert not scene.sees(late + 0.4)


def test_another_process_does_not_miss_what_the_last_one_has_got(scene: Scene) -> None:
    trips: list[Drive] = []
    scene.oracle.on_trip = lambda drive, since, due: trips.append(drive)
    scene.oracle.on_end(1010.1)
    scene.oracle.started()
    scene.tell(1010.0 + 2 * TIMEOUT_S, FAMILY.ready)
    assert not trips


def test_after_a_release_its_controller_asks_anew_and_has_nothing_to_acknowledge(scene: Scene) -> None:
    scene.oracle.released(DRIVE, 1010.0, 1010.01)
    assert "its controller released it" in scene.sees(1010.3)
    late = 1010.0 + TIMEOUT_S + 0.5
    scene.tell(late, FAMILY.ready)
    scene.tell(late + 0.1, FAMILY.run)
    assert not scene.sees(late + 0.2)


def test_who_commands_a_start_has_asked_for_what_enables() -> None:
    scene = Scene()
    scene.oracle.stop_answered(DRIVE, 1010.1, 1010.1)
    assert "somebody stopped it" in scene.sees(1010.5)
    scene.tell(1010.6, ALIVE)
    assert scene.sees(1010.7)
    scene.tell(1010.8, START)
    assert not scene.sees(1010.9)


def test_a_start_acknowledges_no_trip(scene: Scene) -> None:
    late = 1010.0 + TIMEOUT_S + 0.5
    scene.tell(late, START)
    assert "its controller was silent" in scene.sees(late + 0.4)


def test_a_bridge_that_stands_still_falls_silent(scene: Scene) -> None:
    scene.oracle.on_still(1010.0)
    assert not scene.sees(1010.0 + DEAD_S)
    assert "after the bridge fell silent" in scene.sees(1010.1 + DEAD_S)


def test_a_bridge_that_hung_lets_nothing_go_on(scene: Scene) -> None:
    scene.oracle.on_still(1010.0)
    scene.oracle.on_going_on(1010.0, 1010.0 + DEAD_S + 0.1)
    assert "the bridge hung" in scene.sees(1010.2 + DEAD_S)
    scene.tell(1010.3 + DEAD_S, FAMILY.ready)
    scene.tell(1010.4 + DEAD_S, FAMILY.run)
    assert not scene.sees(1010.5 + DEAD_S)


def test_a_short_hang_is_none(scene: Scene) -> None:
    scene.oracle.on_still(1010.0)
    scene.oracle.on_going_on(1010.0, 1010.0 + DEAD_S / 2)
    assert not scene.sees(1010.1 + DEAD_S / 2)


def test_a_pause_that_may_have_been_a_hang_may_have_ended_a_trip(scene: Scene) -> None:
    scene.oracle.on_still(1010.0)
    scene.oracle.on_going_on(1010.0, 1010.0 + DEAD_S * 0.99)
    late = 1010.0 + TIMEOUT_S + 0.5
    scene.tell(late, FAMILY.ready)
    scene.tell(late + 0.1, FAMILY.run)
    assert not scene.sees(late + 0.2)


def test_a_killed_bridge_is_silent_at_once(scene: Scene) -> None:
    scene.oracle.on_end(1010.0)
    assert "the bridge was killed" in scene.sees(1010.1)


def test_a_stop_stays_until_the_controller_enables_anew(scene: Scene) -> None:
    scene.oracle.stop_answered(DRIVE, 1010.0, 1010.01)
    scene.tell(1010.2, FAMILY.run)
    assert "somebody stopped it" in scene.sees(1010.5)
    scene.tell(1010.6, FAMILY.ready)
    scene.tell(1010.7, FAMILY.run)
    assert not scene.sees(1010.8)


@pytest.mark.parametrize("is_same_address", [False, True])
def test_a_controller_goes_on_where_another_connection_of_it_was(is_same_address: bool) -> None:
    oracle = Oracle([DRIVE])
    if is_same_address:
        oracle.shared(DRIVE, 1010.5)
    for at, setpoint in ((1010.0, FAMILY.setpoint + NUMBERS), (1010.6, FAMILY.setpoint)):
        oracle.telegram(DRIVE, at - 0.01, FAMILY.run)
        oracle.frame(at, DRIVE.rpdo, rpdo(FAMILY.run, setpoint), of_bridge=True)
    assert bool(oracle.violations) is not is_same_address


def test_a_stranger_has_no_setpoint(scene: Scene) -> None:
    assert "setpoint of a stranger" in scene.sees(1010.1, setpoint=FAMILY.setpoint + NUMBERS)


@pytest.mark.parametrize("setpoint", [FAMILY.setpoint // 2, 2 * FAMILY.setpoint, FAMILY.setpoint - 1])
def test_a_setpoint_that_nobody_has_sent_is_wrong(scene: Scene, setpoint: int) -> None:
    assert "gets a setpoint that nobody has sent" in scene.sees(1010.1, setpoint=setpoint)
    assert not scene.sees(1010.2, setpoint=FAMILY.setpoint + 1)


def test_who_takes_over_a_drive_without_an_owner_is_none(scene: Scene) -> None:
    scene.oracle.left(DRIVE, 1010.0)
    assert not scene.sees(1010.05)
    assert not scene.sees(1010.1, setpoint=FAMILY.setpoint + NUMBERS)


def test_who_has_come_back_owns_it_with_the_next_telegram(scene: Scene) -> None:
    scene.oracle.left(DRIVE, 1010.0)
    scene.tell(1010.1, FAMILY.run)
    scene.sees(1010.2)
    assert "setpoint of a stranger" in scene.sees(1010.3, setpoint=FAMILY.setpoint + NUMBERS)


def test_a_bus_that_was_off_lets_nothing_go_on(scene: Scene) -> None:
    scene.oracle.bus_off(1010.0)
    assert not scene.sees(1010.01)
    assert "the bus was off" in scene.sees(1010.05)


def test_the_kernel_goes_on_where_the_bridge_does_not_see_it(scene: Scene) -> None:
    scene.oracle.on_still(1009.9)
    scene.oracle.bus_off(1010.0)
    assert not scene.sees(1009.9 + DEAD_S)


def _says(oracle: Oracle, at: float, word: int) -> None:
    oracle.frame(at, DRIVE.tpdo, word.to_bytes(2, "little"), of_bridge=False)


def test_what_is_good_is_what_the_drive_says(scene: Scene) -> None:
    _says(scene.oracle, 1010.0, 0x0B37)
    scene.oracle.value(DRIVE, 1010.1, 0x0B37)
    assert not scene.oracle.violations
    scene.oracle.value(DRIVE, 1010.1, 0x0B40)
    scene.oracle.value(DRIVE, 1012.0, 0x0B37)
    assert ["is said to be good" in text for text in scene.oracle.violations] == [True, True]


def test_a_drive_sees_that_the_bridge_is_dead(scene: Scene) -> None:
    _, value = FAMILY.enabled
    _says(scene.oracle, 1011.0, value)
    scene.oracle.dead_for(DRIVE, 1010.0, 1011.1)
    assert not scene.oracle.violations
    _says(scene.oracle, 1011.8, value)
    scene.oracle.dead_for(DRIVE, 1010.0, 1011.9)
    assert "still runs" in scene.oracle.violations[0]


def test_a_drive_that_is_to_hold_goes_on() -> None:
    hold = next(drive for drive in DRIVES if drive.reaction == "hold")
    oracle = _with(hold)
    setpoint = hold.family.setpoint.to_bytes(2, "little")
    data = hold.family.run.to_bytes(hold.family.control_bytes, "little") + setpoint
    oracle.frame(1100.0, hold.rpdo, data, of_bridge=True)
    assert not oracle.violations


def _with(drive: Drive) -> Oracle:
    oracle = Oracle([drive])
    oracle.published(drive, WORST_S * 1000, None)
    for word in (drive.family.ready, drive.family.run):
        oracle.telegram(drive, 1009.0, word)
    return oracle
