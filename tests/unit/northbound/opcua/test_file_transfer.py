"""Black boxes on the disk, and the methods by which clients read them; no server."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from asyncua import ua
from asyncua.server.address_space import AttributeValue

from bridge.image import DataType, Point, Quality
from bridge.northbound.opcua import file_transfer
from bridge.northbound.opcua.black_box import Column, Trip
from bridge.northbound.opcua.black_box_files import BlackBoxFiles
from bridge.northbound.opcua.file_transfer import MOST_OPEN, READING, FileTransfer, file_method
from bridge.northbound.opcua.nodes import FileNode
from bridge.northbound.opcua.value_rings import ValueRing

Codes, Ids, Kind = ua.StatusCodes, ua.ObjectIds, ua.VariantType
DRIVE = "conveyor/fu1"
NEWEST, SECOND_NEWEST = FileNode(DRIVE, 1), FileNode(DRIVE, 2)
NOON = 1_796_040_000_000_000
DAY = 86_400_000_000


class Rig:
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
        where = ua.NodeId(getattr(Ids, f"FileType_{method}"))
        arguments = [ua.Variant(one, Kind.UInt32) for one in given]
        result = await self.transfer.call(owner, file, where, arguments)
        if not result.StatusCode.is_good():
            return result.StatusCode.value
        return [one.Value for one in result.OutputArguments]


@pytest.fixture
async def rig(tmp_path: Path) -> Rig:
    made = Rig(tmp_path)
    await made.files.start()
    return made


def open_descriptors() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


def names(folder: Path, drive: str = DRIVE) -> list[str]:
    return sorted(path.name for path in (folder / drive).iterdir())


async def test_a_file_that_is_not_there_yet_is_empty_and_cannot_be_opened(rig: Rig) -> None:
    assert [rig.shown(name) for name in ("Size", "OpenCount", "Writable", "UserWritable", "MimeType")] == [
        0,
        0,
        False,
        False,
        "text/csv",
    ]
    assert rig.shown("TripTime") == "BadNoData"
    assert await rig.call("Open", 1) == Codes.BadNotReadable


async def test_the_newest_is_the_first_and_the_oldest_goes(rig: Rig, tmp_path: Path) -> None:
    for day in (1, 3, 2, 4):
        await rig.write(day)
    await rig.write(9, "pump/drive")
    assert names(tmp_path) == ["2026-12-03T12-00-00.000000Z.csv", "2026-12-04T12-00-00.000000Z.csv"]
    assert f"{rig.shown('TripTime'):%d}" == "04"
    assert f"{rig.shown('TripTime', SECOND_NEWEST):%d}" == "03"
    assert rig.shown("Size") == (tmp_path / DRIVE / names(tmp_path)[1]).stat().st_size


async def test_files_are_found_at_the_next_start(rig: Rig, tmp_path: Path) -> None:
    await rig.write(1)
    await rig.write(2)
    (tmp_path / DRIVE / "notes.csv").write_text("mine")
    (tmp_path / DRIVE / "2026-12-01T12-00-00.000000Z.part").write_text("torn")
    again = Rig(tmp_path)
    await again.files.start()
    for name in ("TripTime", "Size"):
        for file in (NEWEST, SECOND_NEWEST):
            assert again.shown(name, file) == rig.shown(name, file)


async def test_who_watches_is_told(rig: Rig) -> None:
    told: list[object] = []

    async def tell(handle: int, value: ua.DataValue) -> None:
        told.append((handle, value.Value.Value))

    rig.live[f"{NEWEST.id}/Size"].datachange_callbacks[7] = tell
    await rig.write(1)
    await rig.write(2)
    assert told == [(7, rig.shown("Size"))], "once: the second is as long as the first"


async def test_a_disk_that_takes_nothing_is_told_and_hinders_nothing(
    rig: Rig, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "conveyor").write_text("in the way")
    await rig.write(1)
    assert rig.shown("Size") == 0
    assert "cannot be written" in caplog.text


async def test_a_file_is_read_in_pieces_from_where_the_client_is(rig: Rig, tmp_path: Path) -> None:
    await rig.write(1)
    content = (tmp_path / DRIVE / names(tmp_path)[0]).read_bytes()
    (handle,) = await rig.call("Open", 1)
    assert rig.shown("OpenCount") == 1
    assert await rig.call("Read", handle, 5) == [content[:5]]
    assert await rig.call("GetPosition", handle) == [5]
    assert await rig.call("Read", handle, 10_000) == [content[5:]]
    assert await rig.call("Read", handle, 10_000) == [b""]
    assert await rig.call("SetPosition", handle, 2) == []
    assert await rig.call("Read", handle, 3) == [content[2:5]]
    assert await rig.call("SetPosition", handle, 10_000) == []
    assert await rig.call("GetPosition", handle) == [len(content)]
    assert await rig.call("Close", handle) == []
    assert rig.shown("OpenCount") == 0
    assert await rig.call("Read", handle, 1) == Codes.BadInvalidArgument


async def test_one_read_is_bounded(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    await rig.write(1)
    monkeypatch.setattr(file_transfer, "MOST_READ", 4)
    (handle,) = await rig.call("Open", 1)
    (data,) = await rig.call("Read", handle, 1000)
    assert len(data) == 4


async def test_an_open_file_can_be_read_though_it_is_no_longer_kept(rig: Rig) -> None:
    await rig.write(1)
    (handle,) = await rig.call("Open", 1)
    for day in (2, 3, 4):
        await rig.write(day)
    (data,) = await rig.call("Read", handle, 1000)
    assert b"2026-12-01T12:00:00.000Z" in data
    assert rig.shown("OpenCount") == 0, "that is another file"


@pytest.mark.parametrize(
    ("method", "given", "code"),
    [
        ("Open", (0,), Codes.BadInvalidArgument),
        ("Open", (2,), Codes.BadNotWritable),
        ("Open", (3,), Codes.BadNotWritable),
        ("Open", (), Codes.BadArgumentsMissing),
        ("Close", (1, 2), Codes.BadTooManyArguments),
        ("Close", (99,), Codes.BadInvalidArgument),
        ("Read", (99, 1), Codes.BadInvalidArgument),
        ("Write", (1, 1), Codes.BadNotWritable),
        ("SetPosition", (99, 1), Codes.BadInvalidArgument),
        ("GetPosition", (99,), Codes.BadInvalidArgument),
    ],
)
async def test_what_cannot_be_is_refused(rig: Rig, method: str, given: tuple[int, ...], code: int) -> None:
    await rig.write(1)
    assert await rig.call(method, *given) == code


async def test_arguments_of_another_type_are_named(rig: Rig) -> None:
    wrong = [ua.Variant("1", Kind.String)]
    result = await rig.transfer.call("anna", NEWEST, ua.NodeId(Ids.FileType_Open), wrong)
    assert result.StatusCode.value == Codes.BadInvalidArgument
    assert [one.value for one in result.InputArgumentResults] == [Codes.BadTypeMismatch]


async def test_a_handle_is_its_session_s_and_its_file_s(rig: Rig) -> None:
    await rig.write(1)
    await rig.write(2)
    (handle,) = await rig.call("Open", 1)
    assert await rig.call("Read", handle, 1, owner="otto") == Codes.BadInvalidArgument
    assert await rig.call("Read", handle, 1, file=SECOND_NEWEST) == Codes.BadInvalidArgument
    assert await rig.call("Read", handle, 0) == Codes.BadInvalidArgument


async def test_open_files_are_bounded_and_end_with_their_session(rig: Rig) -> None:
    await rig.write(1)
    before = open_descriptors()
    found = [await rig.call("Open", 1) for _ in range(MOST_OPEN + 1)]
    assert found[-1] == Codes.BadTooManyOperations
    assert await rig.call("Open", 1, owner="otto") != Codes.BadTooManyOperations
    assert rig.shown("OpenCount") == MOST_OPEN + 1
    rig.transfer.leave("anna")
    await rig.transfer.settled()
    assert rig.shown("OpenCount") == 1
    rig.transfer.leave("otto")
    await rig.transfer.settled()
    assert open_descriptors() == before


async def test_open_files_of_all_are_bounded(rig: Rig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(file_transfer, "MOST_OPEN_IN_ALL", 2)
    await rig.write(1)
    codes = [await rig.call("Open", 1, owner=str(number)) for number in range(3)]
    assert codes[2] == Codes.BadTooManyOperations


def test_reading_changes_nothing() -> None:
    names_ = {"Open", "Close", "Read", "GetPosition", "SetPosition"}
    assert {ua.NodeId(getattr(Ids, f"FileType_{name}")) for name in names_} == READING
    assert file_method(ua.CallMethodRequest(MethodId=ua.NodeId("conveyor/fu1/Start", 2))) is None
