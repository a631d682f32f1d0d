"""What the CANopen side does to a plant, where a test has none: a node changes its state, words are handed to
the bus."""

from __future__ import annotations

from bridge.command import Commanded, Node, Plant
from bridge.command.drive_link import NodeState
from bridge.command.node import Enforcement
from bridge.node.node_view import NodeView


def node_goes(plant: Plant, node: Node, state: NodeState, now: float, *, tell: bool = True) -> None:
    """The node is in another state, as ``NodeCore`` says it; ``tell`` makes that an event."""
    view = NodeView(node, plant.side_of(node.bus))
    view.is_in(state, now)
    node.on_state(state, now)
    if tell:
        view.went(state, now)
    plant.settle()
    plant.tell_events()


def run_timers(plant: Plant, now: float) -> list[Enforcement]:
    """The timers of a plant run that has no master; what that would have made its nodes do."""
    enforcements = list(plant.enforcements(now))
    plant.settle()
    plant.tell_events()
    return enforcements


def hand_over(plant: Plant, one: Commanded, now: float) -> None:
    """What this drive is sent, or these outputs, is on the bus."""
    plant.unsent_stops.discard(one)
    one.on_handed_over(now)
