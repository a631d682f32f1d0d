"""The times of the plants: two halves of all drives, slow enough for seven of them and their owners on one
slow CPU, each with every protocol; and two with what a site file leaves to the program, at ten times the
frames, of which that CPU bears two drives. PROOF_PLANT says which, for all processes of a run. The calm
one is for tests/plant alone, on a clock of its own: fewer frames, so more faults for the same CPU."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from typing import Final

REACTION_MS: Final = 20
"""How late the bridge may be (docs/explanation/dead-man-chain.md)."""


@dataclass(frozen=True, slots=True)
class Settings:
    """``bus`` is what the site file says of them. An owner may be silent for longer than a hang of the bridge
    takes (``paused_s``), and that takes longer than ``deadman_ms``; ``short_s`` does not."""

    name: str
    nodes: tuple[str, ...]
    bus: str
    rpdo_period_ms: int
    deadman_ms: int
    heartbeat_ms: int
    """When a node's silence is noticed, with a heartbeat."""
    fieldbus_timeout_ms: int
    owner_period_s: float
    paused_s: float
    short_s: float
    label: str = ""
    share: int = 1
    """Each fault is injected so many times less often."""


FIRST: Final = Settings(
    "first",
    nodes=("conveyor", "pump_opcua", "lift_zenoh", "fan_modbus"),
    bus="sync_period_ms = 100\nrpdo_period_ms = 100\ndeadman_ms = 400",
    rpdo_period_ms=100,
    deadman_ms=400,
    heartbeat_ms=600,
    fieldbus_timeout_ms=2500,
    owner_period_s=0.35,
    paused_s=0.6,
    short_s=0.35,
)
SECOND: Final = replace(
    FIRST,
    name="second",
    nodes=("pump_modbus", "pump_zenoh", "lift_modbus", "lift_opcua", "fan_opcua", "fan_zenoh"),
)
FIRST_DEFAULTS: Final = Settings(
    "first_defaults",
    nodes=("pump_zenoh", "fan_modbus"),
    bus="",
    rpdo_period_ms=10,
    deadman_ms=100,
    heartbeat_ms=200,
    fieldbus_timeout_ms=1000,
    owner_period_s=0.1,
    paused_s=0.25,
    short_s=0.08,
    label=", default settings",
    share=3,
)
SECOND_DEFAULTS: Final = replace(FIRST_DEFAULTS, name="second_defaults", nodes=("lift_modbus", "fan_opcua"))
CALM: Final = Settings(
    "calm",
    nodes=("pump_modbus", "lift_opcua", "fan_zenoh"),
    bus="sync_period_ms = 250\nrpdo_period_ms = 250\ndeadman_ms = 800",
    rpdo_period_ms=250,
    deadman_ms=800,
    heartbeat_ms=1200,
    fieldbus_timeout_ms=3000,
    owner_period_s=0.7,
    paused_s=1.2,
    short_s=0.7,
)
PLANTS: Final = {plant.name: plant for plant in (FIRST, SECOND, FIRST_DEFAULTS, SECOND_DEFAULTS, CALM)}
PLANT: Final = PLANTS[os.environ.get("PROOF_PLANT", FIRST.name)]
IS_RECORDED: Final = "PROOF_RECORDED" in os.environ
"""Whether the bridge is recorded, and what was recorded is replayed at the end: not in the short proof."""
