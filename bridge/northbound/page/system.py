"""The service itself: versions, who is connected, certificates, the site file and its check, and the log."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

import msgspec
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from bridge.base.guard import Guard
from bridge.command import Role
from bridge.northbound.page.sessions import PageSession
from bridge.text import Said, Text, Words, as_json, render
from bridge.trust.store import REJECTED

MOST_LINES = 500
"""Most lines of the audit log in one answer."""
_Told = TypeVar("_Told")
_encode = msgspec.json.Encoder().encode


@dataclass(frozen=True, slots=True)
class CertificateFacts:
    """One certificate. ``of`` is its owner: ``opcua``, ``page``, a client's file, or the folder that holds
    it; it is valid from ``since`` to ``until``, in seconds since 1970. ``fingerprint`` is SHA-256, and
    ``thumbprint`` SHA-1, by which who decides on it names it. ``wrong`` is what stands against it."""

    of: str
    subject: str
    since: float
    until: float
    fingerprint: str
    thumbprint: str
    wrong: Said = ""

    @property
    def is_refused(self) -> bool:
        return self.of == REJECTED


@dataclass(frozen=True, slots=True)
class UnreadablePart:
    """A part that could not be read. ``of`` as in ``CertificateFacts``, or the name of a part of the system;
    ``text`` is the reason."""

    of: str
    text: Words


class SystemFacts(Protocol):
    """Facts of the service that the page shows. Each may take a moment and is asked for in a thread."""

    def versions(self) -> dict[str, str]: ...

    def connections(self) -> dict[str, list[str]]:
        """Addresses of the clients that are connected, by protocol."""
        ...

    def certificates(self) -> list[CertificateFacts | UnreadablePart]: ...

    def site_file(self) -> dict[str, str]:
        """``path`` and ``text``, without anything secret; ``changed`` where it is not what is run."""
        ...

    def check(self) -> list[dict[str, Any]]:
        """Findings of ``drivebridge check`` on the site file as it is now: severity, line, text."""
        ...

    def audit(self, lines: int) -> list[dict[str, Any]]:
        """The latest entries of the audit log, the newest first."""
        ...


class System:
    """Routes for ``facts``; ``tabs`` lists the open tabs, ``session_of`` gives the session of a request.
    Facts on people and files are for engineers. With ``trusts_anybody`` no list of OPC UA clients counts."""

    def __init__(
        self,
        facts: SystemFacts,
        tabs: Callable[[], list[dict[str, Any]]],
        session_of: Callable[[Request], PageSession | None],
        *,
        trusts_anybody: bool = False,
    ) -> None:
        self._facts = facts
        self._trusts_anybody = trusts_anybody
        self._tabs = tabs
        self._session_of = session_of
        self._checking = asyncio.Semaphore(1)
        self._guard = Guard("page: system")
        self.routes = [
            Route("/api/system", self._system),
            Route("/api/system/site", self._site),
            Route("/api/system/audit", self._audit),
        ]

    async def _system(self, request: Request) -> Response:
        """Answer with all facts; ``faults`` has those that could not be read, with the reason, by certificate
        or whole part."""
        session = self._session_of(request)
        if session is None:
            return JSONResponse({"error": "login"}, 401)
        facts, faults = self._facts, list[UnreadablePart]()
        versions, certificates, connections = await asyncio.gather(
            self._asked(facts.versions, {}, faults),
            self._asked(facts.certificates, [], faults),
            self._asked(facts.connections, {}, faults),
        )
        faults += [one for one in certificates if isinstance(one, UnreadablePart)]
        readable = [one for one in certificates if isinstance(one, CertificateFacts)]
        # Names that strangers have given themselves are for those who decide on them.
        is_engineer = session.role >= Role.ENGINEER
        shown = [_listed(one) for one in readable if is_engineer or not one.is_refused]
        told: dict[str, Any] = {"versions": versions, "certificates": shown}
        told["trusts_anybody"] = self._trusts_anybody
        told["faults"] = [_shown(one) for one in faults]
        told["clients"] = {protocol: len(addresses) for protocol, addresses in connections.items()}
        if is_engineer:
            told |= {"connections": connections, "tabs": self._tabs()}
        return _fresh(told)

    async def _site(self, request: Request) -> Response:
        if refusal := self._for_engineers(request):
            return refusal
        faults = list[UnreadablePart]()
        async with self._checking:
            file = await self._asked(self._facts.site_file, {"path": "", "text": ""}, faults)
            findings = await self._asked(self._facts.check, [], faults)
        return _fresh(file | {"findings": [*map(_as_finding, faults), *findings]})

    async def _audit(self, request: Request) -> Response:
        if refusal := self._for_engineers(request):
            return refusal
        return _fresh(await self._asked(self._latest, [], []))

    def _latest(self) -> list[dict[str, Any]]:
        return self._facts.audit(MOST_LINES)

    async def _asked(self, ask: Callable[[], _Told], nothing: _Told, faults: list[UnreadablePart]) -> _Told:
        """Answer of ``ask``; where it fails ``nothing`` and one more entry in ``faults``, so that the rest is
        still shown."""
        with self._guard:
            return await asyncio.to_thread(ask)
        faults.append(UnreadablePart(ask.__name__, Text.of("page.part_failed")))
        return nothing

    def _for_engineers(self, request: Request) -> Response | None:
        session = self._session_of(request)
        if session is None:
            return JSONResponse({"error": "login"}, 401)
        if session.role < Role.ENGINEER:
            return JSONResponse({"error": "engineer"}, 403)
        return None


def _listed(one: CertificateFacts) -> dict[str, Any]:
    facts = {
        "of": one.of,
        "subject": one.subject,
        "since": one.since,
        "until": one.until,
        "fingerprint": one.fingerprint,
        "thumbprint": one.thumbprint,
    }
    if not one.wrong:
        return facts
    return facts | {"wrong": {"message": render(one.wrong), "text": as_json(one.wrong)}}


def _shown(part: UnreadablePart) -> dict[str, Any]:
    return {"of": part.of, "message": render(part.text), "text": as_json(part.text)}


def _as_finding(part: UnreadablePart) -> dict[str, Any]:
    said = Text.of("page.part", of=part.of, why=Text.plain(part.text))
    return {"severity": "error", "line": 0, "message": render(said), "text": as_json(said)}


def _fresh(body: object) -> Response:
    return Response(_encode(body), headers={"cache-control": "no-store"}, media_type="application/json")
