"""The page as a web application: files, login, and one WebSocket for each tab."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncGenerator, Callable, Iterable, Mapping, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal, TypedDict

import msgspec
from starlette.applications import Starlette
from starlette.middleware import Middleware
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import HTTPConnection, Request
from starlette.responses import FileResponse, Response
from starlette.routing import BaseRoute, Mount, Route, WebSocketRoute
from starlette.staticfiles import StaticFiles
from starlette.types import ASGIApp, Scope
from starlette.websockets import WebSocket

from bridge.base.sources import source_of
from bridge.catalogue import Catalogue
from bridge.command import Role
from bridge.condition.plant_layout import layout_of
from bridge.config import PageTable, UserTable
from bridge.northbound.logins import PasswordChecks, TooManyChecks
from bridge.northbound.page.bus_page import BusPage, Capture
from bridge.northbound.page.certificate_page import CertificatePage
from bridge.northbound.page.guards import MOST_BODY, Guards
from bridge.northbound.page.integration import Export, Integration
from bridge.northbound.page.parameter_page import Counts, ParameterPage, holders_of
from bridge.northbound.page.refused import BodyTooLong
from bridge.northbound.page.sessionfile import SessionFile, credential_of
from bridge.northbound.page.sessions import PageSession, PageSessions
from bridge.northbound.page.site_description import described
from bridge.northbound.page.system import System, SystemFacts
from bridge.northbound.page.tabs import Tabs
from bridge.northbound.page.throttle import FIRST_PAUSE_S, Throttle
from bridge.northbound.page.traffic import BusTap, TrafficViews
from bridge.northbound.view import View
from bridge.text.templates import LANGUAGES, source
from bridge.trust import TrustStore

_log = logging.getLogger(__name__)

STATIC: Final = Path(__file__).parent / "static"
_MOST_CHECKS: Final = 8
"""Most passwords that wait to be checked at a time."""
_BODY_S: Final = 5.0
_encode = msgspec.json.Encoder().encode


FaultTexts = Mapping[str, Mapping[str, Mapping[str, Mapping[str, str]]]]
"""Texts, causes and remedies of faults, by language, family and the fault's number."""


@dataclass(frozen=True, slots=True)
class PageSources:
    """Sources of what the page shows beside the points: files, buses and the system."""

    fault_texts: FaultTexts
    exports: Mapping[str, Export]
    taps: Sequence[tuple[str, int, BusTap]]
    """Name, bit rate in bit/s and tap of each bus."""
    layouts: Mapping[str, Any]
    capture: Capture
    counts: Counts
    dictionaries: Mapping[str, Path]
    """Makers' device descriptions by mapping."""
    system: SystemFacts
    clients: TrustStore | None = None
    """Certificates of OPC UA clients; None where the site serves no OPC UA."""


class _Files(StaticFiles):
    """Static files that a browser revalidates each time: after an update, old modules must not be loaded
    beside new ones."""

    async def get_response(self, path: str, scope: Scope) -> Response:
        response = await super().get_response(path, scope)
        response.headers["cache-control"] = "no-cache"
        return response


class _OfCookie(TypedDict):
    """Attributes of the cookie: without them a browser does not delete it."""

    path: str
    httponly: bool
    samesite: Literal["strict"]
    secure: bool


class _Login(msgspec.Struct, forbid_unknown_fields=True):
    user: str
    password: str


_decode_login = msgspec.json.Decoder(_Login).decode


class Page:
    """The application. Its users, and who may read without a login, are those of OPC UA."""

    def __init__(
        self,
        view: View,
        catalogue: Catalogue,
        sources: PageSources,
        clock: Callable[[], float],
        kept: Path | None = None,
    ) -> None:
        """``kept`` is a file for the sessions, for a front after this one."""
        site = catalogue.site
        settings, table = site.opcua, site.page or PageTable.model_validate({})
        self._clock = clock
        self._fault_texts = sources.fault_texts
        self._site_name = site.site.name
        self._users = {user.name: user for user in settings.user} if settings else {}
        self._anonymous = Role.named(settings.anonymous) if settings else None
        self._sessions = PageSessions()
        self._throttle = Throttle()
        self._checks = PasswordChecks(most=_MOST_CHECKS)
        layout = layout_of(view.image.points, catalogue)
        self._tabs = Tabs(view, layout, self._sessions, TrafficViews(sources.taps), clock)
        if kept is not None:
            file = SessionFile(kept, self._credentials(settings.user if settings else ()))
            self._sessions.restore(file.load(clock()))
            self._tabs.keep = file.save
        self._description = _encode(described(view.image, catalogue))
        self._is_encrypted = table.certificate is not None
        # The port: cookies know none, and two pages of one host would log each other out.
        name = f"session-{table.listen.rpartition(':')[2]}"
        self._cookie = f"__Host-{name}" if self._is_encrypted else name
        self._of_cookie: _OfCookie = {
            "path": "/",
            "httponly": True,
            "samesite": "strict",
            "secure": self._is_encrypted,
        }
        served = Starlette(
            routes=self._routes(catalogue, sources),
            middleware=[Middleware(GZipMiddleware, minimum_size=1024)],
            lifespan=self._life,
        )
        # Not as middleware: Starlette's own answer to an exception would go round it.
        self.app: ASGIApp = Guards(served, table.names, is_encrypted=self._is_encrypted)

    def _routes(self, catalogue: Catalogue, sources: PageSources) -> list[BaseRoute]:
        settings = catalogue.site.opcua
        return [
            Route("/", _index),
            Route("/api/session", self._session),
            Route("/api/site", self._site),
            Route("/api/faults/{language}", self._faults),
            Route("/api/texts/{language}", self._texts),
            Route("/api/login", self._login, methods=["POST"]),
            Route("/api/logout", self._logout, methods=["POST"]),
            *Integration(catalogue.site, sources.exports, self._has_session).routes,
            *ParameterPage(
                holders_of(catalogue),
                sources.counts,
                sources.dictionaries,
                body_of,
                self._has_session,
                self._has_token,
            ).routes,
            *BusPage(self._site_name, sources.layouts, sources.capture, self._session_of).routes,
            *System(
                sources.system,
                lambda: self.shown,
                self._session_of,
                trusts_anybody=settings is not None and settings.trust == "anybody",
            ).routes,
            *self._certificate_routes(sources.clients),
            WebSocketRoute("/live", self._live),
            Mount("/static", _Files(directory=STATIC)),
        ]

    @asynccontextmanager
    async def _life(self, app: Starlette) -> AsyncGenerator[None]:
        async with self._tabs.serving():
            yield
        self._checks.close()

    def _certificate_routes(self, clients: TrustStore | None) -> list[Route]:
        if clients is None:
            return []
        return CertificatePage(clients, body_of, self._session_of, self._has_token).routes

    @property
    def shown(self) -> list[dict[str, Any]]:
        """Tabs that are open, as ``Tabs.shown``."""
        return self._tabs.shown

    # who asks

    def _credentials(self, users: Iterable[UserTable]) -> dict[str, str]:
        """Credential hash of each user, and under the empty name that of visitors."""
        credentials = {user.name: credential_of(user.role, user.password_hash or "") for user in users}
        if self._anonymous is not None:
            credentials[""] = credential_of(self._anonymous.name, "")
        return credentials

    def _session_of(self, connection: HTTPConnection) -> PageSession | None:
        session_id = connection.cookies.get(self._cookie)
        return self._sessions.find(session_id, self._clock()) if session_id else None

    def _has_session(self, connection: HTTPConnection) -> bool:
        return self._session_of(connection) is not None

    def _has_token(self, connection: HTTPConnection) -> bool:
        """True if the request comes from our page, by its token, and not only with its cookie."""
        session = self._session_of(connection)
        return session is not None and session.has(connection.headers.get("x-token", ""))

    def _begin(self, request: Request, user: str, role: Role) -> Response:
        """Answer that begins a session and describes it."""
        session = self._sessions.begin(user, role, self._clock(), _address_of(request))
        return self._with_cookie(self._shown(session), session)

    def _shown(self, session: PageSession) -> dict[str, Any]:
        return {
            "user": session.user,
            "role": session.role.name.lower(),
            "token": session.token,
            "has_users": bool(self._users),
        }

    def _with_cookie(self, body: Mapping[str, Any], session: PageSession) -> Response:
        response = Response(_encode(body), media_type="application/json")
        response.set_cookie(self._cookie, session.id, **self._of_cookie)
        response.headers["cache-control"] = "no-store"
        return response

    async def _session(self, request: Request) -> Response:
        """Session of this browser; where anybody may read, it becomes a visitor by asking."""
        session = self._session_of(request)
        if session is not None:
            return self._json(self._shown(session))
        if self._anonymous is None:
            return self._json({"user": None, "site": self._site_name}, 401)
        return self._begin(request, "", self._anonymous)

    async def _login(self, request: Request) -> Response:
        address = _address_of(request)
        try:
            login = _decode_login(await body_of(request, MOST_BODY))
        except (msgspec.DecodeError, TimeoutError, ValueError):
            return self._json({"error": "malformed"}, 400)
        pause_s = self._throttle.begin(address, login.user, self._clock())
        if pause_s:
            return self._throttled(pause_s)
        user = self._users.get(login.user)
        password_hash = user.password_hash if user else None
        try:
            is_right = await self._checks.is_right(password_hash, login.password, address)
        except TooManyChecks:
            self._throttle.withdrawn(address, login.user)
            return self._throttled(FIRST_PAUSE_S)
        if not is_right or user is None:
            _log.warning("page: login of %r from %s refused", login.user[:64], address)
            return self._json({"error": "wrong"}, 403)
        self._throttle.succeeded(address, login.user)
        before = self._session_of(request)
        if before:
            self._sessions.end(before)
            self._tabs.end(before)
        _log.info("page: %s logged in from %s", user.name, address)
        return self._begin(request, user.name, Role[user.role.upper()])

    def _throttled(self, pause_s: float) -> Response:
        response = self._json({"error": "throttled", "pause_s": round(pause_s, 1)}, 429)
        response.headers["retry-after"] = str(round(pause_s + 0.5))
        return response

    async def _logout(self, request: Request) -> Response:
        session = self._session_of(request)
        if session is None or not session.has(request.headers.get("x-token", "")):
            return self._json({"error": "token"}, 403)
        self._sessions.end(session)
        self._tabs.end(session)
        response = self._json({})
        response.delete_cookie(self._cookie, **self._of_cookie)
        return response

    async def _site(self, request: Request) -> Response:
        if self._session_of(request) is None:
            return self._json({"error": "login"}, 401)
        return Response(
            self._description, media_type="application/json", headers={"cache-control": "no-cache"}
        )

    async def _faults(self, request: Request) -> Response:
        """Fault texts of the families in another language."""
        if self._session_of(request) is None:
            return self._json({"error": "login"}, 401)
        language = request.path_params["language"]
        if language not in self._fault_texts:
            return self._json({"error": "language"}, 404)
        headers = {"cache-control": "no-cache"}
        return Response(_encode(self._fault_texts[language]), headers=headers, media_type="application/json")

    async def _texts(self, request: Request) -> Response:
        """Templates of the bridge's texts in a language."""
        if self._session_of(request) is None:
            return self._json({"error": "login"}, 401)
        language = request.path_params["language"]
        if language not in LANGUAGES:
            return self._json({"error": "language"}, 404)
        return Response(
            source(language), headers={"cache-control": "no-cache"}, media_type="application/json"
        )

    def _json(self, body: Mapping[str, Any], status: int = 200) -> Response:
        headers = {"cache-control": "no-store"}
        return Response(_encode(body), status, headers, media_type="application/json")

    async def _live(self, socket: WebSocket) -> None:
        await self._tabs.serve(socket, self._session_of(socket))


def _address_of(request: Request) -> str:
    return source_of(request.client.host if request.client else "")


async def _index(request: Request) -> Response:
    return FileResponse(STATIC / "index.html", headers={"cache-control": "no-cache"})


async def body_of(request: Request, most: int) -> bytes:
    """Body of a request. Raises ``TimeoutError`` for one that comes too slowly, ``BodyTooLong`` for one of
    more than ``most`` bytes."""
    body = bytearray()
    async with asyncio.timeout(_BODY_S):
        async for chunk in request.stream():
            body += chunk
            if len(body) > most:
                raise BodyTooLong
    return bytes(body)
