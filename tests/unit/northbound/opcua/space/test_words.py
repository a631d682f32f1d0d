"""Words of nodes: in German for who asks for it, and in English as they have always been."""

from __future__ import annotations

import pytest

from bridge.northbound.opcua.space.words import named, spoken, state_named
from bridge.text import Text
from bridge.uaserver.languages import speaking
from bridge.uaserver.library import ua


def both(said: ua.LocalizedText) -> tuple[tuple[str | None, str | None], tuple[str | None, str | None]]:
    told = []
    for locale in ("en", "de"):
        with speaking([locale]):
            told.append((said.Text, said.Locale))
    return told[0], told[1]


@pytest.mark.parametrize(
    ("name", "german"),
    [
        ("StatusWord", "Statuswort"),
        ("Setpoint1", "Sollwert 1"),
        ("TakeControl", "Steuerung übernehmen"),
        ("PdoAgeMs", "PDO-Alter ms"),
        ("Fu1High", "FU1 oberes Bit"),
    ],
)
def test_a_browse_name_is_the_english_name(name: str, german: str) -> None:
    assert both(named(name)) == ((name, "en"), (german, "de"))


@pytest.mark.parametrize(
    ("state", "german"), [("fault_reaction_active", "Störungsreaktion aktiv"), ("off", "Aus")]
)
def test_a_state_is_in_english_what_it_is_on_every_interface(state: str, german: str) -> None:
    assert both(state_named(state)) == ((state, "en"), (german, "de"))


def test_a_makers_state_is_in_the_makers_german() -> None:
    assert both(state_named(Text.both("off", "Ausgänge aus"))) == (("off", "en"), ("Ausgänge aus", "de"))


@pytest.mark.parametrize("words", ["P102", "Acme Turbo 7"])
def test_what_the_program_has_no_word_for_is_the_same_in_every_language(words: str) -> None:
    for said in (named(words), state_named(words), spoken(words)):
        assert both(said) == ((words, "en"), (words, "en"))


def test_a_text_with_facts_is_said_with_them() -> None:
    said = spoken(Text.of("point.bit", number=3, word="status_word"))
    assert both(said) == (("bit 3 of status_word", "en"), ("Bit 3 von status_word", "de"))
    assert both(spoken(Text.both("output current", "Ausgangsstrom")))[1] == ("Ausgangsstrom", "de")
