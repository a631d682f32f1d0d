"""Parameters in the image: values with their time, and how good they are when the node or a read fails."""

from __future__ import annotations

import pytest

from bridge.command import Plant
from bridge.command.drive_link import NodeState
from bridge.image import Quality
from bridge.node.parameters.parameter_view import NO_CHANNEL, ParameterView
from bridge.parameter import ParameterEntry, ParameterError, ParameterReading, Why
from bridge.text import Text, render
from tests.support import sites

DRIVE = "conveyor/fu1"


class Case:
    def __init__(self) -> None:
        self.plant: Plant = sites.plant_of(sites.site(sites.bus(sites.node(sites.drive("fu1", "none", 0)))))
        node = self.plant.nodes["conveyor"]
        self.view = ParameterView(node, self.plant.image)
        self.drive = node.drives[0]
        numbers = [one for one in self.drive.spec.names.points() if one.definition is not None]
        self.entry: ParameterEntry = numbers[0]
        self.hold_s = node.table.hold_ms / 1000

    def shows(self, value: float = 2.5, at: float = 10.0) -> None:
        self.view.show(DRIVE, ParameterReading(self.entry, value, at))

    @property
    def point(self):
        return self.plant.image.read(f"{DRIVE}/parameter/{self.entry.leaf}")


@pytest.fixture
def case() -> Case:
    return Case()


def test_a_value_is_good_since_it_was_asked_for(case: Case) -> None:
    case.shows()
    assert (case.point.value, case.point.quality, case.point.time) == (2.5, Quality.GOOD, 10.0)


@pytest.mark.parametrize(
    ("error", "quality"),
    [
        (ParameterError(Why.NO_ANSWER, Text.plain("silent"), 0x0504_0000), Quality.STALE),
        (ParameterError(Why.REFUSED, Text.plain("no object"), 0x0602_0000), Quality.CONFIG_ERROR),
        (ParameterError(Why.REFUSED, Text.plain("busy"), 0x0800_0022), Quality.STALE),
        (ParameterError(Why.WRITE_ONLY, Text.plain("wo")), Quality.CONFIG_ERROR),
    ],
)
def test_the_last_value_stays_but_is_not_current(case: Case, error: ParameterError, quality: Quality) -> None:
    case.shows()
    case.view.failed(DRIVE, case.entry, error, 11.0)
    assert (case.point.value, case.point.quality, case.point.reason) == (2.5, quality, str(error))
    assert case.view.is_final(error) is (quality is Quality.CONFIG_ERROR)


def test_what_never_had_a_value_waits_on(case: Case) -> None:
    case.view.failed(DRIVE, case.entry, ParameterError(Why.NO_ANSWER, Text.plain("silent")), 11.0)
    assert case.point.quality is Quality.WAITING
    case.view.on_node(NodeState.LOST, 12.0)
    assert case.point.quality is Quality.WAITING


def test_of_a_lost_node_a_value_is_lost_and_then_dead(case: Case) -> None:
    case.shows()
    case.view.on_node(NodeState.LOST, 20.0)
    assert case.point.quality is Quality.LOST
    assert case.view.next_deadline() == 20.0 + case.hold_s
    case.view.on_time(20.0 + case.hold_s - 0.001)
    assert case.point.quality is Quality.LOST
    case.view.on_time(20.0 + case.hold_s)
    assert case.point.quality is Quality.DEAD
    assert case.view.next_deadline() is None


def test_a_node_that_is_back_in_time_does_not_die(case: Case) -> None:
    case.shows()
    case.view.on_node(NodeState.LOST, 20.0)
    case.view.on_node(NodeState.OPERATIONAL, 20.5)
    assert case.view.next_deadline() is None


@pytest.mark.parametrize(
    ("state", "quality"), [(NodeState.DISABLED, Quality.DISABLED), (NodeState.STOPPED, Quality.STALE)]
)
def test_by_the_state_of_the_node(case: Case, state: NodeState, quality: Quality) -> None:
    case.shows()
    case.view.on_node(state, 11.0)
    assert (case.point.quality, case.point.reason) == (quality, f"node {state.value}")


def test_what_no_channel_reaches_is_told(case: Case) -> None:
    case.view.unreached([case.drive], 10.0)
    assert (case.point.quality, case.point.reason) == (Quality.CONFIG_ERROR, render(NO_CHANNEL))
