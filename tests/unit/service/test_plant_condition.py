"""Condition of the plant, as points and events of the bus process."""

from __future__ import annotations

import json
from typing import Any

import pytest

from bridge.command import Event, EventKind, Identity, Source
from bridge.command.drive_link import NodeState
from bridge.image import Quality
from bridge.northbound.modbus.registers import RegisterTable
from bridge.northbound.modbus.unit import BridgeUnit
from bridge.northbound.modbus.units import units_of
from bridge.northbound.zenoh.keys import event_json
from bridge.service.event_log import log_event
from bridge.service.plant_condition import PlantCondition
from tests.support import sites
from tests.support.node_states import node_goes
from tests.support.views import view_of

PLC = Identity(Source.MODBUS, "plc")
_DRIVE = sites.drive("fu1", "lease", 1000)
_NODES = (sites.node(_DRIVE, name="belt"), sites.node(_DRIVE, name="press", node_id=6))
_SITE = sites.site(sites.bus(*_NODES))


class Box:
    def __init__(self) -> None:
        self.plant = sites.plant_of(_SITE)
        self.now = 100.0
        self.events: list[Event] = []
        self.plant.on_event(self.events.append)
        self.condition = PlantCondition(self.plant, lambda: self.now, lambda at: round(at * 1e9))
        self.plant.set("bus/can0/state", 0, self.now)
        for node in self.plant.nodes.values():
            node_goes(self.plant, node, NodeState.OPERATIONAL, self.now, tell=False)
            for drive in node.drives:
                self.plant.set(f"{drive.name}/status/state", 4, self.now)
        self.look(100.0)

    def look(self, after_s: float = 0.5) -> list[dict[str, Any]]:
        self.now += after_s
        self.condition.look()
        return json.loads(str(self.value("bridge/troubles")))

    def value(self, name: str) -> object:
        return self.plant.image.read(name).value

    def lose(self, name: str) -> None:
        node_goes(self.plant, self.plant.nodes[name], NodeState.LOST, self.now)


@pytest.fixture
def box() -> Box:
    return Box()


def test_bus_node_and_everything_are_as_bad_as_their_worst_part(box: Box) -> None:
    names = ("bridge/condition", "bus/can0/condition", "belt/node/condition", "press/node/condition")
    assert [box.value(name) for name in names] == [0, 0, 0, 0]
    box.plant.set("belt/fu1/status/fault_text", "E003/3.0", box.now)
    box.look()
    assert [box.value(name) for name in names] == [2, 2, 2, 0]


def test_a_silent_bus_is_one_event_and_what_follows_names_it(
    box: Box, caplog: pytest.LogCaptureFixture
) -> None:
    box.lose("belt")
    box.lose("press")
    assert [one["kind"] for one in box.look()] == ["bus_silent"]
    told = [event for event in box.events if event.kind is EventKind.CAUSE]
    assert [(event.source, event.severity) for event in told] == [("can0", 900)]
    assert told[0].message.startswith("no node of can0 answers: cable at the box")
    box.look()
    assert len([event for event in box.events if event.kind is EventKind.CAUSE]) == 1
    box.lose("belt")
    assert box.events[-1].cause == told[0].message
    log_event(box.events[-1])
    assert "node lost (because: no node of can0 answers" in caplog.text
    assert json.loads(event_json(box.events[-1], 0))["cause"] == told[0].message


def test_an_event_without_a_known_cause_names_none(box: Box) -> None:
    box.lose("belt")
    assert box.events[-1].cause == ""
    assert "cause" not in json.loads(event_json(box.events[-1], 0))


def test_an_unproven_stop_is_in_every_summary(box: Box) -> None:
    unit = BridgeUnit(units_of(box.plant.catalogue), view_of(box.plant))
    (before,) = unit.read_words(RegisterTable.INPUT_REGISTER, 0, 1, PLC)
    assert before >> 8 == 0
    name = "press/fu1/supervision/worst_case_bridge_ms"
    box.plant.set(name, 0, box.now, Quality.CONFIG_ERROR, "the drive runs on: P513 is 0 (off)")
    (trouble,) = box.look()
    assert (trouble["kind"], trouble["rank"]) == ("stop_unproven", "warning")
    assert box.value("bridge/stops_unproven") == "press/fu1"
    assert box.value("bridge/condition") == 1
    (word,) = unit.read_words(RegisterTable.INPUT_REGISTER, 0, 1, PLC)
    assert word >> 8 == 0b101, "a warning, and that one"
