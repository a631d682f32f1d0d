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
def opened(adapter: Adapter) -> Generator[PythonCanBus]:
    bus = PythonCanBus("can0", "pcan", "PCAN_USBBUS1", 250_000)
    bus.open(adapter.happened)
    try:
        yield bus
    finally:
        bus.close()


async def test_an_adapter_that_is_unplugged_is_opened_anew(adapter: Adapter) -> None:
    with opened(adapter) as bus:
        adapter.unplug()
        await adapter.until(lambda: bus.status.state is ControllerState.DOWN)
        assert "no such device" in bus.status.last_error
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
        await adapter.until(lambda: bus.status.last_error.startswith("no acknowledge"))
        assert not bus.drain(time.monotonic())
