"""The least steps that still show what is wrong."""

from __future__ import annotations

from collections.abc import Callable

from tests.plant.plan import Plan, Step

Fails = Callable[[Plan], bool]


def shrunk(plan: Plan, fails: Fails) -> Plan:
    """A plan of some of these steps that fails, too, and none of whose steps can be left out. It ends a while
    after its last step."""
    steps = list(plan.steps)
    size = max(1, len(steps) // 2)
    while True:
        place = 0
        while place < len(steps):
            fewer = steps[:place] + steps[place + size :]
            if fails(plan._replace(steps=tuple(fewer))):
                steps = fewer
            else:
                place += size
        if size == 1:
            return plan._replace(steps=tuple(steps))
        size = max(1, size // 2)


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
