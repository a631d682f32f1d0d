"""Numbers that points and registers have for states, with their names."""

from __future__ import annotations

from enum import Enum, IntEnum
from typing import Final


class Source(IntEnum):
    """Origin of a command, numbered as Modbus serves the owner (input register 20)."""

    NONE = 0
    OPCUA = 1
    MODBUS = 2
    ZENOH = 3
    LOCAL = 4

    @property
    def label(self) -> str:
        return self.name.lower()


class WatchdogState(IntEnum):
    """The watchdog as others see it, numbered as Modbus serves it (input register 14)."""

    OFF = 0
    IDLE = 1
    RUNNING = 2
    TRIPPED = 3

    @property
    def label(self) -> str:
        return self.name.lower()


class LastStop(IntEnum):
    """Outcome of the last stop."""

    NONE = 0
    FORWARDED = 1
    FOLLOWED = 2
    IGNORED = 3

    @property
    def label(self) -> str:
        return self.name.lower()


class NodeState(Enum):
    """State of the node behind a drive, as far as the master knows it."""

    ABSENT = "not seen yet"
    BOOTING = "booting"
    OPERATIONAL = "operational"
    LOST = "lost"
    STOPPED = "stopped by command"
    DISABLED = "disabled"
    CONFIG_ERROR = "configuration error"


NODE_CODES: Final = {
    NodeState.ABSENT: 0,
    NodeState.BOOTING: 1,
    NodeState.OPERATIONAL: 2,
    NodeState.LOST: 3,
    NodeState.STOPPED: 4,
    NodeState.DISABLED: 5,
    NodeState.CONFIG_ERROR: 6,
}

# Codes with their names, as points have them.
WATCHDOG_STATES: Final = tuple((state.value, state.label) for state in WatchdogState)
LAST_STOPS: Final = tuple((state.value, state.label) for state in LastStop)
NODE_STATES: Final = tuple((code, state.name.lower()) for state, code in NODE_CODES.items())
NMT_STATES: Final = (
    (0, "initialising"),
    (4, "stopped"),
    (5, "operational"),
    (127, "pre_operational"),
    (255, "unknown"),
)
CONTROLLER_STATES: Final = ((0, "ok"), (1, "warning"), (2, "passive"), (3, "bus_off"), (4, "down"))
CONDITIONS: Final = ((0, "ok"), (1, "warning"), (2, "alarm"), (3, "danger"))
"""Severities of the troubles at a place."""
