"""Page for programmers of PLC, SCADA and fleet: how the servers are reached and all that they serve, to look
at and to download."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from typing import Any, Final

import msgspec
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from bridge.base.errors import OperationFailed
from bridge.config import Site
from bridge.northbound.page.refused import refused
from bridge.text import Text

Export = Callable[[], str]
"""Makes the text of a file; raises ``OperationFailed`` where a library that it needs is not installed."""

_MEDIA: Final = {
    "csv": "text/csv; charset=utf-8",
    "json": "application/json",
    "dbc": "text/plain; charset=utf-8",
}
_encode = msgspec.json.Encoder().encode


class Integration:
    """``exports`` are files by their names, such as ``modbus.csv``; each is made when it is asked for first.
    ``has_session`` says whether a request may read."""

    def __init__(
        self, site: Site, exports: Mapping[str, Export], has_session: Callable[[Request], bool]
    ) -> None:
        self._description = _encode(servers_of(site) | {"exports": list(exports)})
        self._site_name = site.site.name
        self._exports = exports
        self._made: dict[str, str] = {}
        self._has_session = has_session
        self.routes = [
            Route("/api/integration", self._servers),
            Route("/api/export/{name}", self._export),
        ]

    async def _servers(self, request: Request) -> Response:
        if not self._has_session(request):
            return JSONResponse({"error": "login"}, 401)
        return Response(self._description, media_type="application/json")

    async def _export(self, request: Request) -> Response:
        if not self._has_session(request):
            return JSONResponse({"error": "login"}, 401)
        name = request.path_params["name"]
        export = self._exports.get(name)
        if export is None:
            return refused(404, Text.of("page.there_is", known=tuple(self._exports)))
        if name not in self._made:
            try:
                self._made[name] = await asyncio.to_thread(export)
            except OperationFailed as error:
                return refused(503, error.said)
        ending = name.rpartition(".")[2]
        headers = {"content-disposition": f'attachment; filename="{self._site_name}-{name}"'}
        return Response(self._made[name], headers=headers, media_type=_MEDIA[ending])


def servers_of(site: Site) -> dict[str, Any]:
    """Servers of the site, for JSON: where each protocol is served and how; None for one that is not."""
    modbus, opcua, zenoh = site.modbus, site.opcua, site.zenoh
    return {
        "modbus": modbus and {"listen": modbus.listen, "word_order": modbus.word_order},
        "opcua": opcua
        and {
            "url": f"opc.tcp://{opcua.listen}",
            "no_security": opcua.no_security,
            "anonymous": opcua.anonymous,
            "users": len(opcua.user),
        },
        "zenoh": zenoh
        and {"mode": zenoh.mode, "listen": zenoh.listen, "prefix": f"{zenoh.prefix}/{site.site.name}"},
    }
