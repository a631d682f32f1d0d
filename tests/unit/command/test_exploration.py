"""The controller leg under every sequence of events, against a model of our own (shared design, watchdog).

Breadth first with all states told apart, so no sequence is left out, however long. What must hold after
each event stands in ``tests/support/leg_machine.py``: no enabling word later than the deadline after the
owner's last valid telegram; none after a trip before an acknowledge, a word that does not enable and a fresh
enable; refused telegrams and reads change nothing; while tripped the served status word says fault, the
drive's own beside it.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final
from unittest.mock import patch

import pytest

from bridge.command.leg import rules, turn
from tests.support.explorer import Map, explore
from tests.support.leg_events import A_MOMENT_BEFORE, NO_LEASE, NO_NEWS, PULSES, REFUSED
from tests.support.leg_machine import LegMachine
from tests.support.leg_model import GONE_S, QUICK_STOP_LIMIT_S
from tests.support.leg_words import HOMING, LENZE, NORD_TU3, POSITION, STOEBER, VELOCITY
from tests.support.recorded_table import recorded_table

# All of a CPU for up to half a minute each: with a fifth of one that takes its time.
pytestmark = pytest.mark.timeout(400)

_MOST: Final = 40_000

_PROFILES: Final[dict[str, dict[str, Any]]] = {
    "disable_voltage": {},
    "disable_voltage, started": {"starts": True, "without": NO_LEASE},
    "quick_stop": {
        "on_expiry": "quick_stop",
        "answers": True,
        "without": (*NO_LEASE, A_MOMENT_BEFORE),
    },
    "stop, then silence": {"on_expiry": "stop", "then_silence_ms": 300, "without": NO_LEASE},
    "stop, and every other": {"on_expiry": "stop", "stops": True, "without": NO_LEASE},
    "silence": {"on_expiry": "silence", "stops": True, "without": NO_LEASE},
    "hold": {"on_expiry": "hold", "answers": True, "without": NO_LEASE},
    "lease": {"control": "lease", "without": REFUSED},
    "lease that ends before the watchdog": {"control": "lease", "ttl_ms": 1000, "without": REFUSED},
    "ignored": {"telegram_downtime_s": -0.1},
    "ignored, started": {
        "words": NORD_TU3,
        "telegram_downtime_s": -0.1,
        "starts": True,
        "without": NO_LEASE,
    },
    "ignored, lease": {"telegram_downtime_s": -0.1, "control": "lease"},
    "off": {"fieldbus_timeout_ms": 0},
    "off, lease": {"fieldbus_timeout_ms": 0, "control": "lease"},
}
"""NORD's words."""

_FAMILIES: Final[dict[str, dict[str, Any]]] = {
    "lenze, stop": {
        "words": LENZE,
        "on_expiry": "stop",
        "stops": True,
        "answers": True,
        "without": (*NO_NEWS, "stranger stops the drive quickly"),  # Lenze's stop is its quick stop
    },
    "stoeber, quick_stop, then silence": {
        "words": STOEBER,
        "on_expiry": "quick_stop",
        "then_silence_ms": 300,
        "answers": True,
        "without": (*NO_NEWS, *PULSES),
    },
    "stoeber, started": {"words": STOEBER, "starts": True},
    "velocity, lease": {
        "words": VELOCITY,
        "control": "lease",
        "ttl_ms": 1000,
        "on_expiry": "stop",
        "without": (*REFUSED, A_MOMENT_BEFORE),
    },
    "velocity, hold": {"words": VELOCITY, "on_expiry": "hold", "answers": True},
    "homing, started": {"words": HOMING, "on_expiry": "stop", "starts": True},
    "position, silence": {
        "words": POSITION,
        "on_expiry": "silence",
        "answers": True,
        "without": (*NO_NEWS, *PULSES, "bridge gap", "bus down", "owner releases"),
    },
    "position, started": {
        "words": POSITION,
        "starts": True,
        "without": (
            *NO_NEWS,
            "owner writes another setpoint",
            "node operational",
            "node lost",
            "drive in fault",
            "bridge gap",
            "bus down",
            "owner releases",
        ),
    },
}
"""Those of the others, each with settings of its own."""
_WATCHED: Final = ("disable_voltage", "lease that ends before the watchdog")
_OFF: Final = ("ignored", "ignored, lease", "off", "off, lease")


def explored(given: Mapping[str, Any]) -> Map:
    limit = patch.object(turn, "_RAMP_LIMIT_S", QUICK_STOP_LIMIT_S)
    gone = patch.object(rules, "GONE_S", GONE_S)
    with recorded_table() as table, limit, gone:
        machine = LegMachine(table, **given)
        found = explore(machine, _MOST)
    assert found.depth >= 6, "sequences that are long enough for a trip, its acknowledge and a fresh enable"
    assert machine.enabled, "a drive that never moves proves nothing"
    assert machine.refusals or given.keys() & {"words", "answers"}
    is_watched = not {"telegram_downtime_s", "fieldbus_timeout_ms"} & given.keys()
    assert bool(machine.trips) is is_watched
    return found


@pytest.mark.parametrize("profile", [name for name in _PROFILES if name not in _WATCHED + _OFF])
def test_whatever_happens_in_whatever_order(profile: str) -> None:
    explored(_PROFILES[profile])


@pytest.mark.parametrize("profile", _FAMILIES)
def test_whatever_happens_in_the_words_of_every_family(profile: str) -> None:
    explored({"without": NO_NEWS, **_FAMILIES[profile]})


@pytest.mark.parametrize("profile", _WATCHED + _OFF)
def test_whatever_happens_to_a_watchdog_and_without_one(profile: str) -> None:
    explored(_PROFILES[profile])
