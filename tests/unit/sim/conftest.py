"""A bench with a virtual clock: one simulated SK TU4-CAO, node 5, and everything it has sent."""

from __future__ import annotations

import pytest

from bridge.canopen.frame import REMOTE, Frame
from bridge.sim.nord.nord_tu4 import NordTu4

NODE = 5
RPDO = (0x205, 0x305, 0x405, 0x505)
TPDO = (0x185, 0x285, 0x385, 0x485)


class Bench:
    """Time moves only in ``run``; the node is called exactly when it asked to be. ``node`` may be of
    another family, whose address is 5 too where ``nmt``, ``guard`` and ``sdo`` are to reach it."""

    def __init__(self, node=None, **options) -> None:
        self.node = NordTu4(NODE, **options) if node is None else node
        self.now = 10.0
        self.sent: list[tuple[float, Frame]] = []
        self.calls = 0
        self.node.start(self.now)
        self._collect()

    def run(self, seconds: float) -> list[Frame]:
        """Let time pass; returns what was sent meanwhile."""
        first, end = len(self.sent), self.now + seconds
        while (deadline := self.node.next_deadline()) is not None and deadline <= end:
            self.now = max(self.now, deadline)
            self.node.on_time(self.now)
            self.calls += 1
            assert self.calls < 100_000, "next_deadline does not move on"
            self._collect()
        self.now = end
        self.node.on_time(self.now)
        self._collect()
        return [frame for _, frame in self.sent[first:]]

    def put(self, can_id: int, data: bytes | str = b"") -> list[Frame]:
        """One frame to the node; returns what it answers at once."""
        first = len(self.sent)
        payload = bytes.fromhex(data) if isinstance(data, str) else data
        self.node.on_frame(Frame(can_id, payload, self.now), self.now)
        self._collect()
        return [frame for _, frame in self.sent[first:]]

    def nmt(self, command: int, node: int = NODE) -> list[Frame]:
        return self.put(0, bytes([command, node]))

    def guard(self) -> list[Frame]:
        return self.put(0x700 + NODE | REMOTE)

    def sync(self) -> list[Frame]:
        return self.put(0x80)

    def sdo(self, request: str, channel: int = 0x605, answer: int = 0x585) -> str:
        """Answer to an SDO request as hexadecimal, "" if there is none."""
        frames = [frame for frame in self.put(channel, request) if frame.can_id == answer]
        assert len(frames) <= 1
        return frames[0].data.hex(" ").upper() if frames else ""

    def read(self, index: int, sub: int) -> int:
        answer = bytes.fromhex(self.sdo(f"40{_multiplexor(index, sub)}00000000"))
        assert answer[0] & 0xE0 == 0x40, answer.hex()
        return int.from_bytes(answer[4 : 8 - (answer[0] >> 2 & 3)], "little")

    def write(self, index: int, sub: int, value: int, size: int) -> str:
        """Answer without the index: "60" or the abort code."""
        command = 0x23 | (4 - size) << 2
        data = (value & ((1 << 8 * size) - 1)).to_bytes(4, "little").hex()
        answer = bytes.fromhex(self.sdo(f"{command:02X}{_multiplexor(index, sub)}{data}"))
        return "60" if answer[0] == 0x60 else f"{int.from_bytes(answer[4:], 'little'):08X}"

    def command(self, control_word: int, *setpoints: int, drive: int = 1) -> list[Frame]:
        """The four words of a drive's RPDO."""
        words = (control_word, *setpoints, 0, 0, 0)[:4]
        return self.put(RPDO[drive - 1], b"".join((word & 0xFFFF).to_bytes(2, "little") for word in words))

    def answer(self, drive: int = 1) -> tuple[int, int]:
        """Status word and first actual value of the newest TPDO of a drive."""
        data = next(f.data for _, f in reversed(self.sent) if f.can_id == TPDO[drive - 1])
        return int.from_bytes(data[:2], "little"), int.from_bytes(data[2:4], "little")

    def of(self, can_id: int) -> list[tuple[float, bytes]]:
        return [(time, frame.data) for time, frame in self.sent if frame.can_id == can_id]

    def _collect(self) -> None:
        self.sent += [(self.now, frame) for frame in self.node.take_frames()]


def _multiplexor(index: int, sub: int) -> str:
    return index.to_bytes(2, "little").hex() + f"{sub:02X}"


@pytest.fixture
def make_bench():
    """A powered bench in Pre-Operational; ``operational=True`` charges the drives and starts the node."""

    def make(*, operational: bool = False, **options) -> Bench:
        bench = Bench(**options)
        if operational:
            bench.run(0.3)
            bench.nmt(1)
        return bench

    return make


@pytest.fixture
def bench_of():
    """A bench with this node, powered, in Pre-Operational."""
    return Bench


@pytest.fixture
def bench(make_bench) -> Bench:
    return make_bench()


@pytest.fixture
def live(make_bench) -> Bench:
    """Operational, drives in switch-on inhibited."""
    return make_bench(operational=True)


@pytest.fixture
def watched(make_bench):
    """P151 = 100 ms, FU1 running at 25 Hz, the last telegram just now."""
    bench = make_bench(operational=True, p151_ms=100)
    bench.command(0x047E)
    bench.command(0x047F, 0x2000)
    for _ in range(30):
        bench.run(0.05)
        bench.command(0x047F, 0x2000)
    assert bench.node.drives[0].output_hz == 25.0
    return bench
