"""Reduction of a plan that fails."""

from __future__ import annotations

from collections.abc import Callable

from hypothesis import given
from hypothesis import strategies as st

from tests.plant.plan import FIRST_S, Plan, Step, plan_of
from tests.plant.shrink import as_test, shrunk

PLAN = plan_of(1, 600.0)


class Model:
    """A plan fails a second after the last of the ``needed`` steps, which are known by what they do; where
    ``at`` matters only at their times."""

    def __init__(self, needed: set[Step], *, at: bool = False) -> None:
        self._needed = needed
        self._at = at
        self.played_s = 0.0
        self.runs = 0

    def __call__(self, plan: Plan) -> float | None:
        self.runs += 1
        steps = {step if self._at else step._replace(at=0.0): step for step in plan.steps}
        needed = {step if self._at else step._replace(at=0.0) for step in self._needed}
        last = max((steps[step].at for step in needed if step in steps), default=0.0)
        if needed <= set(steps) and last + 1.0 <= plan.seconds:
            self.played_s += last + 1.0
            return last + 1.0
        self.played_s += plan.seconds
        return None

    def shrunk(self, spent: Callable[[], bool] = lambda: False) -> Plan:
        failed_at = self(PLAN)
        assert failed_at is not None
        return shrunk(PLAN, failed_at, self, spent)


@given(st.sets(st.sampled_from(PLAN.steps), max_size=3))
def test_what_is_left_is_what_it_takes(needed: set[Step]) -> None:
    found = Model(needed, at=True).shrunk()
    assert set(found.steps) == needed
    assert found.seed == PLAN.seed


@given(st.sets(st.sampled_from(PLAN.steps), min_size=1, max_size=3))
def test_it_begins_at_once_and_ends_with_what_is_wrong(needed: set[Step]) -> None:
    found = Model(needed).shrunk()
    assert {step._replace(at=0.0) for step in found.steps} == {step._replace(at=0.0) for step in needed}
    assert found.steps[0].at < FIRST_S + 1.5
    assert found.steps[-1].at + 1.0 <= found.seconds <= found.steps[-1].at + 1.5


def test_one_late_step_takes_little_time() -> None:
    model = Model({PLAN.steps[-2]})
    model.shrunk()
    assert model.played_s < 4 * PLAN.seconds


def test_when_its_time_is_over_it_has_what_it_has() -> None:
    model = Model({PLAN.steps[3], PLAN.steps[-2]})
    found = model.shrunk(lambda: model.runs > 3)
    assert model.runs == 4
    assert model(found) is not None


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
