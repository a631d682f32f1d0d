"""Troubles in words: what each says in both languages, as the points tell it."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from bridge.condition.causes import TroubleLine
from bridge.condition.point_troubles import Rank, Trouble
from bridge.condition.told import troubles_json
from bridge.northbound.trouble_reader import decoded
from bridge.northbound.trouble_words import KINDS, PlantWords, TroubleWords, trouble_words
from bridge.text import LANGUAGES, Text

JUDGED = re.compile(r'Trouble\(\s*Rank\.\w+,\s*"(\w+)"')
OVERCURRENT = (
    ("text", Text.of("fault.numbered", number="E003/3.0", text="overcurrent")),
    ("number", "E003/3.0"),
    ("cause", "Motor blocked."),
    ("remedy", "Free the motor."),
)
GERMAN = {"text": "überstrom", "cause": "Motor blockiert.", "remedy": "Motor befreien."}
PLANT = PlantWords(
    lambda drive, number, language: GERMAN if (number, language) == ("E003/3.0", "de") else {},
    {"conveyor/fu1": "hold", "conveyor/fu2": "silence"},
)


def told(kind: str, place: str, *facts: tuple[str, Any], until: float | None = None) -> dict[str, Any]:
    """A trouble as it comes through its point."""
    trouble = Trouble(Rank.ALARM, kind, place, facts)
    (one,) = decoded(troubles_json([TroubleLine(trouble, Rank.ALARM, 1000.0, until)]))
    return one


def words(language: str, kind: str, place: str, *facts: tuple[str, Any], **more: float) -> TroubleWords:
    return trouble_words(told(kind, place, *facts, **more), PLANT, language)


def test_each_kind_that_is_judged_has_its_words() -> None:
    judged = "".join(path.read_text(encoding="utf-8") for path in Path("bridge/condition").glob("*.py"))
    kinds = {*JUDGED.findall(judged), "bus_off", "bus_down", "bridge_dead", "no_command", "no_actual"}
    assert kinds == set(KINDS)


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("kind", KINDS)
def test_each_says_what_it_is_why_and_what_to_do(kind: str, language: str) -> None:
    said = words(language, kind, "bus/can0", ("why", ""), ("owner", "zenoh:plc"), ("value", "speed"))
    assert said.headline
    assert said.remedy
    assert said.message[0].isupper()


@pytest.mark.parametrize(
    ("language", "message", "remedy"),
    [
        (
            "en",
            "No node answers. All 40 nodes that should be there are silent, so what they share is to blame",
            "Check the CAN cable",
        ),
        ("de", "Kein Knoten antwortet. Alle 40 Knoten, die da sein müssten, schweigen", "CAN-Kabel an der"),
    ],
)
def test_a_cut_bus_is_told_in_both_languages(language: str, message: str, remedy: str) -> None:
    said = words(language, "bus_silent", "bus/can0", ("nodes", 40))
    assert said.message.startswith(message)
    assert said.remedy.startswith(remedy)


@pytest.mark.parametrize(
    ("language", "said"),
    [
        ("en", ("Fault E003/3.0. Overcurrent.", "Motor blocked.", "Free the motor.")),
        ("de", ("Störung E003/3.0. Überstrom.", "Motor blockiert.", "Motor befreien.")),
    ],
)
def test_a_fault_has_its_makers_cause_and_remedy(language: str, said: tuple[str, str, str]) -> None:
    found = words(language, "drive_fault", "conveyor/fu1", *OVERCURRENT)
    assert (found.message, found.cause, found.remedy) == said


@pytest.mark.parametrize(
    ("drive", "owner", "why"),
    [
        ("conveyor/fu1", "modbus:10.0.0.7", "it may run on"),
        ("conveyor/fu1", "", "until the lease ended, and then stopped it"),
        ("conveyor/fu2", "modbus:10.0.0.7", "the drive stops by itself"),
        ("conveyor/fu3", "modbus:10.0.0.7", "the bridge has stopped the drive"),
    ],
)
def test_a_silent_controller_is_told_with_what_the_bridge_does(drive: str, owner: str, why: str) -> None:
    said = words("en", "controller_silent", drive, ("owner", owner), ("timeout_ms", 500))
    assert said.why.endswith(f"{why}.")
    assert said.why.startswith(f"Nothing came from {owner or 'its controller'} for 500 ms")


def test_what_a_cause_has_left_behind_is_to_be_acknowledged() -> None:
    said = words("en", "bus_silent", "bus/can0", ("nodes", 2), until=2000.0)
    assert said.remedy == "Nothing: it is over. Acknowledge what it has left behind."


def test_the_reason_of_a_text_is_in_the_readers_language() -> None:
    how = Text.word("node_state", "lost")
    english, german = (words(one, "node_lost", "conveyor", ("how", how)).why for one in LANGUAGES)
    assert english != german


def test_the_quantity_that_does_not_come_is_named() -> None:
    said = words("de", "no_command", "conveyor/fu1", ("value", "velocity"), ("why", "P480 [-01] = 0"))
    assert said.message.startswith("Sollwert Drehzahl kommt beim Antrieb nicht an")


def test_what_another_version_tells_is_told_as_it_is() -> None:
    said = words("de", "moon_is_full", "bus/can0", ("why", "who knows"))
    assert (said.message, said.remedy) == ("Moon is full.", "")
