"""For who programs against a site: how its servers are reached, and its exports as files, made once."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest
from starlette.requests import Request
from starlette.responses import Response

from bridge.base.errors import OperationFailed
from bridge.config import Site
from bridge.northbound.page.integration import Integration, servers_of
from tests.support import sites

NODE = sites.bus(sites.node(sites.drive("fu1", "none", 0)))


def site(*servers: str) -> Site:
    return Site.model_validate(sites.parsed(sites.site(NODE, *servers)))


def test_each_protocol_that_is_served_says_where_and_how() -> None:
    found = servers_of(site(sites.modbus(1502), sites.opcua(4840), sites.zenoh(7447)))
    assert found["modbus"] == {"listen": "127.0.0.1:1502", "word_order": "ABCD"}
    assert found["opcua"]["url"] == "opc.tcp://127.0.0.1:4840"
    assert (found["opcua"]["no_security"], found["opcua"]["users"]) == (True, 0)
    assert found["zenoh"]["prefix"].endswith("/hall")


def test_one_that_is_not_served_is_none() -> None:
    assert servers_of(site()) == {"modbus": None, "opcua": None, "zenoh": None}


class Case:
    def __init__(self, *, has_session: bool = True) -> None:
        self.made: list[str] = []
        exports: dict[str, Callable[[], str]] = {"modbus.csv": self._csv, "can0.dbc": self._dbc}
        self.page = Integration(site(sites.modbus(1502)), exports, lambda request: has_session)

    def _csv(self) -> str:
        self.made.append("csv")
        return "a,b\n"

    def _dbc(self) -> str:
        raise OperationFailed("install drivebridge[dbc]")

    async def get(self, path: str, **params: str) -> Response:
        (route,) = (route for route in self.page.routes if route.path == path)
        scope: dict[str, Any] = {"type": "http", "method": "GET", "path": path, "headers": []}
        return await route.endpoint(Request({**scope, "path_params": params}))

    async def export(self, name: str) -> Response:
        return await self.get("/api/export/{name}", name=name)


async def test_who_is_not_logged_in_reads_nothing() -> None:
    case = Case(has_session=False)
    assert (await case.get("/api/integration")).status_code == 401
    assert (await case.export("modbus.csv")).status_code == 401
    assert case.made == []


async def test_the_servers_come_with_the_names_of_the_files() -> None:
    found = json.loads(bytes((await Case().get("/api/integration")).body))
    assert found["exports"] == ["modbus.csv", "can0.dbc"]
    assert found["modbus"]["listen"] == "127.0.0.1:1502"


async def test_a_file_is_made_once_and_named_by_its_site() -> None:
    case = Case()
    for _ in range(2):
        answer = await case.export("modbus.csv")
        assert bytes(answer.body) == b"a,b\n"
    assert case.made == ["csv"]
    assert answer.headers["content-disposition"] == 'attachment; filename="hall-modbus.csv"'
    assert answer.headers["content-type"].startswith("text/csv")


@pytest.mark.parametrize(
    ("name", "status", "error"),
    [
        ("can0.dbc", 503, "install drivebridge[dbc]"),
        ("passwd", 404, "there is modbus.csv, can0.dbc"),
    ],
)
async def test_what_cannot_be_made_or_is_not_there_says_so(name: str, status: int, error: str) -> None:
    answer = await Case().export(name)
    assert (answer.status_code, json.loads(bytes(answer.body))["error"]) == (status, error)
