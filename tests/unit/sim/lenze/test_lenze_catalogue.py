"""From the site file's parameters to a simulated 8400 motec."""

from __future__ import annotations

import pytest

from bridge.base.errors import OperationFailed
from bridge.sim.catalogue import simulate_node
from bridge.sim.lenze.lenze_motec import LenzeMotec

NAME = "lenze/8400-motec"


def test_codes_are_given_in_engineering_units_and_outlast_the_mains():
    node = simulate_node(NAME, 5, {"drive/C00011": 3000, "C00012": 1.5, "C00593/1": 1, "C00088": 10.2})
    assert isinstance(node, LenzeMotec)
    node.start(0.0)
    codes = node.codes
    assert (codes.reference_rpm, codes.ramp_ms[0], codes.rpdo_reactions[0]) == (3000, 1500, 1)
    assert codes.motor_current_ca == 1020


def test_the_factory_setting_watches_nothing():
    node = simulate_node(NAME, 5, {})
    assert isinstance(node, LenzeMotec)
    assert node.codes.rpdo_reactions == [0, 0]
    assert node.codes.rpdo_time_ms == [3000, 3000]


@pytest.mark.parametrize(
    ("node_id", "parameters", "message"),
    [
        (64, {}, "addresses 1…63"),
        (5, {"P105": 1}, "codes such as"),
        (5, {"C09999": 1}, "no such code"),
        (5, {"C00168": 1}, "cannot be set"),
        (5, {"C00002/26": 1}, "cannot be set"),
        (5, {"C00012": 5000}, "outside 0 … 999.999"),
        (5, {"C00593/1": 3}, "C00593/1 = 3: VALUE_RANGE"),
    ],
)
def test_a_wrong_parameter_is_named(node_id, parameters, message):
    with pytest.raises(OperationFailed, match=message):
        simulate_node(NAME, node_id, parameters)
