"""The page's server in the test's own process, and what a browser does with it."""

from __future__ import annotations

import asyncio
import json
import socket
import time
from collections.abc import AsyncGenerator, Callable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

from websockets.asyncio.client import ClientConnection, connect
from websockets.frames import Frame, Opcode

from bridge.command import Event, Outcome, Plant, Reply, Request
from bridge.command.messages.request import DONE
from bridge.northbound.listening import listen
from bridge.northbound.page.server import PageServer
from bridge.northbound.page.web import Page, PageSources
from tests.support import sites
from tests.support.passwords import cheap_hash

TIMEOUT_S: Final = 5.0
ROLES: Final = ("observer", "operator", "engineer")
Json = dict[str, Any]
_hash = cache(cheap_hash)
"""The same in each front of a site."""


class PlantView:
    """Points of a plant that nobody runs; each request has ``outcome``."""

    def __init__(self, plant: Plant) -> None:
        self.image = plant.image
        self.requests: list[Request] = []
        self.outcome: Outcome = DONE
        self.listeners: list[Any] = []

    def look(self, drive: str) -> None: ...

    def hurry(self, *, is_wanted: bool) -> None: ...

    def epoch_ns(self, time: float, /) -> int:
        return round(time * 1e9)

    def submit(self, request: Request, reply: Reply) -> None:
        self.requests.append(request)
        reply(self.outcome)

    def rejected(self, rejection: Any) -> None: ...

    def count(self, leaf: str, by: int = 1) -> None: ...

    def on_connection(self, identity: Any, *, is_there: bool, has_others: bool = False) -> None: ...

    def on_event(self, listener: Any) -> None:
        self.listeners.append(listener)

    def forget(self, listener: Any) -> None:
        self.listeners.remove(listener)

    def happen(self, event: Event) -> None:
        for listener in self.listeners:
            listener(event)


class NoSystem:
    def versions(self) -> dict[str, str]:
        return {}

    def connections(self) -> dict[str, list[str]]:
        return {}

    def certificates(self) -> Any:
        return []

    def site_file(self) -> dict[str, str]:
        return {}

    def check(self) -> list[Json]:
        return []

    def audit(self, lines: int) -> list[Json]:
        return []


async def no_capture(*asked: Any) -> Any:
    raise AssertionError("nobody captures")


@dataclass
class Answer:
    status: int
    headers: Mapping[str, str]
    body: bytes

    @property
    def json(self) -> Any:
        return json.loads(self.body)


class Served:
    """``page`` on a port of its own; ``later_s`` is how much later than now it is for the page. ``opcua`` are
    further keys of that table."""

    def __init__(
        self,
        anonymous: str = "",
        system: Any = None,
        capture: Any = no_capture,
        kept: Path | None = None,
        opcua: str = "",
    ) -> None:
        users = "".join(
            f'[[opcua.user]]\nname = "{one}"\nrole = "{one}"\npassword_hash = "{_hash(one + "!")}"\n'
            for one in ROLES
        )
        more = f'anonymous = "{anonymous}"' if anonymous else ""
        node = sites.node(sites.drive("fu1", "lease", 1000))
        text = sites.site(sites.bus(node), f'[opcua]\nlisten = "127.0.0.1:4840"\n{more}\n{opcua}\n{users}')
        plant = sites.plant_of(text)
        self.later_s = 0.0
        self.view = PlantView(plant)
        self.system = system or NoSystem()
        sources = PageSources({}, {}, [], {"can0": {}}, capture, dict, {}, self.system)
        self.page = Page(self.view, plant.catalogue, sources, lambda: time.monotonic() + self.later_s, kept)
        self.bound = listen("127.0.0.1:0", "page.listen")
        self.port = self.bound.getsockname()[1]
        self.origin = f"http://127.0.0.1:{self.port}"

    @asynccontextmanager
    async def serving(self) -> AsyncGenerator[Served]:
        server = PageServer(self.page, self.bound)
        await server.start()
        try:
            yield self
        finally:
            await server.close()
            self.bound.close()

    async def ask(self, method: str, path: str, body: bytes = b"", **headers: str) -> Answer:
        """One request on a connection of its own."""
        reader, writer = await asyncio.open_connection("127.0.0.1", self.port)
        named = {"Host": f"127.0.0.1:{self.port}", "Connection": "close", "Content-Length": str(len(body))}
        lines = [f"{name.replace('_', '-')}: {value}" for name, value in {**named, **headers}.items()]
        writer.write("\r\n".join([f"{method} {path} HTTP/1.1", *lines, "", ""]).encode() + body)
        try:
            async with asyncio.timeout(TIMEOUT_S):
                head, _, rest = (await reader.read()).partition(b"\r\n\r\n")
        finally:
            writer.close()
        first, *fields = head.decode("latin-1").split("\r\n")
        pairs = (field.partition(": ") for field in fields)
        return Answer(int(first.split()[1]), {name.lower(): value for name, _, value in pairs}, rest)

    async def login(self, user: str = "operator", password: str = "", **headers: str) -> tuple[str, str]:
        """Cookie and token."""
        body = json.dumps({"user": user, "password": password or f"{user}!"}).encode()
        answer = await self.ask("POST", "/api/login", body, **headers)
        assert answer.status == 200, answer.body
        return answer.headers["set-cookie"].partition(";")[0], answer.json["token"]

    def live(self, cookie: str) -> Any:
        """A tab, which has not said its token yet."""
        return connect(
            f"ws://127.0.0.1:{self.port}/live",
            origin=self.origin,  # type: ignore[arg-type]
            additional_headers={"Cookie": cookie},
        )

    @asynccontextmanager
    async def stalled(self, cookie: str, token: str) -> AsyncGenerator[Stalled]:
        """A tab that takes nothing after it was let in."""
        with socket.socket() as sock:
            yield await Stalled.open(self, sock, cookie, token)


class Stalled:
    """A tab that sends and reads nothing, with small buffers."""

    def __init__(self, sock: socket.socket) -> None:
        self.sock = sock

    @classmethod
    async def open(cls, served: Served, sock: socket.socket, cookie: str, token: str) -> Stalled:
        loop = asyncio.get_running_loop()
        sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
        sock.setblocking(False)
        await loop.sock_connect(sock, ("127.0.0.1", served.port))
        lines = (
            "GET /live HTTP/1.1",
            f"Host: 127.0.0.1:{served.port}",
            f"Origin: {served.origin}",
            f"Cookie: {cookie}",
            "Connection: Upgrade",
            "Upgrade: websocket",
            "Sec-WebSocket-Version: 13",
            "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==",
        )
        await loop.sock_sendall(sock, "\r\n".join([*lines, "", ""]).encode())
        assert b" 101 " in await loop.sock_recv(sock, 200)
        stalled = cls(sock)
        await stalled.send(token)
        return stalled

    async def send(self, text: str) -> None:
        frame = Frame(Opcode.TEXT, text.encode()).serialize(mask=True)
        await asyncio.get_running_loop().sock_sendall(self.sock, frame)

    async def say(self, message: Json) -> None:
        await self.send(json.dumps(message))

    async def is_gone(self) -> bool:
        """Whether the server has let the connection go, whatever still lies in its buffers."""
        try:
            await self.say({"hidden": False})
        except OSError:
            return True
        return False


async def message(tab: ClientConnection, key: str) -> Json:
    """The next message with this key."""
    async with asyncio.timeout(TIMEOUT_S):
        while True:
            told = json.loads(await tab.recv())
            if key in told:
                return told


async def until(is_so: Callable[[], bool]) -> None:
    for _ in range(round(TIMEOUT_S / 0.02)):
        if is_so():
            return
        await asyncio.sleep(0.02)
    raise AssertionError("it does not come to that")
