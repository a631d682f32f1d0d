"""Requests of clients to the leg while it is explored."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from bridge.command import Action, Do, Identity, Request, SetTimeout, Start, TakeControl, Write
from bridge.command.messages.life_sign import LifeSign
from bridge.image import Value
from tests.support import rig
from tests.support.leg_seen import Rules
from tests.support.leg_time import NOW
from tests.support.leg_words import LegWords

_LATE_S: Final = 1.0
"""Waiting time in seconds after which a telegram does not count any more."""


class _One(Identity):
    """Identity told apart as an object: every state that is looked up has some of them."""

    __slots__ = ()
    __eq__ = object.__eq__
    __hash__ = object.__hash__

    def without_connection(self) -> Identity:
        return PLC_ANYHOW if self.is_same(PLC_ANYHOW) else self


def _one(who: Identity, connection: str = "") -> Identity:
    return _One(who.source, who.user, who.role, connection=connection)


PLC, OTHER_PLC, OPERATOR = _one(rig.PLC, "one"), _one(rig.OTHER_PLC), _one(rig.OPERATOR)
TWIN: Final = _one(rig.PLC, "another")
"""Another connection of the PLC's address."""
PLC_ANYHOW: Final = _one(rig.PLC)
OBSERVER, ENGINEER = _one(rig.OBSERVER), _one(rig.ENGINEER)


LIFE: Final = LifeSign(start=4711, step=20_002)
AGES_S: Final = {LIFE.token(NOW - age_s): age_s for age_s in (0.0, 1.0, 5.0)}
"""Tokens that are offered now, that were and still count, and that do not any more."""
_FRESH, _OLDER, _EXPIRED = AGES_S
_Telegram = tuple[Identity, Mapping[str, Value]]


def _writes_of(words: LegWords) -> dict[str, _Telegram]:
    """Telegrams of process data in the words of a family; those that it has."""
    stop = {"control_word": words.shut_down}
    enable = {"control_word": words.enable, **words.setpoint}
    acknowledge = words.shut_down | words.acknowledge
    writes: dict[str, _Telegram] = {
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
        "twin writes a stop": (TWIN, stop),
        "twin enables": (TWIN, enable),
        "twin acknowledges by an edge": (TWIN, {"control_word": acknowledge}),
        "owner writes a stop, alive": (PLC, {**stop, "life_sign": _FRESH}),
        "owner enables, alive": (PLC, {**enable, "life_sign": _FRESH}),
        "owner acknowledges by an edge, alive": (
            PLC,
            {"control_word": acknowledge, "life_sign": _FRESH},
        ),
        "owner enables, with an older token": (PLC, {**enable, "life_sign": _OLDER}),
        "owner enables, with an expired token": (PLC, {**enable, "life_sign": _EXPIRED}),
        "owner brings back a token": (PLC, {"life_sign": _FRESH}),
        "rival writes a stop, alive": (OTHER_PLC, {**stop, "life_sign": _FRESH}),
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


def requests_of(rules: Rules, ttl_ms: int) -> dict[str, Request]:
    words = rules.words
    found = {name: Request(who, "", Write(values)) for name, (who, values) in _writes_of(words).items()}
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
        ("twin keeps alive", TWIN, Do(Action.KEEP_ALIVE), None, False),
        ("twin resets the fault by a register", TWIN, Do(Action.RESET_FAULT), None, True),
        ("twin stops the drive", TWIN, Do(Action.STOP), None, None),
        ("twin starts the drive", TWIN, Start(0), None, None),
        ("twin releases", TWIN, Do(Action.RELEASE_CONTROL), None, None),
        ("twin takes control", TWIN, TakeControl(ttl_ms), None, None),
        ("twin sets a longer time-out", TWIN, SetTimeout(3000), None, None),
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
