"""How clients find the server: by what it says of itself, and by a discovery server, which is open62541, or
asyncua's as an older one."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from asyncua import Client, ua

from bridge.config import OpcUaTable
from tests.support.opcua_peers import make_peer
from tests.support.opcua_raw import ask
from tests.support.opcua_site import OPEN, connected, serving
from tests.support.process import REPOSITORY, free_port


@asynccontextmanager
async def discovery_server(kind: str, folder: Path) -> AsyncIterator[str]:
    peer, port = make_peer("lds"), free_port()
    certificate, key = folder / "lds.der", folder / "lds.pem"
    certificate.write_bytes(peer.certificate)
    key.write_bytes(peer.key)
    process = await asyncio.create_subprocess_exec(
        sys.executable,
        *("-m", f"tests.peers.{kind}_lds", str(port), str(certificate), str(key)),
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.DEVNULL,
        cwd=REPOSITORY,
    )
    assert process.stdout and process.stdin
    try:
        async with asyncio.timeout(20):
            while b"ready" not in (line := await process.stdout.readline()):
                assert line, "it has ended"
        yield f"opc.tcp://127.0.0.1:{port}"
    finally:
        process.stdin.close()
        try:
            await asyncio.wait_for(process.wait(), 5)
        except TimeoutError:
            process.kill()
            await process.wait()


async def known(url: str) -> dict[str, list[str]]:
    found = await Client(url, timeout=5).connect_and_find_servers()
    return {one.ApplicationUri: list(one.DiscoveryUrls) for one in found}


async def registers(kind: str, folder: Path) -> None:
    """It is named by the discovery server as long as it runs."""
    async with discovery_server(kind, folder) as url:
        settings = OpcUaTable(listen="127.0.0.1:0", discovery_server=url)
        async with serving(settings, folder / "state") as (server, _):
            found: dict[str, list[str]] = {}
            for _ in range(100):
                found = await known(url)
                if len(found) > 1:
                    break
                await asyncio.sleep(0.05)
            [(uri, urls)] = [(uri, urls) for uri, urls in found.items() if uri.endswith(":drivebridge")]
            assert urls == [server.endpoint_url]
        assert uri not in await known(url), "it has said that it ends"


async def test_a_discovery_server_names_it_as_long_as_it_runs(tmp_path: Path) -> None:
    pytest.importorskip("o6", reason="open62541 is not there")
    await registers("open62541", tmp_path)


async def test_a_discovery_server_that_knows_no_registerserver2_names_it_as_well(tmp_path: Path) -> None:
    """Part 4 §5.5.6.1: after BadServiceUnsupported by RegisterServer."""
    await registers("asyncua", tmp_path)


async def test_a_discovery_server_that_is_away_is_in_nobodys_way(tmp_path: Path) -> None:
    settings = OPEN.model_copy(update={"discovery_server": f"opc.tcp://127.0.0.1:{free_port()}"})
    began = asyncio.get_running_loop().time()
    async with serving(settings, tmp_path) as (server, _), connected(server) as client:
        assert await client.get_namespace_array()
    assert asyncio.get_running_loop().time() - began < 8


async def test_it_names_itself_to_who_looks_for_it(tmp_path: Path) -> None:
    async with serving(OPEN, tmp_path) as (server, _), connected(server) as client:
        own = (await ask(client, "FindServers")).Servers[0].ApplicationUri
        for uris, there in (([own], 1), ([own, "urn:other"], 1), (["urn"], 0), (["urn:other"], 0)):
            answer = await ask(client, "FindServers", ServerUris=uris)
            assert [one.ApplicationUri for one in answer.Servers] == there * [own], uris
        with pytest.raises(ua.uaerrors.BadServiceUnsupported):
            await ask(client, "FindServersOnNetwork")
