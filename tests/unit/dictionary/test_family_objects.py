"""A family as canopen's object dictionary: names, units, limits, texts."""

from __future__ import annotations

import pytest
from canopen.objectdictionary import ODRecord, ODVariable

from bridge.dictionary import load_dictionary
from bridge.mapping.loader import family_names, load_family, mappings_dir
from bridge.parameter import Names

NORD = "nord/sk-tu4-cao"


@pytest.mark.landing(6)
@pytest.mark.parametrize("name", family_names())
def test_every_parameter_of_a_family_is_found_by_its_name(name: str) -> None:
    dictionary = load_dictionary(name, 5)
    for entry in Names(load_family(name)).entries():
        found = dictionary.get_variable(entry.address.index, entry.address.sub)
        assert found is not None and entry.definition is not None
        assert found.unit == entry.definition.unit
        assert dictionary.names.get(entry.name) is not None, entry.name


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
