"""Inputs and outputs of a device: values and their entries in a PDO, and what an output does not take."""

from __future__ import annotations

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.image import DataType
from bridge.mapping.device_signals import Output, Signal


def signal(data_type: str, **more: object) -> Signal:
    return Signal.model_validate({"name": "x", "object": "6000:01", "data_type": data_type, **more})


@pytest.mark.parametrize(
    ("data_type", "more", "raw", "value"),
    [
        ("bool", {}, 1, True),
        ("uint8", {}, 200, 200),
        ("int16", {}, -5, -5),
        ("int16", {"factor": 0.5}, -5, -2.5),
        ("uint16", {"factor": 2.0, "offset": -10.0}, 4, -2.0),
        ("real32", {}, 0x3FC0_0000, 1.5),
    ],
)
def test_what_is_received_is_scaled(data_type: str, more: dict[str, object], raw: int, value: object) -> None:
    found = signal(data_type, **more).decode(raw)
    assert found == value
    assert type(found) is type(value)


@pytest.mark.parametrize(
    ("data_type", "size", "is_signed", "kind"),
    [
        ("bool", 1, False, DataType.BOOL),
        ("int8", 8, True, None),
        ("uint32", 32, False, None),
        ("int16", 16, True, None),
        ("real32", 32, False, DataType.FLOAT),
    ],
)
def test_a_type_has_its_length_and_its_sign(
    data_type: str, size: int, is_signed: bool, kind: DataType | None
) -> None:
    one = signal(data_type)
    assert (one.size, one.is_signed) == (size, is_signed)
    assert kind is None or one.value_type is kind
    assert signal("int16", factor=0.1).value_type is DataType.FLOAT


LARGEST = struct.unpack("<f", b"\xff\xff\x7f\x7f")[0]


@pytest.mark.parametrize(
    ("data_type", "more", "value", "why"),
    [
        ("bool", {}, 2, "takes true or false, not 2"),
        ("uint8", {}, True, "takes a number"),
        ("uint8", {}, "5", "takes a number"),
        ("uint8", {}, math.nan, "takes a number"),
        ("uint8", {}, 1.5, "takes a whole number, not 1.5"),
        ("uint8", {"low": 1, "high": 9}, 10, "takes 1…9, not 10"),
        ("uint8", {}, 256, "takes 0…255, not 256"),
        ("int8", {"factor": -0.5}, 100, "takes -63.5…64, not 100"),
        ("real64", {}, 10**400, "takes a number"),
        ("uint8", {"factor": 0.001}, 1.7e308, "takes 0…0.255, not 1.7e+308"),
        ("real32", {}, 1e39, f"takes -{LARGEST:.0f}…{LARGEST:.0f}, not 1e+39"),
        ("real32", {"factor": 1e-30}, 1e300, "takes -340282000…340282000, not 1e+300"),
        ("real64", {"factor": 1e-308}, -1e300, "takes -1.79769…1.79769, not -1e+300"),
    ],
)
def test_what_an_output_does_not_take_is_told_with_what_it_does(
    data_type: str, more: dict[str, object], value: object, why: str
) -> None:
    with pytest.raises(ValueError) as caught:
        signal(data_type, **more).encode(value)
    assert str(caught.value) == why


@given(st.integers(-(1 << 15), (1 << 15) - 1))
def test_what_is_sent_is_what_is_received(raw: int) -> None:
    for more in ({}, {"factor": 0.1}, {"factor": -4.0, "offset": 3.0}):
        one = signal("int16", **more)
        assert one.encode(one.decode(raw)) == raw & 0xFFFF


@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_a_real_number_is_the_same(value: float) -> None:
    one = signal("real32")
    assert one.encode(value) == struct.unpack("<I", struct.pack("<f", value))[0]
    assert one.decode(one.encode(value)) == value


def test_an_output_is_0_when_its_controller_falls_silent_unless_it_says_otherwise() -> None:
    keys = {"name": "x", "object": "6200:01", "data_type": "uint8"}
    assert Output.model_validate(keys).on_expiry == 0
    assert Output.model_validate({**keys, "on_expiry": "hold"}).on_expiry == "hold"
