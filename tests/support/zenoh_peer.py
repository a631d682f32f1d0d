"""Handle of a zenoh process that we did not write the client for: ``tests/wire/peers/zenoh_peer.py``."""

from __future__ import annotations

import asyncio
import itertools
import json
import signal
import socket
import sys
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

SCRIPT = Path(__file__).parents[1] / "wire" / "peers" / "zenoh_peer.py"


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return server.getsockname()[1]


async def until(condition: Callable[[], object], what: str, timeout_s: float = 10.0) -> None:
    deadline = time.monotonic() + timeout_s
    while True:
        if condition():
            return
        if time.monotonic() > deadline:
            raise AssertionError(f"not within {timeout_s:g} s: {what}")
        await asyncio.sleep(0.01)


class Peer:
    """``samples`` and ``tokens`` grow by themselves; ``latest`` is the newest payload of each key."""

    def __init__(self, process: asyncio.subprocess.Process) -> None:
        self.samples: list[dict[str, Any]] = []
        self.tokens: list[tuple[str, bool]] = []
        self._process = process
        self._ids = itertools.count()
        self._waiting: dict[str, asyncio.Future[dict[str, Any]]] = {}
        self._ready = asyncio.get_running_loop().create_future()
        self._waiting["ready"] = self._ready
        self._reader = asyncio.create_task(self._read())

    async def _read(self) -> None:
        assert self._process.stdout
        async for line in self._process.stdout:
            said = json.loads(line)
            if "sample" in said:
                self.samples.append(said["sample"])
            elif "token" in said:
                self.tokens.append((said["token"]["key"], said["token"]["is_put"]))
            else:
                self._waiting.pop(str(said["id"])).set_result(said)

    async def do(self, what: str, key: str, **more: str | None) -> dict[str, Any]:
        assert self._process.stdin
        number = str(next(self._ids))
        future = self._waiting[number] = asyncio.get_running_loop().create_future()
        order = {"id": number, "do": what, "key": key, **{k: v for k, v in more.items() if v is not None}}
        self._process.stdin.write(json.dumps(order).encode() + b"\n")
        return await asyncio.wait_for(future, 10)

    async def subscribe(self, key: str) -> None:
        """Subscribe; whoever this peer is connected to knows of it, because it has answered a later query."""
        await self.do("subscribe", key)
        await self.do("get", key)

    async def command(
        self,
        key: str,
        payload: object = None,
        controller: str | None = None,
        target: str | None = None,
        session: str | None = None,
        source: str | None = None,
    ) -> dict[str, Any]:
        """The answer to a command query, whether it is an error reply or not."""
        text = payload if isinstance(payload, str) or payload is None else json.dumps(payload)
        named = {"controller": controller, "session": session}
        attachment = (
            json.dumps({name: value for name, value in named.items() if value}) if controller else None
        )
        said = await self.do("get", key, payload=text, attachment=attachment, target=target, source=source)
        texts = said["errors"] + [value["payload"] for value in said["values"]]
        assert len(texts) == 1, said
        answer: dict[str, Any] = json.loads(texts[0])
        assert answer["ok"] == (not said["errors"])
        return answer

    async def value(self, key: str) -> dict[str, Any]:
        """The present value of a point by a get."""
        said = await self.do("get", key)
        assert not said["errors"], said
        (value,) = said["values"]
        assert value["key"] == key
        return json.loads(value["payload"])

    def latest(self, key: str) -> dict[str, Any] | None:
        found = [sample for sample in self.samples if sample["key"] == key]
        return json.loads(found[-1]["payload"]) if found else None

    def stop(self) -> None:
        self._process.send_signal(signal.SIGSTOP)

    def go_on(self) -> None:
        self._process.send_signal(signal.SIGCONT)

    async def ready(self) -> dict[str, Any]:
        return await asyncio.wait_for(asyncio.shield(self._ready), 15)

    async def end(self) -> None:
        if self._process.returncode is None:
            self._process.kill()
        await self._process.wait()
        await asyncio.gather(self._reader, return_exceptions=True)


@asynccontextmanager
async def zenoh_peer(endpoint: str, *user: str, mode: str = "peer") -> AsyncIterator[Peer]:
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        str(SCRIPT),
        endpoint,
        mode,
        *user,
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        limit=2**22,
    )
    peer = Peer(process)
    try:
        await peer.ready()
        yield peer
    finally:
        await peer.end()
