"""Titles of objects of a device description, and the names that are made of them."""

from __future__ import annotations

import pytest

from bridge.derive.titles import name_of, title_of
from bridge.eds import Description, read_device
from tests.support.invented_eds import U8, U16, eds, record, var

OBJECTS = {
    **record("2000", "Ramp", var("up", U16), var("Ramp down", U16)),
    "2001": var("Größe", U8),
    "2002": var("電動機", U8),
}


@pytest.fixture(scope="module")
def description() -> Description:
    return read_device(eds(OBJECTS), "x.eds")


@pytest.mark.parametrize(
    ("index", "sub", "title", "name"),
    [
        (0x2000, 1, "Ramp up", "ramp_up"),
        (0x2000, 2, "Ramp down", "ramp_down"),
        (0x2001, 0, "Größe", "groesse"),
        (0x2002, 0, "電動機", "object_2002_00"),
    ],
)
def test_an_element_has_its_objects_title_before_its_own(
    description: Description, index: int, sub: int, title: str, name: str
) -> None:
    entry = description.entry(index, sub)
    assert entry is not None
    assert title_of(description, entry) == title
    assert name_of(title, entry) == name


def test_a_name_begins_with_a_letter(description: Description) -> None:
    entry = description.entry(0x2001, 0)
    assert entry is not None
    assert name_of("3rd axis", entry) == "object_2001_00"
