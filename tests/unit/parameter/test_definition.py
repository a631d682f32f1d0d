"""Entries: values of a drive by name and place, and the same object as its bytes."""

from __future__ import annotations

import pytest

from bridge.mapping.model import ObjectRef, Parameter
from bridge.parameter.definition import ParameterEntry

PLACE = ObjectRef(0x2066, 2)
P102 = Parameter.model_validate(
    {
        "name": "P102",
        "title": "acceleration time",
        "data_type": "int16",
        "factor": 0.01,
        "unit": "s",
        "low": 0,
        "high": 320,
        "states": {"0": "none"},
        "german_states": {"0": "keine"},
        "access": "ro",
    }
)


@pytest.mark.parametrize(
    ("name", "leaf"), [("P102", "p102"), ("P102[2]", "p102_2"), ("P102[2].3", "p102_2_3")]
)
def test_a_name_becomes_a_point(name: str, leaf: str) -> None:
    assert ParameterEntry(name, PLACE).leaf == leaf


def test_its_unit_is_that_of_its_definition() -> None:
    assert ParameterEntry("P102", PLACE, P102).unit == "s"
    assert ParameterEntry("2066:02", PLACE).unit == ""


def test_as_bytes_it_has_no_scale_no_limits_and_no_texts_and_stays_protected() -> None:
    entry = ParameterEntry("P102", PLACE, P102).as_bytes
    found = entry.definition
    assert found is not None
    assert (found.data_type, found.factor, found.low, found.high, found.unit) == (
        "bytes",
        1.0,
        None,
        None,
        "",
    )
    assert (found.states, found.german_states) == ({}, {})
    assert (entry.address, found.writable, found.title) == (PLACE, False, "acceleration time")
    assert P102.data_type == "int16", "the definition itself is as it was"


def test_an_object_that_no_file_describes_has_bytes_too() -> None:
    entry = ParameterEntry("2345:00", ObjectRef(0x2345, 0)).as_bytes
    assert entry.definition is not None
    assert entry.definition.data_type == "bytes"
