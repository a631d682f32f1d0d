"""A recorded log of all families, decoded by cantools with the exported DBC, against the bridge's image."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from bridge.canopen.frame import REMOTE, Frame
from bridge.command import Action, Code, Identity, Source
from bridge.image import Quality
from bridge.sim.catalogue import SIMULATED
from tests.support.families import FamilyBridge, family_bridge, setpoint_of, speed_of
from tests.support.process import drivebridge_called, peer_called, until

ME = Identity(Source.ZENOH, "test")
FAILING = ("cia402/velocity", "lenze/8400-motec", "nord/sk-tu4-cao", "stoeber/5000")

SERVED = (Quality.GOOD, Quality.STALE)
"""What a drive has sent: a word whose PDO is off or has never come is not compared."""

Image = dict[str, Any]


class Recording:
    """The log of a bus on which every drive runs, but those that have failed, and what the bridge made
    of it."""

    def __init__(self, bridge: FamilyBridge, folder: Path) -> None:
        self.site = bridge.site
        self._folder = folder
        bridge.records = True
        for mapping in SIMULATED:
            self._run(bridge, mapping)
        for mapping in FAILING:
            bridge.fail(self.site.drives[mapping])
            drive = self.site.drives[mapping]
            until(lambda drive=drive: bridge.value(f"{drive}/status/emcy_code"), 5.0, f"{drive} is in fault")
        time.sleep(0.3)  # all that changes comes to rest
        bridge.cut()
        time.sleep(0.05)  # what was on its way is in the image
        self.image: Image = bridge.call(
            lambda: {
                point.name: reading.value
                for point in bridge.service.plant.image.points
                if (reading := bridge.service.plant.image.read(point.name)).quality in SERVED
            }
        )
        self.log = folder / "log"
        self.log.write_text("".join(map(_line, bridge.log)), encoding="ascii")

    def _run(self, bridge: FamilyBridge, mapping: str) -> None:
        drive, setpoint = self.site.drives[mapping], setpoint_of(self.site.families[mapping])
        assert bridge.ask(Action.START, drive, ME).code is Code.OK
        if setpoint is not None:
            name, value = setpoint
            values = {**speed_of(self.site.families[mapping]), name: -value}
            assert bridge.ask(Action.WRITE, drive, ME, values=values).code is Code.OK

            def is_there() -> bool:
                return abs(float(str(bridge.value(f"{drive}/actual/{name}"))) + value) <= 0.02 * value

            until(is_there, 8.0, f"{drive} runs")

    def decoded(self, *options: str) -> Any:
        file = self._folder / "site.dbc"
        exported = drivebridge_called("export", "dbc", str(self.site.path), *options)
        assert exported.returncode == 0, exported.stderr
        file.write_text(exported.stdout, encoding="utf-8")
        done = peer_called("dbc_decode", str(file), str(self.log))
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)


def _line(frame: Frame) -> str:
    return "" if frame.can_id & REMOTE else f"({frame.time:.6f}) can0 {frame.can_id:03X}#{frame.data.hex()}\n"


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Recording]:
    folder = tmp_path_factory.mktemp("dbc")
    with family_bridge(folder, SIMULATED, "zenoh") as bridge:
        yield Recording(bridge, folder)


def points(recording: Recording, *options: str) -> Image:
    """What the log says, as values of points."""
    told: Image = {}
    decoded = recording.decoded(*options)["messages"]
    for drive in recording.site.drives.values():
        for name, message in decoded.items():
            prefix, _, pdo = name.rpartition("_")
            if prefix != drive.replace("/", "_"):
                continue
            group = "command" if pdo.startswith("RPDO") else "actual"
            found = {**message["values"], **message["words"]}
            if "status_word" in found:
                told[f"{drive}/status/drive_status_word"] = found.pop("status_word")
            told |= {f"{drive}/{group}/{leaf}": value for leaf, value in found.items()}
            bits = {f"{drive}/{group}/{leaf}": value for leaf, value in message["bits"].items()}
            told |= {name: value for name, value in bits.items() if name in recording.image}
    return told


@pytest.mark.landing
@pytest.mark.parametrize("options", [(), ("--words",)], ids=["values", "words"])
def test_a_log_says_what_the_bridge_says(recording: Recording, options: tuple[str, ...]) -> None:
    told = points(recording, *options)
    # A word that is a value or bits is no signal of its own, and the other way round.
    image = {name: recording.image[name] for name in told if name in recording.image}
    assert {name: round(float(told[name]), 6) for name in image} == {
        name: round(float(value), 6) for name, value in image.items()
    }
    assert told.keys() == image.keys()


@pytest.mark.landing
def test_every_word_and_value_of_a_drive_is_in_the_file(recording: Recording) -> None:
    told = points(recording) | points(recording, "--words")
    carried = {
        name
        for name, value in recording.image.items()
        if name.rpartition("/")[0].endswith(("/command", "/actual")) and value is not None
    }
    assert carried
    assert carried <= told.keys()


@pytest.mark.landing
def test_heartbeats_and_emergencies_are_told(recording: Recording) -> None:
    decoded = recording.decoded()
    # SDO is in no DBC file, nor are PDOs that a node sends and the bridge does not use.
    assert not [cob_id for cob_id in decoded["unknown"] if not 0x181 <= cob_id <= 0x67F]
    for mapping, drive in recording.site.drives.items():
        node = drive.partition("/")[0]
        heartbeat = decoded["messages"][f"{node}_heartbeat"]
        assert heartbeat["sender"] == [node]
        assert heartbeat["values"]["nmt_state"] == recording.image[f"{node}/node/nmt_state"] == 5
        if mapping in FAILING:
            code = decoded["messages"][f"{node}_EMCY"]["values"]["error_code"]
            assert code == recording.image[f"{drive}/status/emcy_code"] != 0
    assert decoded["messages"]["SYNC"]["sender"] == ["DRIVEBRIDGE"]
