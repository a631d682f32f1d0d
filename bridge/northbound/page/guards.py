"""Headers that each answer of the page carries, and requests that are refused unread."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from ipaddress import ip_address
from typing import Final

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

MOST_BODY: Final = 65_536
"""Largest body of a request, bytes."""
MOST_FILE: Final = 4 << 20
"""Largest file in a request, bytes."""
_FILES: Final = ("/api/set/", "/api/backup/")
"""Paths to which files are sent."""
MOST_HEAD: Final = 16_384
"""Largest head of a request, bytes."""
_POLICY: Final = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self'",
        "img-src 'self' data:",
        "font-src 'self'",
        "connect-src 'self'",
        "base-uri 'none'",
        "form-action 'none'",
        "frame-ancestors 'none'",
    )
)
_HEADERS: Final[Mapping[str, str]] = {
    "content-security-policy": _POLICY,
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), geolocation=(), microphone=()",
}
_ONE_YEAR: Final = "max-age=31536000"


class Guards:
    """Middleware around the application: sets the browser's security headers, and refuses requests that no
    page of ours has sent.

    ``names`` are the host names by which the page may be reached, beside ``localhost`` and addresses. A
    request by another name is how a foreign page reads ours through a name of its own (DNS rebinding); an
    address is nobody's own. ``is_encrypted``: the page is served by
    TLS alone.
    """

    def __init__(self, app: ASGIApp, names: Iterable[str], *, is_encrypted: bool) -> None:
        self._app = app
        self._names = frozenset(name.lower() for name in names) | {"localhost"}
        self._headers = dict(_HEADERS) | ({"strict-transport-security": _ONE_YEAR} if is_encrypted else {})
        self._scheme = "https" if is_encrypted else "http"

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        headers = Headers(scope=scope)
        host = headers.get("host", "")
        why = self._refusal(scope, headers, host)
        if why and scope["type"] == "websocket":
            await send({"type": "websocket.close", "code": 1008, "reason": why})
            return
        answer = PlainTextResponse(why, 400) if why else self._app

        async def guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(self._headers)
            await send(message)

        await answer(scope, receive, guarded)

    def _refusal(self, scope: Scope, headers: Headers, host: str) -> str:
        if sum(len(name) + len(value) for name, value in scope["headers"]) > MOST_HEAD:
            return f"a head has at most {MOST_HEAD} bytes"
        name = _without_port(host)
        if name not in self._names and not _is_address(name):
            return "this page is not served by this name: page.names in the site file has those that it is"
        origin = headers.get("origin")
        changes = scope["type"] == "websocket" or scope["method"] not in ("GET", "HEAD")
        if changes and origin is not None and origin != f"{self._scheme}://{host}":
            return "not from another page"
        if scope["type"] == "websocket" and origin is None:
            return "only from a page"
        length = headers.get("content-length", "0")
        most = MOST_FILE if scope["path"].startswith(_FILES) else MOST_BODY
        if not length.isdecimal() or int(length) > most or "transfer-encoding" in headers:
            return f"a body has at most {most} bytes, and says so"
        return ""


def _is_address(host: str) -> bool:
    try:
        ip_address(host)
    except ValueError:
        return False
    return True


def _without_port(host: str) -> str:
    name, _, port = host.rpartition(":")
    return (name if port.isdecimal() and name else host).strip("[]").lower()
