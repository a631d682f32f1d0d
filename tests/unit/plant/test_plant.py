"""A plant in a seed: the same run on any machine, and what is wrong is found."""

from __future__ import annotations

import os
import subprocess
import sys
from itertools import pairwise
from pathlib import Path

import pytest

from bridge.project import Project
from tests.plant.plan import KINDS, Plan, Step, plan_of
from tests.plant.plant import Plant, project
from tests.plant.world import BEGIN_S
from tests.proof.drives import DRIVES
from tests.support.process import REPOSITORY

SECONDS = 55.0
_HASH = """
import sys
from itertools import pairwise
from pathlib import Path
from tests.plant.plan import plan_of
from tests.plant.plant import Plant, project
print(Plant(project(Path(sys.argv[1])), plan_of(3, 26.0)).run().hash)
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Project:
    return project(tmp_path_factory.mktemp("plant"))


def test_a_plant_that_nothing_happens_to_moves(site: Project) -> None:
    result = Plant(site, Plan(1, 10.0, ())).run()
    assert not result.violations
    assert result.moved == len(DRIVES)
    assert result.looks > 100


@pytest.mark.landing(3)
@pytest.mark.parametrize("third", [0, 1, 2])
def test_a_plant_goes_on_whatever_has_happened(site: Project, third: int) -> None:
    kinds = tuple(KINDS)[third::3]
    drawn = [step for seed in range(200) for step in plan_of(seed, 60.0).steps]
    steps = [next(step for step in drawn if step.what == kind) for kind in kinds]
    timed = tuple(step._replace(at=8.0 + 1.5 * place) for place, step in enumerate(steps))
    result = Plant(site, Plan(1, SECONDS, timed)).run()
    assert not result.violations
    assert result.moved == len(DRIVES)
    assert set(result.counts) == set(kinds)


@pytest.mark.landing
def test_a_seed_gives_the_same_run_whatever_the_hashes_of_texts_are(tmp_path: Path) -> None:
    def run(hash_seed: int) -> str:
        folder = tmp_path / str(hash_seed)
        folder.mkdir()
        command = [sys.executable, "-c", _HASH, str(folder)]
        environment = {**os.environ, "PYTHONHASHSEED": str(hash_seed), "PYTHONPATH": str(REPOSITORY)}
        done = subprocess.run(
            command, env=environment, cwd=REPOSITORY, capture_output=True, text=True, check=True
        )
        return done.stdout

    assert run(1) == run(2)


def test_what_fails_in_a_process_is_found_though_it_is_killed(site: Project) -> None:
    plant = Plant(site, Plan(1, 10.0, (Step(9.0, "kill", 0, 0.2, "between turns"),)))
    plant.world.at(BEGIN_S + 8.0, lambda: plant.bridge.process.post(lambda: [].pop()))
    (fault,) = plant.run().violations
    assert "pop from empty list" in fault


def test_steps_make_a_difference(site: Project) -> None:
    step = Step(9.0, "controller silent", 0, 1.0)
    assert Plant(site, Plan(1, 12.0, ())).run().hash != Plant(site, Plan(1, 12.0, (step,))).run().hash


def test_the_wire_goes_on_while_the_process_stands_still_in_a_turn(site: Project) -> None:
    hangs = tuple(Step(round(8.0 + 0.71 * place, 2), "hang", 0, 0.3, "in a turn") for place in range(10))
    plant = Plant(site, Plan(1, 16.0, hangs), logs=True)
    times = [float(line.split()[0]) for line in plant.run().log if "#" in line]
    assert max(later - at for at, later in pairwise(times) if at > 8.0) < 0.1
