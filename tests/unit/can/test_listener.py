"""Listening to a whole bus beside who drives it: over a wiretap's socket, in one process here."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Callable
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from bridge.base.errors import Unavailable
from bridge.can.listener import LOST, RECORD, SocketCanListener, TapListener, listener_of
from bridge.can.virtual import VirtualBus, VirtualWire
from bridge.can.wiretap import Wiretap
from bridge.canopen.frame import REMOTE, Frame


@asynccontextmanager
async def tapped(path: Path) -> AsyncGenerator[tuple[VirtualBus, VirtualBus]]:
    """The bridge's end of a wire, which has a wiretap, and a drive's."""
    wire = VirtualWire()
    ours, theirs = wire.end("ours"), wire.end("theirs")
    ours.open(lambda: None)
    theirs.open(lambda: None)
    tap = Wiretap(ours, path)
    await tap.start()
    try:
        yield ours, theirs
    finally:
        await tap.close()


async def until(is_true: Callable[[], bool]) -> None:
    for _ in range(1000):
        if is_true():
            return
        await asyncio.sleep(0.005)
    raise AssertionError("it did not happen")


async def heard(listener: TapListener, count: int) -> list[Frame]:
    frames: list[Frame] = []

    def is_enough() -> bool:
        frames.extend(listener.take())
        return len(frames) >= count

    await until(is_enough)
    return frames


async def listening(path: Path, bus: VirtualBus) -> TapListener:
    listener = TapListener(path)
    listener.open()
    await until(lambda: bus._overheard is not None)
    return listener


async def test_a_listener_hears_our_frames_and_the_drives_with_their_times(tmp_path: Path) -> None:
    path = tmp_path / "tap"
    async with tapped(path) as (ours, theirs):
        assert ours.take_overheard() == [], "nothing is kept while nobody listens"
        listener = await listening(path, ours)
        now = asyncio.get_running_loop().time()
        ours.send(Frame(0x205, b"\x7f\x04"), now, now)
        theirs.send(Frame(0x185, bytes(8)), now + 0.001, now)
        theirs.send(Frame(0x705 | REMOTE), now + 0.002, now)
        frames = await heard(listener, 3)
        assert [(frame.can_id, frame.data) for frame in frames] == [
            (0x205, b"\x7f\x04"),
            (0x185, bytes(8)),
            (0x705 | REMOTE, b""),
        ]
        assert [frame.time for frame in frames] == pytest.approx([now, now + 0.001, now + 0.002])
        listener.close()
        listener.close()
        await until(lambda: ours._overheard is None)


async def test_two_listeners_hear_the_same_and_one_that_goes_costs_the_other_nothing(tmp_path: Path) -> None:
    path = tmp_path / "tap"
    async with tapped(path) as (ours, _):
        one, other = await listening(path, ours), await listening(path, ours)
        await asyncio.sleep(0.05)
        ours.send(Frame(0x80), 1.0, 1.0)
        assert len(await heard(one, 1)) == len(await heard(other, 1)) == 1
        one.close()
        await asyncio.sleep(0.05)
        ours.send(Frame(0x80), 2.0, 2.0)
        assert len(await heard(other, 1)) == 1
        other.close()


async def test_a_listener_is_told_that_the_bus_process_has_ended(tmp_path: Path) -> None:
    path = tmp_path / "tap"
    async with tapped(path) as (ours, _):
        listener = await listening(path, ours)
    await until(lambda: bool(listener.failure))
    assert str(listener.failure) == "the process that has the bus has ended"
    listener.close()


async def raw_tap(path: Path, data: bytes) -> asyncio.Server:
    """A wiretap that sends just this, and in pieces."""

    async def serve(_: asyncio.StreamReader, out: asyncio.StreamWriter) -> None:
        for at in range(0, len(data), 7):
            out.write(data[at : at + 7])
            await out.drain()
            await asyncio.sleep(0)
        out.close()

    return await asyncio.start_unix_server(serve, path)


async def test_frames_that_come_in_pieces_are_put_together_and_losses_are_counted(tmp_path: Path) -> None:
    records = [RECORD.pack(1.5, 0x185, 3, b"abc"), RECORD.pack(12.0, LOST, 0, b""), RECORD.pack(2, 1, 0, b"")]
    server = await raw_tap(tmp_path / "tap", b"".join(records))
    listener = TapListener(tmp_path / "tap")
    listener.open()
    assert await heard(listener, 2) == [Frame(0x185, b"abc", 1.5), Frame(1, b"", 2.0)]
    assert listener.lost == 12
    listener.close()
    server.close()


async def test_what_is_not_taken_is_lost_and_counted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bridge.can.listener._MOST_WAITING", 2)
    server = await raw_tap(tmp_path / "tap", RECORD.pack(1.0, 5, 0, b"") * 5)
    listener = TapListener(tmp_path / "tap")
    listener.open()
    await until(lambda: listener.lost == 3)
    assert len(listener.take()) == 2
    listener.close()
    server.close()


async def test_a_reader_that_is_too_slow_is_told_how_many_it_has_lost(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("bridge.can.wiretap._MOST_BYTES", -1)
    path = tmp_path / "tap"
    async with tapped(path) as (ours, _):
        listener = await listening(path, ours)
        ours.send(Frame(0x80), 1.0, 1.0)
        await until(lambda: not ours._overheard)
        monkeypatch.setattr("bridge.can.wiretap._MOST_BYTES", 1 << 20)
        await until(lambda: listener.lost == 1)
        assert listener.take() == []
        listener.close()


async def test_what_cannot_be_listened_to_says_so(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="No such file"):
        listener_of("virtual", "", tmp_path / "nobody").open()
    assert isinstance(listener_of("socketcan", "can0", tmp_path), SocketCanListener)
    with pytest.raises(Unavailable, match="too long"):
        await Wiretap(VirtualWire().end("can0"), tmp_path / ("long" * 60)).start()


def test_an_end_keeps_no_more_than_it_has_room_for() -> None:
    wire = VirtualWire()
    end = wire.end("ours")
    end.overhear(is_on=True)
    for number in range(20_000):
        end.pass_by(Frame(number & 0x7FF), 0.0)
    assert len(end.take_overheard()) == 1 << 14
