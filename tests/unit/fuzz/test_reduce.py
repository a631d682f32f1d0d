"""Few cases are left of many, and they still fail."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from tests.fuzz.case import Case
from tests.fuzz.reduce import reduced

MANY = [Case("any", (number.to_bytes(2, "big"),)) for number in range(400)]


@pytest.mark.parametrize("guilty", [{0}, {399}, {137}, {3, 200}, {10, 11, 390}])
def test_only_the_guilty_are_left(guilty: set[int]) -> None:
    wanted = [MANY[number] for number in sorted(guilty)]
    tries = 0

    def fails(cases: Sequence[Case]) -> bool:
        nonlocal tries
        tries += 1
        return all(case in cases for case in wanted)

    assert reduced(MANY, fails) == wanted
    assert tries < (40 if len(guilty) == 1 else 250)


def test_where_any_will_do_one_is_left() -> None:
    assert len(reduced(MANY, bool)) == 1
