"""Plans that lean to the kinds of steps by which a fault of the chain shows itself, played until something is
wrong.

    python -m tests.plant.leaning --first FAULT [--seed N] [--seconds S] [--until S]

``FAULT`` is one of the proof's (tests/proof/faults.py), another one of ``LEANS``, or a kind of step, such as
``deaf``, or ``deaf: jogs``. Prints one line of JSON; ``--until`` plays the plan of ``--seed`` alone, and no
longer than that.
"""

from __future__ import annotations

import argparse
import json
import logging
import sys
import tempfile
import time
from functools import partial
from pathlib import Path
from random import Random
from typing import Final

from tests.plant.plan import KINDS, Plan, Step, plan_of
from tests.plant.plant import Plant, project

SECONDS: Final = 60.0
_FIRST_S: Final = 8.5
_LAST_S: Final = 8.0
_EACH_S: Final = 7.0
_GENERAL: Final = 4
"""Each so many plans one leans to nothing."""

Group = tuple[str, ...]
"""Kinds of steps that happen to one drive at about the same time; with a colon and how it happens, where that
is not drawn."""

_SILENT: Final[tuple[Group, ...]] = (
    ("controller silent",),
    ("controller silent",),
    ("all controllers silent",),
    ("all controllers silent",),
    ("no acknowledge",),
)
_DEAD: Final[tuple[Group, ...]] = (("hang",), ("kill",), ("hang", "controller silent"), ("kill", "hang"))
_STRANGERS: Final[tuple[Group, ...]] = (
    ("controller silent", "stranger"),
    ("all controllers silent", "stranger"),
    ("controller silent", "reads"),
    ("reads",),
    ("sets time-out",),
)
LEANS: Final[dict[str, tuple[Group, ...]]] = {
    "network cut": (("half open",), ("half open", "hang"), ("controller crashed",)),
    "client writes ahead and hangs": (("backlog",), ("backlog", "controller silent"), ("backlog", "hang")),
    "OPC UA front stopped": (("front hangs",), ("front hangs", "hang"), ("front killed",)),
    "bus process paused": (("hang",), ("hang", "hang"), ("hang", "controller silent")),
    "bus process stopped as it sends": (("hang",), ("hang", "hang"), ("hang", "box slow")),
    "bus process stopped": _DEAD,
    "bus process killed": (("kill",), ("kill", "kill"), ("kill", "controller silent")),
    "SIGTERM to the bus process": (("end",), ("end", "hang"), ("end", "controller silent")),
    "interface down": (("bus off",), ("bus off", "hang"), ("bus cut",)),
    "bus-off": (("bus off",), ("bus off", "hang")),
    "interface down for 50 ms": (("bus off",),),
    "node rebooting": (("node reset",), ("node reset",), ("node reset", "hang")),
    "owner stopped beside strangers": _STRANGERS,
    "owner's telegrams are not valid": (("invalid telegrams",), ("invalid telegrams", "reads")),
    "node silent": (("node silent",), ("node silent", "bus cut"), ("bus cut",)),
    "drive released": (("release",), ("release", "stranger"), ("release", "hang")),
    "pause of the bridge across the deadline": (("pause at the deadline",),),
    "deaf drive": (("deaf",),),
    "deaf drive whose owner jogs": (("deaf",), ("jog", "stop")),
    "boot-up fails after a restart": (("unbooted",), ("unbooted", "kill"), ("kill", "node silent")),
    "intruder on an RPDO": (("intruder",), ("intruder", "intruder")),
    "intruder that is a master": (("intruder",), ("intruder", "stop")),
    "bus process paused with a frame of a second bridge waiting": (("twin",), ("twin", "controller silent")),
    "second bridge": (("second bridge",), ("second bridge", "controller silent")),
    "stop asked for in a silence": (("stops in a silence",),),
    "acknowledge after somebody's stop": (("acknowledges", "stop"), ("acknowledges", "stop", "stop")),
    "stop of outputs that their silent owner's time-out holds": (("outputs stopped",),),
    "acknowledge after somebody's stop of outputs": (("outputs stopped",),),
    "second connection of the owner's address": (("stranger",), ("stranger", "jog")),
    "what moves a drive as a parameter": (("reserved parameter",),),
    "settings changed at a drive": (("keypad: scale",), ("keypad: meaning",), ("keypad: sum",), ("keypad",)),
    "settings changed at a drive that answers late": (
        ("keypad: scale", "late answers: 0.4"),
        ("keypad", "late answers: 0.4"),
    ),
    "settings changed at a drive that answers wrongly": (
        ("keypad: scale", "wrong answers: aborts"),
        ("keypad: scale", "wrong answers: silent"),
        ("wrong answers: another index",),
        ("keypad", "wrong answers"),
    ),
    "settings of a drive that positions": (("positions: P600",), ("positions",)),
}
"""What is done first where the proof would begin with this fault; ``_SILENT`` for any other that is no kind
of step itself."""
_EACH_OF: Final = {
    "deaf drive": 16.0,
    "deaf drive whose owner jogs": 38.0,
    "stop asked for in a silence": 10.0,
    "dead bridge": 16.0,
    "deaf": 22.0,
    "bus cut": 24.0,
    "hang": 16.0,
    "settings changed at a drive": 3.0,
    "settings changed at a drive that answers late": 4.0,
    "settings changed at a drive that answers wrongly": 4.0,
}
"""Seconds from one group to the next, where that takes longer, or several may be at work at once."""


def leaning(seed: int, first: str, seconds: float = SECONDS) -> Plan:
    """A plan of these kinds of steps, in groups one after the other."""
    rng = Random(f"{seed} {first}")
    kind = first.partition(": ")[0]
    groups = LEANS.get(first) or (((first,),) if kind in KINDS else _SILENT)
    steps: list[Step] = []
    at = _FIRST_S
    while at < seconds - _LAST_S:
        group = rng.choice(groups)
        which: int | None = None
        for one in group:
            what, _, wanted = one.partition(": ")
            drawn, length_s, how = KINDS[what](rng)
            which = drawn if which is None else which
            begins = round(at + rng.uniform(0.0, rng.choice((0.1, 1.0, 2.7))), 4)
            steps.append(Step(begins, what, which, round(length_s, 4), wanted or how))
        at += rng.uniform(0.7, 1.4) * _EACH_OF.get(kind, _EACH_S)
    return Plan(seed, seconds, tuple(sorted(steps)))


def plan(seed: int, first: str) -> Plan:
    """Plan of this seed: most lean, some to nothing."""
    is_general = seed % _GENERAL == _GENERAL - 1
    return plan_of(seed, SECONDS, each_s=2.0) if is_general else leaning(seed, first)


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--first", required=True)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--until", type=float)
    asked = parser.parse_args()
    logging.disable(logging.CRITICAL)
    seed, found, played_s = asked.seed - 1, "", 0.0
    with tempfile.TemporaryDirectory() as folder:
        site = project(Path(folder))
        while not found and (seed < asked.seed or time.process_time() < asked.seconds):
            seed += 1
            played = plan(seed, asked.first)
            plant = Plant(site, played._replace(seconds=asked.until or played.seconds))
            # A fault may look at the machine's clock: here that is the plant's.
            time.monotonic = partial(getattr, plant.world, "now")
            result = plant.run(to_first=True)
            found, played_s = next(iter(result.violations), ""), result.played_s
            if asked.until:
                break
    spent = round(time.process_time(), 1)
    print(json.dumps({"seed": seed, "found": found, "played_s": played_s, "cpu_s": spent}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
