"""The claims of conformance: each unit that is held names a test that is there and runs."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache

import pytest

from bridge.uaserver.conformance import PROFILES, ConformanceUnit, Profile, claimed, units_of
from tests.support.process import REPOSITORY

UNITS = [unit for profile in PROFILES.values() for unit in profile.units]
HELD = sorted({unit.test for unit in UNITS if unit.test})


@cache
def functions_of(path: str) -> dict[str, ast.FunctionDef | ast.AsyncFunctionDef]:
    """Tests of a file by their paths within it."""

    def walk(
        body: list[ast.stmt], above: str
    ) -> Iterator[tuple[str, ast.FunctionDef | ast.AsyncFunctionDef]]:
        for node in body:
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                yield f"{above}{node.name}", node
            elif isinstance(node, ast.ClassDef):
                yield from walk(node.body, f"{above}{node.name}::")

    return dict(walk(ast.parse((REPOSITORY / path).read_text("utf-8")).body, ""))


@pytest.mark.parametrize("test", HELD)
def test_a_unit_is_held_by_a_test_that_runs(test: str) -> None:
    path, _, name = test.partition("::")
    found = functions_of(path)[name]
    assert name.rpartition("::")[2].startswith("test_")
    assert not any(
        "skip" in ast.unparse(mark) or "xfail" in ast.unparse(mark) for mark in found.decorator_list
    )


def test_what_is_included_is_there_and_each_unit_once_in_its_profile() -> None:
    for profile in PROFILES.values():
        assert all(name in PROFILES for name in profile.includes)
        names = [unit.name for unit in profile.units]
        assert len(set(names)) == len(names)


def test_a_profile_is_claimed_where_all_that_it_needs_is_held() -> None:
    for profile in PROFILES.values():
        needed = [unit for unit in units_of(profile) if not unit.is_optional]
        is_held = bool(profile.uri) and all(unit.test for unit in needed)
        assert (profile.uri in claimed()) == is_held, profile.name


def test_one_unit_that_is_not_served_takes_the_claim(monkeypatch: pytest.MonkeyPatch) -> None:
    held, missing = ConformanceUnit("a", "x::y"), ConformanceUnit("b")
    optional = ConformanceUnit("c", is_optional=True)
    parts = {
        "part": Profile("part", "urn:part", 1, (), (held, optional)),
        "whole": Profile("whole", "urn:whole", 2, ("part",), (held,)),
        "beyond": Profile("beyond", "urn:beyond", 3, ("whole",), (missing,)),
        "far": Profile("far", "urn:far", 4, ("beyond",), ()),
    }
    monkeypatch.setattr("bridge.uaserver.conformance.PROFILES", parts)
    assert claimed() == ["urn:part", "urn:whole"]
