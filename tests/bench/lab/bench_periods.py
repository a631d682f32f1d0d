"""How even the SYNC of several senders is while the whole bridge works, by the kernel's time stamps.

All send every 10 ms at the same time: the kernel's bursts as ours renews them, canopen's SyncProducer (on
SocketCAN the same facility of the kernel, without an end), python-can's own thread, an asyncio task and a
timerfd in the event loop of the bridge.
"""

from __future__ import annotations

import asyncio
import contextlib
import statistics
import struct
import threading
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager
from itertools import pairwise
from pathlib import Path

import can
import canopen
from can.broadcastmanager import ThreadBasedCyclicSendTask

from bridge.can.socketcan import SocketCanBus
from bridge.master.timer import LoopTimer
from tests.bench.crowd import crowd
from tests.bench.figures import as_the_service, record, show
from tests.peers.can_end import FRAME, can_end

PERIOD_S = 0.01
MEASURED_S = 10.0
NODES = 16
SENDERS = {
    0x080: "kernel, as the bridge uses it",
    0x7E1: "kernel, canopen's SyncProducer",
    0x7E2: "python-can's thread",
    0x7E3: "an asyncio task of the bridge's loop",
    0x7E4: "a timerfd of the bridge's loop",
}
_SCM_TIMESTAMPNS = 35


@contextlib.contextmanager
def canopens_sync(channel: str) -> Iterator[None]:
    network = canopen.Network()
    network.connect(interface="socketcan", channel=channel)
    try:
        network.sync.cob_id = 0x7E1
        network.sync.start(PERIOD_S)
        yield
        network.sync.stop()
    finally:
        network.disconnect()


@contextlib.contextmanager
def a_thread(channel: str) -> Iterator[None]:
    with can.Bus(interface="socketcan", channel=channel) as bus:
        message = can.Message(arbitration_id=0x7E2, is_extended_id=False)
        task = ThreadBasedCyclicSendTask(bus, threading.Lock(), [message], PERIOD_S)
        yield
        task.stop()


@asynccontextmanager
async def in_the_loop(send: Callable[[int], None]) -> AsyncIterator[None]:
    loop = asyncio.get_running_loop()

    async def asleep() -> None:
        at = loop.time()
        while True:
            send(0x7E3)
            at += PERIOD_S
            await asyncio.sleep(max(0.0, at - loop.time()))

    task, at = asyncio.create_task(asleep()), loop.time()

    def on_timer() -> None:
        nonlocal at
        send(0x7E4)
        at = max(at + PERIOD_S, loop.time())
        timer.arm(at)

    timer = LoopTimer(loop, time.monotonic, on_timer)
    timer.arm(at)
    try:
        yield
    finally:
        timer.close()
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)


def stamps(channel: str, until: float) -> dict[int, list[float]]:
    """When each of ``SENDERS`` sent, in s since 1970."""
    seen: dict[int, list[float]] = {can_id: [] for can_id in SENDERS}
    with can_end(channel, (0x080, 0xC00007FF), (0x7E0, 0xC00007F8)) as end:
        end.settimeout(0.1)
        while time.monotonic() < until:
            with contextlib.suppress(TimeoutError):
                raw, ancillary, _, _ = end.recvmsg(FRAME.size, 64)
                can_id = FRAME.unpack(raw)[0]
                for _, kind, data in ancillary:
                    if kind == _SCM_TIMESTAMPNS and can_id in seen:
                        seconds, nanoseconds = struct.unpack("@qq", data)
                        seen[can_id].append(seconds + nanoseconds / 1e9)
    return seen


async def test_the_period_of_sync(tmp_path: Path) -> None:
    bus = SocketCanBus("can0", "vcan0")
    keys = "bitrate = 1000000\nsync_period_ms = 10\nrpdo_period_ms = 20"
    with as_the_service(), can_end("vcan0") as end:

        def send(can_id: int) -> None:
            end.send(FRAME.pack(can_id, 0, bytes(8)))

        async with crowd(tmp_path, NODES, bus, "vcan0", keys), in_the_loop(send):
            with canopens_sync("vcan0"), a_thread("vcan0"):
                seen = await asyncio.to_thread(stamps, "vcan0", time.monotonic() + MEASURED_S)
    for can_id, name in SENDERS.items():
        errors_us = sorted(abs(b - a - PERIOD_S) * 1e6 for a, b in pairwise(seen[can_id]))
        assert len(errors_us) > 0.5 * MEASURED_S / PERIOD_S, f"{name}: {len(errors_us)} SYNCs"
        p99 = errors_us[len(errors_us) * 99 // 100]
        record(f"SYNC error p99, {name}, µs", p99)
        show(
            f"SYNC every 10 ms, {NODES} nodes, {name}",
            f"period error: median {statistics.median(errors_us):.0f} µs   99 % {p99:.0f} µs   "
            f"most {errors_us[-1]:.0f} µs",
        )
