"""A TCP connection between a client and the bridge's Modbus server: delay, a full or a cut network, ends that
do not tell each other."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any

from bridge.northbound.modbus.connection import READ_MOST, ModbusConnection
from tests.plant.machine import Process
from tests.plant.world import World

_ESTABLISHED, _CLOSE_WAIT = b"\x01", b"\x08"
"""First byte of TCP_INFO (linux/tcp.h)."""


class _Socket:
    """What the server asks of the socket."""

    def __init__(self, transport: ServerEnd) -> None:
        self._transport = transport

    def setsockopt(self, *_: object) -> None:
        """The peer's silence is longer than any run."""

    def getsockopt(self, *_: object) -> bytes:
        return _CLOSE_WAIT if self._transport.is_closed_by_client else _ESTABLISHED


class ServerEnd(asyncio.Transport):
    """The bridge's end: what has come waits in the kernel until the process has a turn."""

    def __init__(
        self,
        stream: Stream,
        process: Process,
        accept: Callable[[], ModbusConnection],
        peer: tuple[str, int],
    ) -> None:
        super().__init__()
        self._stream = stream
        self._process = process
        self._accept = accept
        self._peer = peer
        self._waiting = bytearray()
        self._is_paused = self._is_closing = self._is_asked = self._has_ended = False
        self.is_closed_by_client = False
        process.post(self._made)

    def _made(self) -> None:
        self._protocol = self._accept()
        self._protocol.connection_made(self)

    def arrive(self, data: bytes) -> None:
        if not (self._process.is_dead or self._is_closing):
            self._stream.arrived(data)
            self._waiting += data
            self._ask()

    def end_of_stream(self) -> None:
        self.is_closed_by_client = True
        self._ask()

    def _ask(self) -> None:
        if not (self._is_asked or self._is_paused or self._is_closing):
            self._is_asked = True
            self._process.post(self._read)

    def _read(self) -> None:
        """One look of the event loop at the socket."""
        self._is_asked = False
        if self._is_paused or self._is_closing or self._process.is_dead:
            return
        if self._waiting:
            room = self._protocol.get_buffer(-1)
            chunk = self._waiting[: min(READ_MOST, len(room))]
            del self._waiting[: len(chunk)]
            room[: len(chunk)] = chunk
            self._protocol.buffer_updated(len(chunk))
            if self._waiting or self.is_closed_by_client:
                self._ask()
        elif self.is_closed_by_client and not self._has_ended:
            self._has_ended = True
            self._protocol.eof_received()
            self.close()

    # asyncio.Transport

    def get_extra_info(self, name: str, default: Any = None) -> Any:
        return {"peername": self._peer, "socket": _Socket(self)}.get(name, default)

    def is_closing(self) -> bool:
        return self._is_closing

    def close(self) -> None:
        if not self._is_closing:
            self._is_closing = True
            self._stream.close()
            self._process.post(lambda: self._protocol.connection_lost(None))

    def abort(self) -> None:
        self.close()

    def set_write_buffer_limits(self, high: int | None = None, low: int | None = None) -> None:
        """No client of a plant leaves so much unread."""

    def get_write_buffer_size(self) -> int:
        return 0

    def write(self, data: bytes | bytearray | memoryview) -> None:
        if not self._is_closing:
            self._stream.to_client(bytes(data))

    def pause_reading(self) -> None:
        self._is_paused = True

    def resume_reading(self) -> None:
        self._is_paused = False
        if self._waiting or self.is_closed_by_client:
            self._ask()


class Stream:
    """One connection. ``delay_s`` is that of each way; while ``is_cut`` nothing arrives, and what was sent
    comes when it is whole again, as TCP sends it anew. ``take`` gets what the server sends, ``on_closed`` is
    called when the client can know of its end."""

    def __init__(
        self,
        world: World,
        process: Process,
        accept: Callable[[], ModbusConnection],
        peer: tuple[str, int],
        delay_s: float,
        *,
        take: Callable[[bytes], None],
        on_closed: Callable[[], None],
    ) -> None:
        self.arrived: Callable[[bytes], None] = lambda data: None
        """Called with what reaches the bridge's kernel."""
        self._world = world
        self._take = take
        self._on_closed = on_closed
        self.delay_s = delay_s
        self.is_cut = False
        self._held: list[tuple[bool, bytes]] = []
        """Bytes to the server (True) or to the client; an empty one is the end of the stream."""
        self._is_over = False
        self._server = ServerEnd(self, process, accept, peer)

    def send(self, data: bytes) -> None:
        """From the client; nothing is the end of its side."""
        self._carry(True, data)

    def to_client(self, data: bytes) -> None:
        self._carry(False, data)

    def close(self) -> None:
        """The bridge's end is closed, by its server or because the process is gone."""
        self._carry(False, b"")

    def _carry(self, is_to_server: bool, data: bytes) -> None:
        if self.is_cut:
            self._held.append((is_to_server, data))
        else:
            self._world.after(self.delay_s, lambda: self._arrive(is_to_server, data))

    def _arrive(self, is_to_server: bool, data: bytes) -> None:
        if self._is_over:
            return
        if self.is_cut:
            self._held.append((is_to_server, data))
        elif is_to_server:
            if data:
                self._server.arrive(data)
            else:
                self._server.end_of_stream()
        elif data:
            self._take(data)
        else:
            self._is_over = True
            self._on_closed()

    def forget(self) -> None:
        """The client no longer looks at what comes."""
        self._take, self._on_closed = (lambda data: None), (lambda: None)

    def mend(self) -> None:
        self.is_cut = False
        held, self._held = self._held, []
        for is_to_server, data in held:
            self._carry(is_to_server, data)
