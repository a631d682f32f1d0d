"""Names of a family's parameters and the objects that they are."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator
from typing import Any

import pytest

from bridge.mapping.loader import mappings_dir
from bridge.mapping.parameters import ParameterNames, object_of
from bridge.tomlfile import Unfit

NAMES = {
    "nord": {
        "pattern": r"P(?P<number>\d{1,3})(\[(?P<element>\d+)\])?(\.(?P<set>[1-4]))?",
        "example": "P102",
        "index": 0x2000,
        "element_step": 4,
        "element_first": 1,
        "set_step": 1,
    },
    "lenze": {
        "pattern": r"C(?P<number>\d{5})(/(?P<element>\d+))?",
        "example": "C00039/1",
        "index": 0x5FFF,
        "number_step": -1,
        "element_step": 1,
    },
    "stoeber": {
        "pattern": r"(?P<letter>[A-Z])(?P<number>\d{2,3})(\.(?P<element>\d+))?",
        "example": "E08",
        "index": 0x2000,
        "letter_step": 0x200,
        "element_step": 1,
    },
}


@pytest.mark.parametrize(
    ("names", "name", "sets", "elements", "object_"),
    [
        # BU 2500 §6.6.1: 2000h + number, sub-index 4·(element − 1) + parameter set.
        ("nord", "P102", 4, 0, "2066:01"),
        ("nord", "P102.3", 4, 0, "2066:03"),
        ("nord", "P509", 0, 0, "21FD:00"),
        ("nord", "P543[2].3", 4, 5, "221F:07"),
        # EDS84DMOTCAN 3.0 §9.2: 24575 − code, sub-index = sub-code.
        ("lenze", "C00061", 0, 0, "5FC2:00"),
        ("lenze", "C00039/1", 0, 0, "5FD8:01"),
        # ID 441684.06 §11.2: 2000h + 200h·letter + line.
        ("stoeber", "E08", 0, 0, "2808:00"),
        ("stoeber", "A180", 0, 0, "20B4:00"),
        ("stoeber", "C01", 0, 0, "2401:00"),
    ],
)
def test_names_of_parameters_are_objects(
    names: str, name: str, sets: int, elements: int, object_: str
) -> None:
    assert str(object_of(ParameterNames.model_validate(NAMES[names]), name, sets, elements)) == object_


@pytest.mark.parametrize(
    ("name", "sets", "elements", "message"),
    [
        ("C5", 0, 0, "'C5' is no parameter; they are written as P102"),
        ("P102.3", 2, 0, "'P102.3': its parameter sets are 1…2"),
        ("P102[3]", 0, 2, r"'P102\[3\]': its elements are 1…2"),
        ("P102[99]", 0, 0, "there cannot be"),
    ],
)
def test_a_name_that_is_none(name: str, sets: int, elements: int, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        object_of(ParameterNames.model_validate(NAMES["nord"]), name, sets, elements)


@pytest.mark.parametrize(
    ("pattern", "name"),
    [
        (r"P(?P<number>\w+)", "P10G"),
        (r"P(?P<number>\d+)(\[(?P<element>\w+)\])?", "P102[a]"),
        (r"P(?P<number>\d+)(\.(?P<set>\w))?", "P102.a"),
        (r"P(?P<number>\d+)?", "P"),
        (r"(?P<letter>[A-Z]+)(?P<number>\d+)", "AB10"),
    ],
)
def test_a_pattern_that_takes_words_for_numbers_names_none(pattern: str, name: str) -> None:
    names = ParameterNames.model_validate({"pattern": pattern, "example": "P102", "index": 0x2000})
    with pytest.raises(Unfit, match=f"'{re.escape(name)}' is no parameter; they are written as P102"):
        object_of(names, name)


ALIKE = re.compile(r"\d+ [kM]bit/s|SK \w+-CAO|\d SDO, \w+")
"""Texts that are the same in every language."""


def listed() -> Iterator[tuple[str, dict[str, Any]]]:
    """Every ``[[parameter]]`` as a file has it, with the file's name."""
    for path in sorted(mappings_dir().rglob("*.toml")):
        content = tomllib.loads(path.read_text(encoding="utf-8"))
        yield from (
            (f"{path.parent.name}/{path.stem} {one['name']}", one) for one in content.get("parameter", ())
        )


def test_every_parameter_has_its_words_in_german() -> None:
    assert [where for where, one in listed() if bool(one.get("title")) is not bool(one.get("german"))] == []
    stated = [(where, one) for where, one in listed() if "states" in one]
    assert len(stated) > 40
    spoken = {where for where, one in stated if one.get("german_states", {}).keys() == one["states"].keys()}
    alike = {where for where, one in stated if all(ALIKE.fullmatch(text) for text in one["states"].values())}
    assert {where for where, _ in stated} - spoken == alike
