"""From a site file's parameters to a simulated STÖBER."""

from __future__ import annotations

import pytest

from bridge.base.errors import OperationFailed
from bridge.sim.catalogue import simulate_node
from bridge.sim.stoeber.stoeber_5000 import Stoeber5000


def test_parameters_for_all_axes_and_for_one():
    parameters = {"axis2/C01": 1500.0, "C01": 2500.0, "axis4/quick_stop_s": 0.1}
    node = simulate_node("stoeber/5000-four-axes", 7, parameters)
    assert isinstance(node, Stoeber5000)
    node.start(0.0)
    settings = [node.device.parameters(axis) for axis in range(4)]
    assert [one.c01_rpm for one in settings] == [2500, 1500, 2500, 2500]
    assert [one.quick_stop_s for one in settings] == [0.2, 0.2, 0.2, 0.1]


def test_one_axis_is_one_axis():
    node = simulate_node("stoeber/5000", 7, {"C01": 4000.0})
    assert isinstance(node, Stoeber5000)
    assert [axis.number for axis in node.axes] == [1]


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"C02": 1}, "C02: the simulated STÖBER 5000 takes C01"),
        ({"axis2/C01": 1}, "axis2/C01"),
        ({"C01": 0}, "C01 = 0 is outside 1 … 32767"),
        ({"accelerate_s": -1}, "outside 0 … 600"),
    ],
)
def test_a_wrong_parameter_is_named(parameters, message):
    with pytest.raises(OperationFailed, match=message):
        simulate_node("stoeber/5000", 7, parameters)
