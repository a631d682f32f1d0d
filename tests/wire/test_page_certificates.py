"""An administrator on the page decides which OPC UA clients are let in, of the whole service."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from asyncua import Client, ua
from asyncua.ua.status_codes import get_name_and_doc

from bridge.project import load_project
from bridge.trust.files import thumbprint
from tests.support.certificates import CLIENT, CLIENT_URI, Made, make
from tests.support.opcua_peers import Peer
from tests.support.process import Process, drivebridge, free_port, until
from tests.wire.test_page import Answer, Browser, user, write_site

HIDDEN = "BadSecurityChecksFailed"
"""Code for whoever is not trusted: it is told no more (OPC 10000-4 §6.1.3)."""


@dataclass
class Hall:
    """A service with page and OPC UA; ``state`` is its folder."""

    process: Process
    page: int
    opcua: str
    state: Path

    def browser(self, name: str) -> Browser:
        browser = Browser(self.page)
        assert browser.login(name).status == 200
        return browser


@pytest.fixture(scope="module")
def hall(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Hall]:
    folder, port = tmp_path_factory.mktemp("hall"), free_port()
    site = write_site(folder, port, opcua=user("admin"))
    settings = load_project(site).site.opcua
    assert settings is not None
    with drivebridge(folder, "run", "run", str(site), notify=True) as process:
        process.wait_ready()
        until(lambda: "the page is served on" in process.output(), 30.0, "the page is served")
        yield Hall(process, port, f"opc.tcp://{settings.listen}", folder / "state")


async def outcome(hall: Hall, made: Made) -> str:
    """Status code with which a client is refused, or Good."""
    client = Client(hall.opcua, timeout=10)
    client.set_user("operator")
    client.set_password("operator!")
    await Peer(made.der, made.pem_key, CLIENT_URI).secure(client)
    try:
        async with client:
            return "Good"
    except ua.UaStatusCodeError as error:
        return get_name_and_doc(error.code)[0]


def stranger(name: str) -> Made:
    return make(CLIENT.but(subject=name))


def listed(browser: Browser, made: Made) -> list[dict[str, Any]]:
    """Entries of the certificate, as the page shows them."""
    told = browser.request("GET", "/api/system").json
    assert told["faults"] == []
    return [one for one in told["certificates"] if one["thumbprint"] == thumbprint(made.certificate)]


def decide(browser: Browser, decision: str, thumbprint: str, **headers: str) -> Answer:
    named = {"x_token": browser.token} | headers
    return browser.request("POST", f"/api/certificates/{decision}", {"thumbprint": thumbprint}, **named)


async def test_a_refused_client_is_let_in_once_trusted_on_the_page_and_refused_once_rejected(
    hall: Hall,
) -> None:
    panel = stranger("panel")
    assert await outcome(hall, panel) == HIDDEN
    admin = await asyncio.to_thread(hall.browser, "admin")
    (one,) = await asyncio.to_thread(listed, admin, panel)
    assert (one["of"], one["subject"]) == ("rejected", "CN=panel")
    assert (one["since"], one["until"]) == (
        panel.certificate.not_valid_before_utc.timestamp(),
        panel.certificate.not_valid_after_utc.timestamp(),
    )
    assert one["wrong"]["text"]["code"] == "trust.untrusted"
    assert (await asyncio.to_thread(decide, admin, "trust", one["thumbprint"])).status == 200
    assert await outcome(hall, panel) == "Good"
    (now,) = await asyncio.to_thread(listed, admin, panel)
    assert (now["of"], now["thumbprint"], "wrong" in now) == ("trusted", one["thumbprint"], False)
    assert (await asyncio.to_thread(decide, admin, "reject", one["thumbprint"])).status == 200
    assert await outcome(hall, panel) == HIDDEN
    assert [one["of"] for one in await asyncio.to_thread(listed, admin, panel)] == ["rejected"]
    for verb in ("trusts", "rejects"):
        line = f"page: admin from 127.0.0.1 {verb} the certificate {one['thumbprint']}"
        until(lambda line=line: line in hall.process.output(), 5.0, line)


async def test_whoever_may_not_decide_changes_nothing(hall: Hall) -> None:
    panel = stranger("scada")
    assert await outcome(hall, panel) == HIDDEN
    admin = await asyncio.to_thread(hall.browser, "admin")
    (one,) = await asyncio.to_thread(listed, admin, panel)
    print_ = one["thumbprint"]
    for name in ("observer", "operator", "engineer"):
        browser = await asyncio.to_thread(hall.browser, name)
        answer = await asyncio.to_thread(decide, browser, "trust", print_)
        assert (answer.status, answer.json["error"]) == (403, "admin")
        shown = await asyncio.to_thread(listed, browser, panel)
        assert [one["of"] for one in shown] == (["rejected"] if name == "engineer" else [])
    answer = await asyncio.to_thread(decide, Browser(hall.page), "trust", print_)
    assert (answer.status, answer.json["error"]) == (401, "login")
    answer = await asyncio.to_thread(decide, admin, "trust", print_, x_token="guessed")
    assert (answer.status, answer.json["error"]) == (403, "token")
    answer = await asyncio.to_thread(decide, admin, "trust", print_, Origin="http://elsewhere.example")
    assert answer.status == 400
    asked = await asyncio.to_thread(admin.request, "GET", "/api/certificates/trust")
    assert asked.status == 405
    assert await outcome(hall, panel) == HIDDEN
    assert not (hall.state / "certificates" / "trusted" / f"{print_}.der").exists()


async def test_what_another_tool_has_taken_away_meanwhile_is_told(hall: Hall) -> None:
    panel = stranger("historian")
    assert await outcome(hall, panel) == HIDDEN
    admin = await asyncio.to_thread(hall.browser, "admin")
    (one,) = await asyncio.to_thread(listed, admin, panel)
    (hall.state / "certificates" / "rejected" / f"{one['thumbprint']}.der").unlink()
    answer = await asyncio.to_thread(decide, admin, "trust", one["thumbprint"])
    assert (answer.status, answer.json["text"]["code"]) == (409, "trust.no_such")
