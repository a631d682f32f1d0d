"""Values of parameters and their bytes."""

from __future__ import annotations

import math
import re
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.canopen.datatypes import INTEGERS
from bridge.image import Value
from bridge.mapping.model import Parameter
from bridge.parameter import ObjectRef, ParameterEntry, ParameterError, Why
from bridge.parameter.codec import decode, encode_value, matches, parse, shown

WHERE = ObjectRef(0x2066, 1)
RAW = ParameterEntry("2066:01", WHERE)
NUMBERS = [kind for kind in INTEGERS if kind != "bool"]


def entry(data_type: str, **more: object) -> ParameterEntry:
    content = {"name": "P1", "title": "one", "data_type": data_type, **more}
    return ParameterEntry("P1", WHERE, Parameter.model_validate(content))


def limits(kind: str) -> tuple[int, int]:
    return INTEGERS[kind].low, INTEGERS[kind].high


def test_the_manuals_acceleration_time() -> None:
    # BU 2500 §6.6.1: P102 = 1.03 s is 0067h
    p102 = entry("int16", factor=0.01, unit="s", low=0.0, high=320.0)
    assert encode_value(p102, 1.03, None) == bytes.fromhex("67 00")
    assert decode(p102, bytes.fromhex("67 00 00 00")) == 1.03
    assert shown(p102, 1.03) == "1.03 s"


@given(st.data())
def test_a_whole_number_comes_back_as_it_was(data: st.DataObject) -> None:
    kind = data.draw(st.sampled_from(NUMBERS))
    number = data.draw(st.integers(*limits(kind)))
    one = entry(kind)
    coded = encode_value(one, number, None)
    assert len(coded) == INTEGERS[kind].size
    assert decode(one, coded) == number
    assert decode(one, coded + b"\xff\xff") == number


@given(st.data())
def test_a_scaled_number_comes_back_within_half_a_step(data: st.DataObject) -> None:
    factor = data.draw(st.sampled_from([0.1, 0.01, 0.001, 0.25, 10.0]))
    kind = data.draw(st.sampled_from(["int16", "uint16", "int32"]))
    low, high = limits(kind)
    value = data.draw(st.floats(low * factor, high * factor))
    one = entry(kind, factor=factor)
    back = decode(one, encode_value(one, value, None))
    assert isinstance(back, float)
    assert abs(back - value) <= factor / 2 * (1 + 1e-6)
    assert encode_value(one, back, None) == encode_value(one, value, None)


@given(st.data())
def test_what_does_not_fit_is_refused_and_never_cut(data: st.DataObject) -> None:
    kind = data.draw(st.sampled_from(NUMBERS))
    low, high = limits(kind)
    number = data.draw(st.one_of(st.integers(max_value=low - 1), st.integers(min_value=high + 1)))
    with pytest.raises(ParameterError) as told:
        encode_value(entry(kind), number, None)
    assert told.value.why is Why.OUT_OF_RANGE


@given(st.binary(max_size=12), st.sampled_from([*INTEGERS, "real32", "real64", "string", "bytes"]))
def test_whatever_a_drive_sends_is_a_value_or_one_error(data: bytes, kind: str) -> None:
    for one in (entry(kind), entry(kind, factor=0.1), RAW):
        try:
            value = decode(one, data)
        except ParameterError:
            continue
        assert not isinstance(value, float) or math.isfinite(value)


def test_a_range_with_texts_of_some_of_it_takes_the_others_too() -> None:
    source = entry("int16", low=0, high=10, states={3: "system bus", 6: "CANopen"})
    assert (shown(source, 0), shown(source, 3)) == ("0", "3 (system bus)")
    assert [encode_value(source, one, None)[0] for one in (0, "CANopen", 10)] == [0, 6, 10]
    for value, why in ((11, "takes 0…10, not 11"), ("x", "takes 0…10, 3 (system bus), 6 (CANopen), not 'x'")):
        with pytest.raises(ParameterError, match=re.escape(why)):
            encode_value(source, value, None)
    for more in ({}, {"low": 0}, {"high": 10}):
        with pytest.raises(ParameterError, match=r"takes 3 \(system bus\)"):
            encode_value(entry("int16", states={3: "system bus"}, **more), 0, None)


@given(st.one_of(st.booleans(), st.integers(), st.floats(), st.text()), st.binary(max_size=9))
def test_whatever_a_client_sends_is_coded_or_one_error(value: Value, held: bytes) -> None:
    states = entry("uint16", states={0: "off", 1: "on"})
    for one in (
        entry("int16", factor=0.1, low=-5.0, high=5.0),
        entry("real32"),
        entry("string"),
        states,
        RAW,
    ):
        try:
            data = encode_value(one, value, held)
        except ParameterError:
            continue
        assert matches(one, data, data)


def test_a_range_is_that_of_the_value_the_drive_will_hold() -> None:
    one = entry("int16", factor=0.1, low=-0.1, high=100.0, unit="s")
    # 0.1 as IEEE 754 single, as Modbus brings it, is a little more
    as_single: float = struct.unpack("<f", struct.pack("<f", 100.0 / 3))[0]
    assert decode(one, encode_value(one, as_single, None)) == 33.3
    assert encode_value(one, -0.1000000015, None) == b"\xff\xff"
    with pytest.raises(ParameterError, match=r"takes -0\.1…100 s, not 100\.1"):
        encode_value(one, 100.1, None)


def test_a_state_is_written_by_its_code_or_its_text() -> None:
    one = entry("int16", states={0: "RAM only", 1: "EEPROM"})
    assert encode_value(one, "ram only", None) == encode_value(one, 0, None) == b"\0\0"
    assert shown(one, 1) == "1 (EEPROM)"
    with pytest.raises(ParameterError, match=r"takes 0 \(RAM only\), 1 \(EEPROM\)"):
        encode_value(one, 2, None)
    with pytest.raises(ParameterError, match="takes 0"):
        encode_value(one, "flash", None)


def test_an_object_that_no_file_describes_takes_the_length_it_has() -> None:
    assert decode(RAW, b"\xff\xff") == 0xFFFF
    assert encode_value(RAW, -1, b"\0\0") == b"\xff\xff"
    assert decode(RAW, b"SK TU4-CAO") == "SK TU4-CAO"
    with pytest.raises(ParameterError, match="a whole number of 2 bytes"):
        encode_value(RAW, 0x1_0000, b"\0\0")
    with pytest.raises(ParameterError, match="a whole number of 2 bytes"):
        encode_value(RAW, 1.5, b"\0\0")


@pytest.mark.parametrize(
    ("one", "text", "value"),
    [
        (entry("int16"), "0x10", 16),
        (entry("int16", factor=0.1), " 2.5 ", 2.5),
        (entry("int16", states={0: "off"}), "OFF", "OFF"),
        (entry("bool"), "true", True),
        (entry("string"), "12", "12"),
        (RAW, "12", 12),
    ],
)
def test_what_is_typed_is_read_as_the_parameter_takes_it(
    one: ParameterEntry, text: str, value: Value
) -> None:
    assert parse(one, text) == value


def test_what_is_typed_and_is_no_value_is_refused() -> None:
    with pytest.raises(ParameterError, match="P1: 'much' is no number"):
        parse(entry("int16"), "much")


def test_a_negative_number_in_four_bytes_is_the_same_number() -> None:
    number = entry("int16")
    assert matches(number, bytes.fromhex("FB FF FF FF"), encode_value(number, -5, None))
    assert matches(number, bytes.fromhex("05 00 00 00"), encode_value(number, 5, None))
    assert not matches(number, bytes.fromhex("05 00 FF FF"), encode_value(number, 5, None))
    assert not matches(entry("uint16"), bytes.fromhex("FB FF FF FF"), bytes.fromhex("FB FF"))


@pytest.mark.parametrize("text", ["3,5", "1,500", "1_0", "\u0662\u0665", "nan", "inf", "25h"])
def test_what_may_be_another_number_is_never_written_by_the_command_line(text: str) -> None:
    with pytest.raises(ParameterError, match="P1: ") as refused:
        parse(entry("int16", factor=0.1, unit="s"), text)
    assert refused.value.why is Why.OUT_OF_RANGE


def test_a_decimal_comma_is_answered_with_how_it_is_written() -> None:
    with pytest.raises(ParameterError, match=r"'3,5' is not how numbers are written here: write 3\.5"):
        parse(entry("int16", factor=0.1), "3,5")
    with pytest.raises(ParameterError, match=r"'1,500' may mean 1500 or 1\.5: write 1500 or 1\.5"):
        parse(entry("int16", factor=0.1), "1,500")


def test_a_comma_makes_no_text_of_a_number_where_no_file_describes_the_object() -> None:
    with pytest.raises(ParameterError, match=r"write 2\.5"):
        parse(RAW, "2,5")
    assert parse(RAW, "drive 7") == "drive 7"
