"""A CAN bus in memory."""

from __future__ import annotations

import asyncio

from bridge.can.virtual import VirtualWire
from bridge.canopen.frame import Frame


async def test_an_end_is_woken_once_for_frames_that_wait_and_not_for_those_it_has_fetched() -> None:
    wire = VirtualWire()
    sender, end = wire.end("sender"), wire.end("end")
    woken: list[None] = []
    sender.open(lambda: None)
    end.open(lambda: woken.append(None))
    now = asyncio.get_running_loop().time()
    for can_id in (0x205, 0x206):
        sender.send(Frame(can_id), now, now)
    await asyncio.sleep(0)
    assert len(woken) == 1
    assert [frame.can_id for frame in end.drain(now)] == [0x205, 0x206]
    sender.send(Frame(0x205), now, now)
    assert len(end.drain(now)) == 1
    await asyncio.sleep(0)
    assert len(woken) == 1
    sender.send(Frame(0x205), now, now)
    await asyncio.sleep(0)
    assert len(woken) == 2


async def test_an_end_is_woken_for_a_frame_with_an_identifier_of_its_own() -> None:
    wire = VirtualWire()
    sender, end = wire.end("sender"), wire.end("end")
    woken: list[None] = []
    sender.open(lambda: None)
    end.open(lambda: woken.append(None))
    end.accept([])
    end.watch(frozenset({0x205}))
    now = asyncio.get_running_loop().time()
    sender.send(Frame(0x205), now, now)
    await asyncio.sleep(0)
    assert len(woken) == 1
    assert [frame.can_id for frame in end.take_foreign(now)] == [0x205]
