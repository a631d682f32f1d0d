"""History of the plant: what comes from it, and what is written of a trip; no server."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

from asyncua import ua
from asyncua.server.address_space import AttributeValue

from bridge.command import Event, EventKind
from bridge.config import OpcUaHistoryTable
from bridge.image import DataType, Image, Point
from bridge.northbound.opcua.history.plant_history import PlantHistory
from bridge.northbound.opcua.history.value_rings import ValueRings
from bridge.northbound.opcua.space.nodes import FileNode
from tests.support.opcua_history import times_of

SECOND = 1_000_000
DRIVE = "conveyor/fu1"
NAMES = (f"{DRIVE}/actual/current", f"{DRIVE}/actual/frequency", "pump/drive/actual/current")


def epoch_ns(at: float) -> int:
    return round(at * 1e9)


class Tree:
    """In place of the server's: a NodeId is the name of a point."""

    def __init__(self, image: Image) -> None:
        files = [FileNode(drive, 1) for drive in self.drives]
        self.image = image
        self.live = {one.id: AttributeValue(ua.DataValue()) for node in files for one in node.properties}

    drives = (DRIVE, "pump/drive")

    def point(self, where: ua.NodeId) -> int | None:
        return self.image.index.get(str(where.Identifier))


class Rig:
    def __init__(self, folder: Path, **settings: Any) -> None:
        table = OpcUaHistoryTable(points=["*/*/actual/current"], black_boxes=1, before_s=5, **settings)
        self.folder = folder
        self.image = Image([Point(name=name, data_type=DataType.FLOAT) for name in NAMES])
        tree: Any = Tree(self.image)
        rings = ValueRings(self.image, epoch_ns, table)
        self.history = PlantHistory(table, self.image, epoch_ns, tree, rings, None, folder)

    def load(self, at: float, amperes: float) -> None:
        for place in range(len(NAMES)):
            self.image.set(place, amperes, at)
        self.history.record(range(len(NAMES)))

    def trip(self, at: float, drive: str = DRIVE) -> None:
        self.history.on_event(Event(at, EventKind.WATCHDOG, drive, 900, ""))

    def files(self) -> list[Path]:
        return list(self.folder.rglob("*.csv"))

    def rows(self) -> list[dict[str, str]]:
        (path,) = self.files()
        return list(csv.DictReader(path.read_text("utf-8-sig").splitlines()))


async def test_values_of_chosen_points_are_found_by_their_node_ids(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    for at in (1.0, 2.0):
        rig.load(at, at)
    kept = rig.history.value_history(ua.NodeId(NAMES[0], 2))
    assert kept is not None
    assert times_of(kept) == [SECOND, 2 * SECOND]
    assert rig.history.value_history(ua.NodeId(NAMES[1], 2)) is None
    assert rig.history.value_history(ua.NodeId("conveyor", 2)) is None
    assert rig.history.event_history(ua.NodeId("conveyor", 2)) is None, "none are kept"


async def test_a_trip_is_written_when_its_time_has_come(tmp_path: Path) -> None:
    rig = Rig(tmp_path, after_s=0)
    for at in (1.0, 7.0, 9.0, 11.0):
        rig.load(at, at)
    rig.trip(10.0)
    rig.history.look()
    await rig.history.files.settled()
    told = [(row["seconds_from_trip"], row[NAMES[0]]) for row in rig.rows()]
    assert told == [("-5.000", "1.0"), ("-3.000", "7.0"), ("-1.000", "9.0")]
    assert not any("pump" in name for name in rig.rows()[0])


async def test_trips_of_many_drives_are_written_one_after_the_other(tmp_path: Path) -> None:
    rig = Rig(tmp_path, after_s=0)
    rig.load(9.0, 9.0)
    for drive in (DRIVE, "pump/drive"):
        rig.trip(10.0, drive)
    for _ in range(5):
        rig.history.look()
    await rig.history.files.settled()
    assert [path.parent.parent.name for path in rig.files()] == ["conveyor"]
    rig.history.look()
    await rig.history.files.settled()
    assert len(rig.files()) == 2


async def test_a_trip_that_waits_is_written_at_the_end(tmp_path: Path) -> None:
    rig = Rig(tmp_path, after_s=600)
    rig.load(9.0, 9.0)
    rig.trip(10.0)
    rig.load(11.0, 11.0)
    rig.history.look()
    await rig.history.files.settled()
    assert not rig.files()
    await rig.history.close()
    assert [row[NAMES[0]] for row in rig.rows()] == ["9.0", "11.0"]
