"""From a site file's parameters to a simulated NORD node."""

from __future__ import annotations

import pytest

from bridge.base.errors import OperationFailed
from bridge.sim.catalogue import simulate_node
from bridge.sim.nord.nord_single import NordSingle
from bridge.sim.nord.nord_tu4 import NordTu4


def test_a_nord_node_takes_parameters_for_all_drives_and_for_one():
    node = simulate_node("nord/sk-tu4-cao", 5, {"fu2/P105": 60.0, "P105": 70.0, "P112": 4.2, "P151": 200})
    assert isinstance(node, NordTu4)
    assert node.node_id == 5
    assert [drive.parameters.value(105) for drive in node.drives] == [70.0, 60.0, 70.0, 70.0]
    assert node.drives[3].parameters.value(112) == pytest.approx(4.2)


def test_a_single_nord_drive_takes_its_own_watch():
    node = simulate_node("nord/sk-tu3-cao", 5, {"P513": 0.5, "drive/P105": 60.0})
    assert isinstance(node, NordSingle)
    assert (node.drive.parameters.raw(513), node.drive.parameters.value(105)) == (5, 60.0)
    with pytest.raises(OperationFailed, match="SK TU3-CAO takes P<number> or drive/P<number>"):
        simulate_node("nord/sk-tu3-cao", 5, {"fu1/P105": 60.0})
    with pytest.raises(OperationFailed, match="no such parameter"):
        simulate_node("nord/sk-5xxe-rj45", 5, {"P120": 1.0})


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"P999": 1}, "no such parameter"),
        ({"speed": 1}, "speed"),
        ({"fu5/P105": 1}, "fu5"),
        ({"P105": 9999}, "outside"),
        ({"P151": -1}, "P151"),
    ],
)
def test_a_wrong_parameter_is_named(parameters, message):
    with pytest.raises(OperationFailed, match=message):
        simulate_node("nord/sk-tu4-cao", 5, parameters)
