"""The OPC UA server and a client that neither we nor asyncua's authors wrote: node-opcua."""

from __future__ import annotations

import asyncio
import json
import shutil
from pathlib import Path

import pytest

from bridge.config import OpcUaTable, UserTable
from bridge.northbound.opcua.security import hash_password
from tests.support.opcua_site import serving
from tests.support.process import REPOSITORY

FOLDER = REPOSITORY / "tests" / "wire" / "node"


@pytest.fixture(autouse=True)
def _needs_node_opcua() -> None:
    if shutil.which("node") is None or not (FOLDER / "node_modules" / "node-opcua-client").is_dir():
        pytest.skip(f"node-opcua is not there: install nodejs and npm, then `npm install` in {FOLDER}")


@pytest.mark.parametrize("encrypted", [False, True])
async def test_node_opcua_browses_reads_writes_subscribes_and_calls(encrypted: bool, tmp_path: Path) -> None:
    user = UserTable(name="anna", role="operator", password_hash=hash_password("swordfish"))
    settings = OpcUaTable(
        listen="127.0.0.1:0",
        no_security=not encrypted,
        anonymous="none" if encrypted else "operator",
        user=[user],
    )
    async with serving(settings, tmp_path) as (server, _):
        login = ["anna", "swordfish"] if encrypted else []
        process = await asyncio.create_subprocess_exec(
            "node",
            str(FOLDER / "client.mjs"),
            server.endpoint_url,
            *login,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.PIPE,
            env={"HOME": str(tmp_path), "PATH": "/usr/local/bin:/usr/bin:/bin"},
        )
        async with asyncio.timeout(60):
            out, errors = await process.communicate()
    assert process.returncode == 0, errors.decode()
    # node-opcua writes what it thinks of certificates to the standard output, too.
    (line,) = [line for line in out.decode().splitlines() if line.startswith("{")]
    seen = json.loads(line)
    assert seen.pop("children")[:2] == ["Start", "Stop"]
    assert seen.pop("states")[-3:] == [2, 4, 2]
    assert seen == {
        "unit": "Hz",
        "ready": "Good",
        "run": "Good",
        "readOnly": "BadNotWritable",
        "wrongType": "BadTypeMismatch",
        "notOurs": "BadUserAccessDenied",
        "stop": "Good",
    }
