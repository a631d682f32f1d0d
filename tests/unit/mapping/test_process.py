"""Process data of a mapping file: resting words, writes at the start, and the kinds of values."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from bridge.image import DataType
from bridge.mapping.process import Process, ProcessValue, Scale, StartWrite


def test_setpoints_rest_at_0_unless_the_file_says_otherwise() -> None:
    words = {"rpdo": ["control_word", "speed", "modes"], "tpdo": ["status_word"]}
    assert Process.model_validate(words).resting == (0, 0)
    assert Process.model_validate({**words, "rest": {"modes": 3}}).resting == (0, 3)


def start(**more: object) -> StartWrite:
    return StartWrite.model_validate({"object": "6060:00", "type": "int8", "value": 3, **more})


def test_a_start_write_is_the_bytes_of_its_type() -> None:
    assert start().download(10).data == b"\3"
    assert start(value=-1).download(10).data == b"\xff"
    assert start(type="uint32").download(10).data == b"\3\0\0\0"


@pytest.mark.parametrize("wrong", [{"value": 128}, {"value": 1.5}, {"value": "x"}, {"type": "int9"}])
def test_one_that_does_not_fit_is_refused(wrong: dict[str, object]) -> None:
    with pytest.raises(ValidationError):
        start(**wrong)


def test_the_period_of_sync_stands_for_what_the_bus_has() -> None:
    one = start(type="uint8", value="sync_period_ms")
    assert one.is_sync_period
    assert one.download(10).data == b"\x0a"
    with pytest.raises(ValueError):
        one.download(1000)
    assert not start().is_sync_period


def value(**more: object) -> ProcessValue:
    return ProcessValue.model_validate({"name": "speed", "group": "actual", "word": "speed_now", **more})


@pytest.mark.parametrize(
    ("more", "kind", "width"),
    [
        ({}, DataType.INT16, 1),
        ({"data_type": "uint16"}, DataType.UINT16, 1),
        ({"word": None, "words": ["low", "high"]}, DataType.INT32, 2),
        ({"word": None, "words": ["low", "high"], "data_type": "real32"}, DataType.FLOAT, 2),
        ({"scale": {"factor": 0.1}}, DataType.FLOAT, 1),
        ({"bit": 3}, DataType.BOOL, 1),
    ],
)
def test_a_point_has_the_type_of_what_it_means(more: dict[str, object], kind: DataType, width: int) -> None:
    one = value(**more)
    assert (one.point_type, one.width) == (kind, width)


def test_a_value_belongs_to_its_group() -> None:
    assert value().leaf == "actual/speed"
    assert value(group="command").leaf == "command/speed"


def test_what_scales_a_value_is_known_by_name() -> None:
    one = value(scale={"full": "P105", "at": 16384})
    assert one.full == "P105"
    assert "P105" in one.scaled_by
    assert value().scaled_by == ()
    assert Scale.model_validate({"factor": 2.0}).full is None
