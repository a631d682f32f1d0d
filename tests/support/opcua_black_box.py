"""Black boxes of two drives on a disk, and the methods by which clients read them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from asyncua import ua
from asyncua.server.address_space import AttributeValue

from bridge.image import DataType, Point, Quality
from bridge.northbound.opcua.history.black_box import Column, Trip
from bridge.northbound.opcua.history.black_box_files import BlackBoxFiles
from bridge.northbound.opcua.history.file_transfer import FileTransfer
from bridge.northbound.opcua.history.value_rings import ValueRing
from bridge.northbound.opcua.space.nodes import FileNode

Kind = ua.VariantType
DRIVE = "conveyor/fu1"
NEWEST, SECOND_NEWEST = FileNode(DRIVE, 1), FileNode(DRIVE, 2)
NOON = 1_796_040_000_000_000
DAY = 86_400_000_000


class BlackBoxRig:
    def __init__(self, folder: Path) -> None:
        self.folder = folder
        nodes = [FileNode(drive, number) for drive in (DRIVE, "pump/drive") for number in (1, 2)]
        self.live = {one.id: AttributeValue(ua.DataValue()) for node in nodes for one in node.properties}
        self.files = BlackBoxFiles(folder, (DRIVE, "pump/drive"), 2, self.live)
        self.transfer = FileTransfer(self.files)

    async def write(self, day: int, drive: str = DRIVE) -> None:
        ring = ValueRing(DataType.FLOAT, 10)
        ring.append(NOON + day * DAY, float(day), Quality.GOOD)
        columns = [Column(Point(name="f", data_type=DataType.FLOAT), ring.part(0, 10**18))]
        self.files.write(Trip(drive, NOON + day * DAY, 0.0), columns, 0)
        await self.files.settled()

    def shown(self, name: str, file: FileNode = NEWEST) -> object:
        held = self.live[f"{file.id}/{name}"].value
        return (
            held.Value.Value if held.StatusCode is None or held.StatusCode.is_good() else held.StatusCode.name
        )

    async def call(self, method: str, *given: int, file: FileNode = NEWEST, owner: str = "anna") -> Any:
        """Code of a call that is refused, else what it gives."""
        where = ua.NodeId(getattr(ua.ObjectIds, f"FileType_{method}"))
        arguments = [ua.Variant(one, Kind.UInt32) for one in given]
        result = await self.transfer.call(owner, file, where, arguments)
        if not result.StatusCode.is_good():
            return result.StatusCode.value
        return [one.Value for one in result.OutputArguments]


def names(folder: Path, drive: str = DRIVE) -> list[str]:
    return sorted(path.name for path in (folder / drive).iterdir())
