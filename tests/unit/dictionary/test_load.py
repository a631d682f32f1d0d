"""What canopen gets to know of a family, a mapping file and a device description."""

from __future__ import annotations

from io import StringIO
from pathlib import Path

import canopen
import pytest
from canopen.objectdictionary import ODRecord, ODVariable
from typer.testing import CliRunner

from bridge.base.errors import FileFaults
from bridge.cli.app import make_app
from bridge.dictionary import as_eds, load_dictionary
from bridge.mapping.loader import family_names, load_family, mappings_dir
from bridge.parameter import Names

NORD = "nord/sk-tu4-cao"


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


@pytest.mark.parametrize("name", family_names())
def test_every_parameter_of_a_family_is_found_by_its_name(name: str) -> None:
    dictionary = load_dictionary(name, 5)
    for entry in Names(load_family(name)).entries():
        found = dictionary.get_variable(entry.address.index, entry.address.sub)
        assert found is not None and entry.definition is not None
        assert found.unit == entry.definition.unit
        assert dictionary.names.get(entry.name) is not None, entry.name


@pytest.mark.parametrize("name", family_names())
def test_canopen_reads_from_the_eds_what_was_written(name: str) -> None:
    dictionary = load_dictionary(name, 5)
    again = imported(as_eds(dictionary))
    assert list(again) == sorted(dictionary, key=list(again).index)
    for one in variables(dictionary):
        read = again.get_variable(one.index, one.subindex)
        assert read is not None and facts(read) == facts(one)


def test_a_parameter_has_unit_factor_limits_and_texts() -> None:
    dictionary = load_dictionary(NORD)
    acceleration = dictionary.names["P102.2"]
    assert isinstance(acceleration, ODVariable)
    assert acceleration is dictionary.names["p102_2"]
    assert isinstance(dictionary["P102"], ODRecord)
    assert (acceleration.unit, acceleration.factor) == ("s", 0.01)
    assert acceleration.decode_phys(103) == pytest.approx(1.03)
    assert acceleration.description


def test_texts_of_values_and_names_of_bits_are_there() -> None:
    family = load_family(NORD)
    stated = next(one for one in family.parameter if one.states)
    dictionary = load_dictionary(NORD)
    code, text = next(iter(stated.states.items()))
    entry = Names(family).resolve(stated.name)
    variable = dictionary.get_variable(entry.address.index, entry.address.sub)
    assert variable is not None
    assert variable.value_descriptions[round(code / stated.factor)] == text
    assert f"{code} = {text}" in variable.description
    inputs = dictionary.get_variable(0x3005)
    assert inputs is not None and inputs.bit_definitions["input_2"] == [1]


def test_a_mapping_that_extends_another_has_its_objects() -> None:
    pdo3, whole = load_dictionary("nord/sk-tu3-cao-pdo3"), load_dictionary("nord/sk-tu3-cao")
    assert set(pdo3) >= set(whole)
    by_file = load_dictionary(mappings_dir() / "nord" / "sk-tu3-cao-pdo3.toml")
    assert list(by_file) == list(pdo3)


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


@pytest.mark.parametrize("name", ["nord/none", "none.eds", "none.toml", "nord/drive"])
def test_what_is_not_there_is_named(name: str) -> None:
    with pytest.raises(FileFaults, match=name.removesuffix(".toml")):
        load_dictionary(name)


def test_the_command_prints_the_eds() -> None:
    result = CliRunner().invoke(make_app("eds"), ["eds", NORD, "--format", "canopen", "--node-id", "5"])
    assert result.exit_code == 0, result.output
    dictionary = imported(result.output)
    assert dictionary["P102"]["P102.1"].unit == "s"


def test_the_format_for_canopen_stands_alone() -> None:
    result = CliRunner().invoke(make_app("eds"), ["eds", NORD, "--format", "canopen", "--json"])
    assert result.exit_code == 2
