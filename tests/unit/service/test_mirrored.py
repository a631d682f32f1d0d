"""The frame of a front: its server opens on the mirror image, and both end together."""

from __future__ import annotations

import asyncio
from contextlib import AsyncExitStack
from pathlib import Path

import pytest

from bridge.base.errors import OperationFailed
from bridge.config import load_site
from bridge.northbound.view import View
from bridge.service import mirrored
from bridge.service.mirrored import required, serve_mirrored
from tests.support import sites


class Parts:
    """The mirror's client and the server of a front; ``said`` has what happens to them."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.said: list[str] = []
        monkeypatch.setattr(mirrored, "limit_memory", lambda most_mb: self.said.append(f"{most_mb} MB"))  # type: ignore[misc]
        monkeypatch.setattr(mirrored, "MirrorClient", self.client)

    def client(self, endpoint: str, clock: object, role: str) -> Parts:
        self.said.append(f"mirror of {role}")
        return self

    async def open(self) -> None:
        self.said.append("mirror open")

    async def close(self) -> None:
        self.said.append("mirror closed")

    async def run(self) -> None:
        await asyncio.get_running_loop().create_future()

    async def failed(self) -> None:
        await self.run()


class Ended:
    """A server that fails at once."""

    async def failed(self) -> None:
        raise OperationFailed("it listens no more")


async def test_a_front_whose_server_fails_closes_it_before_the_mirror(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    site = load_site(sites.write(tmp_path, sites.bus(sites.node(sites.drive("fu1", "none", 0)))))
    parts = Parts(monkeypatch)

    async def open_server(mirror: View, stack: AsyncExitStack) -> Ended:
        assert mirror is parts
        parts.said.append("server open")
        stack.callback(lambda: parts.said.append("server closed"))
        return Ended()

    with pytest.raises(ExceptionGroup) as raised:
        await serve_mirrored(site, "page", open_server, None)
    assert str(raised.value.exceptions[0]) == "it listens no more"
    memory = f"{site.site.front_memory_mb} MB"
    assert parts.said == [
        memory,
        "mirror of page",
        "mirror open",
        "server open",
        "server closed",
        "mirror closed",
    ]


def test_a_table_that_is_missing_is_named() -> None:
    assert required(5, "page") == 5
    with pytest.raises(OperationFailed, match=r"the site file has no \[page\] table"):
        required(None, "page")
