"""The layout of a plant: what contains what, and by what each drive is moved."""

from __future__ import annotations

from bridge.condition.plant_layout import PlantLayout, layout_of
from bridge.image import DataType, Point
from tests.support import sites

LAYOUT = PlantLayout({"conveyor/fu1": "conveyor"}, {"conveyor": "can0", "io": "can1"}, ("can0", "can1"))


def test_a_place_is_in_its_node_and_that_on_its_bus() -> None:
    assert LAYOUT.above("conveyor/fu1") == ("conveyor/fu1", "conveyor", "bus/can0")
    assert LAYOUT.above("io") == ("io", "bus/can1")
    assert LAYOUT.above("bus/can0") == ("bus/can0",)
    assert LAYOUT.above("bridge") == ("bridge",)


def mains(*points: tuple[str, str]) -> str | None:
    text = sites.site(sites.bus(sites.node(sites.drive("fu1", "none", 0))))
    shown = [Point(name=f"conveyor/fu1/{leaf}", data_type=DataType.FLOAT, unit=unit) for leaf, unit in points]
    found = layout_of(shown, sites.catalogue_of(text))
    assert found.drives == {"conveyor/fu1": "conveyor"}
    assert (found.nodes, found.buses) == ({"conveyor": "can0"}, ("can0",))
    return found.mains.get("conveyor/fu1")


def test_a_drive_is_moved_by_the_most_telling_setpoint_that_has_an_actual_value() -> None:
    torque = ("command/torque", "%"), ("actual/torque", "%")
    frequency = ("command/frequency", "Hz"), ("actual/frequency", "Hz")
    assert mains(*torque, *frequency) == "frequency"
    assert mains(*torque) == "torque"
    assert mains(("command/ramp", "s"), ("actual/ramp", "s")) == "ramp"


def test_what_has_no_unit_or_no_actual_value_is_no_motion() -> None:
    assert mains(("command/frequency", "Hz")) is None
    assert mains(("command/setpoint_1", ""), ("actual/setpoint_1", "")) is None
