"""How a node is shown: its points, and which of its news is an event, once."""

from __future__ import annotations

import pytest

from bridge.canopen.nmt import NmtState
from bridge.command import Identification
from bridge.command.drive_link import NodeState
from bridge.node.boot import BootError
from bridge.node.node_view import NodeView
from bridge.text import Text
from tests.support import sites


class Case:
    def __init__(self) -> None:
        self.plant = sites.plant_of(sites.site(sites.bus(sites.node(sites.drive("fu1", "none", 0)))))
        self.view = NodeView(self.plant.nodes["conveyor"], self.plant.side_of(self.plant.site.bus[0]))

    def point(self, leaf: str) -> object:
        return self.plant.image.read(f"conveyor/node/{leaf}").value

    def told(self) -> list[str]:
        return [event.message for event in self.plant.events.take()]


@pytest.fixture
def case() -> Case:
    return Case()


def test_a_failed_boot_up_is_an_event_once_until_it_succeeds(case: Case) -> None:
    for _ in range(3):
        case.view.failed(BootError("B", Text.plain("1000h")), 10.0)
    assert len(case.told()) == 1
    assert case.point("boot_status") == str(BootError("B", Text.plain("1000h")))
    case.view.failed(BootError("B", Text.plain("1018h")), 10.0)
    assert len(case.told()) == 1, "another way of failing"
    case.view.succeeded("no errors", 11.0)
    assert case.point("boot_status") == "no errors"
    case.view.failed(BootError("B", Text.plain("1018h")), 12.0)
    assert len(case.told()) == 1


def test_toggle_errors_stand_beside_the_state(case: Case) -> None:
    case.view.show(NmtState.OPERATIONAL, NodeState.OPERATIONAL, 0, 10.0)
    assert case.point("nmt_state") == 5
    before = str(case.point("supervision_state"))
    case.view.show(NmtState.OPERATIONAL, NodeState.OPERATIONAL, 1, 10.0)
    assert case.point("supervision_state") == f"{before}, 1 wrong toggle bit"
    case.view.show(NmtState.OPERATIONAL, NodeState.OPERATIONAL, 2, 10.0)
    assert case.point("supervision_state") == f"{before}, 2 wrong toggle bits"


def test_errors_of_the_node_are_an_event_when_they_are_others(case: Case) -> None:
    case.view.errors("1001h is 11h", 10.0)
    case.view.errors("1001h is 11h", 11.0)
    assert case.told() == ["the node says: 1001h is 11h"]
    case.view.errors("", 12.0)
    assert case.told() == []
    assert case.point("device_errors") == ""
    case.view.errors("1001h is 11h", 13.0)
    assert len(case.told()) == 1


ONE = Identification(0x38, 1, 0x10000, 7, "SK")


def test_who_is_first_seen_is_nobody_else(case: Case) -> None:
    assert not case.view.identified(ONE, 10.0)
    assert not case.view.identified(ONE, 11.0)
    assert case.told() == []


@pytest.mark.parametrize(
    ("other", "said"),
    [
        (Identification(0x39, 1, 0x10000, 7, "SK"), "vendor 00000039h, was 00000038h"),
        (Identification(0x38, 1, 0x20000, 7, "SK"), "revision 00020000h, was 00010000h"),
        (Identification(0x38, 1, 0x10000, 8, "SK"), "serial number 8, was 7"),
    ],
)
def test_another_device_is_told_with_what_is_another(case: Case, other: Identification, said: str) -> None:
    case.view.identified(ONE, 10.0)
    assert case.view.identified(other, 11.0)
    assert case.told() == [f"another device than before: {said}. Its settings may be others"]


def test_habits_stand_behind_the_success_and_are_told_when_they_are_new(case: Case) -> None:
    case.view.succeeded("no errors", 10.0)
    case.view.shows_habits(
        [Text.plain("3 heartbeats of 2 bytes")], [Text.plain("3 heartbeats of 2 bytes")], 11.0
    )
    assert case.told() == ["3 heartbeats of 2 bytes"]
    assert case.point("boot_status") == "no errors; 3 heartbeats of 2 bytes"
