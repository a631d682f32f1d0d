"""An I/O block of nobody's make on a bench: its outputs stick, or cannot be read, where a test wants that."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Final

from bridge.command import Action, Identity, Source
from bridge.command.stop_check.state import LastStop
from tests.support.bench import Bench
from tests.support.devices import IO_BLOCK, OUTPUTS, device_bench, io_block
from tests.support.pdo_node import PdoNode

OTHER: Final = Identity(Source.MODBUS, "10.0.0.9")
_WRITE_ONLY: Final = 0x0601_0001
_REQUEST: Final = 0x614
_NMT_STOP: Final = b"\x02\x14"


class Block(PdoNode):
    """Node of ``io_block``. ``refuses_reading`` are indices that it aborts, ``mute`` those that it does not
    answer."""

    def __init__(self) -> None:
        super().__init__(20)
        self.__dict__ |= vars(io_block())
        self.refuses_reading: set[int] = set()
        self.mute: set[int] = set()
        self.stuck: dict[str, tuple[int, int]] = {}
        """Objects that keep a number, by their names: size and number."""
        self._react = lambda node: [self.put(name, *held) for name, held in self.stuck.items()] and None

    def _on_sdo(self, data: bytes, now: float) -> None:
        command, index, sub = struct.unpack_from("<BHB", data)
        if command == 0x40 and index in self.mute:
            return
        if command == 0x40 and index in self.refuses_reading:
            self._abort(index, sub, _WRITE_ONLY)
            return
        super()._on_sdo(data, now)


def block_bench(
    folder: Path,
    *,
    outputs: str = "",
    prepare: Callable[[Block], None] | None = None,
) -> Bench:
    block = Block()
    if prepare:
        prepare(block)
    more = OUTPUTS.replace("[modbus]", f"{outputs}\n[modbus]")
    bench = device_bench(folder, block, IO_BLOCK, more)
    bench.run(2.0)
    return bench


def block_of(bench: Bench) -> Block:
    assert isinstance(bench.node, Block)
    return bench.node


def go(bench: Bench) -> Bench:
    """Every output is active, and the log begins."""
    assert bench.ask(Action.WRITE, "shaft", values={"valves": 0}).ok
    bench.run(0.05)
    assert bench.ask(Action.WRITE, "shaft", values={"valves": 0x81, "speed": -2.5, "lamp": 3}).forwarded
    bench.run(0.05)
    bench.log.clear()
    bench.events.clear()
    return bench


def stop(bench: Bench, for_s: float) -> Bench:
    assert bench.ask(Action.STOP, "shaft", OTHER).forwarded
    bench.run(for_s)
    return bench


def last_stop(bench: Bench) -> LastStop:
    return LastStop(bench.number("shaft/supervision/last_stop"))


def why(bench: Bench) -> str:
    return bench.plant.image.read("shaft/supervision/last_stop").reason


def told(bench: Bench) -> list[tuple[int, str]]:
    return [(event.severity, event.message) for event in bench.events if event.severity in (300, 1000)]


def asked(bench: Bench) -> list[str]:
    """The objects that were read, in order."""
    reads = [frame.data for frame in bench.sent(_REQUEST) if frame.data[0] == 0x40]
    return [f"{data[2]:02X}{data[1]:02X}:{data[3]:02X}" for data in reads]


def nmt_stops(bench: Bench) -> int:
    return sum(frame.data == _NMT_STOP for frame in bench.sent(0))
