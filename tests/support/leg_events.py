"""What may happen to the controller leg of a drive while it is explored."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from bridge.command import Action, Identity
from bridge.image import Value
from tests.support.rig import (
    ACKNOWLEDGE,
    ENABLE,
    ENGINEER,
    HALF_SPEED,
    OBSERVER,
    OPERATOR,
    OTHER_PLC,
    PLC,
    SHUT_DOWN,
)

WRITES: Final[Mapping[str, tuple[Identity, dict[str, Value]]]] = {
    "owner writes a stop": (PLC, {"control_word": SHUT_DOWN}),
    "owner enables": (PLC, {"control_word": ENABLE, "setpoint_1": HALF_SPEED}),
    "owner acknowledges by an edge": (PLC, {"control_word": ACKNOWLEDGE}),
    "owner acknowledges and enables in one word": (PLC, {"control_word": ACKNOWLEDGE | 1}),
    "owner writes a setpoint": (PLC, {"setpoint_1": HALF_SPEED}),
    "owner's control data are not valid": (PLC, {"control_word": 0x007F}),
    "owner writes a value that is too large": (PLC, {"control_word": ENABLE, "frequency": 1e9}),
    "rival writes a stop": (OTHER_PLC, {"control_word": SHUT_DOWN}),
    "rival enables": (OTHER_PLC, {"control_word": ENABLE, "setpoint_1": HALF_SPEED}),
    "rival's control data are not valid": (OTHER_PLC, {"control_word": 0x007F}),
    "stranger enables": (OPERATOR, {"control_word": ENABLE, "setpoint_1": HALF_SPEED}),
    "reader enables": (OBSERVER, {"control_word": ENABLE}),
}
ACTIONS: Final[Mapping[str, tuple[Identity, Action]]] = {
    "owner keeps alive": (PLC, Action.KEEP_ALIVE),
    "owner resets the fault": (PLC, Action.RESET_FAULT),
    "owner disables voltage": (PLC, Action.DISABLE_VOLTAGE),
    "owner starts the drive": (PLC, Action.START),
    "owner releases": (PLC, Action.RELEASE_CONTROL),
    "owner takes control": (PLC, Action.TAKE_CONTROL),
    "rival takes control": (OTHER_PLC, Action.TAKE_CONTROL),
    "engineer takes control": (ENGINEER, Action.TAKE_CONTROL),
    "engineer resets the fault": (ENGINEER, Action.RESET_FAULT),
    "stranger stops the drive": (OPERATOR, Action.STOP),
    "stranger stops the drive quickly": (OPERATOR, Action.QUICK_STOP),
    "reader stops the drive": (OBSERVER, Action.STOP),
}
TIMES: Final = (
    "a moment before the deadline",
    "at the deadline",
    "the process hangs beyond all deadlines",
)
REST: Final = (
    "node operational",
    "node lost",
    "bus down",
    "bridge gap",
    "drive follows",
    "drive in fault",
    "everything is read",
)
STARTS: Final = ("owner starts the drive",)
ANSWERS: Final = ("drive follows", "drive in fault")
RIVALS: Final = tuple(name for name in (*WRITES, *ACTIONS) if name.startswith("rival"))
PULSES: Final = ("owner resets the fault", "engineer resets the fault")
"""The pulse has a length of its own, by which the rest of a start would be counted: one or the other."""
STOPS: Final = ("owner disables voltage", "stranger stops the drive quickly")
"""What each stop makes of a word multiplies the states, and leads to no others: once is enough."""
