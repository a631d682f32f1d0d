"""Both ends of an SDO block transfer (CiA 301 §7.2.4.3.9–15) on a virtual clock; a wire that loses frames."""

from __future__ import annotations

import struct
from collections.abc import Callable

from bridge.canopen.frame import Frame
from bridge.canopen.sdo import Result, SdoChannel, SdoError
from bridge.sim.core.dictionary import Dictionary, Domain
from bridge.sim.core.sdo_server import SimulatedSdoServer

REQUEST, REPLY = 0x605, 0x585
LONG = bytes(range(256)) * 4
INDEX = 0x1F20

Lose = Callable[[str, bytes], bool]
"""Whether a frame ("to" or "from" the server) is lost."""


class Link:
    """A channel and a server, joined by a wire on a virtual clock."""

    def __init__(
        self,
        data: bytes = LONG,
        *,
        block: int = 127,
        lose: Lose = lambda way, frame: False,
        retries: int = 0,
        segment_s: float = 0.0,
    ) -> None:
        self.stored = data
        objects = Dictionary()
        objects.add(INDEX, 0, Domain(1 << 16, lambda: self.stored, self._store))
        self.server = SimulatedSdoServer(objects, block)
        self.channel = SdoChannel(REQUEST, REPLY, 0.5, retries=retries, segment_s=segment_s)
        self.lose = lose
        self.now = 0.0
        self.log: list[str] = []
        self.results: list[Result] = []

    def _store(self, data: bytes) -> None:
        self.stored = data

    def read(self) -> Result:
        self.channel.read(INDEX, 0, self.now, self.results.append)
        return self._finish()

    def write(self, data: bytes) -> Result:
        self.channel.write(INDEX, 0, data, self.now, self.results.append)
        return self._finish()

    def _finish(self) -> Result:
        for _ in range(10_000):
            self.exchange()
            if self.results:
                return self.results.pop()
            deadline = self.channel.next_deadline()
            assert deadline is not None, "a transfer without an end"
            self.now = max(self.now, deadline)
            self.channel.on_time(self.now)
        raise AssertionError("a transfer without an end")

    def exchange(self) -> None:
        """Carry frames both ways until nobody has anything to say at this moment."""
        while frames := self.channel.take_frames():
            for request in frames:
                self.log.append(f"> {request.data.hex(' ')}")
                if self.lose("to", request.data):
                    continue
                for answer in self.server.on_request(request.data):
                    self.log.append(f"< {answer.hex(' ')}")
                    if not self.lose("from", answer):
                        self.channel.on_frame(Frame(REPLY, answer, self.now))

    def count(self, start: str) -> int:
        return sum(line.startswith(start) for line in self.log)


def once(way: str, first: int) -> Lose:
    """Lose the first frame of one direction that begins with this byte."""
    lost: list[bytes] = []

    def lose(direction: str, frame: bytes) -> bool:
        if direction != way or frame[0] != first or lost:
            return False
        lost.append(frame)
        return True

    return lose


class Asker:
    """A channel whose server is the test."""

    def __init__(self, retries: int = 0, segment_s: float = 0.0) -> None:
        self.channel = SdoChannel(REQUEST, REPLY, 0.5, retries=retries, segment_s=segment_s)
        self.results: list[Result] = []
        self.now = 0.0

    def start_upload(self, size: int = 140, command: str = "C6") -> None:
        """Read, up to the start of the first block."""
        self.channel.read(INDEX, 0, self.now, self.results.append)
        length = struct.pack("<I", size).hex()
        self.say(f"41 20 1F 00 {length}")
        self.say(f"{command} 20 1F 00 {length}")
        self.sent()

    def start_download(self, size: int = 140, blksize: int = 127) -> None:
        """Write, up to the first block."""
        self.channel.write(INDEX, 0, bytes(size), self.now, self.results.append)
        self.say(f"A4 20 1F 00 {blksize:02X} 00 00 00")

    def say(self, *frames: str) -> None:
        for text in frames:
            self.channel.on_frame(Frame(REPLY, bytes.fromhex(text), self.now))

    def segments(self, *numbers: int) -> None:
        for number in numbers:
            self.say(f"{number:02X} 11 22 33 44 55 66 77")

    def sent(self) -> list[str]:
        return [frame.data.hex(" ").upper() for frame in self.channel.take_frames()]

    def silence(self) -> None:
        """Let as much time pass without an answer as the channel waits."""
        deadline = self.channel.next_deadline()
        assert deadline is not None
        self.now = deadline
        self.channel.on_time(self.now)

    @property
    def sentence(self) -> str:
        (result,) = self.results
        assert isinstance(result, SdoError)
        return str(result)
