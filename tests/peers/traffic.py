"""Slaves that boot, and then send TPDOs at a given rate: what the end-to-end figures are measured with.

traffic.py CHANNEL MANAGER NODES RATE CHANGED SECONDS REPORT

MANAGER is an open socket on which the bridge tells the kernel's broadcast manager what to repeat; its part is
played here. SIGUSR1 begins RATE TPDOs a second, of the nodes in turn, for SECONDS. In CHANGED percent of them
the three values are new: the first is the number of the change. Nobody waits for the other end: a frame for
which its queue has no room is lost, as in the kernel. SIGTERM ends it; then REPORT becomes a JSON file: what
was sent and when, and for each node when its RPDO had which new setpoint 1.
"""

import contextlib
import json
import select
import signal
import socket
import struct
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from bridge.canopen.frame import Frame
from tests.peers.broadcast_manager import MOST_BYTES, BroadcastManager
from tests.peers.can_end import FRAME, can_end
from tests.peers.crowd import be_hardware
from tests.support.quick import OPERATIONAL, QuickNode

STATUS_WORD = 0x0B31
"""Ready to be switched on: nobody commands these drives."""
_TPDO = struct.Struct("=IB3x4H")
_FILTERS = ((0x000, 0xC00007FF), (0x200, 0xC0000780), (0x600, 0xC0000780))
_NEVER = float("inf")


class Traffic:
    """Slaves 1 … ``nodes``; of ``every`` PDOs of one, the first has new values."""

    def __init__(
        self,
        bus: socket.socket,
        bridge: socket.socket,
        nodes: int,
        rate: float,
        every: int,
        seconds: float,
    ) -> None:
        self._bus = bus
        self._bridge = bridge
        self._manager = BroadcastManager()
        self._nodes = {number: QuickNode(number) for number in range(1, nodes + 1)}
        self._rate = rate
        self._every = every
        self._total = round(rate * seconds)
        self._begin = _NEVER
        self._beat_at = _NEVER
        self.running = True
        self.begun = False
        self.sent = self.lost = 0
        self.took_s = 0.0
        self.changes: list[list[float]] = [[] for _ in self._nodes]
        """When each change of each node was sent for the first time (monotonic s)."""
        self.setpoints: dict[int, list[tuple[float, int]]] = {number: [] for number in self._nodes}

    @property
    def operational(self) -> bool:
        return all(node.state == OPERATIONAL for node in self._nodes.values())

    @property
    def all_sent(self) -> bool:
        return self.sent == self._total

    def start(self) -> None:
        for node in self._nodes.values():
            node.start(time.monotonic())
            self._send_all(node)

    def turn(self) -> None:
        """Wait for what is next, and do it."""
        now = time.monotonic()
        if self.begun and self._begin == _NEVER:
            self._begin = now
        pdo_at = self._begin + self.sent / self._rate if not self.all_sent else _NEVER
        pause_s = min(pdo_at, self._beat_at, self._manager.due, now + 0.1) - now
        ready = select.select([self._bus, self._bridge], [], [], max(0.0, pause_s))[0]
        if self._bus in ready:
            self._receive()
        if self._bridge in ready:
            self._obey()
        now = time.monotonic()
        for frame in self._manager.send(now):
            self._hear(frame)
        if now >= self._beat_at:
            self._beat(now)
        while pdo_at <= now:
            self._send_pdo()
            pdo_at = self._begin + self.sent / self._rate if not self.all_sent else _NEVER
        if self.all_sent and not self.took_s:
            self.took_s = time.monotonic() - self._begin

    def _send_pdo(self) -> None:
        turn, place = divmod(self.sent, len(self._nodes))
        change = turn // self._every + 1
        changes = self.changes[place]
        if change > len(changes):
            changes.append(time.monotonic())
        values = change & 0xFFFF, ~change & 0xFFFF, change * 3 & 0xFFFF
        self.lost += not self._send(_TPDO.pack(0x181 + place, 8, STATUS_WORD, *values))
        self.sent += 1

    def _send(self, frame: bytes) -> bool:
        """Whether there was room for it."""
        with contextlib.suppress(BlockingIOError):
            self._bus.send(frame, socket.MSG_DONTWAIT)
            return True
        return False

    def _receive(self) -> None:
        with contextlib.suppress(BlockingIOError):
            while True:
                can_id, length, data = FRAME.unpack(self._bus.recv(FRAME.size, socket.MSG_DONTWAIT))
                self._hear(Frame(can_id, data[:length]))

    def _obey(self) -> None:
        with contextlib.suppress(BlockingIOError):
            while message := self._bridge.recv(MOST_BYTES, socket.MSG_DONTWAIT):
                for frame in self._manager.take(message, time.monotonic()):
                    self._hear(frame)

    def _hear(self, frame: Frame) -> None:
        if frame.can_id == 0 or frame.can_id & 0x780 == 0x600:
            self._tell(frame)
        elif frame.can_id & 0x780 == 0x200:
            self._command(self.setpoints[frame.can_id & 0x7F], int.from_bytes(frame.data[2:4], "little"))

    @staticmethod
    def _command(setpoints: list[tuple[float, int]], setpoint: int) -> None:
        if not setpoints or setpoints[-1][1] != setpoint:
            setpoints.append((time.monotonic(), setpoint))

    def _tell(self, frame: Frame) -> None:
        number = frame.data[1] if frame.can_id == 0 else frame.can_id & 0x7F
        for node in [self._nodes[number]] if number in self._nodes else self._nodes.values():
            node.on_frame(frame, time.monotonic())
            self._send_all(node)
        self._beat_at = min(node.heartbeat_at for node in self._nodes.values())

    def _beat(self, now: float) -> None:
        for node in self._nodes.values():
            node.on_time(now)
            self._send_all(node)
        self._beat_at = min(node.heartbeat_at for node in self._nodes.values())

    def _send_all(self, node: QuickNode) -> None:
        for frame in node.outbox:
            self._send(FRAME.pack(frame.can_id, len(frame.data), frame.data.ljust(8, b"\0")))
        node.outbox = []


def main(
    channel: str, manager: int, nodes: int, rate: float, changed: int, seconds: float, report: Path
) -> None:
    be_hardware()
    with can_end(channel, *_FILTERS) as bus, socket.socket(fileno=manager) as bridge:
        traffic = Traffic(bus, bridge, nodes, rate, 100 // changed, seconds)
        signal.signal(signal.SIGUSR1, lambda *_: setattr(traffic, "begun", True))
        signal.signal(signal.SIGTERM, lambda *_: setattr(traffic, "running", False))
        print("the nodes are there", flush=True)
        traffic.start()
        said = iter(
            [(lambda: traffic.operational, "all operational"), (lambda: traffic.all_sent, "all sent")]
        )
        condition, words = next(said)
        while traffic.running:
            traffic.turn()
            if condition():
                print(words, flush=True)
                condition, words = next(said, (lambda: False, ""))
        told = {"sent": traffic.sent, "lost": traffic.lost, "took_s": traffic.took_s}
        told |= {"changes": traffic.changes, "setpoints": traffic.setpoints}
        report.write_text(json.dumps(told), encoding="utf-8")


if __name__ == "__main__":
    end, kernel, number, pdos, new, lasts, file = sys.argv[1:]
    main(end, int(kernel), int(number), float(pdos), int(new), float(lasts), Path(file))
