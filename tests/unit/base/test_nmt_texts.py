"""NMT commands and states as texts: in English as ``canopen`` says them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.base.nmt_texts import text_of_command, text_of_state
from bridge.canopen import nmt
from bridge.canopen.nmt import NmtState
from bridge.text import LANGUAGES, render


@given(st.binary(max_size=3) | st.binary(min_size=2, max_size=2))
def test_a_command_reads_as_canopen_says_it(data: bytes) -> None:
    assert render(text_of_command(data)) == nmt.describe(data)


@pytest.mark.parametrize(
    ("data", "german"),
    [
        ("0100", "Start für alle Knoten"),
        ("8105", "Knoten-Reset für Knoten 5"),
        ("0705", "unbekannter Befehl 07h für Knoten 5"),
        ("", "nichts (kein NMT-Befehl)"),
    ],
)
def test_and_in_german(data: str, german: str) -> None:
    assert render(text_of_command(bytes.fromhex(data)), "de") == german


@pytest.mark.parametrize("state", NmtState)
def test_each_state_has_its_words(state: NmtState) -> None:
    english, german = (render(text_of_state(state), language) for language in LANGUAGES)
    assert english == state.words
    assert german
