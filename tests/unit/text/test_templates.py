"""Templates and how facts fill them, in Python and in the page's script."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any, Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.text import LANGUAGES, Fact, Text, as_json, render
from bridge.text.templates import TemplatePart, parse, source, templates

SCRIPTS: Final = Path("bridge/northbound/page/static/js/texts")
_RENDER: Final = """
import { readFileSync } from "node:fs";
import { formatted, isKnown, rendered } from "./text.js";
const { texts, asked, numbers, templates } = JSON.parse(readFileSync(0));
console.log(JSON.stringify({
  texts: texts.map((text) => rendered(text, templates)),
  known: asked.map((text) => isKnown(text, templates)),
  numbers: numbers.map(([number, format]) => formatted(number, format)),
}));
"""


def by_the_page(asked: dict[str, object]) -> dict[str, list[Any]]:
    run = subprocess.run(
        ["node", "--input-type=module", "--eval", _RENDER],
        cwd=SCRIPTS,
        input=json.dumps({"texts": [], "asked": [], "numbers": [], "templates": {}} | asked),
        capture_output=True,
        text=True,
        timeout=30,
        check=True,
    )
    return json.loads(run.stdout)


@pytest.mark.landing(8)
@pytest.mark.parametrize(
    ("said", "english", "german"),
    [
        (Text.of("node.lost"), "node lost", "Knoten nicht erreichbar"),
        ("somebody's words", "somebody's words", "somebody's words"),
        (
            Text.of("bridge.round_late", late_ms=25.6, allowed_ms=20),
            "a round came 26 ms late; 20 ms are allowed for",
            "eine Runde kam 26 ms zu spät; 20 ms sind eingerechnet",
        ),
        (
            Text.of("bus.state", bus="can0", state=Text.word("controller_state", "bus-off")),
            "bus can0 is bus-off",
            "Bus can0: Bus-Off",
        ),
        (
            Text.of("check.pdos_wait_for_sync", pdos=("RPDO1", "TPDO2"), sync=0x80),
            "RPDO1 and TPDO2 would wait for it, and the bridge's SYNC is 80h",
            "RPDO1 und TPDO2 würden darauf warten, und das SYNC der Bridge ist 80h",
        ),
        (
            Text.of("node.emergency", number=0x810, text=Text.plain("x")),
            "emergency 0810h: x",
            "Emergency 0810h: x",
        ),
        (
            Text.of(
                "request.refused_on_unsaid", action=Text.word("action", "start"), target="a'b", who="modbus"
            ),
            'start on "a\'b" by modbus refused',
            'Start an "a\'b" von modbus abgelehnt',
        ),
        (
            Text.of(
                "node.other_device",
                changes=(
                    Text.of("node.other_vendor", now=2, before=1),
                    Text.of("node.other_serial", now=8, before=7),
                ),
            ),
            "another device than before: vendor 00000002h, was 00000001h, serial number 8, was 7. "
            "Its settings may be others",
            "ein anderes Gerät als zuvor: Hersteller 00000002h, war 00000001h, Seriennummer 8, war 7. "
            "Seine Einstellungen können andere sein",
        ),
    ],
)
def test_a_text_is_rendered_in_both_languages(said: Text | str, english: str, german: str) -> None:
    assert (render(said), render(said, "de")) == (english, german)
    if isinstance(said, Text):
        found = by_the_page({"texts": [as_json(said)], "templates": json.loads(source("de"))})
        assert found["texts"] == [german]


def test_several_texts_are_joined_as_the_template_says() -> None:
    affected = Text.of("meaning.other", leaf="speed"), Text.of("meaning.other", leaf="torque")
    said = Text.of("meaning.unreadable", parameter="P1", in_set=1, affected=affected)
    assert render(said).endswith(": speed has another meaning; torque has another meaning")


def test_braces_may_be_words() -> None:
    assert parse("accepts = {{ a = {value} }}")[0] == TemplatePart("accepts = {", "", "", False)
    found = by_the_page(
        {"texts": [{"code": "a", "facts": {"value": 1}}], "templates": {"a": "{{ {value} }}"}}
    )
    assert found["texts"] == ["{ 1 }"]


def test_an_unknown_code_and_a_missing_fact_are_errors() -> None:
    with pytest.raises(KeyError):
        render(Text("nobody.knows_it"))
    with pytest.raises(KeyError):
        render(Text("owner.controls"))


FORMATS: Final = [".0f", ".1f", ".2f", ".3f", "g", ".3g", "X", "02X", "03X", "04X", "08X"]
_NUMBERS: Final = [0, 1, -1, 12, 255, 65535, 1_000_000, 123456789, 0.5, 1.5, 2.5, 0.125, 0.375, 8.345, 1.005]
_NUMBERS_TOO: Final = [-0.5, -2.5, 1e-5, 0.0001, 1234567.0, 99999.95, 999999.5, 1e21, 3.14159265, 100.0, 0.1]


def test_numbers_read_on_the_page_as_in_python() -> None:
    asked = [
        (number, form)
        for form in FORMATS
        for number in (*_NUMBERS, *_NUMBERS_TOO)
        if not form.endswith("X") or (isinstance(number, int) and number >= 0)
        if not (form.endswith("f") and abs(number) >= 1e21)
    ]
    found = by_the_page({"numbers": asked})["numbers"]
    assert found == [format(number, form) for number, form in asked]


def test_all_formats_of_the_templates_are_known_to_the_page() -> None:
    used = {
        part.format
        for language in LANGUAGES
        for parts in templates(language).values()
        for part in parts
        if part.format and not part.format[-1].isspace()
    }
    assert used <= set(FORMATS)


_facts: Final = st.recursive(
    st.text(max_size=8) | st.integers(-(2**31), 2**31) | st.floats(allow_nan=False, allow_infinity=False),
    lambda inner: inner.map(lambda fact: Text("plain", (("text", fact),))),
    max_leaves=3,
)


@given(_facts)
def test_a_fact_stands_in_the_text_as_it_is(fact: Fact) -> None:
    said = Text("plain", (("text", fact),))
    shown = render(said)
    assert shown == render(said, "de")
    match fact:
        case str():
            assert shown == fact
        case Text():
            assert shown == render(fact)
        case _:
            assert float(shown) == fact


@given(st.lists(st.text("ab", min_size=1), max_size=4))
def test_a_list_has_each_of_its_texts_once(leaves: list[str]) -> None:
    affected = tuple(Text.plain(leaf) for leaf in leaves)
    shown = render(Text.of("meaning.unreadable", parameter="P", in_set=1, affected=affected))
    assert shown.partition("read: ")[2] == "; ".join(leaves)


@pytest.mark.landing
def test_templates_are_read_before_the_first_event() -> None:
    """A trip is told in the round that stops the drive: it must not wait for a disk."""
    script = (
        "import bridge.command.messages.event\n"
        "from bridge.text.templates import templates\n"
        "print(templates.cache_info().currsize)"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert run.stdout == "1\n"


def test_the_page_knows_what_it_has_no_template_for() -> None:
    """A tab may be older than the bridge that it shows: it shows such a text in English."""
    vendor = {"code": "vendor", "facts": {"now": 2}}
    newer = {"code": "newer", "facts": {}}
    asked = [
        vendor,
        newer,
        {"code": "plain", "facts": {"text": "x"}},
        {"code": "vendor", "facts": {"now": newer}},
        {"code": "vendor", "facts": {"now": [vendor, newer]}},
        {"code": "vendor", "facts": {"now": [vendor, vendor]}},
    ]
    templates_of_page = {"plain": "{text}", "vendor": "Hersteller {now}"}
    told = by_the_page({"asked": asked, "templates": templates_of_page})["known"]
    assert told == [True, False, True, False, False, True]
