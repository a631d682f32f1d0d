"""The OPC UA server and a client that neither we nor asyncua's authors wrote: node-opcua."""

from __future__ import annotations

import asyncio
import base64
import json
import shutil
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from cryptography.hazmat.primitives.serialization import Encoding

from bridge.command import Event, EventKind
from bridge.config import OpcUaTable, UserTable
from bridge.text import Text
from bridge.trust import TrustStore
from tests.support.certificates import AUTHORITY, CLIENT_URI, Case, cases, make, signed
from tests.support.opcua_alarms import cut_bus, tell
from tests.support.opcua_raw import cut, sessions
from tests.support.opcua_site import OPEN, serving
from tests.support.passwords import cheap_hash
from tests.support.process import REPOSITORY

FOLDER = REPOSITORY / "tests" / "wire" / "node"


@pytest.fixture(autouse=True)
def _needs_node_opcua() -> None:
    if shutil.which("node") is None or not (FOLDER / "node_modules" / "node-opcua-client").is_dir():
        pytest.skip(f"node-opcua is not there: install nodejs and npm, then `npm install` in {FOLDER}")


@asynccontextmanager
async def node(script: str, home: Path, *arguments: str) -> AsyncIterator[asyncio.subprocess.Process]:
    process = await asyncio.create_subprocess_exec(
        "node",
        str(FOLDER / script),
        *arguments,
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
        env={"HOME": str(home), "PATH": "/usr/local/bin:/usr/bin:/bin"},
    )
    try:
        async with asyncio.timeout(60):
            yield process
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()


def lines(out: bytes) -> list[dict[str, Any]]:
    """What a script said. node-opcua writes what it thinks of certificates to the standard output, too."""
    return [json.loads(line) for line in out.decode().splitlines() if line.startswith("{")]


async def answers(script: str, home: Path, *arguments: str) -> dict[str, Any]:
    async with node(script, home, *arguments) as process:
        out, errors = await process.communicate()
    assert process.returncode == 0, errors.decode()
    (seen,) = lines(out)
    return seen


def settings_for(*, encrypted: bool) -> OpcUaTable:
    user = UserTable(name="anna", role="operator", password_hash=cheap_hash("swordfish"))
    return OpcUaTable(
        listen="127.0.0.1:0",
        no_security=not encrypted,
        # It makes its certificate itself; whom the list lets in is for test_certificates.py.
        trust="anybody",
        anonymous="none" if encrypted else "operator",
        user=[user],
    )


@pytest.mark.landing(2)
@pytest.mark.parametrize("encrypted", [False, True])
async def test_node_opcua_browses_reads_writes_subscribes_and_calls(encrypted: bool, tmp_path: Path) -> None:
    async with serving(settings_for(encrypted=encrypted), tmp_path) as (server, _):
        login = ["anna", "swordfish"] if encrypted else []
        seen = await answers("client.mjs", tmp_path, server.endpoint_url, *login)
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


@pytest.mark.landing
async def test_node_opcua_walks_through_the_services(tmp_path: Path) -> None:
    async with serving(OPEN, tmp_path) as (server, view):
        happened = Event(time.monotonic(), EventKind.WATCHDOG, "conveyor/fu1", 900, Text.of("node.lost"))
        view.plant.events.report(happened)
        view.plant.deliver_outcomes()
        seen = await answers("services.mjs", tmp_path, server.endpoint_url)
    browsed = seen.pop("browsed")
    assert set(browsed[:-1]) == {3}
    assert sum(browsed) > 10
    assert seen == {
        "history": "BadHistoryOperationUnsupported",
        "kept": ["Good", True],
        "at": True,
        "past": [["conveyor/fu1", "node lost", 900]],
        "query": "BadServiceUnsupported",
        "part": 2,
        "none": "BadIndexRangeNoData",
        "revised": [50, 21, 7],
        "percent": "Good",
        "beyond": "BadDeadbandFilterInvalid",
        "rangeless": "BadDeadbandFilterInvalid",
        "events": "Good",
        "sessions": 3,
        "security": [
            "UA Binary",
            "opc.tcp",
            "http://opcfoundation.org/UA/SecurityPolicy#None",
            ["anonymous"],
        ],
        "queries": [1, 1],
        "links": ["Good"],
        "linked": True,
    }


@pytest.mark.landing
async def test_node_opcua_goes_on_after_lost_connections(tmp_path: Path) -> None:
    """First its session is still there, then only its subscription is: it is transferred."""
    said: list[dict[str, Any]] = []
    async with serving(settings_for(encrypted=True), tmp_path) as (server, view):
        login = (server.endpoint_url, "anna", "swordfish")
        async with node("reconnect.mjs", tmp_path, *login) as process:
            assert process.stdin and process.stdout

            async def until(key: str, value: object = None) -> None:
                while not any(key in one and value in (None, one[key]) for one in said):
                    line = await process.stdout.readline()  # pyright: ignore
                    assert line, said
                    said.extend(lines(line))

            def load(percent: float) -> None:
                view.plant.set("bus/can0/load", percent, time.monotonic())

            load(1.0)
            await until("value", 1)
            for percent, keeps_session in ((2.0, True), (3.0, True), (4.0, False)):
                (session,) = sessions(server)
                if not keeps_session:
                    await session.close_session(delete_subs=False)
                cut(server)
                load(percent)
                await until("value", percent)
                assert ([session] == sessions(server)) == keeps_session
                load(percent + 0.5)
                await until("value", percent + 0.5)
            process.stdin.close()
            await until("sent")
    told = [line["value"] for line in said if "value" in line]
    assert sorted(set(told)) == [1, 2, 2.5, 3, 3.5, 4, 4.5]
    # One subscription all the time: nothing had to be made anew.
    assert len({line["subscription"] for line in said if "subscription" in line}) == 1
    sent = said[-1]["sent"]
    assert sent.get("CreateSubscriptionRequest") == 1
    assert sent.get("TransferSubscriptionsRequest") == 1
    # Asked until there is nothing more, not for ever.
    assert 3 <= sent["RepublishRequest"] <= 12


@pytest.mark.landing
async def test_node_opcua_works_in_the_middle_of_a_crowd(tmp_path: Path) -> None:
    """Of its own address three hundred sockets that say nothing."""
    async with serving(settings_for(encrypted=True), tmp_path) as (server, _):
        crowd = [await asyncio.open_connection("127.0.0.1", server.port) for _ in range(300)]
        seen = await answers("client.mjs", tmp_path, server.endpoint_url, "anna", "swordfish")
        for _, writer in crowd:
            writer.close()
    assert (seen["run"], seen["stop"]) == ("Good", "Good")


@pytest.mark.landing
async def test_node_opcua_is_told_what_is_wrong_with_its_certificate(tmp_path: Path) -> None:
    hidden = "BadSecurityChecksFailed"
    expected = {
        "trusted itself": "Good",
        "short key": hidden,
        "run out": "BadCertificateTimeInvalid",
        "not for signing": "BadCertificateUseNotAllowed",
        "revoked": "BadCertificateRevoked",
    }
    shown, home = tmp_path / "shown", tmp_path / "state"
    shown.mkdir()
    store = TrustStore(home / "certificates")
    store.prepare()
    stranger = make()
    shown_by = {name: cases()[name] for name in expected} | {"unknown": Case((stranger,), ())}
    for name, case in shown_by.items():
        (shown / f"{name}.der").write_bytes(case.sent[0].der)
        (shown / f"{name}.pem").write_bytes(case.sent[0].pem_key)
        for number, one in enumerate(case.trusted):
            (store.trusted / f"{name} {number}.der").write_bytes(one.der)
        for crl in case.crls if name == "revoked" else ():
            (store.trusted / "revoked.crl").write_bytes(crl.public_bytes(Encoding.DER))
    site = settings_for(encrypted=True).model_copy(update={"trust": "list"})
    async with serving(site, home) as (server, _):
        how = (server.endpoint_url, str(shown), CLIENT_URI, "anna", "swordfish")
        assert await answers("certificates.mjs", tmp_path, *how) == expected | {"unknown": hidden}


@pytest.mark.landing
async def test_node_opcua_renews_the_certificate_of_the_server(tmp_path: Path) -> None:
    """By push, on a session that goes on."""
    admin = UserTable(name="eva", role="admin", password_hash=cheap_hash("swordfish"))
    site = settings_for(encrypted=True).model_copy(update={"user": [admin]})
    root = make(AUTHORITY)
    async with (
        serving(site, tmp_path) as (server, _),
        node("push.mjs", tmp_path, server.endpoint_url, "eva", "swordfish") as process,
    ):
        assert process.stdin and process.stdout
        while not (said := lines(line := await process.stdout.readline())):
            assert line, (await process.communicate())[1].decode()
        (asked,) = said
        made = signed(base64.b64decode(asked["request"]), root).public_bytes(Encoding.DER)
        answer = b" ".join(map(base64.b64encode, (made, root.der)))
        out, errors = await process.communicate(answer + b"\n")
    assert process.returncode == 0, errors.decode()
    (seen,) = lines(out)
    assert base64.b64decode(seen.pop("shown")) == made
    assert seen == {"updated": "Good", "required": True, "applied": "Good", "state": "Good"}


async def test_node_opcua_follows_an_alarm_and_handles_it(tmp_path: Path) -> None:
    """By its own means for alarms, with a comment in German. It asks for no language."""
    async with serving(settings_for(encrypted=False), tmp_path) as (server, view):
        said: list[dict[str, Any]] = []
        async with node("alarms.mjs", tmp_path, server.endpoint_url, "anna", "swordfish") as process:
            assert process.stdout
            async for line in process.stdout:
                said.extend(lines(line))
                if said and "monitoring" in said[-1]:
                    tell(view, cut_bus("conveyor"))
    _, raised, acked, shelved, done = said
    assert raised.pop("message").startswith("No node answers.")
    assert raised == {"severity": 800, "source": "can0", "retain": True}
    comment = {"comment": "gesehen, Kabel wird getauscht", "locale": "de"}
    assert acked == {"acked": "acknowledged", "user": "anna"} | comment
    assert shelved == {"shelved": "timed shelved"}
    assert done == {"calls": ["Good", "Good", "BadConditionBranchAlreadyAcked", "Good"]}
