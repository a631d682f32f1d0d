"""A slave that keeps a communication error, as CANopenNode does: after one SYNC of a wrong length it sends
EMCY 8240h, leaves Operational, and refuses it until it is reset."""

from __future__ import annotations

from typing import Any

from bridge.canopen.frame import Frame

START, RESETS = 0x01, (0x81, 0x82)
WRONG_LENGTH = 0x8240
_SDO_REQUEST, _SDO_REPLY, _EMCY = 0x600, 0x580, 0x80


class LatchingSlave:
    """Any simulated node with that behaviour before it. ``codes`` are the errors that it latches in turn at
    each reset, nothing where they have run out; ``register`` is what 1001h says then."""

    def __init__(self, node: Any, *codes: int, register: int = 0x11) -> None:
        self.node = node
        self.latched = 0
        self.history: list[int] = []
        self.register = register
        self._next = list(codes)
        self._outbox: list[Frame] = []

    def __getattr__(self, name: str) -> Any:
        return getattr(self.node, name)

    def latch(self, code: int, now: float) -> None:
        self.latched = code
        self.history.insert(0, code)
        emergency = code.to_bytes(2, "little") + bytes((self.register,)) + bytes(5)
        self._outbox.append(Frame(_EMCY + self.node.node_id, emergency))
        self.node.on_frame(Frame(0, bytes((0x80, self.node.node_id))), now)

    def on_frame(self, frame: Frame, now: float) -> None:
        if frame.can_id == 0x80 and len(frame.data) != 0:
            self.latch(WRONG_LENGTH, now)
            return
        if frame.can_id == 0 and len(frame.data) == 2 and frame.data[1] in (0, self.node.node_id):
            if frame.data[0] == START and self.latched:
                return
            self.node.on_frame(frame, now)
            if frame.data[0] in RESETS:
                self.latched = 0
                if self._next:
                    self.latch(self._next.pop(0), now)
            return
        if frame.can_id == _SDO_REQUEST + self.node.node_id and self._answer(frame.data):
            return
        self.node.on_frame(frame, now)

    def _answer(self, request: bytes) -> bool:
        """Objects 1001h and 1003h are ours."""
        index, sub = int.from_bytes(request[1:3], "little"), request[3]
        if request[0] != 0x40 or index not in (0x1001, 0x1003):
            return False
        if index == 0x1001:
            data = bytes((self.register if self.latched else 0,))
        elif sub == 0:
            data = bytes((len(self.history),))
        else:
            data = (self.history[sub - 1] | 0x0042_0000).to_bytes(4, "little")
        head = 0x43 | (4 - len(data)) << 2
        reply = bytes((head,)) + request[1:4] + data.ljust(4, b"\0")
        self._outbox.append(Frame(_SDO_REPLY + self.node.node_id, reply))
        return True

    def next_deadline(self) -> float | None:
        return self.node.next_deadline()

    def take_frames(self) -> list[Frame]:
        frames, self._outbox = [*self.node.take_frames(), *self._outbox], []
        return frames
