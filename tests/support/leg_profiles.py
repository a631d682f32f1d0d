"""The settings with which the leg is explored, and which events can tell their states apart."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace
from time import process_time
from typing import Any, Final, get_args

from bridge.command.leg.event import NodeBack, StatusReport
from bridge.command.leg.settings import leg_settings
from bridge.command.leg.state import Stage, Way
from bridge.command.leg.step import initial, step
from bridge.command.leg.table import Stimulus
from bridge.command.messages.telegram import TelegramDecoder
from bridge.command.status import DriveStatus
from bridge.config import DriveTable, Reaction
from bridge.drive import DriveState, Meanings
from bridge.mapping import load_family
from tests.support.leg_recorded import Cells
from tests.support.leg_requests import AGES_S, LIFE
from tests.support.leg_seen import Rules
from tests.support.leg_space import Space
from tests.support.leg_time import NOW
from tests.support.leg_words import ALL, HOMING, LENZE, NORD_TU4, LegWords

CYCLIC: Final = replace(
    HOMING,
    mapping="cia402/cyclic-position",
    begin=0,
    setpoint={"position": 70_000},
    place=(0x2222, 0x0002),
)
"""Profile of a drive whose setpoints follow its own position."""
FAMILIES: Final = (*ALL, CYCLIC)
REACTIONS: Final = get_args(Reaction)

_WAY: Final = {"node lost", "node operational", "bus back", "bridge gap"}
_BASE: Final = _WAY | {
    "owner writes a stop",
    "owner enables",
    "owner acknowledges by an edge",
    "owner resets the fault",
    "owner releases",
    "owner's stop comes late",
    "rival enables",
    "stranger stops the drive",
    "drive follows",
    "drive says: fault",
    "everything is due",
    "nothing is due",
}
_START: Final = _BASE - {"owner resets the fault", "node operational"} | {
    "owner starts the drive",
    "drive repeats",
    "drive says: enabled",
    "drive says: braking",
    "drive says: inhibited",
    "node operational, not heard",
}
_SHORT_START: Final = {
    "owner writes a stop",
    "owner writes a setpoint",
    "owner's control data are not valid",
    "owner starts the drive",
    "drive follows",
    "drive repeats",
    "drive says: braking",
    "node lost",
    "node operational, not heard",
}
"""Enough for each stage of a start to be there when the time is up."""
_NORDS: Final = {"owner writes a setpoint", "owner's control data are not valid"}
_NO_WORDS: Final = {"owner's stop comes late", "rival enables", "bus back", "nothing is due"}
"""Events with which the words of another family make nothing else than NORD's."""
_NOBODY: Final = {
    "reader enables",
    "reader stops the drive",
    "stranger enables",
    "rival starts the drive",
    "rival writes a stop",
    "rival sets a longer time-out",
    "rival takes control",
    "engineer resets the fault",
    "engineer takes control",
    "owner's control data are not valid",
    "rival's control data are not valid",
    "owner writes a value that is too large",
    "owner's enable comes late",
    "owner's start comes late",
    "owner sets a longer time-out",
    "owner takes control",
}
"""Little comes of these with a watchdog and no lease: one profile is enough."""
_ACKNOWLEDGES: Final = {
    "owner keeps alive",
    "owner resets the fault by a register",
    "owner acknowledges and enables in one word",
}
_STOPS: Final = {
    "owner stops the drive",
    "owner disables voltage",
    "stranger stops the drive quickly",
    "stranger disables voltage",
}
_WATCH: Final = {"drive's own watch is off", "drive's own watch is on"}
_CONNECTION: Final = {"owner's connection ends", "owner is connected"}
_TWINS: Final = {
    "owner writes a stop",
    "owner enables",
    "owner releases",
    "twin writes a stop",
    "twin enables",
    "twin stops the drive",
    "twin releases",
    "owner's connection ends, not its twin",
    "twin's connection ends",
    "rival enables",
    "drive follows",
    "everything is due",
}
"""Two connections of one address."""
_ALIVE: Final = {
    "owner writes a stop, alive",
    "owner enables, alive",
    "owner acknowledges by an edge, alive",
    "owner enables, with an older token",
    "owner enables, with an expired token",
    "owner brings back a token",
    "owner writes a stop",
    "owner enables",
    "owner resets the fault",
    "owner stops the drive",
    "owner releases",
    "rival writes a stop, alive",
    "rival writes a stop",
    "stranger stops the drive",
    "drive follows",
    "everything is due",
}
"""Events of a drive that asks for a life sign."""
_LEAN: Final = _BASE - {
    "owner acknowledges by an edge",
    "owner's stop comes late",
    "rival enables",
    "bus back",
}
_LEASE: Final = _BASE - {"owner's stop comes late", "bus back", "rival enables"} | {
    "owner takes control",
    "rival takes control",
    "engineer takes control",
    "owner keeps alive",
}

_STATES: Final = {
    "drive says: ready",
    "drive says: switched on",
    "drive says: enabled",
    "drive says: braking",
    "drive says: inhibited",
    "drive says: not ready",
    "drive says: fault reaction",
    "drive says: fault",
    "drive says: unknown",
    "drive repeats",
    "owner writes a stop",
    "owner enables",
    "owner starts the drive",
    "owner resets the fault",
    "stranger stops the drive",
    "node operational, not heard",
    "everything is due",
}
_MOVES: Final = {
    "drive is moved",
    "drive follows",
    "drive says: fault",
    "owner writes a stop",
    "owner enables",
    "owner starts the drive",
    "owner resets the fault",
    "stranger stops the drive",
    "node lost",
    "node operational",
    "position not known",
    "position known",
    "everything is due",
}
_HANDSHAKE: Final = {
    "owner writes a stop",
    "owner enables",
    "owner writes a setpoint",
    "owner writes another setpoint",
    "stranger stops the drive",
    "owner disables voltage",
    "drive takes the setpoint",
    "drive follows",
    "drive says: fault",
    "node lost",
    "node operational",
    "node operational, not heard",
    "everything is due",
}


def space(
    words: LegWords = NORD_TU4, *, names: Any = _BASE, after_hang: Any = (), ttl_ms: int = 5000, **given: Any
) -> Space:
    family = load_family(words.mapping)
    name = family.slot[0].name
    settings = {"slot": name, "control": "modbus", "fieldbus_timeout_ms": 2000, **given}
    table = DriveTable.model_validate(settings)
    meanings = Meanings(family, family.slot[0], {})
    meanings.take_defaults()
    decode = TelegramDecoder(f"n/{name}", family, family.slot[0], meanings, {}, DriveStatus(family)).decode
    drive = leg_settings(family, table, decode, LIFE)
    leg = initial(drive)
    for event in (NodeBack(), Way(True, "", "", True), StatusReport(DriveState.READY, False, "")):
        leg, _ = step(drive, leg, event, NOW)
    reaction = table.on_expiry
    rules = Rules(
        words=words,
        timeout_s=settings["fieldbus_timeout_ms"] / 1000,
        ignores=table.telegram_downtime_s == -0.1,
        reaction=reaction,
        mutes_after_s=0.0 if reaction == "silence" else table.then_silence_ms / 1000 or None,
        control=table.control,
        stop_by_anyone=table.stop_by_anyone,
        is_writable=table.fieldbus_timeout_writable,
        ages_s=AGES_S if table.life_sign else None,
    )
    return Space(drive, rules, leg, names, after_hang, ttl_ms)


Profile = dict[str, Any]


def family_profiles(words: LegWords) -> dict[str, Profile]:
    """Every reaction, and starts, in the words of one family."""
    names, started, more = _BASE | _NORDS, _START, set[str]()
    if words is not NORD_TU4:
        names = names - _NORDS - _NO_WORDS
        started = started - _NO_WORDS - {"owner acknowledges by an edge", "owner releases"}
    if words is CYCLIC or words.handshake:
        names, started = names - {"owner resets the fault"}, started - {"drive says: inhibited"}
        more = {"drive takes the setpoint"} if words.handshake else {"position not known", "position known"}
    found: dict[str, Profile] = {
        reaction: {"words": words, "names": names | more, "on_expiry": reaction} for reaction in REACTIONS
    }
    found["started"] = {"words": words, "names": started | more}
    if words.handshake:
        found["two positions"] = {"words": words, "names": _HANDSHAKE}
    if words.place:
        found |= {
            f"moved, {reaction}": {"words": words, "names": _MOVES, "on_expiry": reaction}
            for reaction in ("quick_stop", "hold")
        }
    if words in (NORD_TU4, LENZE):
        for reaction in ("quick_stop", "stop"):
            found[f"whatever it says, {reaction}"] = {"words": words, "names": _STATES, "on_expiry": reaction}
    return found


_SETTINGS: Final[dict[str, Profile]] = {
    **{f"started, {reaction}": {"names": _SHORT_START, "on_expiry": reaction} for reaction in REACTIONS[1:]},
    "refused": {
        "names": _LEAN | _NOBODY,
        "after_hang": {
            "owner enables",
            "owner writes a stop",
            "owner resets the fault",
            "rival enables",
            "owner keeps alive",
            "owner takes control",
            "stranger stops the drive",
            "owner releases",
            "reader enables",
        },
    },
    "acknowledges": {
        "names": _BASE - {"rival enables", "bus back", "owner's stop comes late"} | _ACKNOWLEDGES
    },
    "every stop": {"names": _LEAN | _STOPS, "on_expiry": "stop"},
    "stop, then silence": {"names": _LEAN | _WATCH, "on_expiry": "stop", "then_silence_ms": 300},
    "quick_stop, then silence": {"names": _LEAN | _WATCH, "on_expiry": "quick_stop", "then_silence_ms": 300},
    "silence, own watch off": {"names": _LEAN | _WATCH, "on_expiry": "silence"},
    "lease": {"names": _LEASE, "control": "lease", "after_hang": {"owner keeps alive", "owner enables"}},
    "lease, hold": {"names": _LEASE, "control": "lease", "on_expiry": "hold"},
    "started, then silent": {
        "names": {
            "owner starts the drive",
            "stranger stops the drive",
            "owner resets the fault",
            "drive follows",
            "drive says: fault",
            "everything is due",
        },
        "on_expiry": "silence",
    },
    "words that do not reach the bus": {
        "names": _SHORT_START - {"owner's control data are not valid", "owner writes a setpoint"}
        | {
            "words do not reach the bus",
            "words reach the bus",
            "owner enables",
            "owner resets the fault",
            "stranger stops the drive",
            "drive says: fault",
        },
    },
    "errors ignored": {"names": _BASE - {"node lost"}, "telegram_downtime_s": -0.1},
    "errors ignored, started": {
        "names": _SHORT_START - {"node lost"}
        | {
            "owner resets the fault",
            "drive says: unknown",
            "drive says: fault",
        },
        "telegram_downtime_s": -0.1,
    },
    "errors ignored, started unheard": {
        "names": {
            "owner starts the drive",
            "drive repeats",
            "drive says: braking",
            "drive says: unknown",
            "node operational, not heard",
        },
        "telegram_downtime_s": -0.1,
    },
    "errors ignored, lease": {
        "names": _LEASE - {"node lost"},
        "telegram_downtime_s": -0.1,
        "control": "lease",
    },
    "off": {"names": _BASE | _CONNECTION, "fieldbus_timeout_ms": 0},
    "off, lease": {"names": _LEASE | _CONNECTION, "fieldbus_timeout_ms": 0, "control": "lease"},
    "off, stopped by the owner only": {
        "names": _LEAN | _CONNECTION,
        "fieldbus_timeout_ms": 0,
        "stop_by_anyone": False,
    },
    "stopped by the owner only": {"names": _LEAN | {"owner stops the drive"}, "stop_by_anyone": False},
    "two connections": {
        "names": _TWINS
        | {
            "owner resets the fault",
            "owner acknowledges by an edge",
            "twin acknowledges by an edge",
            "owner's connection ends",
            "node lost",
            "node operational",
        }
    },
    "two connections, hold": {"names": _TWINS | {"owner resets the fault"}, "on_expiry": "hold"},
    "two connections, registers": {
        "names": _TWINS
        | {
            "owner keeps alive",
            "owner resets the fault by a register",
            "twin keeps alive",
            "twin resets the fault by a register",
        }
    },
    "two connections, started": {
        "names": _TWINS - {"rival enables"} | {"owner starts the drive", "twin starts the drive"},
    },
    "two connections, off": {
        "names": _TWINS | _CONNECTION | {"stranger stops the drive"},
        "fieldbus_timeout_ms": 0,
    },
    "two connections, lease": {
        "names": _TWINS | {"owner takes control", "twin takes control", "owner resets the fault"},
        "control": "lease",
    },
    "two connections, time-out writable": {
        "names": _TWINS
        | {
            "owner sets a longer time-out",
            "owner switches the time-out off",
            "twin sets a longer time-out",
        },
        "fieldbus_timeout_writable": True,
        "fieldbus_timeout_range_ms": [0, 3000],
    },
    "life sign": {"names": _ALIVE | {"owner's stop comes late"}, "life_sign": True},
    "life sign, hold": {"names": _ALIVE, "life_sign": True, "on_expiry": "hold"},
    "life sign, started": {
        "names": _ALIVE - {"owner acknowledges by an edge, alive"} | {"owner starts the drive"},
        "life_sign": True,
    },
    "life sign, lease": {
        "names": _ALIVE | {"owner takes control", "owner keeps alive"},
        "life_sign": True,
        "control": "lease",
    },
    "life sign, time-out writable": {
        "names": _ALIVE | {"owner sets a longer time-out"},
        "life_sign": True,
        "fieldbus_timeout_writable": True,
    },
    "life sign, errors ignored": {"names": _ALIVE, "life_sign": True, "telegram_downtime_s": -0.1},
    "time-out writable": {
        "names": _LEAN
        | {"owner sets a longer time-out", "owner switches the time-out off", "rival sets a longer time-out"},
        "fieldbus_timeout_writable": True,
        "fieldbus_timeout_range_ms": [0, 3000],
    },
    "nobody": {"names": _BASE | _NOBODY, "control": "none"},
}
"""Profiles of further settings of the site file, in NORD's words."""
ROWS: Final[dict[str, dict[str, Profile]]] = {
    **{words.mapping: family_profiles(words) for words in FAMILIES},
    "nord/sk-tu4-cao, other settings": _SETTINGS,
}
MOST: Final = 20_000
"""States of a profile: more are no exploration that anybody waits for."""


@dataclass(slots=True)
class Figures:
    """Figures of the profiles of one row. ``seconds`` are those of the processor."""

    profiles: int = 0
    states: int = 0
    steps: int = 0
    seconds: float = 0.0
    cells: Cells = field(default_factory=set[tuple[Stage, Stimulus]])


def explored(row: str, profiles: Collection[str] | None = None) -> Figures:
    """Every profile of the row, or those of these names, each walked to its end."""
    found = Figures()
    begun = process_time()
    for profile in ROWS[row] if profiles is None else profiles:
        given = ROWS[row][profile]
        try:
            walked = space(**given).explore(MOST)
        except AssertionError as error:
            raise AssertionError(f"{row}, {profile}: {error}") from error
        assert walked.states > 100 or given.get("control") == "none"
        assert walked.enabled or given.get("control") == "none", "a drive that never moves proves nothing"
        found.profiles += 1
        found.states += walked.states
        found.steps += walked.steps
        found.cells |= walked.cells
    found.seconds = process_time() - begun
    return found
