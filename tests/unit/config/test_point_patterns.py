"""Patterns of points in a site file."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.config.point_patterns import HISTORY_POINTS, fits, is_pattern
from tests.support.small_site import SMALL, faults, load


@pytest.mark.parametrize(
    ("name", "pattern", "expected"),
    [
        ("conveyor/fu1/actual/current", "*/*/actual/*", True),
        ("conveyor/fu1/actual/current", "conveyor/fu?/actual/current", True),
        ("conveyor/fu1/actual/current", "conveyor/*", False),
        ("conveyor/fu1/actual/current", "*/*/*", False),
        ("conveyor/fu12/actual/current", "*/fu?/actual/*", False),
        ("bus/can0/load", "bus/*/load", True),
    ],
)
def test_a_star_stays_between_two_slashes(name: str, pattern: str, expected: bool) -> None:
    assert fits(name, pattern) is expected


@pytest.mark.parametrize("text", ["", "*", "/a", "a/", "a//b", "A/b", "a/[bc]", "a b/c"])
def test_what_is_no_pattern(tmp_path: Path, text: str) -> None:
    assert not is_pattern(text)
    (fault,) = faults(tmp_path, f'{SMALL}[opcua.history]\npoints = ["*/*/status/state", "{text}"]\n')
    assert fault.startswith("14: opcua.history.points[1]: must be the name of a point")


def test_what_is_kept_where_nothing_is_named(tmp_path: Path) -> None:
    site = load(tmp_path, f"{SMALL}[opcua]\n")
    assert site.opcua
    assert tuple(site.opcua.history.points) == HISTORY_POINTS
    assert all(map(is_pattern, HISTORY_POINTS))
