"""The OPC UA server and a client that neither we nor asyncua's authors wrote: node-opcua."""

from __future__ import annotations

import asyncio
import json
import shutil
from pathlib import Path

import pytest

from bridge.config import OpcUaTable, UserTable
from bridge.northbound.opcua.security import hash_password
from bridge.northbound.opcua.server import OpcUaServer
from tests.support.opcua_site import serving
from tests.support.process import REPOSITORY

FOLDER = REPOSITORY / "tests" / "wire" / "node"


@pytest.fixture(autouse=True)
def _needs_node_opcua() -> None:
    if shutil.which("node") is None or not (FOLDER / "node_modules" / "node-opcua-client").is_dir():
        pytest.skip(f"node-opcua is not there: install nodejs and npm, then `npm install` in {FOLDER}")


def settings_for(*, encrypted: bool) -> OpcUaTable:
    user = UserTable(name="anna", role="operator", password_hash=hash_password("swordfish"))
    return OpcUaTable(
        listen="127.0.0.1:0",
        no_security=not encrypted,
        anonymous="none" if encrypted else "operator",
        user=[user],
    )


async def play(server: OpcUaServer, home: Path, *login: str) -> dict[str, object]:
    """What node-opcua has seen."""
    process = await asyncio.create_subprocess_exec(
        "node",
        str(FOLDER / "client.mjs"),
        server.endpoint_url,
        *login,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
        env={"HOME": str(home), "PATH": "/usr/local/bin:/usr/bin:/bin"},
    )
    async with asyncio.timeout(60):
        out, errors = await process.communicate()
    assert process.returncode == 0, errors.decode()
    # node-opcua writes what it thinks of certificates to the standard output, too.
    (line,) = [line for line in out.decode().splitlines() if line.startswith("{")]
    return json.loads(line)


@pytest.mark.parametrize("encrypted", [False, True])
async def test_node_opcua_browses_reads_writes_subscribes_and_calls(encrypted: bool, tmp_path: Path) -> None:
    async with serving(settings_for(encrypted=encrypted), tmp_path) as (server, _):
        seen = await play(server, tmp_path, *(["anna", "swordfish"] if encrypted else []))
    children, states = seen.pop("children"), seen.pop("states")
    assert isinstance(children, list)
    assert isinstance(states, list)
    assert children[:2] == ["Start", "Stop"]
    assert states[-3:] == [2, 4, 2]
    assert seen == {
        "unit": "Hz",
        "ready": "Good",
        "run": "Good",
        "readOnly": "BadNotWritable",
        "wrongType": "BadTypeMismatch",
        "notOurs": "BadUserAccessDenied",
        "stop": "Good",
    }


async def test_node_opcua_works_in_the_middle_of_a_crowd(tmp_path: Path) -> None:
    """Of its own address three hundred sockets that say nothing."""
    async with serving(settings_for(encrypted=True), tmp_path) as (server, _):
        crowd = [await asyncio.open_connection("127.0.0.1", server.port) for _ in range(300)]
        seen = await play(server, tmp_path, "anna", "swordfish")
        for _, writer in crowd:
            writer.close()
    assert (seen["run"], seen["stop"]) == ("Good", "Good")
