"""A device description as canopen's object dictionary, and as the EDS that canopen writes of it."""

from __future__ import annotations

from io import StringIO
from pathlib import Path

import canopen
import pytest
from canopen.objectdictionary import ODVariable

from bridge.dictionary import as_eds, load_dictionary
from bridge.mapping.loader import family_names, mappings_dir


def imported(text: str, node_id: int = 5) -> canopen.ObjectDictionary:
    file = StringIO(text)
    file.name = "dictionary.eds"
    return canopen.import_od(file, node_id)


def variables(dictionary: canopen.ObjectDictionary) -> list[ODVariable]:
    found: list[ODVariable] = []
    for one in dictionary.values():
        found += [one] if isinstance(one, ODVariable) else one.subindices.values()
    return found


def facts(one: ODVariable) -> tuple[object, ...]:
    numbers = (one.factor, one.min, one.max, one.default)
    return (one.name, one.data_type, one.access_type, one.unit, one.description, *numbers)


@pytest.mark.landing(6)
@pytest.mark.parametrize("name", family_names())
def test_canopen_reads_from_the_eds_what_was_written(name: str) -> None:
    dictionary = load_dictionary(name, 5)
    again = imported(as_eds(dictionary))
    assert list(again) == sorted(dictionary, key=list(again).index)
    for one in variables(dictionary):
        read = again.get_variable(one.index, one.subindex)
        assert read is not None and facts(read) == facts(one)


def test_what_depends_on_the_node_id_is_that_of_the_node() -> None:
    file = mappings_dir() / "nord" / "sk-tu4-cao.eds"
    first = load_dictionary(file, 5).get_variable(0x1400, 1)
    nobody = load_dictionary(file).get_variable(0x1400, 1)
    assert first is not None and nobody is not None
    assert first.default == 0x4000_0205
    assert first.relative
    assert nobody.default is None
    again = imported(as_eds(load_dictionary(file)), 7).get_variable(0x1400, 1)
    assert again is not None and again.default == 0x4000_0207


def test_negative_numbers_bytes_and_long_names_survive_the_eds(tmp_path: Path) -> None:
    file = tmp_path / "odd.eds"
    file.write_text(
        "[OptionalObjects]\nSupportedObjects=3\n1=0x2000\n2=0x2001\n3=0x2002\n"
        "[2000]\nParameterName=minus\nDataType=0x3\nAccessType=rw\nDefaultValue=-5\nLowLimit=-7\nHighLimit=9\n"
        "[2001]\nParameterName=bytes\nDataType=0xA\nAccessType=ro\nDefaultValue=01 02 0A\n"
        "[2002]\nParameterName=50 % = half\nDataType=0x8\nAccessType=rw\nDefaultValue=1.5\nLowLimit=0\n"
    )
    again = imported(as_eds(load_dictionary(file)))
    minus, octets, real = (again.get_variable(index) for index in (0x2000, 0x2001, 0x2002))
    assert minus and octets and real
    assert (minus.default, minus.min, minus.max) == (-5, -7, 9)
    assert octets.default == bytes((1, 2, 10))
    assert (real.name, real.default, real.min) == ("50 % = half", 1.5, None)
