"""Readings and outcomes in OPC UA's words, and what is told to whom; no server."""

from __future__ import annotations

import math

import pytest
from asyncua import ua

from bridge.command.messages.request import Code, Identity, Outcome, Source
from bridge.image import DataType, Point, Quality, Reading
from bridge.northbound.opcua.space.data_values import (
    OUTCOME_STATUS,
    QUALITY_STATUS,
    VARIANT_TYPE,
    outcome_status,
    point_value,
    reading_value,
    rejection,
)

Codes, Kind = ua.StatusCodes, ua.VariantType
WORD = Point(name="a/b/command/word", data_type=DataType.UINT16)
NUMBER = Point(name="a/b/command/number", data_type=DataType.FLOAT)


def test_every_quality_type_and_outcome_has_a_place() -> None:
    assert set(QUALITY_STATUS) == set(Quality)
    assert set(VARIANT_TYPE) == set(DataType)
    assert set(OUTCOME_STATUS) == set(Code)


def test_a_value_is_kept_exactly_where_the_status_is_not_bad() -> None:
    for quality in Quality:
        read = reading_value(Reading(7, quality, 1.0, ""), Kind.UInt16, 10**18)
        assert (read.Value.Value is None) == read.StatusCode.is_bad()


def test_what_has_never_had_a_value_has_no_source_time() -> None:
    read = reading_value(Reading(0, Quality.WAITING, 0.0, ""), Kind.UInt16, 10**18)
    assert (read.SourceTimestamp, read.ServerTimestamp is not None) == (None, True)


def test_a_bit_is_taken_from_its_word() -> None:
    for bit in range(16):
        read = reading_value(Reading(0x8001, Quality.GOOD, 1.0, ""), Kind.Boolean, 0, bit)
        assert read.Value.Value is (bit in (0, 15))


@pytest.mark.parametrize(
    ("code", "status"),
    [
        (Code.OK, Codes.Good),
        (Code.NOT_ALLOWED, Codes.BadUserAccessDenied),
        (Code.OUT_OF_RANGE, Codes.BadOutOfRange),
        (Code.NOT_VALID, Codes.BadOutOfRange),
        (Code.ACKNOWLEDGE_FIRST, Codes.BadInvalidState),
        (Code.NOT_CONFIGURED, Codes.BadConfigurationError),
        (Code.TIMED_OUT, Codes.BadTimeout),
    ],
)
def test_outcomes_are_status_codes(code: Code, status: int) -> None:
    assert outcome_status(Outcome(code)).value == status


@pytest.mark.parametrize("kind", [k for k in Kind if "Int" in k.name or k.name in ("Byte", "SByte")])
def test_any_integer_is_taken_for_a_word_and_for_a_number(kind: ua.VariantType) -> None:
    assert point_value(WORD, ua.Variant(7, kind)) == 7
    assert point_value(NUMBER, ua.Variant(7, kind)) == 7


@pytest.mark.parametrize(
    ("point", "written"),
    [
        (WORD, ua.Variant(7.0, Kind.Double)),
        (WORD, ua.Variant(True, Kind.Boolean)),
        (WORD, ua.Variant([7], Kind.UInt16)),
        (WORD, ua.Variant(None, Kind.Null)),
        (NUMBER, ua.Variant("7", Kind.String)),
        (NUMBER, ua.Variant([], Kind.Double, is_array=True)),
        (Point(name="x", data_type=DataType.BOOL), ua.Variant(1, Kind.Byte)),
        (Point(name="x", data_type=DataType.STRING), ua.Variant(b"x", Kind.ByteString)),
    ],
)
def test_other_types_are_not(point: Point, written: ua.Variant) -> None:
    with pytest.raises(TypeError, match="take"):
        point_value(point, written)


@pytest.mark.parametrize("number", [math.nan, -math.inf])
def test_what_is_no_number_is_out_of_range(number: float) -> None:
    with pytest.raises(ValueError, match="take"):
        point_value(NUMBER, ua.Variant(number, Kind.Double))


def test_a_clients_words_are_cut_before_they_are_told():
    guest = Identity(Source.OPCUA, "guest")
    told = rejection(guest, "x" * 10_000, "call", Codes.BadNodeIdUnknown, {"y" * 10_000: "z" * 10_000})
    assert (told.code, str(told.said)) == ("unknown_point", "BadNodeIdUnknown")
    assert len(told.target) == 200
    assert [(len(name), len(str(value))) for name, value in told.values.items()] == [(200, 200)]
