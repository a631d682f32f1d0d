"""Units by their UNECE codes."""

from __future__ import annotations

import pytest

from bridge.northbound.opcua.space.engineering_units import unit_id


# Part 8 §5.6.3: the characters of the UNECE common code, the first one highest.
@pytest.mark.parametrize(
    ("unit", "number"),
    [
        ("Hz", 4740186),
        ("A", 4279632),
        ("V", 5655636),
        ("%", 20529),
        ("ms", 4403766),
        ("s", 5457219),
        ("furlong", -1),
    ],
)
def test_units_are_those_of_unece(unit: str, number: int) -> None:
    assert unit_id(unit) == number
