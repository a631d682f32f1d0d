"""The texts of the page: every language has every text, and each is asked for by somebody."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from bridge.command import Code
from bridge.condition.point_troubles import Rank
from bridge.image import DataType, Point
from bridge.mapping import family_names, load_family
from tests.support import sites

JS = Path("bridge/northbound/page/static/js")
_WRITES_HTML = ("innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval(", "dangerously")
_KEY = re.compile(r'  "?([\w.]+)"?: ')
_SLOT = re.compile(r"\{(\w+)\}")
_ASKED = re.compile(r'\b(?:t|maybe)\(\s*"([\w.]+)"')
_MANY = re.compile(r'\bmany\(\s*"([\w.]+)"')
_KINDS = re.compile(r'Trouble\(\s*Rank\.\w+,\s*"(\w+)"')


def texts(language: str) -> dict[str, str]:
    """The language's own file, and its part of those that the bridge has."""
    of_bridge = (JS / "texts/troubles.js").read_text(encoding="utf-8")
    shared = of_bridge.partition(f"export const {language} = ")[2].partition("};")[0]
    lines = [*(JS / f"texts/{language}.js").read_text(encoding="utf-8").splitlines(), *shared.splitlines()]
    found = {match[1]: line[match.end() :] for line in lines if (match := _KEY.match(line))}
    assert len(found) > 150
    return found


def scripts() -> dict[str, str]:
    return {str(path): path.read_text(encoding="utf-8") for path in JS.rglob("*.js")}


def test_german_has_what_english_has_with_the_same_slots() -> None:
    english, german = texts("en"), texts("de")
    assert english.keys() - german.keys() == set()
    for key, text in english.items():
        assert set(_SLOT.findall(text)) == set(_SLOT.findall(german[key])), key


def test_what_german_has_beside_it_names_what_comes_from_the_bridge() -> None:
    more = texts("de").keys() - texts("en").keys()
    assert {key.partition(".")[0] for key in more} == {"point", "bit"}


def points_of(mapping: str) -> list[Point]:
    """Points of the first drive of a family."""
    slot = load_family(mapping).slot[0].name
    text = sites.site(sites.bus(sites.node(sites.drive(slot, "lease", 1000, ""), mapping=mapping)))
    return list(sites.plant_of(text, mapping).image.points)


def is_trendable(point: Point) -> bool:
    """True if ``trendable`` of trend.js takes the point."""
    is_word = point.data_type in (DataType.STRING, DataType.BOOL) or point.states or point.bits
    return not is_word and point.path[-2] in ("actual", "command", "supervision")


@pytest.mark.parametrize("mapping", [name for name in family_names() if load_family(name).slot])
def test_german_names_whatever_a_trend_or_a_setpoint_can_show(mapping: str) -> None:
    german = texts("de")
    shown = {point.path[-1] for point in points_of(mapping) if is_trendable(point)}
    assert {f"point.{leaf}" for leaf in shown} <= german.keys()


def test_each_text_that_is_asked_for_is_there() -> None:
    english = texts("en")
    for name, script in scripts().items():
        for key in _ASKED.findall(script):
            assert key in english, f"{name}: {key}"
        for key in _MANY.findall(script):
            assert {f"{key}.one", f"{key}.other"} <= english.keys(), f"{name}: {key}"


def test_each_kind_of_trouble_says_what_it_is_why_and_what_to_do() -> None:
    judged = "".join(path.read_text(encoding="utf-8") for path in Path("bridge/condition").glob("*.py"))
    kinds = {*_KINDS.findall(judged), "bus_off", "bus_down", "bridge_dead"}
    assert len(kinds) >= 21
    english = texts("en")
    for kind in kinds:
        assert {f"trouble.{kind}", f"trouble.{kind}.why", f"trouble.{kind}.remedy"} <= english.keys(), kind


def test_each_outcome_of_a_request_is_a_sentence_and_no_code() -> None:
    english = texts("en")
    assert {f"outcome.{code}" for code in Code if code is not Code.OK} <= english.keys()
    for name, script in scripts().items():
        assert "outcome.message || outcome.code" not in script, name


@pytest.mark.parametrize("rank", list(Rank))
def test_each_rank_has_a_shape(rank: Rank) -> None:
    assert f"  {rank.name.lower()}: html`" in (JS / "icons.js").read_text(encoding="utf-8")


def test_no_script_of_ours_is_longer_than_one_sitting_or_writes_html() -> None:
    for name, script in scripts().items():
        assert "/texts/" in name or script.count("\n") <= 300, name
        for word in (
            "innerHTML",
            "outerHTML",
            "insertAdjacentHTML",
            "document.write",
            "eval(",
            "dangerously",
        ):
            assert word not in script, name


def _imports(script: Path) -> list[Path]:
    """Modules that a script imports as soon as it is loaded."""
    found = re.findall(
        r'\b(?:import|export)\b[^;]*?\bfrom *"([^"]+)"|^import "([^"]+)"', script.read_text("utf-8"), re.M
    )
    return [(script.parent / (one or other)).resolve() for one, other in found]


def test_the_first_screen_fetches_its_scripts_at_once() -> None:
    """Without a list of them a browser finds each only in the one before."""
    static = JS.parent.resolve()
    needed: set[Path] = set()
    todo = [static / "js/main.js"]
    while todo:
        script = todo.pop()
        if script not in needed:
            needed.add(script)
            todo += _imports(script)
    page = (static / "index.html").read_text(encoding="utf-8")
    named = {static / one for one in re.findall(r'rel="modulepreload" href="static/([^"]+)"', page)}
    assert named == needed - {static / "js/main.js"}
    assert not [one for one in named if one.name.startswith("uplot")], "a trend is on another page"
