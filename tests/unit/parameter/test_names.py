"""A parameter is found by the vendor's own name, and where it is not, the nearest names are told."""

from __future__ import annotations

import pytest

from bridge.mapping import load_family
from bridge.mapping.model import Aliases, Parameter, ParameterNames
from bridge.parameter import Names, ParameterError, Why

NORD = load_family("nord/sk-tu4-cao")
NAMES = Names(NORD)


@pytest.mark.parametrize(
    ("text", "name", "address"),
    [
        # BU 2500 §6.6.1: 2000h + number; 4·(element − 1) + set, 0 where there is neither
        ("P102", "P102", "2066:01"),
        ("P102.3", "P102.3", "2066:03"),
        ("p102.4", "P102.4", "2066:04"),
        ("P543[2]", "P543[2]", "221F:05"),
        ("P543[-2]", "P543[2]", "221F:05"),
        ("P543[3].4", "P543[3].4", "221F:0C"),
        ("P509", "P509", "21FD:00"),
        ("P701[5]", "P701[5]", "22BD:11"),
        # §7.1: the interface's own count from 1
        ("P151", "P151", "2097:01"),
        ("P170[2]", "P170[2]", "20AA:02"),
        ("P176[17]", "P176[17]", "20B0:11"),
        # points and objects
        ("p543_2_3", "P543[2].3", "221F:07"),
        ("2066:02", "P102.2", "2066:02"),
        ("0x2066:2", "P102.2", "2066:02"),
        ("1018h:1", "1018:01", "1018:01"),
        # fits the pattern, and no file lists it
        ("P999", "P999", "23E7:00"),
        ("P740[2]", "P740[2]", "22E4:05"),
    ],
)
def test_a_name_leads_to_its_object(text: str, name: str, address: str) -> None:
    entry = NAMES.resolve(text)
    assert (entry.name, str(entry.address)) == (name, address)


def test_what_no_file_describes_has_no_definition() -> None:
    assert NAMES.resolve("P999").definition is None
    assert NAMES.resolve("1018:01").definition is None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("P1002", "did you mean P102"),
        ("acceleration", "names look like P102"),
        ("", "names look like P102"),
        ("P102[2]", "P102 has no elements, not 2"),
        ("P543[4]", "P543 has elements 1…3, not 4"),
        ("P509.2", "P509 has no parameter sets, not 2"),
    ],
)
def test_a_name_that_does_not_exist_is_told_with_the_nearest(text: str, message: str) -> None:
    with pytest.raises(ParameterError) as told:
        NAMES.resolve(text)
    assert message in str(told.value)
    assert told.value.why is Why.UNKNOWN_NAME


def test_every_entry_is_found_again_by_its_name_its_leaf_and_its_object() -> None:
    entries = list(NAMES.entries())
    assert len({entry.name for entry in entries}) == len({entry.address for entry in entries}) == len(entries)
    for entry in entries:
        assert NAMES.resolve(entry.name) == entry
        assert NAMES.resolve(entry.leaf).address == entry.address
        assert NAMES.resolve(str(entry.address)) == entry


def _with(rule: dict[str, object], parameters: list[dict[str, object]]) -> Names:
    given = {
        "parameter_names": ParameterNames.model_validate(rule),
        "parameter": [Parameter.model_validate(parameter) for parameter in parameters],
    }
    return Names(NORD.model_copy(update={**given, "aliases": Aliases(), "own_supervision": []}))


def test_lenze_codes_count_downwards_and_their_subcode_is_the_sub_index() -> None:
    # 8400 motec §9.2: index = 24575 − code, sub-index = sub-code
    rule: dict[str, object] = {
        "pattern": r"C(?P<number>\d{1,5})(/(?P<element>\d{1,3}))?",
        "example": "C00039/1",
        "index": 0x5FFF,
        "number_step": -1,
    }
    one = {"name": "C00039/1", "title": "fixed setpoint 1", "data_type": "int32", "factor": 0.01}
    names = _with(rule, [one])
    assert str(names.resolve("C00011").address) == "5FF4:00"
    assert str(names.resolve("C00039/1").address) == "5FD8:01"
    assert names.resolve("c39/1").definition == names.resolve("C00039/1").definition


def test_stoeber_coordinates_have_a_letter() -> None:
    # CAN 5000 §11.2: index = 2000h + 200h·(letter − A) + line, sub-index = element
    rule: dict[str, object] = {
        "pattern": r"(?P<letter>[A-Z])(?P<number>\d{1,3})(\.(?P<element>\d{1,2}))?",
        "example": "E08, I10.2",
        "index": 0x2000,
        "letter_step": 0x200,
    }
    names = _with(rule, [])
    found = [str(names.resolve(text).address) for text in ("C01", "E08", "A180", "I10.2", "e08")]
    assert found == ["2401:00", "2808:00", "20B4:00", "300A:02", "2808:00"]


def test_digits_of_other_scripts_are_no_numbers() -> None:
    with pytest.raises(ParameterError):
        NAMES.resolve("P١٠٢")
