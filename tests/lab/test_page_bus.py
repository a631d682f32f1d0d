"""The page's front listens to a real SocketCAN bus by a socket of its own."""

from __future__ import annotations

import asyncio
import io
import socket
import struct
from pathlib import Path

import can

from bridge.can.listener import SocketCanListener
from bridge.canopen.frame import REMOTE, Frame
from bridge.project import load_project
from bridge.service.page.buses import Buses
from tests.support import sites

_CAN_FRAME = struct.Struct("=IB3x8s")


def send(*frames: Frame) -> None:
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as sender:
        sender.bind(("vcan0",))
        for frame in frames:
            sender.send(_CAN_FRAME.pack(frame.can_id, len(frame.data), frame.data))


async def until_heard(listener: SocketCanListener, count: int) -> list[Frame]:
    frames: list[Frame] = []
    for _ in range(500):
        frames += listener.take()
        if len(frames) >= count:
            return frames
        await asyncio.sleep(0.01)
    raise AssertionError(f"only {len(frames)} frames came")


async def test_all_that_passes_is_heard_with_its_time() -> None:
    loop = asyncio.get_running_loop()
    listener = SocketCanListener("vcan0")
    listener.open()
    before = loop.time()
    send(Frame(0x205, b"\x7f\x04"), Frame(0x705 | REMOTE), *(Frame(n & 0x7FF, bytes(8)) for n in range(300)))
    frames = await until_heard(listener, 302)
    assert [(one.can_id, one.data) for one in frames[:2]] == [(0x205, b"\x7f\x04"), (0x705 | REMOTE, b"")]
    assert listener.lost == 0
    assert all(before - 0.1 <= one.time <= loop.time() for one in frames)
    listener.close()


async def test_frames_that_the_kernel_drops_are_counted() -> None:
    listener = SocketCanListener("vcan0")
    listener.open()
    for _ in range(20):  # nobody reads meanwhile: the loop stands still
        send(*(Frame(n & 0x7FF, bytes(8)) for n in range(1000)))
    got = 0
    for _ in range(500):
        await asyncio.sleep(0.01)
        got += len(listener.take())
        send(Frame(0x7FF))
        if listener.lost and got + listener.lost >= 20_000:
            break
    assert listener.lost > 0
    assert got + listener.lost >= 20_000
    listener.close()


async def waits() -> bool:
    return False


async def test_a_capture_of_the_page_is_read_by_python_can(tmp_path: Path) -> None:
    path = sites.write(tmp_path, sites.socketcan(sites.node(sites.drive("fu1", "lease", 1000))))
    buses = Buses(load_project(path), lambda at: round(at * 1e9))
    capturing = asyncio.create_task(buses.capture("can0", 1.0, "candump", waits))
    await asyncio.sleep(0.3)
    send(Frame(0x205, bytes(8)), Frame(0x80))
    text = (await capturing).content.decode()
    assert [one.arbitration_id for one in can.CanutilsLogReader(io.StringIO(text))] == [0x205, 0x80]
    ((_, _, tap),) = buses.taps()
    tap.open()
    send(Frame(0x205, bytes.fromhex("7f04004000000000")))
    await asyncio.sleep(0.1)
    (heard,) = tap.take()
    assert (heard.identifier, heard.label) == ("205", "RPDO1 conveyor/fu1")
    assert "control_word 047Fh" in heard.text
    tap.close()
