"""How a drive stops is judged: by the reaction that is asked for, and for a reason."""

from __future__ import annotations

import pytest

from tests.plant.oracle import Oracle
from tests.plant.ways import Ways
from tests.proof.drives import DRIVES, Drive
from tests.proof.settings import PLANT

TIMEOUT_S = PLANT.fieldbus_timeout_ms / 1000
BEGIN = 1030.0
STOPS = [drive for drive in DRIVES if drive.reaction in ("disable_voltage", "quick_stop", "stop")]


class Scene:
    """A drive that runs, and whose controller's last telegram came at ``BEGIN``."""

    def __init__(self, drive: Drive) -> None:
        self.drive = drive
        self.oracle = Oracle([drive])
        self.ways = Ways(self.oracle)
        own_s = 0.5 if drive.reaction == "silence" else 0.0
        self.oracle.published(drive, (TIMEOUT_S + 0.3 + own_s) * 1000, 1000)
        for word in (drive.family.ready, drive.family.run):
            self.oracle.telegram(drive, BEGIN, word)
        self.says(BEGIN, drive.family.enabled[1])
        self.gets(BEGIN + 0.1, drive.family.run, drive.family.setpoint)

    def says(self, at: float, word: int) -> None:
        self.oracle.frame(at, self.drive.tpdo, word.to_bytes(2, "little"), of_bridge=False)

    def gets(self, at: float, word: int, setpoint: int = 0) -> str:
        """What is wrong with its next RPDO."""
        before = len(self.oracle.violations)
        data = word.to_bytes(self.drive.family.control_bytes, "little")
        data += b"" if self.drive.setpoint_rpdo else setpoint.to_bytes(2, "little")
        self.oracle.frame(at, self.drive.rpdo, data, of_bridge=True)
        self.ways.frame(at, self.drive.rpdo, data)
        return " ".join(self.oracle.violations[before:])


def word_of(drive: Drive, stop: str) -> int:
    """A word that does this: what it does not say is as when the drive runs."""
    mask, value = drive.family.stops[stop]
    return drive.family.run & ~mask | value


@pytest.mark.parametrize("drive", STOPS, ids=lambda drive: drive.path)
def test_the_reaction_of_the_site_file_is_right(drive: Drive) -> None:
    scene = Scene(drive)
    assert not scene.gets(BEGIN + TIMEOUT_S + 0.1, word_of(drive, drive.reaction))


@pytest.mark.parametrize("drive", STOPS, ids=lambda drive: drive.path)
def test_another_is_not(drive: Drive) -> None:
    other = "quick_stop" if drive.reaction == "disable_voltage" else "disable_voltage"
    assert "is to react by" in Scene(drive).gets(BEGIN + TIMEOUT_S + 0.1, word_of(drive, other))


def test_a_reaction_has_no_setpoint() -> None:
    drive = next(one for one in STOPS if not one.setpoint_rpdo)
    word = word_of(drive, drive.reaction)
    assert "is to react by" in Scene(drive).gets(BEGIN + TIMEOUT_S + 0.1, word, 100)
    assert "setpoint is sent on" in Scene(drive).gets(BEGIN + TIMEOUT_S + 0.5, word, 100)


@pytest.mark.parametrize("drive", STOPS, ids=lambda drive: drive.path)
def test_who_is_there_is_not_stopped(drive: Drive) -> None:
    assert "for no reason" in Scene(drive).gets(BEGIN + 1.0, word_of(drive, drive.reaction))


def test_what_somebody_asks_for_is_a_reason() -> None:
    scene = Scene(STOPS[0])
    scene.ways.stop_asked(scene.drive, BEGIN + 0.9)
    assert not scene.gets(BEGIN + 1.0, word_of(scene.drive, "disable_voltage"))


def test_what_goes_wrong_beside_it_is_a_reason() -> None:
    scene = Scene(STOPS[0])
    scene.ways.excuse(BEGIN + 0.9)
    assert not scene.gets(BEGIN + 1.0, word_of(scene.drive, "disable_voltage"))


def test_hold_stops_nothing() -> None:
    drive = next((one for one in DRIVES if one.reaction == "hold"), None)
    if drive is not None:
        scene = Scene(drive)
        assert "is to hold" in scene.gets(BEGIN + TIMEOUT_S + 0.1, word_of(drive, "disable_voltage"))


class TestSilence:
    @pytest.fixture
    def scene(self) -> Scene:
        drive = next((one for one in DRIVES if one.reaction == "silence"), None)
        if drive is None:
            pytest.skip("none of these drives is to be silent")
        return Scene(drive)

    def test_whoever_is_to_be_silent_gets_nothing(self, scene: Scene) -> None:
        word = word_of(scene.drive, "quick_stop")
        assert "is to be silent" in scene.gets(BEGIN + TIMEOUT_S + 1.0, word)

    def test_a_stop_breaks_it_once(self, scene: Scene) -> None:
        word, at = word_of(scene.drive, "quick_stop"), BEGIN + TIMEOUT_S + 1.0
        scene.ways.stop_asked(scene.drive, at)
        assert not scene.gets(at + 0.01, word)
        assert not scene.gets(at + 0.11, word)
        scene.ways.stop_asked(scene.drive, at + 1.0)
        assert "broken again" in scene.gets(at + 1.01, word)

    def test_it_has_to_be_forwarded(self, scene: Scene) -> None:
        at = BEGIN + TIMEOUT_S + 1.0
        scene.ways.stop_answered(scene.drive, "stop", at, at, is_forwarded=False)
        assert "was not forwarded" in scene.oracle.violations[-1]
