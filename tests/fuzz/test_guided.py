"""Every codec and parser takes whatever was ever found to take a new way through it."""

from __future__ import annotations

import pytest

from tests.fuzz.guided import corpus
from tests.fuzz.guided.parsers import PARSERS


@pytest.mark.parametrize("name", PARSERS)
def test_a_parser_raises_nothing_but_what_it_says_of_strange_bytes(name: str) -> None:
    inputs = [*PARSERS[name].seeds(), *corpus.kept(name)]
    assert inputs
    for one in inputs:
        PARSERS[name].feed(one)
        PARSERS[name].feed(one[: len(one) // 2])
