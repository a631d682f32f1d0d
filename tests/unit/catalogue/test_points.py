"""The points of a site as the reference describes them."""

from __future__ import annotations

import pytest

from bridge.image import Point
from tests.support.docs import page
from tests.unit.command.test_plant import Hall


@pytest.fixture
def points() -> dict[str, Point]:
    return {point.name: point for point in Hall().plant.image.points}


@pytest.mark.parametrize(
    ("name", "heading"),
    [
        ("conveyor/node/state", "Node states"),
        ("conveyor/node/nmt_state", "NMT states"),
        ("bus/can0/nmt_state", "NMT states"),
        ("bus/can0/state", "CAN controller states"),
        ("conveyor/fu1/status/state", "Drive states"),
        ("conveyor/fu1/supervision/watchdog_state", "Watchdog states"),
    ],
)
def test_a_state_has_the_numbers_of_the_reference(points: dict[str, Point], name: str, heading: str) -> None:
    rows = page("reference/points.md").table(heading)
    assert points[name].states == tuple((int(row["code"]), row["name"]) for row in rows)


def test_a_load_is_a_percentage(points: dict[str, Point]) -> None:
    load = points["bus/can0/load"]
    assert (load.unit, load.low, load.high) == ("%", 0, 100)


def test_setpoints_are_before_actual_values_and_written_by_the_owner(points: dict[str, Point]) -> None:
    of_drive = [point for name, point in points.items() if name.startswith("conveyor/fu1/")]
    groups = [point.name.split("/")[2] for point in of_drive]
    assert list(dict.fromkeys(groups)) == [
        "command",
        "status",
        "actual",
        "supervision",
        "identity",
        "parameter",
    ]
    written = [point.name.split("/", 2)[2] for point in of_drive if point.writable]
    assert [leaf for leaf in written if not leaf.startswith("parameter/")] == [
        "command/control_word",
        "command/setpoint_1",
        "command/setpoint_2",
        "command/setpoint_3",
        "command/setpoint_4",
        "command/frequency",
        "command/digital_outputs",
        "command/position",
    ]
