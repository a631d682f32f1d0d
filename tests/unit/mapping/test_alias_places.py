"""Places of the parameters that are other names of communication objects."""

from __future__ import annotations

import pytest

from bridge.mapping import load_family
from bridge.mapping.alias_places import aliases, place_of
from bridge.mapping.aliases import Aliases
from bridge.mapping.entry_types import ObjectRef
from bridge.mapping.model import Parameter

NORD = load_family("nord/sk-tu4-cao")


def with_aliases(**tables: dict[str, object]):
    return NORD.model_copy(update={"aliases": Aliases.model_validate(tables)})


def test_further_elements_stand_at_the_next_sub_indices() -> None:
    """BU 2500 §6.4.3: parameter n is object 2000h + n, element m its sub-index m."""
    family = with_aliases(same={"P512[1]": ["1400:02", "1401:02"]}, related={"P509": "1017:00"})
    first, second, third = aliases(family)
    assert (first.name, first.is_same, first.objects) == ("P512[1]", True, (ObjectRef(0x1400, 2),))
    assert (second.name, second.objects) == ("P512[1] …", (ObjectRef(0x1401, 2),))
    assert second.ref == ObjectRef(first.ref.index, first.ref.sub + 1)
    assert (third.name, third.is_same) == ("P509", False)


def test_a_name_that_is_none_is_an_error() -> None:
    with pytest.raises(ValueError):
        place_of(NORD, "no such")


def test_a_parameter_of_the_file_has_its_own_place() -> None:
    own = Parameter.model_validate({"name": "X", "title": "", "object": "2345:01", "data_type": "uint16"})
    family = NORD.model_copy(update={"parameter": [own], "parameter_names": None})
    assert place_of(family, "X") == ObjectRef(0x2345, 1)
    with pytest.raises(ValueError, match=r"names of parameters need \[parameter_names\]"):
        place_of(family, "P509")
