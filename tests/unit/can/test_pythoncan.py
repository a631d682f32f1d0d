"""A python-can adapter that is unplugged and plugged in again, and what is counted meanwhile."""

from __future__ import annotations

import asyncio
import queue
import time
from collections.abc import Callable, Generator
from contextlib import contextmanager

import can
import pytest

from bridge.can import pythoncan
from bridge.can.interface import ControllerState
from bridge.can.pythoncan import PythonCanBus
from bridge.canopen.frame import Frame


class Adapter:
    """An adapter behind ``can.Bus``: while it is unplugged, everything about it fails.

    It is used by the bus's threads. ``until`` waits for what they do: each of their calls, and each time
    that the bus wakes its owner, is a moment to look again.
    """

    def __init__(self) -> None:
        self.opened = 0
        self.sent: list[can.Message] = []
        self._unplugged = False
        self._incoming: queue.Queue[can.Message | None] = queue.Queue()
        self._loop = asyncio.get_running_loop()
        self._something = asyncio.Event()

    def happened(self) -> None:
        self._loop.call_soon_threadsafe(self._something.set)

    async def until(self, condition: Callable[[], bool]) -> None:
        async with asyncio.timeout(5):
            while not condition():
                await self._something.wait()
                self._something.clear()

    def comes(self, message: can.Message) -> None:
        self._incoming.put(message)

    def unplug(self) -> None:
        self._unplugged = True
        self._incoming.put(None)  # whoever waits for a frame learns of it

    def plug_in(self) -> None:
        self._unplugged = False

    def _fail(self) -> None:
        if self._unplugged:
            raise can.CanOperationError("no such device")

    # what python-can has

    def __call__(self, **options: object) -> Adapter:
        self._fail()
        self.opened += 1
        return self

    def recv(self, timeout: float) -> can.Message | None:
        self.happened()
        self._fail()
        try:
            message = self._incoming.get(timeout=timeout)
        except queue.Empty:
            message = None
        self._fail()
        return message

    def send(self, message: can.Message, timeout: float) -> None:
        self._fail()
        self.sent.append(message)
        self.happened()

    def shutdown(self) -> None:
        self._fail()


@pytest.fixture
async def adapter(monkeypatch: pytest.MonkeyPatch) -> Adapter:
    adapter = Adapter()
    monkeypatch.setattr(pythoncan.can, "Bus", adapter)
    return adapter


@contextmanager
def opened(adapter: Adapter, interface: str = "pcan") -> Generator[PythonCanBus]:
    bus = PythonCanBus("can0", interface, "channel", 250_000)
    bus.open(adapter.happened)
    try:
        yield bus
    finally:
        bus.close()


async def test_an_adapter_that_is_unplugged_is_opened_anew(adapter: Adapter) -> None:
    with opened(adapter) as bus:
        adapter.unplug()
        await adapter.until(lambda: bus.status.state is ControllerState.DOWN)
        assert "no such device" in str(bus.status.last_error)
        now = time.monotonic()
        bus.send(Frame(0x605, b"stale"), now, now + 60)
        adapter.plug_in()
        await adapter.until(lambda: bus.status.state is ControllerState.OK)
        assert adapter.opened == 2
        bus.send(Frame(0x605, b"fresh"), now, now + 60)
        adapter.comes(can.Message(arbitration_id=0x185, data=b"x", is_extended_id=False))
        frames: list[Frame] = []

        def both_ways() -> bool:
            frames.extend(bus.drain(time.monotonic()))
            return bool(frames and adapter.sent)

        await adapter.until(both_ways)
        assert frames[0].can_id == 0x185
        assert [bytes(message.data) for message in adapter.sent] == [b"fresh"]
        assert bus.status.frames_expired == 1
        # The sending thread counts after it has sent.
        await adapter.until(lambda: bus.status.bits > 100)


async def test_error_frames_are_counted_and_put_into_words(adapter: Adapter) -> None:
    with opened(adapter) as bus:
        adapter.comes(can.Message(arbitration_id=0x20, data=bytes(8), is_error_frame=True))
        await adapter.until(lambda: bus.status.error_frames == 1)
        await adapter.until(lambda: str(bus.status.last_error).startswith("no acknowledge"))
        assert not bus.drain(time.monotonic())


HEARTBEAT = 0x77F
"""Heartbeat identifier of the bridge: nobody else sends it."""


def message(data: bytes, *, is_rx: bool = True, is_fd: bool = False) -> can.Message:
    return can.Message(
        arbitration_id=HEARTBEAT, data=data, is_extended_id=False, is_rx=is_rx, is_fd=is_fd, check=True
    )


async def heard(
    adapter: Adapter, bus: PythonCanBus, *messages: can.Message
) -> tuple[list[bytes], list[bytes]]:
    """Result of these messages after the bus has sent its own heartbeat: foreign frames on identifiers that
    are ours alone, and received frames."""
    bus.watch(frozenset({HEARTBEAT}))
    now = time.monotonic()
    bus.send(Frame(HEARTBEAT, b"\x05"), now, now + 60)
    await adapter.until(lambda: bool(adapter.sent))
    for one in messages:
        adapter.comes(one)
    adapter.comes(can.Message(arbitration_id=0x701, data=b"\x7f", is_extended_id=False))
    frames: list[Frame] = []

    def all_came() -> bool:
        frames.extend(bus.drain(time.monotonic()))
        return any(frame.can_id == 0x701 for frame in frames)

    await adapter.until(all_came)
    foreign = bus.take_foreign(time.monotonic())
    return [frame.data for frame in foreign], [frame.data for frame in frames if frame.can_id == HEARTBEAT]


@pytest.mark.parametrize("interface", ["pcan", "gs_usb", "udp_multicast"])
async def test_what_the_adapter_says_is_our_own_is_nobody_elses(adapter: Adapter, interface: str) -> None:
    with opened(adapter, interface) as bus:
        assert await heard(adapter, bus, message(b"\x05", is_rx=False)) == ([], [])


async def test_own_frames_without_a_mark_are_told_by_what_was_sent(adapter: Adapter) -> None:
    with opened(adapter, "udp_multicast") as bus:
        assert await heard(adapter, bus, message(b"\x05"), message(b"\x7f")) == ([b"\x7f"], [b"\x7f"])


async def test_more_of_them_than_were_sent_are_a_strangers(adapter: Adapter) -> None:
    with opened(adapter, "udp_multicast") as bus:
        foreign, _ = await heard(adapter, bus, *[message(b"\x05")] * 100)
        assert 1 <= len(foreign) < 100


async def test_an_adapter_without_echo_gives_what_a_second_bridge_sends(adapter: Adapter) -> None:
    with opened(adapter) as bus:
        assert await heard(adapter, bus, message(b"\x05")) == ([b"\x05"], [b"\x05"])


async def test_frames_of_can_fd_are_named_and_not_read(adapter: Adapter) -> None:
    with opened(adapter) as bus:
        assert await heard(adapter, bus, message(b"\x05", is_fd=True)) == ([], [])
        assert str(bus.status.last_error) == "CAN FD frame 77Fh: not read, this bus is classical CAN"
