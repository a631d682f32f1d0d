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


@pytest.mark.parametrize("codes", [(0, 1), (0,), (255,), (1, 0, 255)])
def test_up_to_256_codes_from_0_on_are_a_list(codes: tuple[int, ...]) -> None:
    """Texts by their place (OPC UA Part 8 v1.05, 5.3.3.3)."""
    assert [code for code, _ in states_of("int16", *codes)] == list(codes)


@pytest.mark.parametrize("codes", [(-1, 0), (0, 256), (65535,)])
def test_others_are_not(codes: tuple[int, ...]) -> None:
    assert states_of("int32", *codes) == ()
