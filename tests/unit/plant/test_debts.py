"""What the bridge owes to nodes is judged, and a bridge that gives it owes nothing."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.plant.debts import Debts
from tests.plant.oracle import Oracle
from tests.proof.drives import DRIVES
from tests.proof.settings import PLANT

DRIVE = DRIVES[0]
FAMILY = DRIVE.family
DEADMAN_S = PLANT.deadman_ms / 1000
STOP_NODE = bytes((2, DRIVE.node_id))
START_NODE = bytes((1, DRIVE.node_id))
HEARTBEAT = 0x700 + DRIVE.node_id


class Scene:
    """A drive that runs at 1030 s."""

    def __init__(self) -> None:
        self.oracle = Oracle([DRIVE])
        self.debts = Debts(self.oracle)
        for word in (FAMILY.ready, FAMILY.run):
            self.oracle.telegram(DRIVE, 1029.9, word)
        self.says(1029.9)
        self.debts.frame(1029.9, HEARTBEAT, b"\5", "node")
        self.gets(1030.0, FAMILY.run)

    def says(self, at: float) -> None:
        self.oracle.frame(at, DRIVE.tpdo, FAMILY.enabled[1].to_bytes(2, "little"), of_bridge=False)

    def gets(self, at: float, word: int) -> None:
        data = word.to_bytes(FAMILY.control_bytes, "little") + bytes(2)
        self.oracle.frame(at, DRIVE.rpdo, data, of_bridge=True)
        self.debts.frame(at, DRIVE.rpdo, data, "bridge")

    def wrong(self, at: float = 1040.0) -> str:
        self.debts.look(at, is_still=False)
        return " ".join(self.oracle.violations)

    def hangs(self, since: float, until: float) -> None:
        self.debts.on_still(since)
        self.debts.on_going_on(since, until)


@pytest.fixture
def scene() -> Scene:
    found = Scene()
    assert not found.wrong(1030.0)
    return found


def test_after_a_hang_a_stop_is_owed(scene: Scene) -> None:
    scene.hangs(1030.1, 1031.0)
    assert "gets no stop though the bridge has hung" in scene.wrong()


def test_a_stop_pays_it(scene: Scene) -> None:
    scene.hangs(1030.1, 1031.0)
    scene.gets(1031.01, FAMILY.ready)
    assert not scene.wrong()


def test_a_node_that_has_just_started_anew_ends_the_debt(scene: Scene) -> None:
    scene.debts.frame(1030.05, HEARTBEAT, b"\0", "node")
    scene.gets(1030.08, FAMILY.run)
    scene.hangs(1030.1, 1031.0)
    scene.debts.gives_way(1030.1, 1031.0)
    assert not scene.wrong()


def test_a_short_hang_owes_nothing(scene: Scene) -> None:
    scene.hangs(1030.1, 1030.1 + DEADMAN_S / 2)
    assert not scene.wrong()


def test_a_bridge_that_fails_again_is_excused(scene: Scene) -> None:
    scene.hangs(1030.1, 1031.0)
    scene.debts.disturbed(1031.1)
    assert not scene.wrong()


def test_who_gives_way_stops_the_node(scene: Scene) -> None:
    scene.debts.gives_way(1030.1, 1031.0)
    assert "no NMT stop before the bridge gives way" in scene.wrong()


@pytest.mark.parametrize("does_follow", [False, True])
def test_but_not_where_its_drives_have_followed_a_stop(scene: Scene, does_follow: bool) -> None:
    scene.gets(1030.02, FAMILY.ready)
    if does_follow:
        scene.oracle.frame(1030.05, DRIVE.tpdo, b"\0\0", of_bridge=False)
    else:
        scene.says(1030.05)
    scene.debts.gives_way(1030.1, 1031.0)
    assert bool(scene.wrong()) is not does_follow


def test_an_nmt_stop_of_the_bridge_is_one(scene: Scene) -> None:
    scene.debts.gives_way(1030.1, 1031.0)
    scene.debts.frame(1031.1, 0, STOP_NODE, "bridge")
    assert not scene.wrong()


def test_a_dead_bridge_sends_nothing(scene: Scene) -> None:
    scene.debts.on_still(1030.1)
    scene.debts.frame(1030.1 + DEADMAN_S, 0x77F, b"\5", "bridge")
    assert not scene.wrong(1030.4)
    scene.debts.frame(1030.1 + 2 * DEADMAN_S, 0x77F, b"\5", "bridge")
    assert "a dead bridge sends 77Fh" in scene.wrong(1030.4)


def test_a_service_that_ends_stops_its_drives(scene: Scene) -> None:
    scene.debts.ending(1030.1)
    scene.gets(1030.5, FAMILY.run)
    assert "by a service that ends" in scene.wrong()


def test_what_silence_stops_gets_nothing_even_then(scene: Scene, monkeypatch: pytest.MonkeyPatch) -> None:
    drive = replace(DRIVE, reaction="silence")
    monkeypatch.setattr(scene.oracle.tracks[DRIVE], "drive", drive)
    scene.oracle.tracks[DRIVE].last_at = 1030.0 - PLANT.fieldbus_timeout_ms / 1000
    scene.debts.ending(1030.1)
    scene.debts.ended(1030.2)
    assert not scene.wrong()


@pytest.mark.parametrize(("word", "text"), [(FAMILY.run, "though the service ends"), (FAMILY.ready, "")])
def test_it_ends_when_they_have_their_stop(scene: Scene, word: int, text: str) -> None:
    scene.debts.ending(1030.1)
    scene.gets(1030.15, word)
    scene.debts.ended(1030.2)
    assert text in scene.wrong()
    assert bool(scene.wrong()) is bool(text)


def test_a_lost_node_is_not_commanded_on(scene: Scene) -> None:
    scene.gets(1030.5, FAMILY.run)
    assert not scene.wrong()
    scene.gets(1031.0, FAMILY.run)
    assert "its node is silent" in scene.wrong()


def test_a_bridge_that_stands_still_knows_of_no_lost_node_and_then_stops_it(scene: Scene) -> None:
    scene.debts.on_still(1030.5)
    scene.gets(1030.9, FAMILY.run)
    scene.debts.on_going_on(1030.5, 1030.94)
    scene.gets(1030.95, FAMILY.run)
    assert not scene.wrong()
    scene.gets(1031.1, FAMILY.run)
    assert "its node is silent" in scene.wrong()


def test_after_a_boot_up_its_controller_has_to_ask_anew(scene: Scene) -> None:
    scene.debts.frame(1030.1, HEARTBEAT, b"\0", "node")
    scene.gets(1030.4, FAMILY.run)
    assert "since its node has started anew" in scene.wrong()


def test_a_second_bridge_listens(scene: Scene) -> None:
    for place in range(50):
        scene.debts.frame(1040.0 + place * 0.1, 0x77F, b"\5", "bridge")
    scene.debts.frame_of_other(1045.5, 0x77F)
    assert not scene.wrong()
    scene.debts.frame_of_other(1045.0, 0x77F)
    assert "another bridge sends 77Fh" in scene.wrong()


def test_an_intruder_is_answered(scene: Scene) -> None:
    scene.debts.intruded(DRIVE, "rpdo", 1030.1)
    assert "is not answered" in scene.wrong()


def test_a_bridge_that_has_just_begun_may_listen(scene: Scene) -> None:
    scene.debts.disturbed(1029.0)
    scene.debts.intruded(DRIVE, "rpdo", 1030.1)
    scene.debts.frame(1030.2, 0, START_NODE, "intruder")
    scene.debts.master_left(DRIVE, 1030.2)
    assert not scene.wrong()


def test_the_last_word_is_the_bridges(scene: Scene) -> None:
    scene.debts.frame(1030.1, 0, STOP_NODE, "bridge")
    scene.debts.frame(1030.2, 0, START_NODE, "intruder")
    scene.debts.master_left(DRIVE, 1030.2)
    assert "nobody stops it" in scene.wrong()


def test_a_stop_after_its_start_answers_a_master(scene: Scene) -> None:
    scene.debts.frame(1030.2, 0, START_NODE, "intruder")
    scene.debts.master_left(DRIVE, 1030.2)
    scene.debts.frame(1030.3, 0, STOP_NODE, "bridge")
    assert not scene.wrong()


@pytest.mark.parametrize(("is_halted", "text"), [(False, "ignores its stop"), (True, "")])
def test_a_deaf_drive_is_found(scene: Scene, is_halted: bool, text: str) -> None:
    scene.debts.deaf(DRIVE, 1030.1, 8.0)
    scene.gets(1033.0, FAMILY.ready)
    scene.says(1034.0)
    if is_halted:
        scene.debts.frame(1035.0, 0, STOP_NODE, "bridge")
    assert text in scene.wrong()
    assert bool(scene.wrong()) is bool(text)


def test_a_drive_that_hears_is_not_deaf(scene: Scene) -> None:
    scene.debts.deaf(DRIVE, 1030.1, 8.0)
    scene.gets(1033.0, FAMILY.ready)
    scene.oracle.frame(1034.0, DRIVE.tpdo, b"\0\0", of_bridge=False)
    assert not scene.wrong()


def test_a_bridge_that_starts_begins_with_stops(scene: Scene) -> None:
    scene.debts.started()
    scene.says(1030.9)
    scene.debts.frame(1031.0, 0x77F, b"\0", "bridge")
    assert "it runs as the bridge starts" in scene.wrong()


SYNCED = next(drive for drive in DRIVES if drive.syncs)


@pytest.mark.parametrize(
    ("sync_at", "state", "is_wrong"), [(1029.9, 5, True), (1030.1, 5, False), (1029.9, 4, False)]
)
def test_a_stop_that_waits_for_sync_is_brought_before_its_node_is_stopped(
    sync_at: float, state: int, is_wrong: bool
) -> None:
    oracle = Oracle([SYNCED])
    debts = Debts(oracle)
    family = SYNCED.family
    frames = [
        (1029.0, 0x700 + SYNCED.node_id, bytes((state,)), "node"),
        (1029.9, SYNCED.tpdo, family.enabled[1].to_bytes(2, "little"), "node"),
        (1029.8, SYNCED.rpdo, family.run.to_bytes(2, "little") + bytes(2), "bridge"),
        (1030.0, SYNCED.rpdo, family.ready.to_bytes(2, "little") + bytes(2), "bridge"),
        (sync_at, 0x080, b"", "bridge"),
    ]
    for at, can_id, data, who in frames:
        oracle.frame(at, can_id, data, of_bridge=who == "bridge")
        debts.frame(at, can_id, data, who)
    oracle.violations.clear()
    debts.frame(1030.15, 0x000, bytes((2, SYNCED.node_id)), "bridge")
    assert ("before SYNC brings its stop" in " ".join(oracle.violations)) is is_wrong
