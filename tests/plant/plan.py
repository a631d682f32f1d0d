"""What happens to a plant, drawn from one seed: a list of steps, each of which can be left out."""

from __future__ import annotations

from collections.abc import Callable
from random import Random
from typing import Final, NamedTuple

from tests.plant.sdo_answers import LATE, WRONG
from tests.plant.third_parties import Intruder
from tests.proof.drives import DRIVES
from tests.proof.settings import PLANT

FIRST_S: Final = 8.0
"""By then every node is booted and every drive moves."""
_LAST_S: Final = 12.0
"""So long nothing is done at the end."""
_STOPS: Final = ("stop", "quick_stop", "disable_voltage")
_DEAF: Final = ("silent", "jogs", "to everything")
_WHILE_DEAD: Final = ("runs on", "taken out", "kept running", "outputs are active")
_NODES: Final = len({drive.node for drive in DRIVES})


KEYPAD: Final = ("scale", "scale", "current", "meaning", "setpoint", "sum", "other set")
"""What somebody changes at a drive."""
HOIST: Final = ("P600", "P600", "P546", "gear", "encoder")
"""The same, at the one that positions."""


class Step(NamedTuple):
    """At ``at`` seconds from the beginning; ``what`` is one of ``KINDS``. The other fields mean what its kind
    says, and nothing where it has no use for them."""

    at: float
    what: str
    which: int = 0
    """Drive or node by its place, or a number of another kind."""
    seconds: float = 0.0
    how: str = ""


def length_s(step: Step) -> float:
    """How long it lasts."""
    return 0.0 if step.what == "clock stepped" else step.seconds


class Plan(NamedTuple):
    """``seed`` decides what no step does: losses on a noisy bus, when a bridge that was passive acts."""

    seed: int
    seconds: float
    steps: tuple[Step, ...]


Draw = Callable[[Random], tuple[int, float, str]]
"""``which``, ``seconds`` and ``how`` of a step."""


def _drive(rng: Random) -> int:
    return rng.randrange(len(DRIVES))


def _around(rng: Random, *bounds_ms: float) -> float:
    """Seconds that lie about one of these times, on either side, or anywhere below the longest."""
    if rng.random() < 0.3:
        return rng.uniform(0.0, 1.5 * max(bounds_ms)) / 1000
    return max(0.001, rng.choice(bounds_ms) * rng.uniform(0.8, 1.25) / 1000)


def _found_or_not(rng: Random) -> float:
    """Seconds that a change at a drive lasts: it is found by 10 s, so often too short for that."""
    return rng.uniform(0.5, 10.0) if rng.random() < 0.3 else rng.uniform(12.0, 30.0)


KINDS: Final[dict[str, Draw]] = {
    "controller silent": lambda rng: (_drive(rng), _around(rng, PLANT.fieldbus_timeout_ms, 5000), ""),
    "all controllers silent": lambda rng: (0, _around(rng, PLANT.fieldbus_timeout_ms, 5000), ""),
    "controller crashed": lambda rng: (_drive(rng), _around(rng, PLANT.fieldbus_timeout_ms, 5000), ""),
    "half open": lambda rng: (_drive(rng), _around(rng, PLANT.fieldbus_timeout_ms, 5000), ""),
    "release": lambda rng: (_drive(rng), rng.uniform(0.1, 3.0), ""),
    "jog": lambda rng: (_drive(rng), rng.uniform(3.0, 10.0), ""),
    "acknowledges": lambda rng: (_drive(rng), rng.uniform(3.0, 10.0), ""),
    "starts by command": lambda rng: (_drive(rng), rng.uniform(4.0, 10.0), rng.choice(("stands", "at once"))),
    "stop": lambda rng: (_drive(rng), 0.0, rng.choice(_STOPS)),
    "stranger": lambda rng: (_drive(rng), rng.uniform(0.2, 5.0), rng.choice(("elsewhere", "same host"))),
    "backlog": lambda rng: (_drive(rng), rng.uniform(2.0, 6.0), rng.choice(("20", "1000", "6000"))),
    "hang": lambda rng: (
        rng.randrange(5),
        _around(rng, PLANT.deadman_ms, 1000),
        rng.choice(("in a turn", "in a round", "in a telegram", "between turns")),
    ),
    "kill": lambda rng: (0, rng.uniform(0.05, 4.0), rng.choice(("in a turn", "between turns"))),
    "front hangs": lambda rng: (
        0,
        _around(rng, PLANT.fieldbus_timeout_ms, 1000, 5000),
        rng.choice(("in a turn", "between turns")),
    ),
    "front killed": lambda rng: (0, rng.uniform(0.05, 4.0), ""),
    "bus off": lambda rng: (0, rng.uniform(0.02, 2.0), ""),
    "bus cut": lambda rng: (0, _around(rng, PLANT.heartbeat_ms, 3000), ""),
    "noise": lambda rng: (0, rng.uniform(0.5, 5.0), rng.choice(("0.01", "0.1", "0.5"))),
    "node reset": lambda rng: (rng.randrange(_NODES), 0.0, ""),
    "node silent": lambda rng: (rng.randrange(_NODES), _around(rng, PLANT.heartbeat_ms, 3000), ""),
    "intruder": lambda rng: (_drive(rng), rng.uniform(0.01, 2.0), rng.choice(Intruder.WAYS)),
    "outputs stopped": lambda rng: (0, 0.0, rng.choice(("silent", "acknowledges"))),
    "twin": lambda rng: (0, rng.uniform(1.2, 3.0) * PLANT.deadman_ms / 1000, ""),
    "end": lambda rng: (0, rng.uniform(0.05, 4.0), ""),
    "deaf": lambda rng: (_drive(rng), rng.uniform(8.0, 10.0), rng.choice(_DEAF)),
    "unbooted": lambda rng: (_drive(rng), rng.uniform(2.0, 6.0), ""),
    "no acknowledge": lambda rng: (_drive(rng), rng.uniform(2.0, 6.0), ""),
    "pause at the deadline": lambda rng: (_drive(rng), rng.uniform(0.8, 1.5) * PLANT.deadman_ms / 1000, ""),
    "invalid telegrams": lambda rng: (_drive(rng), rng.uniform(2.0, 6.0), ""),
    "reads": lambda rng: (_drive(rng), rng.uniform(3.0, 8.0), ""),
    "sets time-out": lambda rng: (_drive(rng), rng.uniform(0.2, 5.0), ""),
    "stops in a silence": lambda rng: (_drive(rng), rng.uniform(0.1, 3.0), ""),
    "reserved parameter": lambda rng: (_drive(rng), 0.0, ""),
    "second bridge": lambda rng: (0, rng.uniform(1.0, 8.0), ""),
    "box slow": lambda rng: (0, rng.uniform(1.0, 6.0), rng.choice(("0.0001", "0.0003"))),
    "dead bridge": lambda rng: (_drive(rng), rng.uniform(6.8, 7.8), rng.choice(_WHILE_DEAD)),
    "late answers": lambda rng: (_drive(rng), _found_or_not(rng), rng.choice(LATE)),
    "wrong answers": lambda rng: (_drive(rng), _found_or_not(rng), rng.choice(WRONG)),
    "keypad": lambda rng: (_drive(rng), _found_or_not(rng), rng.choice(KEYPAD)),
    "other set": lambda rng: (_drive(rng), _found_or_not(rng), rng.choice(("", "scale", "meaning"))),
    "positions": lambda rng: (0, _found_or_not(rng), rng.choice(("", *HOIST))),
    "clock stepped": lambda rng: (0, rng.uniform(-3600.0, 3600.0), ""),
}
"""What can happen, and how it is drawn."""


def plan_of(seed: int, seconds: float, each_s: float = 4.0) -> Plan:
    """A plan with a step each ``each_s`` seconds in the mean, alone and in bunches."""
    rng = Random(seed)
    steps: list[Step] = []
    at = FIRST_S
    while (at := at + rng.expovariate(1 / (2 * each_s))) < seconds - _LAST_S:
        for _ in range(rng.choice((1, 1, 2, 2, 4))):
            what = rng.choice(tuple(KINDS))
            which, length_s, how = KINDS[what](rng)
            begins = round(at + rng.uniform(0.0, rng.choice((0.05, 0.5, 3.0))), 4)
            steps.append(Step(begins, what, which, round(length_s, 4), how))
    return Plan(seed, seconds, tuple(sorted(steps)))
