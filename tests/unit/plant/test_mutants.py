"""Plants of seeded faults: what they lean to is there, and each finding has a rule."""

from __future__ import annotations

import pytest

from tests.plant.leaning import LEANS, SECONDS, leaning, plan
from tests.plant.mutants import ELSEWHERE, TAKEN_BACK, rule_of, tables
from tests.plant.plan import KINDS
from tests.proof.faults import FAULTS
from tests.proof.mutants import load


def test_each_kind_that_a_plan_leans_to_is_one() -> None:
    named = {one.partition(": ")[0] for groups in LEANS.values() for group in groups for one in group}
    assert named <= set(KINDS)
    taken_back = {mutant.first for mutant in tables(TAKEN_BACK)}
    assert set(LEANS) <= {fault.name for fault in FAULTS} | taken_back


def test_a_plan_that_leans_has_these_kinds_alone() -> None:
    steps = leaning(1, "bus process killed").steps
    assert {step.what for step in steps} <= {"kill", "controller silent"}
    assert all(8.0 < step.at < SECONDS for step in steps)


def test_a_plan_that_leans_to_how_something_happens_has_it_so() -> None:
    steps = leaning(1, "settings of a drive that positions").steps
    assert "P600" in {step.how for step in steps}
    assert {step.what for step in steps} == {"positions"}


def test_some_plans_lean_to_nothing() -> None:
    kinds = {step.what for seed in range(1, 9) for step in plan(seed, "bus process killed").steps}
    assert len(kinds) > 10


def test_a_mutant_that_no_plant_finds_is_there() -> None:
    assert set(ELSEWHERE) <= {mutant.name for mutant in (*load(), *tables(TAKEN_BACK))}


@pytest.mark.parametrize(
    ("found", "rule"),
    [
        ("9.5 s: fan is enabled, and its controller has not asked for it since the bridge hung", "asked for"),
        ("9.5 s: an intruder's rpdo at fan is not answered, since 9.0 s", "intruders are answered"),
        ("9.5 s: fan/drive/actual/velocity is said to be 5, and the drive has 10", "image is drive"),
        ("9.5 s: fan/drive: C01 was changed at 1.000 s, and no event says so", "causes are told"),
        ("something else", "?"),
        ("", ""),
    ],
)
def test_a_finding_has_a_rule(found: str, rule: str) -> None:
    assert rule_of(found) == rule


@pytest.mark.parametrize(
    ("first", "ways"), [("deaf", {"silent", "jogs", "to everything"}), ("deaf: jogs", {"jogs"})]
)
def test_a_plan_may_lean_to_a_kind_of_step_and_to_one_way_of_it(first: str, ways: set[str]) -> None:
    steps = [step for seed in range(20) for step in leaning(seed, first).steps]
    assert {(step.what, step.how) for step in steps} == {("deaf", how) for how in ways}
