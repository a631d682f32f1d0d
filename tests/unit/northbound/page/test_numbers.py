"""The page reads a typed number as the bridge does: its script runs here without a browser."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path
from typing import Any, Final

import pytest

from tests.support.number_table import CASES

JS: Final = Path("bridge/northbound/page/static/js")
_READ_ALL: Final = """
import { readNumber } from "./numbers.js";
const texts = JSON.parse(process.argv[1]);
const read = (language) => texts.map((text) => readNumber(text, language));
console.log(JSON.stringify({ en: read("en"), de: read("de") }));
"""
_TYPED: Final = re.compile(r'type\s*[:=]\s*\$?\{?[^>\n]*"number"')
_BY_ITSELF: Final = re.compile(
    r"\bparseFloat\(|\bparseInt\(|valueAsNumber|\bNumber\((?:text|typed|\w+\.value)\b"
)


def read_by_page(texts: list[str]) -> dict[str, list[dict[str, Any]]]:
    """Readings of ``texts`` by the page's script, by language."""
    script = ["node", "--input-type=module", "--eval", _READ_ALL, json.dumps(texts)]
    run = subprocess.run(script, cwd=JS, capture_output=True, text=True, timeout=30, check=True)
    return json.loads(run.stdout)


@pytest.fixture(scope="module")
def read() -> dict[str, list[dict[str, Any]]]:
    return read_by_page([case["text"] for case in CASES])


@pytest.mark.parametrize("language", ["en", "de"])
def test_the_page_reads_the_table_as_the_command_line_does(
    read: dict[str, list[dict[str, Any]]], language: str
) -> None:
    for case, found in zip(CASES, read[language], strict=True):
        wanted = case[language]
        if isinstance(wanted, str):
            readings = {"readings": case["readings"]} if wanted == "ambiguous" else {}
            assert found == {"why": wanted} | readings, case
        else:
            assert found["value"] == wanted, case
            assert found.get("isOther", False) == (case.get("other_notation_in") == language), case


def test_a_whole_number_that_a_browser_would_round_is_refused() -> None:
    (found,) = read_by_page(["9007199254740993"])["en"]
    assert found == {"why": "too_large"}


def test_no_field_of_the_page_leaves_a_number_to_the_browser() -> None:
    """A browser reads numbers in its own language and says nothing where it drops a comma."""
    for path in (*JS.rglob("*.js"), JS.parent / "index.html"):
        text = path.read_text(encoding="utf-8")
        assert not _TYPED.search(text), path
        if path.name != "numbers.js":
            assert not _BY_ITSELF.search(text), path


_SHOW_ALL: Final = """
globalThis.localStorage = { getItem: () => process.argv[1], setItem() {} };
globalThis.document = { documentElement: {} };
Object.defineProperty(globalThis, "navigator", { value: { language: "en" } });
const { range } = await import("./format.js");
const { readNumber } = await import("./numbers.js");
const limits = JSON.parse(process.argv[2]);
const shown = limits.map(([low, high, unit]) => range(low, high, unit));
const read = (text) => readNumber(text, process.argv[1]);
const ends = (text) => text.replace(/ [^ ]*$/, "").split(" … ").map(read);
console.log(JSON.stringify(shown.map((text) => ({ text, ends: ends(text) }))));
"""
_LIMITS: Final = [
    [-100.0, 50.0 * 32767 / 16384, "Hz"],
    [-100.0, 99.99695, "1/min"],
    [-0.0123, 0.0456, "s"],
    [0.1, 400.0, "Hz"],
    [-2147483.648, 2147483.647, "rev"],
    [-8000, 7999.755859375, "1/min"],
]


@pytest.mark.landing(2)
@pytest.mark.parametrize("language", ["en", "de"])
def test_what_the_page_shows_as_allowed_is_allowed_and_can_be_typed(language: str) -> None:
    script = ["node", "--input-type=module", "--eval", _SHOW_ALL, language, json.dumps(_LIMITS)]
    run = subprocess.run(script, cwd=JS, capture_output=True, text=True, timeout=30, check=True)
    for (low, high, _), shown in zip(_LIMITS, json.loads(run.stdout), strict=True):
        least, most = (end["value"] for end in shown["ends"])
        assert low <= least < most <= high, shown
        assert most >= high - abs(high) / 100, shown
        assert least <= low + abs(low) / 100, shown
