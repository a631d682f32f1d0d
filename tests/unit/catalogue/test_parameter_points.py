"""A parameter's codes are shown as a list of texts where every protocol can have them as one."""

from __future__ import annotations

import pytest

from bridge.catalogue.parameter_points import parameter_points
from bridge.mapping import load_family
from bridge.mapping.model import Aliases, Parameter
from bridge.parameter import Names
from bridge.text import Words, render

NORD = load_family("nord/sk-tu4-cao")


def states_of(data_type: str, *codes: int) -> tuple[tuple[int, Words], ...]:
    """As the point has them; the parameter has them in this order."""
    given = {
        "name": "P509",
        "title": "source",
        "data_type": data_type,
        "point": True,
        "states": {code: f"code {code}" for code in codes},
    }
    family = NORD.model_copy(
        update={
            "parameter": [Parameter.model_validate(given)],
            "aliases": Aliases(),
            "own_supervision": [],
        }
    )
    (point,) = parameter_points("conveyor/fu1", Names(family))
    assert point.name == "conveyor/fu1/parameter/p509"
    return point.states


@pytest.mark.parametrize("codes", [(0, 1), (1, 0, 255), (-1, 0), (0, 65535)])
def test_an_integer_has_the_texts_of_its_codes(codes: tuple[int, ...]) -> None:
    assert [code for code, _ in states_of("int32", *codes)] == list(codes)


def test_words_are_the_makers_in_both_languages_and_one_for_all_drives() -> None:
    one, other = (
        next(point for point in parameter_points(f"conveyor/{drive}", Names(NORD)) if point.leaf == "p509")
        for drive in ("fu1", "fu2")
    )
    said = {
        language: (
            render(one.description, language),
            [(code, render(text, language)) for code, text in one.states],
        )
        for language in ("en", "de")
    }
    assert said == {
        "en": ("P509 source of the control word", [(3, "system bus"), (6, "CANopen")]),
        "de": ("P509 Quelle Steuerwort", [(3, "Systembus"), (6, "CANopen")]),
    }
    assert one.description is other.description and one.states is other.states
