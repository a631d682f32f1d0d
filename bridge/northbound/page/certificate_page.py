"""Decisions on certificates of OPC UA clients: who was refused is trusted, who is trusted is rejected.

For administrators alone, as push is (``northbound/opcua/certificates/server_configuration``), and where
nobody on the way can take over the session. The folders are the interface: the OPC UA server judges by what
is there.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from ipaddress import ip_address
from typing import Annotated, Final

import msgspec
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from bridge.base.errors import OperationFailed
from bridge.base.sources import source_of
from bridge.command import Role
from bridge.northbound.page.guards import MOST_BODY
from bridge.northbound.page.refused import BodyTooLong, refused
from bridge.northbound.page.sessions import PageSession
from bridge.trust import TrustStore

_log = logging.getLogger(__name__)

ReadBody = Callable[[Request, int], Awaitable[bytes]]
"""Reads the body of a request, of so many bytes at most; raises ``BodyTooLong`` or ``TimeoutError``."""


class _Chosen(msgspec.Struct, forbid_unknown_fields=True):
    """Certificate by its whole thumbprint: a beginning could be that of a stranger's, too."""

    thumbprint: Annotated[str, msgspec.Meta(pattern=r"^[0-9a-f]{40}\Z")]


_decode: Final = msgspec.json.Decoder(_Chosen).decode


class CertificatePage:
    """Routes for the folders of ``store``. ``session_of`` says who asks, ``has_token`` whether a request
    comes from our page."""

    def __init__(
        self,
        store: TrustStore,
        read_body: ReadBody,
        session_of: Callable[[Request], PageSession | None],
        has_token: Callable[[Request], bool],
    ) -> None:
        self._store = store
        self._read_body = read_body
        self._session_of = session_of
        self._has_token = has_token
        # One after the other: each may take a moment in a thread.
        self._turn = asyncio.Lock()
        self.routes = [
            Route("/api/certificates/trust", self._trust, methods=["POST"]),
            Route("/api/certificates/reject", self._reject, methods=["POST"]),
        ]

    async def _trust(self, request: Request) -> Response:
        return await self._decide(request, "trusts", self._put_into_trusted)

    async def _reject(self, request: Request) -> Response:
        return await self._decide(request, "rejects", self._take_out_of_trusted)

    def _put_into_trusted(self, thumbprint: str) -> None:
        self._store.trust(self._store.find_rejected(thumbprint).certificate)

    def _take_out_of_trusted(self, thumbprint: str) -> None:
        self._store.reject(self._store.find_trusted(thumbprint))

    async def _decide(self, request: Request, verb: str, decide: Callable[[str], None]) -> Response:
        session = self._session_of(request)
        if session is None:
            return JSONResponse({"error": "login"}, 401)
        if refusal := self._refusal(request, session):
            return refusal
        try:
            chosen = _decode(await self._read_body(request, MOST_BODY))
        except BodyTooLong as error:
            return refused(400, error.said)
        except (msgspec.DecodeError, TimeoutError, ValueError) as error:
            return refused(400, str(error))
        try:
            async with self._turn:
                await asyncio.to_thread(decide, chosen.thumbprint)
        except OperationFailed as error:
            _log.warning("page: %s %s %s in vain: %s", session.user, verb, chosen.thumbprint, error)
            return refused(409, error.said)
        # The address as it is: ``session.address`` may be that of a whole network.
        address = request.client.host if request.client else "an unknown address"
        _log.info("page: %s from %s %s the certificate %s", session.user, address, verb, chosen.thumbprint)
        return JSONResponse({}, headers={"cache-control": "no-store"})

    def _refusal(self, request: Request, session: PageSession) -> Response | None:
        if not self._has_token(request):
            return JSONResponse({"error": "token"}, 403)
        if session.role < Role.ADMIN:
            return JSONResponse({"error": "admin"}, 403)
        if not _is_private(request):
            return JSONResponse({"error": "encryption"}, 403)
        return None


def _is_private(request: Request) -> bool:
    """True by TLS, and on the box itself, where a proxy with TLS may be."""
    if request.scope["scheme"] == "https":
        return True
    try:
        return ip_address(source_of(request.client.host if request.client else "")).is_loopback
    except ValueError:
        return False
