"""Reduction of a plan that fails."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from tests.plant.plan import Plan, Step, plan_of
from tests.plant.shrink import as_test, shrunk

PLAN = plan_of(1, 600.0)


@given(st.sets(st.sampled_from(PLAN.steps), max_size=3))
def test_what_is_left_is_what_it_takes(needed: set[Step]) -> None:
    found = shrunk(PLAN, lambda plan: needed <= set(plan.steps))
    assert set(found.steps) == needed
    assert found.seed == PLAN.seed


def test_a_plan_is_printed_as_a_test_that_makes_it() -> None:
    plan = PLAN._replace(steps=PLAN.steps[:2])
    text = as_test(plan, "seed_1")
    begin = text.index("Plan(")
    end = text.index("assert")
    made: Plan = eval(text[begin:end].strip(), {"Plan": Plan, "Step": Step})
    assert made == plan
    compile(text, "<test>", "exec")


def test_a_seed_is_a_plan() -> None:
    assert plan_of(7, 300.0) == plan_of(7, 300.0)
    assert plan_of(7, 300.0).steps != plan_of(8, 300.0).steps
