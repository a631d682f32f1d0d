"""An SDO client by itself: what it sends, in hexadecimal, and what it makes of the answers."""

from __future__ import annotations

from bridge.canopen.frame import Frame
from bridge.canopen.sdo import Priority, Result, SdoChannel, SdoJob

REQUEST, REPLY = 0x605, 0x585


class Client:
    """A channel to node ``node_id`` on a virtual clock, its requests and its results."""

    def __init__(self, retries: int = 0, node_id: int = 5) -> None:
        self.channel = SdoChannel(0x600 + node_id, 0x580 + node_id, 0.5, retries=retries)
        self.now = 0.0
        self.results: list[Result] = []

    def read(self, index: int, sub: int = 0, *, priority: Priority = Priority.COMMAND) -> SdoJob:
        return self.channel.read(index, sub, self.now, self.results.append, priority=priority)

    def write(self, index: int, sub: int, data: bytes) -> None:
        self.channel.write(index, sub, data, self.now, self.results.append)

    def wait(self, seconds: float) -> None:
        """Let time pass; the channel is called whenever it asked for it."""
        end = self.now + seconds
        while (deadline := self.channel.next_deadline()) is not None and deadline <= end:
            self.now = max(self.now, deadline)
            self.channel.on_time(self.now)
        self.now = end

    def sent(self) -> list[str]:
        return [frame.data.hex(" ").upper() for frame in self.channel.take_frames()]

    def answer(self, text: str) -> None:
        self.channel.on_frame(Frame(self.channel.reply_id, bytes.fromhex(text), self.now))

    @property
    def result(self) -> Result:
        assert len(self.results) == 1
        return self.results[0]
