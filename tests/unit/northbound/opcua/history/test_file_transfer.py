"""The methods by which clients read the files of black boxes; no server."""

from __future__ import annotations

from pathlib import Path

import pytest
from asyncua import ua

from bridge.northbound.opcua.history import file_transfer
from bridge.northbound.opcua.history.file_transfer import MOST_OPEN, READING, file_method
from tests.support.opcua_black_box import DRIVE, NEWEST, SECOND_NEWEST, BlackBoxRig, Kind, names

Codes, Ids = ua.StatusCodes, ua.ObjectIds


@pytest.fixture
async def rig(tmp_path: Path) -> BlackBoxRig:
    made = BlackBoxRig(tmp_path)
    await made.files.start()
    return made


def open_descriptors() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))


async def test_a_file_that_is_not_there_yet_is_empty_and_cannot_be_opened(rig: BlackBoxRig) -> None:
    assert [rig.shown(name) for name in ("Size", "OpenCount", "Writable", "UserWritable", "MimeType")] == [
        0,
        0,
        False,
        False,
        "text/csv",
    ]
    assert rig.shown("TripTime") == "BadNoData"
    assert await rig.call("Open", 1) == Codes.BadNotReadable


async def test_a_file_is_read_in_pieces_from_where_the_client_is(rig: BlackBoxRig, tmp_path: Path) -> None:
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


async def test_one_read_is_bounded(rig: BlackBoxRig, monkeypatch: pytest.MonkeyPatch) -> None:
    await rig.write(1)
    monkeypatch.setattr(file_transfer, "MOST_READ", 4)
    (handle,) = await rig.call("Open", 1)
    (data,) = await rig.call("Read", handle, 1000)
    assert len(data) == 4


async def test_an_open_file_can_be_read_though_it_is_no_longer_kept(rig: BlackBoxRig) -> None:
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
async def test_what_cannot_be_is_refused(
    rig: BlackBoxRig, method: str, given: tuple[int, ...], code: int
) -> None:
    await rig.write(1)
    assert await rig.call(method, *given) == code


async def test_arguments_of_another_type_are_named(rig: BlackBoxRig) -> None:
    wrong = [ua.Variant("1", Kind.String)]
    result = await rig.transfer.call("anna", NEWEST, ua.NodeId(Ids.FileType_Open), wrong)
    assert result.StatusCode.value == Codes.BadInvalidArgument
    assert [one.value for one in result.InputArgumentResults] == [Codes.BadTypeMismatch]


async def test_a_handle_is_its_session_s_and_its_file_s(rig: BlackBoxRig) -> None:
    await rig.write(1)
    await rig.write(2)
    (handle,) = await rig.call("Open", 1)
    assert await rig.call("Read", handle, 1, owner="otto") == Codes.BadInvalidArgument
    assert await rig.call("Read", handle, 1, file=SECOND_NEWEST) == Codes.BadInvalidArgument
    assert await rig.call("Read", handle, 0) == Codes.BadInvalidArgument


async def test_open_files_are_bounded_and_end_with_their_session(rig: BlackBoxRig) -> None:
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


async def test_open_files_of_all_are_bounded(rig: BlackBoxRig, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(file_transfer, "MOST_OPEN_IN_ALL", 2)
    await rig.write(1)
    codes = [await rig.call("Open", 1, owner=str(number)) for number in range(3)]
    assert codes[2] == Codes.BadTooManyOperations


def test_reading_changes_nothing() -> None:
    names_ = {"Open", "Close", "Read", "GetPosition", "SetPosition"}
    assert {ua.NodeId(getattr(Ids, f"FileType_{name}")) for name in names_} == READING
    assert file_method(ua.CallMethodRequest(MethodId=ua.NodeId("conveyor/fu1/Start", 2))) is None
