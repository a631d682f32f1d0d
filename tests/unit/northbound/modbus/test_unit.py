"""The bridge's own Modbus unit: itself, its buses, its nodes and watchdogs."""

from __future__ import annotations

import pytest

from bridge.command.drive_link import NodeState
from bridge.northbound.modbus.registers import RegisterTable
from bridge.northbound.modbus.unit import BridgeUnit
from bridge.northbound.modbus.units import units_of
from tests.support import sites
from tests.support.modbus_site import (
    ENABLED,
    PLC,
    READY,
    Rig,
)
from tests.support.node_states import node_goes
from tests.support.views import view_of

NO_FUNCTION, NO_ADDRESS = -1, -2


@pytest.mark.parametrize("unit", [0, 255])
def test_the_bridge_itself(unit: int):
    rig = Rig()
    assert rig.read(4, 0, 8, unit=unit) == [0x01, 0, 4, 3, 0, 0xFF00, 0xFF00, 0xFF00]
    rig.plant.set("bus/can0/state", 0, rig.now)
    rig.plant.set("bus/can0/load", 12.34, rig.now)
    rig.runs(ENABLED)
    assert rig.read(4, 0, 8, unit=unit) == [0x02, 123, 0, 3, 1, 0x0401, 0xFF00, 0xFF00]
    assert rig.read(4, 0, 9, unit=unit) == [NO_ADDRESS]
    assert rig.read(3, 0, 1, unit=unit) == [NO_FUNCTION]
    assert rig.read_bits(2, 0, 1, unit=unit) == [NO_FUNCTION]
    assert rig.ask("06 0000 0001", unit) == b"\x86\x01"
    assert rig.ask("05 0000 FF00", unit) == b"\x85\x01"
    assert rig.ask("16 0000 0000 0000", unit) == b"\x96\x01"


@pytest.mark.parametrize(("bus_state", "bits"), [(1, 0x12), (2, 0x12), (3, 0x22), (4, 0x02)])
def test_module_state_of_the_bus(bus_state: int, bits: int):
    rig = Rig()
    rig.runs(ENABLED)
    rig.plant.set("bus/can0/state", bus_state, rig.now)
    assert rig.read(4, 0, 3, unit=255) == [bits, 0, bus_state]


def test_module_state_of_nodes_and_watchdogs():
    rig = Rig()
    rig.plant.set("bus/can0/state", 0, rig.now)
    rig.runs(READY)
    rig.write(0, 0x047E)
    rig.pass_time(0.3)
    assert rig.read(4, 0, 1, unit=255) == [0x0A]
    rig.node(NodeState.LOST)
    assert rig.read(4, 0, 1, unit=255) == [0x0C]


def test_a_node_that_is_out_of_service_says_nothing_of_the_module():
    plant = sites.plant_of(
        sites.site(
            sites.bus(
                sites.node(sites.drive("fu1", "modbus", 200, ""), name="conveyor"),
                sites.node(
                    sites.drive("fu1", "modbus", 200, ""), name="spare", node_id=6, more="enabled = false"
                ),
            ),
            sites.modbus(0),
        )
    )
    plant.set("bus/can0/state", 0, 100.0)
    node_goes(plant, plant.nodes["conveyor"], NodeState.OPERATIONAL, 100.0)
    node_goes(plant, plant.nodes["spare"], NodeState.DISABLED, 100.0)
    unit = BridgeUnit(units_of(plant.catalogue), view_of(plant, lambda: 100.0))
    (state,) = unit.read_words(RegisterTable.INPUT_REGISTER, 0, 1, PLC)
    assert state == 0x02, "operational, and nothing else"


def test_a_node_whose_first_drive_has_no_process_data_is_not_in_operation():
    rig = Rig()
    rig.plant.set("bus/can0/state", 0, 100.0)
    node = rig.plant.nodes["conveyor"]
    node_goes(rig.plant, node, NodeState.OPERATIONAL, 100.0)
    assert rig.read(4, 0, 1, 255)[0] & 0x03 == 0x02
    node.drives[1].channel.on_node(NodeState.CONFIG_ERROR, 100.0)
    rig.plant.settle()
    assert rig.read(4, 0, 1, 255)[0] & 0x03 == 0x02, "the first one has them"
    node.drives[0].channel.on_node(NodeState.CONFIG_ERROR, 100.0)
    rig.plant.settle()
    assert rig.read(4, 0, 1, 255)[0] & 0x03 == 0x01, "starting"
    assert rig.plant.image.read("conveyor/node/state").value == 6
