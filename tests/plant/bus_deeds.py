"""What happens to the bus of a plant, and to its nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bridge.can.interface import ControllerState
from tests.plant.field import FieldNode
from tests.plant.plan import Step

if TYPE_CHECKING:
    from tests.plant.plant import Plant


def bus_off(plant: Plant, step: Step) -> None:
    for bus in plant.bridge.buses:
        bus.enter(ControllerState.BUS_OFF)
    plant.oracle.bus_off(plant.world.now)
    plant.disturbed()
    plant.loud(step.seconds)
    buses = list(plant.bridge.buses)

    def back() -> None:
        plant.disturbed()
        for bus in buses:
            bus.enter(ControllerState.OK)

    plant.world.after(step.seconds, back)


def cut(plant: Plant, step: Step) -> None:
    plant.loud(step.seconds)
    plant.wire.is_cut = True
    plant.summaries.cut(plant.world.now, step.seconds, lambda: plant.wire.is_cut)
    plant.world.after(step.seconds, lambda: setattr(plant.wire, "is_cut", False))


def noise(plant: Plant, step: Step) -> None:
    plant.loud(step.seconds)
    plant.wire.loss = float(step.how)
    plant.world.after(step.seconds, lambda: setattr(plant.wire, "loss", 0.0))


def _node(plant: Plant, step: Step) -> FieldNode:
    return plant.nodes[step.which % len(plant.nodes)]


def reset_node(plant: Plant, step: Step) -> None:
    node = _node(plant, step)
    node.device.power_cycle()
    node.serve()


def silence_node(plant: Plant, step: Step) -> None:
    node = _node(plant, step)
    node_id = node.device.node_id

    def is_missed() -> bool:
        """It is silent, and would be operational otherwise."""
        return not node.speaks and plant.debts.is_operational(node_id)

    node.speaks = False
    plant.summaries.silenced(plant.names[node_id], plant.world.now, step.seconds, is_missed)
    plant.world.after(step.seconds, lambda: setattr(node, "speaks", True))
