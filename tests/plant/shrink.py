"""The least steps that still show what is wrong, as far as they are found in the time there is."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from tests.plant.plan import FIRST_S, Plan, Step

_SETTLED_S: Final = 0.25
"""By so much the plan is longer than the time at which its violation was found."""
_EARLIER_S: Final = (0.0, 0.1, 0.35, 1.0)
"""Steps that begin so much later than they could show the same where the phase of a period matters."""

_WORTH_S: Final = 1.0
"""To begin earlier by less is not worth a run."""

FailsAt = Callable[[Plan], float | None]
"""When the first violation of a plan is found, in its seconds; None where there is none."""


class _Search:
    """A plan that fails, and its times. ``spent`` says that there is no time for another run."""

    def __init__(self, plan: Plan, failed_at: float, fails_at: FailsAt, spent: Callable[[], bool]) -> None:
        self._fails_at = fails_at
        self._spent = spent
        self.plan = _cut(plan, failed_at)

    def keep_last(self) -> None:
        """Do without all but the last steps, where these few show it by themselves: their runs are short."""
        steps, size = self.plan.steps, 1
        while size < len(steps) and not self._begins_earlier(steps[-size:], 0.0):
            size *= 2

    def tries(self, steps: tuple[Step, ...]) -> bool:
        """Whether a plan of these steps fails, too: then it is the one."""
        return self._is_it(self.plan._replace(steps=steps))

    def _is_it(self, plan: Plan) -> bool:
        if self._spent():
            return False
        failed_at = self._fails_at(plan)
        if failed_at is not None:
            self.plan = _cut(plan, failed_at)
        return failed_at is not None

    def leave_out(self, size: int) -> None:
        """Do without each block of so many steps that is not needed."""
        place = 0
        while place < len(self.plan.steps):
            steps = self.plan.steps
            if not self.tries(steps[:place] + steps[place + size :]):
                place += size

    def begin_earlier(self) -> None:
        """Leave out the time in which nothing happens before the first step: each further run is shorter."""
        steps = self.plan.steps
        any(self._begins_earlier(steps, late_s) for late_s in _EARLIER_S)

    def _begins_earlier(self, steps: tuple[Step, ...], late_s: float) -> bool:
        by = steps[0].at - FIRST_S - late_s if steps else 0.0
        if by < _WORTH_S:
            return False
        moved = tuple(step._replace(at=round(step.at - by, 4)) for step in steps)
        return self._is_it(self.plan._replace(seconds=self.plan.seconds - by + _SETTLED_S, steps=moved))


def _cut(plan: Plan, failed_at: float) -> Plan:
    """The plan up to its first violation."""
    seconds = round(failed_at + _SETTLED_S, 3)
    return plan._replace(seconds=seconds, steps=tuple(step for step in plan.steps if step.at < failed_at))


def shrunk(
    plan: Plan, failed_at: float, fails_at: FailsAt, spent: Callable[[], bool] = lambda: False
) -> Plan:
    """A plan of some of these steps that fails, too, and ends then. None of its steps can be left out, unless
    the time for it is ``spent`` before that is known."""
    search = _Search(plan, failed_at, fails_at, spent)
    search.keep_last()
    size = max(1, len(search.plan.steps) // 2)
    while not spent():
        search.leave_out(size)
        search.begin_earlier()
        if size == 1:
            break
        size = max(1, min(size // 2, len(search.plan.steps)))
    return search.plan


def as_test(plan: Plan, name: str) -> str:
    """A unit test that runs by itself."""
    steps = "".join(f"            {_step(step)},\n" for step in plan.steps)
    return (
        f"def test_{name}(tmp_path: Path) -> None:\n"
        f"    plan = Plan(\n        {plan.seed},\n        {plan.seconds},\n"
        f"        (\n{steps}        ),\n    )\n"
        f"    assert not Plant(project(tmp_path), plan).run().violations\n"
    )


def _step(step: Step) -> str:
    return f"Step({step.at}, {step.what!r}, {step.which}, {step.seconds}, {step.how!r})".replace("'", '"')
