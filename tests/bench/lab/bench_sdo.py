"""Expedited SDO reads per second on real SocketCAN: ours beside canopen's, against one slave process."""

from __future__ import annotations

import asyncio
import time
from pathlib import Path

import canopen

from bridge.southbound.bus.socketcan import SocketCanBus
from bridge.southbound.canopen.sdo import Priority, Result, SdoChannel
from tests.bench.figures import show
from tests.support.process import peer

NODE = 5
READS = 1000
ANSWER = b"\x2a\0\0\0"


class Reader:
    """A channel on a bus, pumped as the master does it: drain, tell, send."""

    def __init__(self) -> None:
        self.bus = SocketCanBus("can0", "vcan0")
        self.channel = SdoChannel(0x600 + NODE, 0x580 + NODE, 1.0)
        self.done = asyncio.Event()
        self.left = READS
        self.now = 0.0

    async def run(self) -> float:
        self.bus.open(self.pump)
        self.bus.accept([self.channel.reply_id])
        begin = self.now = time.monotonic()
        self.ask()
        self.send()
        await self.done.wait()
        seconds = time.monotonic() - begin
        self.bus.close()
        return READS / seconds

    def ask(self) -> None:
        self.channel.read(0x2000, 1, self.now, self.answered, priority=Priority.POLL)

    def answered(self, result: Result) -> None:
        assert result == ANSWER
        self.left -= 1
        if self.left:
            self.ask()
        else:
            self.done.set()

    def pump(self) -> None:
        self.now = time.monotonic()
        for frame in self.bus.drain(self.now):
            self.channel.on_frame(frame)
        self.channel.on_time(self.now)
        self.send()

    def send(self) -> None:
        for frame in self.channel.take_frames():
            self.bus.send(frame, self.now, self.now + 0.1)


async def ours() -> float:
    return await Reader().run()


def theirs() -> float:
    network = canopen.Network()
    network.connect(interface="socketcan", channel="vcan0")
    try:
        node = network.add_node(NODE, canopen.ObjectDictionary())
        begin = time.monotonic()
        for _ in range(READS):
            assert node.sdo.upload(0x2000, 1) == ANSWER
        return READS / (time.monotonic() - begin)
    finally:
        network.disconnect()


def test_expedited_reads(tmp_path: Path) -> None:
    with peer(tmp_path, "sdo_slave", "vcan0", str(NODE)) as slave:
        slave.wait_output("is there")
        rounds = [(asyncio.run(ours()), theirs()) for _ in range(3)]
    our_best = max(our for our, _ in rounds)
    their_best = max(their for _, their in rounds)
    show("expedited reads per second, ours", f"{our_best:6.0f}")
    show("expedited reads per second, canopen's blocking client", f"{their_best:6.0f}")
    show("ours : canopen's", f"{our_best / their_best:6.2f}")
    assert our_best >= 2 * their_best
