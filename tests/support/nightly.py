"""Extent of long trials, and a plugin of pytest.

| run | by | takes |
|---|---|---|
| by day | ``make test`` | what has neither mark, and each nth of what is marked ``landing(n)`` |
| before a change lands | ``make landing``, ``LANDING=rest`` | the rest of what is marked ``landing`` |
| both | ``LANDING=1`` | what a change has to pass (``.ci/run``) |
| by night | ``make nightly``, ``NIGHTLY=1`` | everything, with all examples: an hour |

A test that is named on the command line (``test_it.py::test_this``) is taken in every run.
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
    """Rows for ``parametrize``. Each value of each column is there once by day, where a change lands
    ``times`` times (where it is there as often), and by night with every other."""
    every = list(rows)
    seen, by_day, landing = Counter[tuple[int, str]](), set[int](), set[int]()
    order = Random(1).sample(range(len(every)), len(every))
    for chosen, wanted in ((by_day, 1), (landing, times)):
        for place in order:
            cells = list(enumerate(map(repr, every[place])))
            if place not in by_day and any(seen[cell] < wanted for cell in cells):
                seen.update(cells)
                chosen.add(place)
    return [
        row
        if place in by_day
        else pytest.param(*row, marks=pytest.mark.landing if place in landing else pytest.mark.nightly)
        for place, row in enumerate(every)
    ]


def by_night_of(values: Iterable[Any], few: int) -> list[Any]:
    """Values for ``parametrize``, such as seeds, one as good as the other: the first by day, ``few`` where a
    change lands."""
    return [
        value
        if place < 1
        else pytest.param(value, marks=pytest.mark.landing if place < few else pytest.mark.nightly)
        for place, value in enumerate(values)
    ]


def pytest_configure(config: pytest.Config) -> None:
    for mark, extent in (("landing", "before a change lands (make landing)"), ("nightly", "make nightly")):
        config.addinivalue_line("markers", f"{mark}: takes long, and is left out by make test, as {extent}")


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    if IS_NIGHTLY or any("::" in name for name in config.args):  # who names a test wants it
        return
    by_day = _by_day(items)
    taken = {item for item in items if not item.get_closest_marker("nightly")}
    taken = {"rest": taken - by_day, "1": taken}.get(os.environ.get("LANDING", "0"), taken & by_day)
    left_out = [item for item in items if item not in taken]
    if left_out:
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if item in taken]


def _by_day(items: Iterable[pytest.Item]) -> set[pytest.Item]:
    """Items without a mark, and of ``landing(n)`` the first of each test and each nth after it."""
    taken, counts = set[pytest.Item](), Counter[str]()
    for item in items:
        mark = item.get_closest_marker("landing")
        name = item.nodeid.partition("[")[0]
        if mark is None or (mark.args and counts[name] % mark.args[0] == 0):
            taken.add(item)
        counts[name] += 1
    return taken
