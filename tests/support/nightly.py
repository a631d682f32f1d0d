"""Extent of long trials: a part by default, all of them with ``NIGHTLY=1`` (``make nightly``).

A plugin of pytest, too. A test that is marked ``nightly`` is left out by default. No mark leaves a test out
of a nightly run.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable
from random import Random
from typing import Any, Final

import pytest

IS_NIGHTLY: Final = os.environ.get("NIGHTLY", "0") not in ("", "0")

_PART: Final = 6
_LEAST: Final = 5


def examples(every: int, few: int | None = None) -> int:
    """Number of ``every`` that are tried: ``few``, or the sixth part, unless it is night."""
    return every if IS_NIGHTLY else min(every, max(every // _PART, _LEAST) if few is None else few)


def by_night(rows: Iterable[tuple[Any, ...]], times: int = 2) -> list[Any]:
    """Rows for ``parametrize``. By default so many that each value of each column is there ``times`` times,
    where it is there as often; all of them by night."""
    every = list(rows)
    seen, chosen = Counter[tuple[int, str]](), set[int]()
    for place in Random(1).sample(range(len(every)), len(every)):
        cells = list(enumerate(map(repr, every[place])))
        if any(seen[cell] < times for cell in cells):
            seen.update(cells)
            chosen.add(place)
    return [
        row if n in chosen else pytest.param(*row, marks=pytest.mark.nightly) for n, row in enumerate(every)
    ]


def by_night_of(values: Iterable[Any], few: int) -> list[Any]:
    """Values for ``parametrize``, such as seeds, one as good as the other: the first ``few`` by default."""
    return [
        value if place < few else pytest.param(value, marks=pytest.mark.nightly)
        for place, value in enumerate(values)
    ]


def pytest_configure(config: pytest.Config) -> None:
    config.addinivalue_line("markers", "nightly: takes long, and is left out by default (make nightly)")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    left_out = [] if IS_NIGHTLY else [item for item in items if item.get_closest_marker("nightly")]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if not item.get_closest_marker("nightly")]
