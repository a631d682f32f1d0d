"""Whole plants on one seeded clock.

    python -m tests.plant [--seed N] [--runs N] [--minutes M] [--seconds S] [--log]

Plays plants of ``--minutes`` each, one seed after the other from ``--seed`` on (of today, unless given),
for ``--seconds`` of CPU or ``--runs`` of them. What fails ends there, is reduced for ``--reduce`` seconds and
printed as a unit test; ends with 1 then.
``PROOF_PLANT`` says which half of the drives there is (tests/proof/settings.py).
"""

from __future__ import annotations

import argparse
import datetime
import logging
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

from bridge.project import Project
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
    parser.add_argument("--log", action="store_true", help="print all that happens, of the first plant")
    asked = parser.parse_args()
    logging.disable(logging.CRITICAL)  # of what the bridge says, the oracle hears the events
    counts: Counter[str] = Counter()
    played_s = frames = looks = runs = 0.0
    failed: list[Result] = []
    began = time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        site = project(Path(folder))
        while runs < asked.runs and time.process_time() - began < asked.seconds and not failed:
            seed = asked.seed + int(runs)
            result = Plant(site, plan_of(seed, asked.minutes * 60), logs=asked.log).run(to_first=True)
            runs += 1
            played_s += result.played_s
            frames += result.frames
            looks += result.looks
            counts += result.counts
            if asked.log:
                print("\n".join(result.log))
                return 0
            if result.violations:
                failed.append(result)
        spent = time.process_time() - began
        hours, rate = played_s / 3600, played_s / max(spent, 0.01)
        print(
            f"{PLANT.name}: seeds {asked.seed} … {asked.seed + int(runs) - 1}: {hours:.2f} h of plants in "
            f"{spent:.0f} s ({rate:.0f} times real time), {frames:.0f} frames, {looks:.0f} judgements"
        )
        for what, number in sorted(counts.items()):
            print(f"  {number:5}  {what}")
        for result in failed:
            _tell(site, result, asked.reduce)
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
