"""Whole plants on one seeded clock.

    python -m tests.plant [--seed N] [--runs N] [--minutes M] [--seconds S] [--out FOLDER] [--log]

Plays plants of ``--minutes`` each, one seed after the other from ``--seed`` on (of today, unless given),
for ``--seconds`` of CPU or ``--runs`` of them. What fails ends there, is reduced for ``--reduce`` seconds and
printed as a unit test; ends with 1 then.
``PROOF_PLANT`` says which plant it is: half of the drives, or a few at calm rates (tests/proof/settings.py).
"""

from __future__ import annotations

import argparse
import datetime
import gc
import logging
import sys
import tempfile
import time
from pathlib import Path

from bridge.project import Project
from tests.plant.figures import Figures, counted, figures_of, summary, write
from tests.plant.plan import Plan, plan_of
from tests.plant.plant import Plant, Result, project
from tests.plant.shrink import as_test, shrunk
from tests.proof.settings import PLANT

_MOST_SHOWN = 10


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seed", type=int, default=int(f"{datetime.datetime.now(tz=datetime.UTC):%Y%m%d}00"))
    parser.add_argument("--runs", type=int, default=1_000_000)
    parser.add_argument("--minutes", type=float, default=5.0)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument(
        "--reduce", type=float, default=60.0, metavar="S", help="how long what fails is reduced"
    )
    parser.add_argument("--out", type=Path, help="write plant.NAME.json for tests.plant.figures there")
    parser.add_argument("--log", action="store_true", help="print all that happens, of the first plant")
    asked = parser.parse_args()
    logging.disable(logging.CRITICAL)  # of what the bridge says, the oracle hears the events
    figures = Figures()
    failed: Result | None = None
    began = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        site = project(Path(folder))
        gc.freeze()
        with counted(figures.cells):
            while figures.runs < asked.runs and figures.spent_s < asked.seconds and failed is None:
                plan = plan_of(asked.seed + figures.runs, asked.minutes * 60)
                result = Plant(site, plan, logs=asked.log).run(to_first=True)
                if asked.log:
                    print("\n".join(result.log))
                    return 0
                spent_s = time.process_time() - began - figures.spent_s
                figures.add(figures_of(result, spent_s))
                failed = result if result.violations else None
        print(f"{PLANT.name}: seeds {asked.seed} … {asked.seed + figures.runs - 1}: {summary(figures)}")
        if failed:
            _tell(site, failed, asked.reduce)
    if asked.out:
        write(asked.out / f"plant.{PLANT.name}.json", figures)
    return 1 if failed else 0


def _tell(site: Project, result: Result, seconds: float) -> None:
    print(f"FAILED: seed {result.plan.seed}, {len(result.violations)} violations")
    for text in result.violations[:_MOST_SHOWN]:
        print(f"  {text}")

    spent_at = time.process_time() + seconds

    def fails_at(plan: Plan) -> float | None:
        again = Plant(site, plan).run(to_first=True)
        return again.played_s if again.violations else None

    least = shrunk(result.plan, result.played_s, fails_at, lambda: time.process_time() >= spent_at)
    print(f"\nreduced from {len(result.plan.steps)} steps to {len(least.steps)}:\n")
    print(as_test(least, f"seed_{least.seed}"))
    for text in Plant(site, least).run().violations[:_MOST_SHOWN]:
        print(f"  {text}")


if __name__ == "__main__":
    sys.exit(main())
