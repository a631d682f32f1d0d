"""The witness is judged: what it owes is demanded, what is not so may not be said, and one that is right is
left alone."""

from __future__ import annotations

import pytest

from tests.plant.oracle import Oracle
from tests.plant.witnessed import Witnessed
from tests.proof.block import BLOCK
from tests.proof.drives import DRIVES
from tests.proof.settings import PLANT

DRIVE = DRIVES[0]
FAMILY = DRIVE.family
BUS = "can0"
HEARTBEAT = 0x700 + DRIVE.node_id
RUN = FAMILY.run.to_bytes(2, "little") + bytes(2)
STOP = FAMILY.ready.to_bytes(2, "little") + bytes(2)
ENABLED = FAMILY.enabled[1].to_bytes(2, "little") + bytes(2)
PERIOD_S = PLANT.rpdo_period_ms / 1000


class Scene:
    """A drive that runs at 1010 s, and is heard each 0.3 s."""

    def __init__(self) -> None:
        self.oracle = Oracle([DRIVE])
        self.witnessed = Witnessed(self.oracle, BUS)
        self.now = 1010.0
        self.sends(DRIVE.rpdo, RUN)
        self.says(ENABLED)

    def sends(self, can_id: int, data: bytes, who: str = "bridge one") -> None:
        self.witnessed.sender = who
        self.witnessed.heard(self.now, can_id, data)

    def says(self, data: bytes) -> None:
        self.sends(DRIVE.tpdo, data, "node 5")
        self.sends(HEARTBEAT, b"\5", "node 5")

    def goes_on(self, seconds: float, *, rpdo: bytes | None, tpdo: bytes | None) -> None:
        ends = self.now + seconds
        while self.now < ends:
            self.now += 0.1
            if rpdo is not None:
                self.sends(DRIVE.rpdo, rpdo)
            if tpdo is not None:
                self.says(tpdo)
            self.witnessed.look(self.now)

    def alarm(self, kind: str, source: str = DRIVE.path) -> None:
        self.witnessed.told(source, kind, self.now, "")

    @property
    def wrong(self) -> str:
        self.witnessed.look(self.now + 1.0)
        return " ".join(self.oracle.violations)


@pytest.fixture
def scene() -> Scene:
    found = Scene()
    assert not found.wrong
    return found


@pytest.mark.parametrize(
    ("kind", "rpdo", "tpdo", "seconds"),
    [("runs on", None, ENABLED, 4.0), ("stop ignored", STOP, ENABLED, 7.0), ("unheard", RUN, None, 3.5)],
)
def test_a_drive_beyond_its_bound_is_told(
    scene: Scene, kind: str, rpdo: bytes | None, tpdo: bytes | None, seconds: float
) -> None:
    scene.goes_on(seconds, rpdo=rpdo, tpdo=tpdo)
    assert f"the witness does not say {kind!r}: {DRIVE.path}" in scene.wrong


@pytest.mark.parametrize(
    ("kind", "rpdo", "tpdo", "seconds"),
    [("runs on", None, ENABLED, 3.2), ("stop ignored", STOP, ENABLED, 6.1), ("unheard", RUN, None, 1.9)],
)
def test_what_is_told_is_told(
    scene: Scene, kind: str, rpdo: bytes | None, tpdo: bytes | None, seconds: float
) -> None:
    scene.goes_on(seconds, rpdo=rpdo, tpdo=tpdo)
    scene.alarm(kind)
    scene.goes_on(1.0, rpdo=rpdo, tpdo=tpdo)
    assert not scene.wrong


@pytest.mark.parametrize("rpdo", [RUN, STOP])
def test_who_comes_back_enabled_and_stops_at_once_need_not_be_told(scene: Scene, rpdo: bytes) -> None:
    scene.sends(DRIVE.rpdo, rpdo)
    scene.now += 10.0
    scene.says(ENABLED)
    scene.now += 0.02
    scene.says(bytes(4))
    assert not scene.wrong


@pytest.mark.parametrize("kind", ["runs on", "stop ignored", "unheard", "enabled untold", "late", "blind"])
def test_what_is_not_so_is_a_false_alarm(scene: Scene, kind: str) -> None:
    scene.goes_on(2.0, rpdo=RUN, tpdo=ENABLED)
    scene.alarm(kind)
    assert f"the witness says {kind!r} of {DRIVE.path}" in scene.wrong


def test_it_does_not_repeat_itself(scene: Scene) -> None:
    scene.goes_on(6.1, rpdo=STOP, tpdo=ENABLED)
    for _ in range(3):
        scene.alarm("stop ignored")
    assert "again and again" in scene.wrong


def test_one_that_is_deaf_may_be_found_by_its_speed(scene: Scene) -> None:
    scene.witnessed.deaf(DRIVE, scene.now + 5.0)
    scene.goes_on(1.0, rpdo=STOP, tpdo=ENABLED)
    scene.alarm("stop ignored")
    assert not scene.wrong


@pytest.mark.parametrize(
    ("can_id", "data"),
    [(0x000, bytes((2, DRIVE.node_id))), (0x600 + DRIVE.node_id, bytes.fromhex("2305100080000000"))],
)
def test_who_commands_a_node_that_is_to_run_is_told(scene: Scene, can_id: int, data: bytes) -> None:
    scene.sends(can_id, data, "intruder")
    scene.alarm("intruder", BUS)
    assert not scene.wrong
    scene.now += 5.0
    scene.sends(DRIVE.rpdo, RUN)
    scene.sends(can_id, data, "intruder")
    assert "the witness does not say 'intruder': somebody" in scene.wrong


def test_a_bridge_that_may_be_a_new_one_keeps_nothing_running(scene: Scene) -> None:
    scene.now += 0.6
    scene.sends(0x000, bytes((2, DRIVE.node_id)), "tool")
    assert not scene.wrong


def test_who_repeats_the_word_that_runs_a_drive_is_told(scene: Scene) -> None:
    for _ in range(round(3.0 / 0.02)):
        scene.now += 0.02
        scene.sends(DRIVE.rpdo, RUN, "intruder")
    assert "an RPDO is repeated" in scene.wrong


def test_an_intruder_whom_nobody_has_sent_is_a_false_alarm(scene: Scene) -> None:
    scene.goes_on(4.0, rpdo=RUN, tpdo=ENABLED)
    scene.alarm("intruder", BUS)
    assert "the witness says 'intruder' of can0" in scene.wrong


def test_a_bridge_that_is_there_again_at_once_is_taken_for_one(scene: Scene) -> None:
    scene.witnessed.restarted(scene.now - 0.5)
    scene.alarm("intruder", BUS)
    assert not scene.wrong


def test_who_has_missed_a_frame_may_take_the_next_for_somebody_elses(scene: Scene) -> None:
    scene.witnessed.is_quiet = lambda: False
    scene.alarm("intruder", BUS)
    assert not scene.wrong


def test_an_rpdo_that_turns_is_told_whoevers_it_is(scene: Scene) -> None:
    for word in (STOP, RUN) * 3:
        scene.now += 0.05
        scene.sends(DRIVE.rpdo, word)
    scene.alarm("intruder")
    assert not scene.wrong


def test_a_drive_whose_node_was_taken_out_of_operation_is_told_as_long_as_it_is_not_heard(
    scene: Scene,
) -> None:
    scene.sends(0x000, bytes((2, DRIVE.node_id)))
    for _ in range(13):
        scene.now += 0.5
        scene.sends(HEARTBEAT, b"\4", "node 5")
        scene.witnessed.look(scene.now)
    assert "was enabled when its node was taken out of operation" in scene.wrong


def test_one_that_is_heard_again_is_not(scene: Scene) -> None:
    scene.sends(0x000, bytes((2, DRIVE.node_id)))
    scene.now += 0.2
    scene.goes_on(7.0, rpdo=RUN, tpdo=ENABLED)
    assert not scene.wrong
    scene.alarm("unheard")
    assert "the witness says 'unheard'" in scene.wrong


@pytest.mark.parametrize(("values", "is_owed"), [(BLOCK.active, True), (BLOCK.held, False)])
def test_outputs_that_are_active_without_a_bridge_are_told(
    scene: Scene, values: bytes, is_owed: bool
) -> None:
    scene.sends(BLOCK.rpdo, values)
    for _ in range(8):
        scene.now += 0.5
        scene.sends(0x700 + BLOCK.node_id, b"\5", "node 41")
    assert ("active outputs are operational" in scene.wrong) is is_owed
