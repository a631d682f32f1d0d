"""A bus that is cut under 40 drives: one alarm with its cause and what it explains, in both languages, gone
when the bus is back, and in the history after a restart of the service."""

from __future__ import annotations

import asyncio
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from asyncua import ua

from tests.support import scenario_plant
from tests.support.opcua_alarms import Follower, following, is_active, is_over, of
from tests.support.process import free_port
from tests.support.scenario_plant import Plant
from tests.wire.scenarios.asyncua_client import Ids, Session, logged_in
from tests.wire.scenarios.steps import Steps

NODES = [f"a{number}" for number in range(1, 11)]
DRIVES = [f"{node}/fu{number}" for node in NODES for number in range(1, 5)]
PLACE = "bus/can0"
SUPERVISION_MS = 300
SETTLED_S = 40.0
"""Where this machine was too slow meanwhile, that explains the silence for its first 20 s."""
CAUSE = {
    "de": "Alle 10 Knoten, die da sein müssten, schweigen: es liegt an dem, was sie gemeinsam haben, und"
    " nicht an jedem einzelnen.",
    "en": "All 10 nodes that should be there are silent, so what they share is to blame and not each of"
    " them.",
}
MESSAGE = {"de": f"Kein Knoten antwortet. {CAUSE['de']}", "en": f"No node answers. {CAUSE['en']}"}
REMEDY = {
    "de": "CAN-Kabel an der Box, beide Abschlusswiderstände (je 120 Ω), die Versorgung des Busses und die"
    " Bitrate prüfen.",
    "en": "Check the CAN cable at the box, both terminators (120 Ω each), the supply of the bus and the bit"
    " rate.",
}


async def _seen(follower: Follower, plant: Plant, locale: str) -> Mapping[str, Any]:
    raised = await follower.until(of(PLACE), is_active, seconds=SETTLED_S)
    assert raised["Message"] == ua.LocalizedText(MESSAGE[locale], locale)
    assert raised["Cause"] == ua.LocalizedText(CAUSE[locale], locale)
    assert raised["Remedy"] == ua.LocalizedText(REMEDY[locale], locale)
    return raised


@pytest.mark.landing
@pytest.mark.timeout(300)
def test_a_bus_that_is_cut_under_forty_drives_is_one_alarm(tmp_path: Path) -> None:
    port, began = free_port(), datetime.now(UTC)
    scenario_plant.lay_out(tmp_path)
    site = scenario_plant.write_site(
        tmp_path, port, [scenario_plant.nodes_of(0, 11, len(NODES), SUPERVISION_MS)]
    )
    with scenario_plant.serving(site, port, len(NODES)) as plant:
        told = asyncio.run(_cut_and_mended(plant, _steps(tmp_path, plant)))
    with scenario_plant.serving(site, port, len(NODES)) as plant:
        asyncio.run(_remembered(_steps(tmp_path, plant), began, told))


def _steps(folder: Path, plant: Plant) -> Steps:
    return Steps("a", str(folder), plant.url, str(plant.commands))


async def _cut_and_mended(plant: Plant, steps: Steps) -> list[bytes]:
    """EventIds of the alarm: active, and over."""
    async with (
        logged_in(steps, "anna", locale="de") as german,
        logged_in(steps, "otto", locale="en") as english,
        following(german) as follower,
        following(english) as other,
    ):
        before = len(follower.events)
        plant.tell("cut_cable", "can0")
        raised = await _seen(follower, plant, "de")
        await _seen(other, plant, "en")
        assert (raised["SourceName"], raised["Severity"], raised["Code"]) == (
            "can0",
            800,
            "condition.bus_silent",
        )
        assert sorted(raised["Explains"]) == sorted([*DRIVES, *NODES])
        session = await Session.of(german)
        places = [f"{one}/Alarm/ActiveState/Id" for one in (*DRIVES, *NODES)]
        active = [one for one in places if await session.until(one, lambda is_active: not is_active)]
        assert active == [], "one alarm"
        plant.tell("mend_cable", "can0")
        over = await follower.until(of(PLACE), is_over, seconds=SETTLED_S)
        assert over["Message"].Text == f"vorbei: {MESSAGE['de']}"
        others = [
            one for one in follower.events[before:] if one["SourceName"] in DRIVES and one["ActiveState/Id"]
        ]
        assert [(one["SourceName"], one["Code"]) for one in others] == []
        return [raised["EventId"], over["EventId"]]


async def _remembered(steps: Steps, began: datetime, told: list[bytes]) -> None:
    for locale in ("de", "en"):
        async with logged_in(steps, "otto", locale=locale) as client:
            kind = ua.NodeId(Ids.AlarmConditionType)
            bus = (await Session.of(client)).node(PLACE)
            found = await bus.read_event_history(began, datetime.now(UTC), 1000, evtypes=kind)
            kept = {one.EventId: one for one in found}
            first, last = (kept[one] for one in told)
            assert first.Message == ua.LocalizedText(MESSAGE[locale], locale)
            assert (getattr(first, "ActiveState/Id"), getattr(last, "ActiveState/Id")) == (True, False)
