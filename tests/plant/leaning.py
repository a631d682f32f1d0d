"""Plans that lean to the kinds of steps by which a fault of the chain shows itself, played until something is
wrong.

    python -m tests.plant.leaning --first FAULT [--seed N] [--seconds S] [--only]

``FAULT`` is one of the proof's (tests/proof/faults.py). Prints one line of JSON; ``--only`` plays the plan of
``--seed`` alone.
"""

from __future__ import annotations

import argparse
import json
import logging
import sys
import tempfile
import time
from pathlib import Path
from random import Random
from typing import Final

from tests.plant.plan import KINDS, Plan, Step, plan_of
from tests.plant.plant import Plant, project
from tests.plant.world import BEGIN_S

SECONDS: Final = 60.0
_FIRST_S: Final = 8.5
_LAST_S: Final = 8.0
_EACH_S: Final = 7.0
_GENERAL: Final = 4
"""Each so many plans one leans to nothing."""
_LOOK_S: Final = 0.5

Group = tuple[str, ...]
"""Kinds of steps that happen to one drive at about the same time."""

_SILENT: Final[tuple[Group, ...]] = (
    ("controller silent",),
    ("all controllers silent",),
    ("controller crashed",),
    ("half open",),
    ("controller silent", "hang"),
    ("controller silent", "acknowledges"),
    ("controller silent", "stop"),
)
_DEAD: Final[tuple[Group, ...]] = (("hang",), ("kill",), ("hang", "controller silent"), ("kill", "hang"))
LEANS: Final[dict[str, tuple[Group, ...]]] = {
    "client writes ahead and hangs": (("backlog",), ("backlog", "controller silent"), ("backlog", "hang")),
    "bus process paused": (("hang",), ("hang", "hang"), ("hang", "controller silent")),
    "bus process stopped as it sends": (("hang",), ("hang", "hang"), ("hang", "box slow")),
    "bus process stopped": _DEAD,
    "bus process killed": (("kill",), ("kill", "kill"), ("kill", "controller silent")),
    "interface down": (("bus off",), ("bus off", "hang"), ("bus cut",)),
    "bus-off": (("bus off",), ("bus off", "hang")),
    "interface down for 50 ms": (("bus off",),),
    "node rebooting": (("node reset",), ("node reset", "node reset"), ("node reset", "hang")),
    "owner stopped beside strangers": (
        ("controller silent", "stranger"),
        ("all controllers silent", "stranger"),
        ("stranger",),
    ),
    "node silent": (("node silent",), ("node silent", "bus cut"), ("bus cut",)),
    "drive released": (("release",), ("release", "stranger"), ("release", "hang")),
    "pause of the bridge across the deadline": (("controller silent", "hang"), ("half open", "hang")),
    "boot-up fails after a restart": (("kill", "node silent"), ("kill", "node reset"), ("kill",)),
    "intruder on an RPDO": (("intruder",), ("intruder", "intruder")),
    "intruder that is a master": (("intruder",), ("intruder", "stop")),
    "bus process paused with a frame of a second bridge waiting": (
        ("hang", "second bridge"),
        ("second bridge",),
        ("bus cut", "second bridge"),
    ),
    "second bridge": (("second bridge",), ("second bridge", "controller silent")),
    "stop asked for in a silence": (("controller silent", "stop", "stop"), ("controller silent", "stop")),
    "acknowledge after somebody's stop": (("acknowledges", "stop"), ("acknowledges", "stop", "stop")),
    "second connection of the owner's address": (("stranger",), ("stranger", "jog")),
    "deaf drive whose owner jogs": (("jog",), ("jog", "stop")),
}
"""What is done first where the proof would begin with this fault; ``_SILENT`` for any other."""


def leaning(seed: int, first: str, seconds: float = SECONDS) -> Plan:
    """A plan of these kinds of steps, in groups one after the other."""
    rng = Random(f"{seed} {first}")
    groups = LEANS.get(first, _SILENT)
    steps: list[Step] = []
    at = _FIRST_S
    while at < seconds - _LAST_S:
        group = rng.choice(groups)
        which: int | None = None
        for what in group:
            drawn, length_s, how = KINDS[what](rng)
            which = drawn if which is None else which
            begins = round(at + rng.uniform(0.0, rng.choice((0.1, 1.0, 2.7))), 4)
            steps.append(Step(begins, what, which, round(length_s, 4), how))
        at += rng.uniform(0.5, 1.5) * _EACH_S
    return Plan(seed, seconds, tuple(sorted(steps)))


def plan(seed: int, first: str) -> Plan:
    """Plan of this seed: most lean, some to nothing."""
    is_general = seed % _GENERAL == _GENERAL - 1
    return plan_of(seed, SECONDS, each_s=2.0) if is_general else leaning(seed, first)


def first_wrong(plant: Plant, plan: Plan) -> str:
    """What is wrong first, or nothing."""
    at = 0.0
    while at < plan.seconds:
        at = min(at + _LOOK_S, plan.seconds)
        plant.world.run_until(BEGIN_S + at)
        if found := plant.oracle.violations + plant.bridge.faults:
            return found[0]
    return ""


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--first", required=True)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--only", action="store_true")
    asked = parser.parse_args()
    logging.disable(logging.CRITICAL)
    seed, found = asked.seed - 1, ""
    with tempfile.TemporaryDirectory() as folder:
        site = project(Path(folder))
        while not found and (seed < asked.seed or time.process_time() < asked.seconds):
            seed += 1
            played = plan(seed, asked.first)
            found = first_wrong(Plant(site, played), played)
            if asked.only:
                break
    print(json.dumps({"seed": seed, "found": found, "cpu_s": round(time.process_time(), 1)}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
