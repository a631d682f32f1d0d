"""Names of bits in control and status words: each says what is so while the bit is 1, for every bit of every
family, in both languages."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, Final

import pytest

from bridge.command import Action, Code, Identity, Outcome, Request, Role, Source, command_of
from bridge.config import load_site
from bridge.drive import DriveState
from bridge.mapping import family_names, load_family
from bridge.sim.catalogue import simulate_node
from tests.support import sites
from tests.support.bench import Bench

JS: Final = Path("bridge/northbound/page/static/js")
MAPPINGS: Final = [name for name in family_names() if load_family(name).slot]
TAB: Final = Identity(Source.LOCAL, "page", Role.OPERATOR)

RUNS: Final = 1
STOPS: Final = 0
CONTROL: Final[dict[str, int | None]] = {
    # True of a drive that runs, …
    "ready for operation": RUNS,
    "Betriebsbereit": RUNS,
    "switch on": RUNS,
    "Einschalten": RUNS,
    "voltage enabled": RUNS,
    "Spannung freigegeben": RUNS,
    "quick stop lifted": RUNS,
    "Schnellhalt aufgehoben": RUNS,
    "enable operation": RUNS,
    "Betrieb freigeben": RUNS,
    "enable": RUNS,
    "Freigabe": RUNS,
    "enable pulses": RUNS,
    "Impulse freigeben": RUNS,
    "enable ramp": RUNS,
    "Rampe freigeben": RUNS,
    "unlock ramp": RUNS,
    "Rampe lösen": RUNS,
    "reference ramp": RUNS,
    "Sollwert auf die Rampe": RUNS,
    "enable setpoint": RUNS,
    "Sollwert freigeben": RUNS,
    "control data valid": RUNS,
    "Steuerdaten gültig": RUNS,
    # … true of one that is stopped, …
    "quick stop": STOPS,
    "Schnellhalt": STOPS,
    "disable voltage": STOPS,
    "Spannung sperren": STOPS,
    "halt": STOPS,
    "Halt": STOPS,
    "no axis": STOPS,
    "Keine Achse gewählt": STOPS,
    # … true while a fault is acknowledged, which is not now, …
    "acknowledge fault": 0,
    "fault reset": 0,
    "reset fault": 0,
    "Störung quittieren": 0,
}
STATUS: Final[dict[str, int | None]] = {
    "ready to switch on": RUNS,
    "Einschaltbereit": RUNS,
    "ready for operation": RUNS,
    "Betriebsbereit": RUNS,
    "switched on": RUNS,
    "Eingeschaltet": RUNS,
    "operation enabled": RUNS,
    "Betrieb freigegeben": RUNS,
    "enabled": RUNS,
    "Freigegeben": RUNS,
    "voltage enabled": RUNS,
    "Spannung freigegeben": RUNS,
    "quick stop lifted": RUNS,
    "Schnellhalt aufgehoben": RUNS,
    "bus control active": RUNS,
    "Bussteuerung aktiv": RUNS,
    "remote": RUNS,
    "Fernsteuerung": RUNS,
    "axis active": RUNS,
    "Achse aktiv": RUNS,
    "quick stop": STOPS,
    "Schnellhalt": STOPS,
    "switch on inhibited": STOPS,
    "switch on disabled": STOPS,
    "Einschaltsperre": STOPS,
    "power disabled": STOPS,
    "Leistung gesperrt": STOPS,
    "controller inhibited": STOPS,
    "Reglersperre": STOPS,
    "local": STOPS,
    "Bedienung vor Ort": STOPS,
    "fault": 0,
    "error": 0,
    "Störung": 0,
    "trouble": 0,
    "Gerätestörung, die von selbst endet": 0,
    "warning": 0,
    "Warnung": 0,
    "homing error": 0,
    "Referenzfahrt fehlgeschlagen": 0,
    "following error": 0,
    "Schleppfehler": 0,
    "command aborted": 0,
    "Befehl abgebrochen": 0,
    "slippage": 0,
    "Schlupf zu groß": 0,
}
FREE: Final = frozenset(
    (
        "axis_bit_0",
        "axis_bit_1",
        "change_immediately",
        "change_on_setpoint",
        "command_bit_0",
        "command_bit_1",
        "command_bit_2",
        "command_bit_3",
        "command_taken",
        "current_limited",
        "direction_left",
        "direction_right",
        "e48_bit_0",
        "e48_bit_1",
        "e48_bit_2",
        "follows_command",
        "free_status_0",
        "function_480_11",
        "function_480_12",
        "function_481_9",
        "function_481_10",
        "handshake",
        "homing_attained",
        "homing_start",
        "internal_limit",
        "limit_switch_negative",
        "limit_switch_positive",
        "manufacturer_8",
        "manufacturer_11",
        "manufacturer_12",
        "manufacturer_13",
        "manufacturer_14",
        "manufacturer_15",
        "mode_bit_4",
        "mode_bit_5",
        "mode_bit_6",
        "mode_bit_9",
        "mode_bit_12",
        "mode_bit_13",
        "new_setpoint",
        "parameter_set_bit_0",
        "parameter_set_bit_1",
        "relative",
        "release_brake",
        "setpoint_acknowledged",
        "setpoint_reached",
        "speed_at_setpoint",
        "speed_below_comparison",
        "standstill",
        "start",
        "state_bit_0",
        "state_bit_1",
        "state_bit_2",
        "state_bit_3",
        "target_reached",
        "turning_left",
        "turning_right",
    )
)
"""Bits that say neither that a drive may run nor that it may not."""
_DENIES: Final = ("kein", "nicht ", "ohne ", "no ", "not ", "without ", "non-")
_TEXTS: Final = """
import { en } from "./texts/en.js";
import { de } from "./texts/de.js";
console.log(JSON.stringify({ en, de }));
"""


@cache
def texts() -> dict[str, dict[str, str]]:
    script = ["node", "--input-type=module", "--eval", _TEXTS]
    run = subprocess.run(script, cwd=JS, capture_output=True, text=True, timeout=30, check=True)
    return json.loads(run.stdout)


def shown(name: str, language: str) -> str:
    """Name of a bit as bits.js has it."""
    return texts()[language].get(f"bit.{name}") or name.replace("_", " ")


def bits_of(mapping: str) -> Iterator[tuple[dict[str, int | None], str]]:
    """The table that has each named bit of a family, and the bit's name."""
    family = load_family(mapping)
    yield from ((CONTROL, name) for name in family.control_word.bits if name)
    yield from ((STATUS, name) for name in family.status_word.bits if name)


@pytest.mark.parametrize("language", ["en", "de"])
@pytest.mark.parametrize("mapping", MAPPINGS)
def test_each_bit_has_a_name_whose_meaning_is_known(mapping: str, language: str) -> None:
    for table, name in bits_of(mapping):
        text = shown(name, language)
        assert (name in FREE) != (text in table), f"{name}: {text}"
        denies = any(word in f"{text.lower()} " for word in _DENIES)
        assert not denies or text in table, f"{name}: {text}"


@pytest.mark.parametrize("mapping", MAPPINGS)
def test_each_bit_has_a_german_name(mapping: str) -> None:
    assert {f"bit.{name}" for _, name in bits_of(mapping)} <= texts()["de"].keys()


def test_no_name_of_a_bit_is_left_over() -> None:
    known = {f"bit.{name}" for mapping in MAPPINGS for _, name in bits_of(mapping)}
    assert {code for code in texts()["de"] if code.startswith("bit.")} <= known


class Running(Bench):
    """A simulated drive of a family that runs, and is then stopped by the page's tab."""

    def __init__(self, folder: Path, mapping: str) -> None:
        slot = load_family(mapping).slot[0].name
        whole = sites.node(sites.drive(slot, "lease", 30_000, ""), name="n", mapping=mapping)
        site = load_site(sites.write(folder, sites.bus(whole), ""))
        node = simulate_node(mapping, 5, {})
        super().__init__(site, family=load_family(mapping), mapping=mapping, node=node)
        self.run(2.0)
        (self.name,) = self.plant.drives
        self.do(Action.TAKE_CONTROL, 0.1, ttl_ms=30_000)
        self.do(Action.START, 2.0, direction=1)
        assert self.number(f"{self.name}/status/state") == DriveState.OPERATION_ENABLED

    def do(self, action: Action, seconds: float, **more: Any) -> None:
        outcomes: list[Outcome] = []
        self.view.submit(Request(TAB, self.name, command_of(action, **more)), outcomes.append)
        self.run(seconds)
        assert [outcome.code for outcome in outcomes] == [Code.OK], outcomes

    def words(self) -> tuple[int, int]:
        return (
            self.number(f"{self.name}/supervision/sent_control_word"),
            self.number(f"{self.name}/status/drive_status_word"),
        )


def told(names: list[str], word: int, language: str) -> dict[str, int]:
    """The bits of ``word`` as the page shows them."""
    return {shown(name, language): word >> bit & 1 for bit, name in enumerate(names) if name}


@pytest.mark.landing(5)
@pytest.mark.parametrize("mapping", MAPPINGS)
def test_what_a_running_drive_is_said_to_do_it_does(tmp_path: Path, mapping: str) -> None:
    family = load_family(mapping)
    bench = Running(tmp_path, mapping)
    control, status = bench.words()
    for language in ("en", "de"):
        for names, word, table in (
            (family.control_word.bits, control, CONTROL),
            (family.status_word.bits, status, STATUS),
        ):
            for text, bit in told(names, word, language).items():
                if table.get(text) is not None:
                    assert bit == table[text], f"{text}: {bit} ({word:04X}h)"


@pytest.mark.landing(9)
@pytest.mark.parametrize("action", [Action.QUICK_STOP, Action.DISABLE_VOLTAGE])
@pytest.mark.parametrize("mapping", MAPPINGS)
def test_the_bit_that_stops_a_drive_is_said_to(tmp_path: Path, mapping: str, action: Action) -> None:
    """Quick stop and voltage are named where a word changes them, and as what the word makes of them."""
    family = load_family(mapping)
    bench = Running(tmp_path, mapping)
    before, _ = bench.words()
    bench.do(action, 0.02)
    after, _ = bench.words()
    for language in ("en", "de"):
        was, is_now = (told(family.control_word.bits, word, language) for word in (before, after))
        changed = {text for text in was if was[text] != is_now[text]}
        assert changed
        for text in changed:
            # What was true of a running drive is true no more, and what is true of a stopped one is.
            assert was[text] == CONTROL.get(text, was[text]), text
        topic = ("quick stop", "schnellhalt") if action is Action.QUICK_STOP else None
        assert topic is None or any(word in text.lower() for text in changed for word in topic), changed
