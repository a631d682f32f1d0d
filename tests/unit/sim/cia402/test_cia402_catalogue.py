"""From a site file's parameters to a simulated CiA 402 drive."""

from __future__ import annotations

import pytest

from bridge.base.errors import OperationFailed
from bridge.mapping import family_names
from bridge.sim.catalogue import simulate_node
from bridge.sim.cia402.cia402_drive import Cia402Drive

FAMILIES = [name for name in family_names() if name.startswith("cia402/")]


@pytest.mark.parametrize("name", FAMILIES)
def test_every_mode_can_be_simulated(name: str):
    node = simulate_node(name, 5, {})
    assert isinstance(node, Cia402Drive)
    assert node.node_id == 5


def test_parameters_are_objects_in_the_drives_units_and_outlast_the_mains():
    node = simulate_node("cia402/velocity", 5, {"6083": 1000, "6046:02": 1500, "drive/605a": 6, "6098": 17})
    assert isinstance(node, Cia402Drive)
    node.start(1.0)
    settings = node.settings
    assert (settings.acceleration, settings.vl_limits, settings.options[0x605A]) == (1000, [0, 1500], 6)
    assert settings.homing_method == 17


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"6FFF": 1}, "no such object"),
        ({"6046:09": 1}, "no such object"),
        ({"speed": 1}, "takes objects such as 6083"),
        ({"6041": 1}, "cannot be set"),
        ({"6040": 6}, "cannot be set"),
        ({"605A": 99}, "0 … 8"),
        ({"6083": 1.5}, "whole number"),
        ({"6098": 1}, "VALUE_RANGE"),
    ],
)
def test_a_wrong_parameter_is_named(parameters: dict[str, float], message: str):
    with pytest.raises(OperationFailed, match=message):
        simulate_node("cia402/velocity", 5, parameters)
