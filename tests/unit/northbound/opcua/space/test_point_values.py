"""Values of points, made when somebody looks at them."""

from __future__ import annotations

from bridge.image import DataType, Image, Point
from bridge.northbound.opcua.space.nodes import layout
from bridge.northbound.opcua.space.point_values import PointValue, WatchedVariable

POINTS = [Point(name="bridge/word", data_type=DataType.UINT16, bits=("low", "", "third"))]


def test_each_look_is_at_the_image_and_a_bit_is_its_own() -> None:
    image, watched = Image(POINTS), dict[int, dict[int, WatchedVariable]]()
    (word,) = layout(image.points)[2].variables
    whole, bit = (PointValue(image, lambda at: 0, node, watched) for node in (word, word.bits[1]))
    for value in (4, 3):
        image.set(0, value, 1.0)
        assert whole.read().Value.Value == value
        assert bit.value_callback().Value.Value is bool(value & 4)


def test_who_watches_is_kept_however_often_it_is_made() -> None:
    image, watched = Image(POINTS), dict[int, dict[int, WatchedVariable]]()
    (word,) = layout(image.points)[2].variables
    first, second = (PointValue(image, lambda at: 0, word, watched) for _ in range(2))
    first.datachange_callbacks[1] = print
    assert second.datachange_callbacks == {1: print}
    PointValue(image, lambda at: 0, word.bits[0], watched).datachange_callbacks[2] = print
    assert {place: set(one.watchers) for place, one in watched[0].items()} == {-1: {1}, 0: {2}}
