"""A python-can adapter that is unplugged and plugged in again, and what is counted meanwhile."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable

import can
import pytest

from bridge.southbound.bus import pythoncan
from bridge.southbound.bus.frame import Frame
from bridge.southbound.bus.interface import ControllerState
from bridge.southbound.bus.pythoncan import PythonCanBus


class Adapter:
    """An adapter behind ``can.Bus``: while ``unplugged`` is set, everything about it fails."""

    def __init__(self) -> None:
        self.unplugged = threading.Event()
        self.opened = 0
        self.incoming: list[can.Message] = []
        self.sent: list[can.Message] = []

    def __call__(self, **options: object) -> Adapter:
        self._fail()
        self.opened += 1
        return self

    def _fail(self) -> None:
        if self.unplugged.is_set():
            raise can.CanOperationError("no such device")

    def recv(self, timeout: float) -> can.Message | None:
        self._fail()
        time.sleep(0.002)
        return self.incoming.pop(0) if self.incoming else None

    def send(self, message: can.Message, timeout: float) -> None:
        self._fail()
        self.sent.append(message)

    def shutdown(self) -> None:
        self._fail()


async def until(condition: Callable[[], bool]) -> None:
    """The bus lives on threads: they are given five seconds."""
    for _ in range(500):
        if condition():
            return
        await asyncio.sleep(0.01)
    raise AssertionError("not within 5 s")


async def test_an_adapter_that_is_unplugged_is_opened_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    adapter = Adapter()
    monkeypatch.setattr(pythoncan.can, "Bus", adapter)
    bus = PythonCanBus("can0", "pcan", "PCAN_USBBUS1", 250_000)
    bus.open(lambda: None)
    try:
        adapter.unplugged.set()
        await until(lambda: bus.status.state is ControllerState.DOWN)
        assert "no such device" in bus.status.last_error
        now = time.monotonic()
        bus.send(Frame(0x605, b"stale"), now, now + 60)
        adapter.unplugged.clear()
        await until(lambda: bus.status.state is ControllerState.OK)
        assert adapter.opened == 2
        bus.send(Frame(0x605, b"fresh"), now, now + 60)
        adapter.incoming.append(can.Message(arbitration_id=0x185, data=b"x", is_extended_id=False))
        frames: list[Frame] = []

        def both_ways() -> bool:
            frames.extend(bus.drain(time.monotonic()))
            return bool(frames and adapter.sent)

        await until(both_ways)
        assert frames[0].can_id == 0x185
        assert [bytes(message.data) for message in adapter.sent] == [b"fresh"]
        assert bus.status.frames_expired == 1
        assert bus.status.bits > 100
    finally:
        bus.close()


async def test_error_frames_are_counted_and_put_into_words(monkeypatch: pytest.MonkeyPatch) -> None:
    adapter = Adapter()
    monkeypatch.setattr(pythoncan.can, "Bus", adapter)
    bus = PythonCanBus("can0", "pcan", "PCAN_USBBUS1", 250_000)
    bus.open(lambda: None)
    try:
        adapter.incoming.append(can.Message(arbitration_id=0x20, data=bytes(8), is_error_frame=True))
        await until(lambda: bus.status.error_frames == 1)
        assert bus.status.last_error.startswith("no acknowledge")
        assert not bus.drain(time.monotonic())
    finally:
        bus.close()
