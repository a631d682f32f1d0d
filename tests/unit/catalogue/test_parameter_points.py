"""A parameter's codes are shown as a list of texts where every protocol can have them as one."""

from __future__ import annotations

import pytest

from bridge.catalogue.parameter_points import parameter_points
from bridge.mapping import load_family
from bridge.mapping.model import Aliases, Parameter
from bridge.parameter import Names

NORD = load_family("nord/sk-tu4-cao")


def states_of(data_type: str, *codes: int) -> tuple[tuple[int, str], ...]:
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
