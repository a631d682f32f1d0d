"""The asyncio shell around simulated nodes, on a bus without hardware."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import pytest

from bridge.base.errors import Unavailable
from bridge.can.interface import BusStatus
from bridge.canopen.frame import Frame
from bridge.sim.nord.nord_tu4 import NordTu4
from bridge.sim.runner import Simulation


class Wire:
    """A bus end that a test holds the other end of."""

    name = "wire"

    def __init__(self, *, broken: bool = False) -> None:
        self.status = BusStatus()
        self.sent: list[Frame] = []
        self.deadlines: list[float] = []
        self.closed = False
        self._broken = broken
        self._arrived: list[Frame] = []
        self._wake: Callable[[], None] = lambda: None
        self._expected: list[tuple[int, asyncio.Event]] = []

    def open(self, wake: Callable[[], None]) -> None:
        if self._broken:
            raise Unavailable("wire: no such interface")
        self._wake = wake

    def arrive(self, can_id: int, data: bytes, time: float) -> None:
        self._arrived.append(Frame(can_id, data, time))
        asyncio.get_running_loop().call_soon(self._wake)

    async def expect(self, can_id: int) -> Frame:
        """The next frame with this identifier."""
        seen = asyncio.Event()
        self._expected.append((can_id, seen))
        await asyncio.wait_for(seen.wait(), 5)
        return next(frame for frame in reversed(self.sent) if frame.can_id == can_id)

    def accept(self, can_ids: list[int]) -> None: ...

    def drain(self, now: float) -> list[Frame]:
        arrived, self._arrived = self._arrived, []
        return arrived

    def send(self, frame: Frame, now: float, deadline: float) -> None:
        self.sent.append(frame)
        self.deadlines.append(deadline - now)
        for can_id, seen in self._expected:
            if frame.can_id == can_id:
                seen.set()

    def next_deadline(self) -> float | None:
        return None

    def on_time(self, now: float) -> None: ...

    def close(self) -> None:
        self.closed = True


async def test_several_nodes_live_on_one_bus_and_keep_time():
    wire = Wire()
    simulation = Simulation(wire, [NordTu4(5), NordTu4(6)])
    running = asyncio.create_task(simulation.run())
    await wire.expect(0x706)
    assert [frame.can_id for frame in wire.sent] == [0x705, 0x706]
    now = asyncio.get_running_loop().time()
    wire.arrive(0x606, bytes.fromhex("2B17100014000000"), now)
    await wire.expect(0x586)
    first = asyncio.get_running_loop().time()
    for _ in range(3):
        assert (await wire.expect(0x706)).data == b"\x7f"
    assert asyncio.get_running_loop().time() - first >= 0.055, "three heartbeats of 20 ms"
    assert wire.deadlines == pytest.approx([0.1] * len(wire.deadlines))
    running.cancel()
    with pytest.raises(asyncio.CancelledError):
        await running
    simulation.close()
    assert wire.closed


async def test_what_is_done_to_a_node_shows_after_a_poke():
    wire = Wire()
    node = NordTu4(5)
    simulation = Simulation(wire, [node])
    running = asyncio.create_task(simulation.run())
    await wire.expect(0x705)
    node.fail_drive("fu2", 30)
    simulation.poke()
    assert (await wire.expect(0x085)).data == bytes.fromhex("1023030100000000")
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)


async def test_a_bus_that_cannot_be_opened_says_so():
    with pytest.raises(Unavailable, match="no such interface"):
        await Simulation(Wire(broken=True), [NordTu4(5)]).run()


async def test_a_node_that_fails_ends_the_simulation() -> None:
    wire = Wire()
    node = NordTu4(5)
    simulation = Simulation(wire, [node])
    running = asyncio.create_task(simulation.run())
    await wire.expect(0x705)
    node._injected.append(lambda: 1 // 0)
    simulation.poke()
    with pytest.raises(ZeroDivisionError):
        await asyncio.wait_for(running, 5)


async def test_a_bus_that_wakes_while_a_node_sends_does_not_starve_the_loop() -> None:
    class Eager(Wire):
        def send(self, frame: Frame, now: float, deadline: float) -> None:
            super().send(frame, now, deadline)
            self._wake()

    wire = Eager()
    running = asyncio.create_task(Simulation(wire, [NordTu4(5)]).run())
    await wire.expect(0x705)
    for _ in range(3):
        await asyncio.sleep(0)
    assert [frame.can_id for frame in wire.sent] == [0x705]
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)
