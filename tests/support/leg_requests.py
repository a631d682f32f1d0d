"""What clients may ask of the leg while it is explored."""

from __future__ import annotations

from typing import Final

from bridge.command import Action, Do, Request, SetTimeout, Start, TakeControl, Write
from tests.support.leg_events import writes_of
from tests.support.leg_seen import Rules
from tests.support.leg_time import NOW
from tests.support.rig import ENGINEER, OBSERVER, OPERATOR, OTHER_PLC, PLC

_LATE_S: Final = 1.0
"""What has waited for so long is no telegram any more."""


def requests_of(rules: Rules, ttl_ms: int) -> dict[str, Request]:
    words = rules.words
    found = {name: Request(who, "", Write(values)) for name, (who, values) in writes_of(words).items()}
    stop, enable = Write({"control_word": words.shut_down}), Write({"control_word": words.enable})
    late = NOW - _LATE_S
    for name, who, command, received_at, pressed in (
        ("owner keeps alive", PLC, Do(Action.KEEP_ALIVE), None, False),
        ("owner resets the fault", PLC, Do(Action.RESET_FAULT), None, None),
        ("owner resets the fault by a register", PLC, Do(Action.RESET_FAULT), None, True),
        ("owner stops the drive", PLC, Do(Action.STOP), None, None),
        ("owner disables voltage", PLC, Do(Action.DISABLE_VOLTAGE), None, None),
        ("owner's stop comes late", PLC, stop, late, None),
        ("owner's enable comes late", PLC, enable, late, None),
        ("owner's start comes late", PLC, Start(0), late, None),
        ("owner starts the drive", PLC, Start(0), None, None),
        ("owner releases", PLC, Do(Action.RELEASE_CONTROL), None, None),
        ("owner takes control", PLC, TakeControl(ttl_ms), None, None),
        ("owner sets a longer time-out", PLC, SetTimeout(3000), None, None),
        ("owner switches the time-out off", PLC, SetTimeout(0), None, None),
        ("rival sets a longer time-out", OTHER_PLC, SetTimeout(3000), None, None),
        ("rival takes control", OTHER_PLC, TakeControl(ttl_ms), None, None),
        ("rival starts the drive", OTHER_PLC, Start(0), None, None),
        ("engineer takes control", ENGINEER, TakeControl(ttl_ms), None, None),
        ("engineer resets the fault", ENGINEER, Do(Action.RESET_FAULT), None, None),
        ("stranger stops the drive", OPERATOR, Do(Action.STOP), None, None),
        ("stranger stops the drive quickly", OPERATOR, Do(Action.QUICK_STOP), None, None),
        ("stranger disables voltage", OPERATOR, Do(Action.DISABLE_VOLTAGE), None, None),
        ("reader stops the drive", OBSERVER, Do(Action.STOP), None, None),
    ):
        found[name] = Request(who, "", command, received_at, pressed)
    return found
