"""Many slaves on one bus: they boot, then send a heartbeat and a TPDO each in their periods, until SIGTERM.

crowd.py CHANNEL NODES REPORT

REPORT becomes a JSON file with the kernel's time stamps of the SYNCs (s since 1970) and the times at
which frames were sent (s of the monotonic clock).
"""

import contextlib
import heapq
import json
import os
import select
import signal
import socket
import struct
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from bridge.canopen.frame import Frame
from tests.peers.can_end import FRAME, can_end
from tests.support.quick import OPERATIONAL, QuickNode

_SYNC = 0x080
_FILTERS = ((0x000, 0xC00007FF), (_SYNC, 0xC00007FF), (0x600, 0xC0000780))


class Crowd:
    """Slaves 1 … ``nodes``."""

    def __init__(self, channel: str, nodes: int) -> None:
        self._end = can_end(channel, *_FILTERS)
        self._nodes = {number: QuickNode(number) for number in range(1, nodes + 1)}
        self._plan: list[tuple[float, int]] = []
        self.syncs: list[float] = []
        self.sent: list[float] = []
        self._values = 0
        self.running = True

    def run(self) -> None:
        with self._end as self._bus:
            print("the crowd is there", flush=True)
            for node in self._nodes.values():
                node.start(time.monotonic())
                self._send_all(node)
            while self.running:
                pause_s = self._plan[0][0] - time.monotonic() if self._plan else 0.1
                if select.select([self._bus], [], [], min(max(0.0, pause_s), 0.1))[0]:
                    self._receive()
                self._on_time(time.monotonic())

    def _receive(self) -> None:
        try:
            while True:
                raw, ancillary, _, _ = self._bus.recvmsg(FRAME.size, 64, socket.MSG_DONTWAIT)
                can_id, length, data = FRAME.unpack(raw)
                if can_id == _SYNC:
                    seconds, nanoseconds = struct.unpack("@qq", ancillary[0][2])
                    self.syncs.append(seconds + nanoseconds * 1e-9)
                elif can_id == 0 or can_id & 0x780 == 0x600:
                    self._tell(Frame(can_id, data[:length]))
        except BlockingIOError:
            return

    def _tell(self, frame: Frame) -> None:
        number = frame.data[1] if frame.can_id == 0 else frame.can_id & 0x7F
        now = time.monotonic()
        for node in [self._nodes[number]] if number in self._nodes else self._nodes.values():
            planned = node.heartbeat_at
            node.on_frame(frame, now)
            if planned != node.heartbeat_at < float("inf"):
                heapq.heappush(self._plan, (node.heartbeat_at, node.node_id))
            self._send_all(node)

    def _on_time(self, now: float) -> None:
        while self._plan and self._plan[0][0] <= now:
            due, number = heapq.heappop(self._plan)
            node = self._nodes[number]
            if due != node.heartbeat_at:
                continue
            node.on_time(due)
            heapq.heappush(self._plan, (node.heartbeat_at, number))
            if node.state == OPERATIONAL:
                self._values += 1
                words = struct.pack("<4H", 0x0B37, self._values & 0x3FFF, self._values & 0xFF, 0)
                node.outbox.append(Frame(0x180 + number, words))
            self._send_all(node)

    def _send_all(self, node: QuickNode) -> None:
        for frame in node.outbox:
            self.sent.append(time.monotonic())
            self._bus.send(FRAME.pack(frame.can_id, len(frame.data), frame.data.ljust(8, b"\0")))
        node.outbox = []


def be_hardware() -> None:
    """No load of the machine holds up a drive: take precedence of everything, where that is allowed."""
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(11))


def main(channel: str, nodes: int, report: Path) -> None:
    be_hardware()
    crowd = Crowd(channel, nodes)

    def stop(*_: object) -> None:
        crowd.running = False

    signal.signal(signal.SIGTERM, stop)
    crowd.run()
    report.write_text(json.dumps({"syncs": crowd.syncs, "sent": crowd.sent}), encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), Path(sys.argv[3]))
