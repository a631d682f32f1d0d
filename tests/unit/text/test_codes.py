"""Each text that the program makes has a template in every language, with exactly its facts; and the other
way round. Whoever adds one touches three files: the place where it is said, ``en.json`` and ``de.json``."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Final, NamedTuple, get_args

import pytest

from bridge.can.interface import ControllerState
from bridge.canopen.nmt import NmtCommand, NmtState, command_name
from bridge.catalogue import Catalogue
from bridge.catalogue.points import LIFE_SIGN
from bridge.command.drive_link import NodeState
from bridge.command.messages.request import Action
from bridge.condition.causes import RULES
from bridge.condition.plant_layout import MOVES_BY
from bridge.config import NodeTable, Reaction
from bridge.drive import DriveState
from bridge.mapping import family_names, load_family
from bridge.northbound.opcua.space.nodes import DEVICE_GROUPS
from bridge.northbound.opcua.space.nodes import GROUPS as GROUP_NAMES
from bridge.northbound.trouble_words import CONDITION_WORDS
from bridge.project import load_project
from bridge.text import LANGUAGES, Text
from bridge.text.templates import parse, source, templates
from bridge.uaserver.conditions.condition_fields import STATES


def names() -> set[str]:
    """Names of what OPC UA serves of every family, without the number at their end."""
    found = {*GROUP_NAMES, *DEVICE_GROUPS, "drives", "buses", "bridge", "node", LIFE_SIGN}
    found |= {action.value for action in Action} - {Action.WRITE, Action.SET_TIMEOUT}
    project = load_project(Path("bridge/demo/site.toml"))
    points = list(Catalogue.of(project.site, project.families).points)
    for name in family_names():
        family = load_family(name)
        found |= {value.name for value in family.value} | {poll.name for poll in family.poll}
        found |= {state for value in family.value for state in value.states.values()}
        found |= {bit for word in (family.control_word, family.status_word) for bit in word.bits}
        found |= {bit for one in (*family.value, *family.poll) for bit in one.bits}
    shown = [point for point in points if "parameter" not in point.path]
    found |= {point.leaf for point in shown}
    found |= {state for point in shown for _, state in point.states}
    found |= {bit for point in shown for bit in point.bits}
    return {re.sub(r"(_?\d+)+$", "", name.replace(" ", "_")) for name in found if name}


GROUPS: Final[Mapping[str, Iterable[str]]] = {
    "action": list(Action),
    "alarm_state": STATES,
    "condition": CONDITION_WORDS,
    "controller_state": [state.name.lower() for state in ControllerState],
    "drive_state": [state.label for state in DriveState],
    "nmt_command": [command_name(command) for command in NmtCommand],
    "nmt_state": [state.words for state in NmtState],
    "name": names(),
    "node_state": [state.value for state in NodeState],
    "quantity": MOVES_BY,
    "reaction": get_args(Reaction),
    "supervision": get_args(NodeTable.model_fields["supervision"].annotation),
    "trouble": sorted({rule.cause for rule in RULES}),
    "word": ["control_word", "status_word"],
}
"""Words out of enumerations."""
_CODE: Final = re.compile(r"[a-z][a-z0-9_]*(\.[a-z0-9_]+)*")
_ENGLISH: Final = (" the ", " is ", " of ", " and ", " not ", " has ", " by ", " with ", " are ", " it ")


class Made(NamedTuple):
    """A text that a line of the program makes."""

    place: str
    codes: tuple[str, ...]
    facts: frozenset[str]


def made_in(path: Path) -> Iterator[Made]:
    """Raises AssertionError for a code that is not written out."""
    source_text = path.read_text(encoding="utf-8")
    if "from bridge.text import" not in source_text:
        return
    for node in ast.walk(ast.parse(source_text)):
        match node:
            case ast.Call(func=ast.Attribute(value=ast.Name(id="Text"), attr="of"), args=[code]):
                place = f"{path}:{node.lineno}"
                assert all(one.arg for one in node.keywords), f"{place}: facts are named at their place"
                yield Made(place, _codes(code, place), frozenset(str(one.arg) for one in node.keywords))
            case ast.Call(func=ast.Attribute(value=ast.Name(id="Text"), attr="word"), args=[group, _]):
                place = f"{path}:{node.lineno}"
                for one in _codes(group, place):
                    assert one in GROUPS, f"{place}: {one} is no group of words"
            case ast.Call(func=ast.Attribute(value=ast.Name(id="Text"), attr="plain"), args=[words]):
                place = f"{path}:{node.lineno}"
                assert not _is_sentence(words), f"{place}: a sentence of the program has a code"
            case ast.Call(func=ast.Name(id="Text")):
                raise AssertionError(f"{path}:{node.lineno}: a text is made by Text.of")
            case _:
                pass


def _is_sentence(node: ast.expr) -> bool:
    """Whether words are written at this place; what is not is somebody else's."""
    return any(isinstance(one, ast.JoinedStr) or _is_written(one) for one in ast.walk(node))


def _is_written(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and isinstance(node.value, str)


def _codes(node: ast.expr, place: str) -> tuple[str, ...]:
    match node:
        case ast.Constant(value=str(code)):
            return (code,)
        case ast.IfExp(body=body, orelse=other):
            return *_codes(body, place), *_codes(other, place)
        case _:
            raise AssertionError(f"{place}: a code is written out")


@cache
def all_made() -> tuple[Made, ...]:
    return tuple(made for path in sorted(Path("bridge").rglob("*.py")) for made in made_in(path))


def names_of(language: str) -> dict[str, frozenset[str]]:
    """The facts of each code."""
    return {
        code: frozenset(part.name for part in parts if part.name)
        for code, parts in templates(language).items()
    }


@pytest.mark.parametrize("language", LANGUAGES)
def test_each_text_has_its_template_with_exactly_its_facts(language: str) -> None:
    known = names_of(language)
    wrong = [
        f"{made.place}: {code} with {sorted(made.facts)}, {language}.json has {sorted(known.get(code, ()))}"
        for made in all_made()
        for code in made.codes
        if known.get(code) != made.facts
    ]
    assert not wrong, "\n".join(wrong)


def test_each_word_of_a_group_has_its_template() -> None:
    words = {Text.word(group, word).code for group, all_of in GROUPS.items() for word in all_of}
    assert words <= templates("en").keys()
    of_groups = {code for code in templates("en") if code.partition(".")[0] in GROUPS}
    assert of_groups == words


def test_no_template_is_left_over() -> None:
    used = {code for made in all_made() for code in made.codes}
    left = [code for code in templates("en") if code not in used and code.partition(".")[0] not in GROUPS]
    assert left == ["both", "plain"]


def test_both_languages_have_the_same_codes_with_the_same_facts() -> None:
    english, german = names_of("en"), names_of("de")
    assert (english.pop("both"), german.pop("both")) == ({"en"}, {"de"})
    assert english == german


@pytest.mark.parametrize("language", LANGUAGES)
def test_codes_are_in_their_order_and_read_as_such(language: str) -> None:
    lines = source(language).decode().splitlines()[1:-1]
    codes = [line.partition('"')[2].partition('"')[0] for line in lines]
    assert codes == sorted(set(codes))
    assert all(_CODE.fullmatch(code) for code in codes)


def test_german_is_german() -> None:
    for code, parts in templates("de").items():
        bare = f" {' '.join(part.words for part in parts)} "
        assert not [word for word in _ENGLISH if word in bare], code
        assert "<" not in bare, code


def test_a_text_with_the_wrong_facts_is_found(tmp_path: Path) -> None:
    file = tmp_path / "one.py"
    head = "from bridge.text import Text\n"
    file.write_text(head + 'Text.of("node.lost", why=1)\nText.of("a.b" if x else "a.c")\n')
    assert [(made.codes, made.facts) for made in made_in(file)] == [
        (("node.lost",), frozenset({"why"})),
        (("a.b", "a.c"), frozenset()),
    ]
    for wrong in (
        "Text.of(code)",
        "Text.of('a', **facts)",
        "Text('a')",
        "Text.word('nothing', x)",
        "Text.plain('no')",
        "Text.plain(f'{x}')",
    ):
        file.write_text(head + wrong)
        with pytest.raises(AssertionError):
            list(made_in(file))


def test_braces_that_do_not_fit_are_found() -> None:
    with pytest.raises(ValueError, match="'}'"):
        parse("{name")
