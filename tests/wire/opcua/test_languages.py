"""Names, descriptions, states and units in the language that each client asks for."""

from __future__ import annotations

import asyncio
import time

import pytest
from asyncua import Client, Node, ua

from bridge.northbound.opcua.server import OpcUaServer
from tests.support.opcua_client import node
from tests.support.opcua_site import LocalView

pytestmark = pytest.mark.asyncio(loop_scope="module")

SOURCE, SYSTEM_BUS = "conveyor/fu1/parameter/p509", 3
STATE, STATUS = "conveyor/fu1/status/state", "conveyor/fu1/status/status_word"
ENGLISH = {
    "name": "StatusWord",
    "browsed": "Status",
    "description": "output current",
    "state": "operation_enabled",
    "true": "true",
    "unit": "ampere",
    "argument": "1 forward, -1 reverse, 0 as the drive is set",
    "method": "ramp down, then no voltage",
    "parameter": "P509 source of the control word",
    "choice": "system bus",
    "chosen": "system bus",
}
GERMAN = {
    "name": "Statuswort",
    "browsed": "Status",
    "description": "Ausgangsstrom",
    "state": "Betrieb freigegeben",
    "true": "wahr",
    "unit": "Ampere",
    "argument": "1 vorwärts, -1 rückwärts, 0 wie der Antrieb eingestellt ist",
    "method": "Rampe herunter, dann keine Spannung",
    "parameter": "P509 Quelle Steuerwort",
    "choice": "Systembus",
    "chosen": "Systembus",
}


async def value(client: Client, name: str) -> object:
    return await (await node(client, name)).read_value()


async def browsed(drive: Node) -> ua.LocalizedText:
    found = await drive.get_references(ua.ObjectIds.HasComponent, ua.BrowseDirection.Forward)
    return next(one.DisplayName for one in found if one.BrowseName.Name == "Status")


async def told(server: OpcUaServer, *locales: str) -> dict[str, tuple[str | None, str | None]]:
    client = Client(server.endpoint_url, timeout=10)
    client.set_locale(locales)
    async with client:
        arguments = await value(client, "conveyor/fu1/Start/InputArguments")
        found = {
            "name": await (await node(client, STATUS)).read_display_name(),
            "browsed": await browsed(await node(client, "conveyor/fu1")),
            "description": await (await node(client, "conveyor/fu1/actual/current")).read_description(),
            "state": (await value(client, f"{STATE}/EnumStrings"))[4],
            "true": await value(client, f"{STATUS}/fault/TrueState"),
            "unit": (await value(client, "conveyor/fu1/actual/current/EngineeringUnits")).Description,
            "argument": arguments[0].Description,
            "method": await (await node(client, "conveyor/fu1/Stop")).read_description(),
            "parameter": await (await node(client, SOURCE)).read_description(),
            "choice": (await value(client, f"{SOURCE}/EnumValues"))[0].DisplayName,
            "chosen": await value(client, f"{SOURCE}/ValueAsText"),
        }
    return {what: (one.Text, one.Locale) for what, one in found.items()}


async def test_each_client_is_told_in_its_own_language_at_the_same_time(
    served: tuple[OpcUaServer, LocalView],
) -> None:
    server, view = served
    view.plant.image.set(view.plant.image.index[SOURCE], SYSTEM_BUS, time.monotonic())
    german, english, french = await asyncio.gather(
        told(server, "de-AT"), told(server, "en", "de"), told(server, "fr")
    )
    assert {what: words for what, (words, _) in english.items()} == ENGLISH
    assert {what: words for what, (words, _) in german.items()} == GERMAN
    assert {locale for what, (_, locale) in german.items() if GERMAN[what] != ENGLISH[what]} == {"de"}
    assert french == english


async def test_the_server_says_which_languages_it_has(client: Client) -> None:
    offered = client.get_node(ua.ObjectIds.Server_ServerCapabilities_LocaleIdArray)
    assert await offered.read_value() == ["en", "de"]
