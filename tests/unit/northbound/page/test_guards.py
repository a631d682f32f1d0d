"""Guards around the page: names by which it is reached, other pages, sizes, and the browser's rules."""

from __future__ import annotations

from typing import Any

import pytest
from starlette.types import Message, Receive, Scope, Send

from bridge.northbound.page.guards import MOST_BODY, MOST_FILE, MOST_HEAD, Guards


async def application(scope: Scope, receive: Receive, send: Send) -> None:
    if scope["type"] == "websocket":
        await send({"type": "websocket.accept"})
        return
    await send({"type": "http.response.start", "status": 200, "headers": []})
    await send({"type": "http.response.body", "body": b"ours"})


async def asked(
    kind: str = "http", method: str = "GET", path: str = "/", encrypted: bool = False, **headers: str
) -> list[dict[str, Any]]:
    sent: list[dict[str, Any]] = []

    async def send(message: Message) -> None:
        sent.append(dict(message))

    async def receive() -> Message:
        return {"type": "http.request", "body": b"", "more_body": False}

    named = {"host": "hall.local:8080", **headers}
    raw = [(name.replace("_", "-").encode(), value.encode()) for name, value in named.items()]
    scope = {"type": kind, "method": method, "path": path, "headers": raw}
    await Guards(application, ["Hall.local"], is_encrypted=encrypted)(scope, receive, send)
    return sent


async def refusal(**more: Any) -> str:
    """Reason of the refusal; empty where there is none."""
    sent = await asked(**more)
    if sent[0]["type"] == "websocket.close":
        assert sent[0]["code"] == 1008
        return sent[0]["reason"]
    if sent[0].get("status") == 400:
        return sent[1]["body"].decode()
    return ""


@pytest.mark.parametrize(
    "host", ["hall.local", "HALL.local:8080", "localhost", "127.0.0.1:8080", "[::1]:8080", "192.168.1.5"]
)
async def test_names_of_the_site_file_and_addresses_are_served(host: str) -> None:
    assert await refusal(host=host) == ""


@pytest.mark.parametrize("host", ["evil.example", "hall.local.evil.example", "", "hall"])
async def test_a_foreign_name_is_refused(host: str) -> None:
    """DNS rebinding."""
    assert "not served by this name" in await refusal(host=host)


async def test_another_page_changes_nothing_and_may_read_no_more_than_anybody() -> None:
    other = "https://evil.example"
    assert await refusal(method="POST", origin=other) == "not from another page"
    assert await refusal(method="POST", origin="http://hall.local:8080") == ""
    assert await refusal(method="POST", origin="https://hall.local:8080") == "not from another page"
    assert await refusal(method="POST", origin="https://hall.local:8080", encrypted=True) == ""
    assert await refusal(method="GET", origin=other) == ""
    assert await refusal(method="POST") == "", "who is no browser names no page"


async def test_a_websocket_comes_from_a_page_of_ours_alone() -> None:
    assert await refusal(kind="websocket") == "only from a page"
    assert await refusal(kind="websocket", origin="http://evil.example") == "not from another page"
    assert await refusal(kind="websocket", origin="http://hall.local:8080") == ""


@pytest.mark.parametrize(
    ("path", "length", "is_refused"),
    [
        ("/api/login", str(MOST_BODY), False),
        ("/api/login", str(MOST_BODY + 1), True),
        ("/api/set/conveyor", str(MOST_FILE), False),
        ("/api/backup/conveyor", str(MOST_FILE + 1), True),
        ("/api/login", "-1", True),
        ("/api/login", "many", True),
    ],
)
async def test_a_body_has_a_bound_and_says_so(path: str, length: str, is_refused: bool) -> None:
    assert bool(await refusal(method="POST", path=path, content_length=length)) is is_refused


async def test_a_body_without_a_length_is_refused() -> None:
    assert "says so" in await refusal(method="POST", transfer_encoding="chunked")


async def test_a_head_has_a_bound() -> None:
    assert await refusal(x="y" * MOST_HEAD) == f"a head has at most {MOST_HEAD} bytes"


async def test_every_answer_names_the_browsers_rules() -> None:
    for headers in ({}, {"host": "evil.example"}):
        start = (await asked(**headers))[0]
        found = {name.decode(): value.decode() for name, value in start["headers"]}
        assert found["content-security-policy"].startswith("default-src 'none'; script-src 'self'")
        assert found["x-content-type-options"] == "nosniff"
        assert "strict-transport-security" not in found
    start = (await asked(encrypted=True))[0]
    assert (b"strict-transport-security", b"max-age=31536000") in start["headers"]


async def test_what_is_neither_is_passed_on() -> None:
    seen: list[str] = []

    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        seen.append(scope["type"])

    await Guards(app, [], is_encrypted=False)({"type": "lifespan"}, None, None)  # type: ignore[arg-type]
    assert seen == ["lifespan"]
