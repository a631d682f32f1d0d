"""The service itself: versions, who is connected, certificates, the site file and its check, and the log."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import msgspec
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from bridge.command import Role
from bridge.northbound.page.sessions import Session

MOST_LINES = 500
"""Of the audit log."""
_encode = msgspec.json.Encoder().encode


@dataclass(frozen=True, slots=True)
class CertificateFacts:
    """``of`` is whose it is: ``opcua``, ``page`` or a client's file; ``until`` is in seconds since 1970."""

    of: str
    subject: str
    until: float
    fingerprint: str


class SystemFacts(Protocol):
    """What the page shows of the service. All of it may take a moment, and is asked for in a thread."""

    def versions(self) -> dict[str, str]: ...

    def connections(self) -> dict[str, list[str]]:
        """Addresses of the clients that are connected, by protocol."""
        ...

    def certificates(self) -> list[CertificateFacts]: ...

    def site_file(self) -> dict[str, str]:
        """``path`` and ``text``, without anything secret; ``changed`` where it is not what is run."""
        ...

    def check(self) -> list[dict[str, Any]]:
        """What ``drivebridge check`` says of the site file as it is now: severity, line, text."""
        ...

    def audit(self, lines: int) -> list[dict[str, Any]]:
        """The latest entries of the audit log, the newest first."""
        ...


class System:
    """Routes for ``facts``; ``tabs`` tells who has the page open, ``session_of`` who asks. What tells of
    people and files is for engineers."""

    def __init__(
        self,
        facts: SystemFacts,
        tabs: Callable[[], list[dict[str, Any]]],
        session_of: Callable[[Request], Session | None],
    ) -> None:
        self._facts = facts
        self._tabs = tabs
        self._session_of = session_of
        self._checking = asyncio.Semaphore(1)
        self.routes = [
            Route("/api/system", self._system),
            Route("/api/system/site", self._site),
            Route("/api/system/audit", self._audit),
        ]

    async def _system(self, request: Request) -> Response:
        session = self._session_of(request)
        if session is None:
            return JSONResponse({"error": "login"}, 401)
        facts = self._facts
        versions, certificates, connections = await asyncio.gather(
            asyncio.to_thread(facts.versions),
            asyncio.to_thread(facts.certificates),
            asyncio.to_thread(facts.connections),
        )
        told: dict[str, Any] = {"versions": versions, "certificates": certificates}
        told["clients"] = {protocol: len(addresses) for protocol, addresses in connections.items()}
        if session.role >= Role.ENGINEER:
            told |= {"connections": connections, "tabs": self._tabs()}
        return _fresh(told)

    async def _site(self, request: Request) -> Response:
        if refusal := self._for_engineers(request):
            return refusal
        async with self._checking:
            file = await asyncio.to_thread(self._facts.site_file)
            return _fresh(file | {"findings": await asyncio.to_thread(self._facts.check)})

    async def _audit(self, request: Request) -> Response:
        if refusal := self._for_engineers(request):
            return refusal
        return _fresh(await asyncio.to_thread(self._facts.audit, MOST_LINES))

    def _for_engineers(self, request: Request) -> Response | None:
        session = self._session_of(request)
        if session is None:
            return JSONResponse({"error": "login"}, 401)
        if session.role < Role.ENGINEER:
            return JSONResponse({"error": "engineer"}, 403)
        return None


def _fresh(body: object) -> Response:
    return Response(_encode(body), headers={"cache-control": "no-store"}, media_type="application/json")
