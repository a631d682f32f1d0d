"""Names of points."""

from __future__ import annotations

from bridge.image import DataType, Point


def test_a_name_is_a_path():
    it = Point(name="conveyor/fu1/command/x", data_type=DataType.BOOL)
    assert it.path == ("conveyor", "fu1", "command", "x")
    assert it.leaf == "x"
