"""The wiretap: frames of a bus for other processes, its socket, and readers that are too many."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from bridge.base.errors import Unavailable
from bridge.can.listener import RECORD
from bridge.can.virtual import VirtualWire
from bridge.can.wiretap import Wiretap
from bridge.canopen.frame import Frame


class Case:
    def __init__(self, path: Path) -> None:
        self.path = path
        self.bus = VirtualWire().end("ours")
        self.bus.open(lambda: None)
        self.tap = Wiretap(self.bus, path)

    async def reader(self) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
        return await asyncio.open_unix_connection(self.path)


@pytest.fixture
async def case(tmp_path: Path):
    case = Case(tmp_path / "tap")
    await case.tap.start()
    yield case
    await case.tap.close()


async def test_who_reads_gets_each_frame_with_its_time(case: Case) -> None:
    incoming, outgoing = await case.reader()
    async with asyncio.timeout(5):
        while case.bus._overheard is None:  # noqa: ASYNC110 - the tap tells nobody
            await asyncio.sleep(0)
        case.bus.send(Frame(0x205, b"\1\2"), 10.5, 11.0)
        record = await incoming.readexactly(RECORD.size)
    at, can_id, length, data = RECORD.unpack(record)
    assert (can_id, data[:length]) == (0x205, b"\1\2")
    assert at == 10.5
    outgoing.close()


async def test_its_socket_is_ours_alone_and_gone_at_the_end(case: Case) -> None:
    assert case.path.stat().st_mode & 0o777 == 0o600
    await case.tap.close()
    assert not case.path.exists()


async def test_while_nobody_reads_nothing_is_kept(case: Case) -> None:
    case.bus.send(Frame(0x205), 10.5, 11.0)
    assert case.bus.take_overheard() == []


async def test_one_reader_too_many_is_turned_away(case: Case) -> None:
    async with asyncio.timeout(5):
        readers = [await case.reader() for _ in range(16)]
        while len(case.tap._readers) < 16:  # noqa: ASYNC110 - the tap tells nobody
            await asyncio.sleep(0)
        incoming, outgoing = await case.reader()
        assert await incoming.read() == b""
    for _, writer in (*readers, (incoming, outgoing)):
        writer.close()


async def test_a_path_that_cannot_be_one_is_told(tmp_path: Path) -> None:
    bus = VirtualWire().end("ours")
    with pytest.raises(Unavailable, match="nowhere"):
        await Wiretap(bus, tmp_path / "nowhere" / "tap").start()
