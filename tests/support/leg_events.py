"""What may happen to the controller leg of a drive while it is explored."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from bridge.command import Action, Identity
from bridge.image import Value
from tests.support.leg_words import LegWords
from tests.support.rig import ENGINEER, OBSERVER, OPERATOR, OTHER_PLC, PLC

Write = tuple[Identity, Mapping[str, Value]]


def writes_of(words: LegWords) -> dict[str, Write]:
    """Telegrams of process data in the words of a family; those that it has."""
    stop = {"control_word": words.shut_down}
    enable = {"control_word": words.enable, **words.setpoint}
    acknowledge = words.shut_down | words.acknowledge
    writes: dict[str, Write] = {
        "owner writes a stop": (PLC, stop),
        "owner enables": (PLC, enable),
        "owner acknowledges by an edge": (PLC, {"control_word": acknowledge}),
        "owner acknowledges and enables in one word": (
            PLC,
            {"control_word": words.enable | words.acknowledge},
        ),
        "owner writes a setpoint": (PLC, words.setpoint),
        "owner writes another setpoint": (PLC, words.more),
        "owner writes a value that is too large": (PLC, words.too_large),
        "rival writes a stop": (OTHER_PLC, stop),
        "rival enables": (OTHER_PLC, enable),
        "stranger enables": (OPERATOR, enable),
        "reader enables": (OBSERVER, {"control_word": words.enable}),
    }
    if words.valid:
        invalid = {"control_word": words.enable & ~words.valid}
        writes["owner's control data are not valid"] = (PLC, invalid)
        writes["rival's control data are not valid"] = (OTHER_PLC, invalid)
    return {name: (who, values) for name, (who, values) in writes.items() if values}


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
A_MOMENT_BEFORE: Final = "a moment before the deadline"
TIMES: Final = (
    A_MOMENT_BEFORE,
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
TAKEN: Final = "drive takes the setpoint"
"""Only of families that say so."""
PULSES: Final = ("owner resets the fault", "engineer resets the fault")
"""The pulse has a length of its own, by which the rest of a start would be counted: one or the other."""
STOPS: Final = ("owner disables voltage", "stranger stops the drive quickly")
"""What each stop makes of a word multiplies the states, and leads to no others: once is enough."""
REFUSED: Final = frozenset(
    (
        "reader enables",
        "reader stops the drive",
        "stranger enables",
        "rival's control data are not valid",
        "owner writes a value that is too large",
        "everything is read",
    )
)
"""Nothing comes of these, whatever the settings: a few profiles try them in each state."""
NO_LEASE: Final = REFUSED | {"engineer takes control", "engineer resets the fault"}
"""Nor of these but with a lease."""
NO_NEWS: Final = NO_LEASE | {
    "owner takes control",
    "owner keeps alive",
    "owner acknowledges and enables in one word",
    A_MOMENT_BEFORE,
}
"""With the words of another family these find nothing that they do not find with NORD's."""
