"""Sections and keys of an EDS (CiA 306 §4.2) with their lines, from text that need not be well formed."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.eds.ini import SPELLING, IniValue, read_sections, shown, stripped
from bridge.eds.model import FindingSeverity, Report


def read(text: str) -> tuple[dict[str, dict[str, tuple[str, int]]], list[tuple[int, str]]]:
    report = Report()
    sections = read_sections(text.split("\n"), report)
    told = [(one.line, str(one.said)) for one in report.findings()]

    keys = {
        name: {key: (found.text, found.line) for key, found in one.keys.items()}
        for name, one in sections.items()
    }
    return keys, told


def test_keys_have_their_sections_and_lines() -> None:
    keys, told = read("; comment\n[1018]\nParameterName=Identity \n# comment\n[1018sub1]\nDataType = 0x0007")
    assert keys == {
        "1018": {"parametername": ("Identity", 3)},
        "1018sub1": {"datatype": ("0x0007", 6)},
    }
    assert told == []


def test_a_sections_name_is_read_without_blanks_and_in_any_case() -> None:
    assert set(read("[ 1018 Sub 1 ]\nx=1")[0]) == {"1018sub1"}


@pytest.mark.parametrize(
    ("text", "line", "told"),
    [
        ("x=1", 1, "x stands before the first section"),
        ("[a]\nnonsense", 2, "is neither a section nor a key: nonsense"),
        ("[a]\n=5", 2, "is neither a section nor a key: =5"),
        ("[a\nx=1", 1, "[a has no closing bracket: taken as a section"),
        ("[a] b\nx=1", 1, "b after the section's name is ignored"),
        ("[a]\nx=1\n[A]\ny=2", 3, "section [A] appears again, first in line 1: joined"),
        ("[a]\nx=1\nX=1", 3, "X appears again in [a], first in line 2, and says the same"),
        ("[a]\nx=1\nx=2", 3, "x appears again in [a], first in line 2: 1 counts, not 2"),
        (
            "[a]\nparametername=x\nDATATYPE=5",
            2,
            "2 keys are not spelt as CiA 306 has it, such as parametername: taken as ParameterName",
        ),
    ],
)
def test_what_is_odd_is_told_with_its_line(text: str, line: int, told: str) -> None:
    assert read(text)[1] == [(line, told)]


def test_a_comment_behind_a_section_is_none_of_it() -> None:
    assert read("[a] ; the first\nx=1") == ({"a": {"x": ("1", 2)}}, [])


def test_the_first_value_counts_unless_it_is_empty() -> None:
    assert read("[a]\nx=1\nx=2")[0]["a"]["x"] == ("1", 2)
    assert read("[a]\nx=\nx=2")[0]["a"]["x"] == ("2", 3)


def test_a_key_is_found_in_any_case_and_an_empty_one_is_missing() -> None:
    section = read_sections(["[a]", "DefaultValue=5", "unit="], Report())["a"]
    assert section.get("DEFAULTVALUE") == IniValue("5", 2)
    assert section.get("unit") is None
    assert (section.text("unit"), section.text("other")) == ("", "")


def test_lists_have_numbers_for_keys() -> None:
    section = read_sections(["[a]", "1=0x1000", "x=5", "0002=0x1018", "12345=7"], Report())["a"]
    assert [(number, text.text) for number, text in section.numbered()] == [(1, "0x1000"), (2, "0x1018")]


def test_what_means_nothing_at_the_ends_of_a_line() -> None:
    assert stripped("\ufeff [a]\t\x1a\0") == "[a]"


def test_what_is_shown_is_short_and_disturbs_no_terminal() -> None:
    assert shown("a\x1b[31m") == "a�[31m"
    assert shown("x" * 61) == "x" * 60 + "…"
    assert shown("x" * 60) == "x" * 60


def test_spellings_are_found_by_any_case() -> None:
    assert all(key == name.lower() for key, name in SPELLING.items())


@given(st.text(alphabet="[]=;#ax1 \n\t", max_size=60))
def test_no_text_raises_and_each_finding_has_a_line_of_it(text: str) -> None:
    report = Report()
    read_sections(text.split("\n"), report)
    lines = text.count("\n") + 1
    assert all(1 <= one.line <= lines and one.severity in FindingSeverity for one in report.findings())
