"""The tool that changes the code: what it changes, and whether it hears what tests say about it."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from tools.mutants.find import Mutant, find
from tools.mutants.run import REPOSITORY, Recorded

PATH = Path("bridge/room/file.py")
CHANGES = {
    "a < b": "(a <= b)",
    "a < b <= c": "(a <= b <= c)",
    "a is None": "(a is not None)",
    "a in b": "(a not in b)",
    "a and b": "((a) or (b))",
    "a + b": "((a) - (b))",
    "a << b": "((a) >> (b))",
    "not a": "(a)",
    "a if b else c": "(c if b else a)",
    "a += b": "a -= b",
    "True": "False",
    "7": "8",
    "call()": "pass",
}
SAID = ["log.info('x')", "a: dict[str, 1]", "'a' 'b'", "f'{a + 1}'", "assert a < b"]


@pytest.mark.parametrize(("old", "new"), CHANGES.items())
def test_what_is_changed(old: str, new: str):
    source = f"text = 'ä'\nif x:\n    {old}\n    done = y\n"
    first, *_ = find(PATH, source)
    assert (first.old, first.new, first.line, first.statement) == (old, new, 3, 3)
    changed = first.applied(source.encode()).decode()
    assert changed == source.replace(old, new)
    ast.parse(changed)


@pytest.mark.parametrize("source", SAID)
def test_what_is_only_said_is_left_alone(source: str):
    assert not find(PATH, source)


def test_tests_are_asked_that_run_the_statement_those_that_are_about_the_file_first():
    suite = Recorded()
    suite.add(
        Recorded(
            took_s={"short": 0.1, "thorough": 0.1, "long": 2.0},
            lines={
                str(PATH): {1: {""}, 5: {"short", "long", "thorough"}, 6: {"thorough"}, 7: {"long"}},
                "other.py": {1: {"short", "thorough"}},
            },
        )
    )
    assert suite.tests_of(Mutant(PATH, 5, 5, 0, "1", "2")) == ["thorough", "short", "long"]
    assert suite.tests_of(Mutant(PATH, 6, 7, 0, "1", "2")) == ["thorough", "long"]
    assert len(suite.tests_of(Mutant(PATH, 1, 1, 0, "1", "2"))) == 3, "run by the import: all of them"
    assert not suite.tests_of(Mutant(PATH, 9, 9, 0, "1", "2")), "run by none"
    suite.add(Recorded(lines={str(PATH): {1: {"long"}}}))
    assert len(suite.tests_of(Mutant(PATH, 1, 1, 0, "1", "2"))) == 3, "all, though one of them imports it"


def test_a_test_of_little_else_is_asked_before_one_of_the_whole_program():
    """The latter runs more of the file, and is quick for what it does."""
    suite = Recorded()
    suite.add(
        Recorded(
            took_s={"unit": 0.01, "whole": 0.1},
            lines={
                str(PATH): {5: {"unit", "whole"}, **{line: {"whole"} for line in range(6, 30)}},
                "other.py": {line: {"whole"} for line in range(1, 500)},
            },
        )
    )
    assert suite.tests_of(Mutant(PATH, 5, 5, 0, "1", "2")) == ["unit", "whole"]


def test_of_a_file_that_only_an_import_runs_those_are_asked_that_run_its_folder():
    types = PATH.with_name("types.py")
    suite = Recorded()
    suite.add(
        Recorded(
            took_s={"short": 0.1, "thorough": 0.1, "other": 0.1, "long": 2.0},
            lines={
                str(types): {1: {"", "long"}, 2: {""}},
                str(PATH): {1: {""}, 5: {"short", "thorough"}, 6: {"thorough"}},
                "bridge/hall/file.py": {1: {"other", "short"}},
            },
        )
    )
    for line in (1, 2):
        assert suite.tests_of(Mutant(types, line, line, 0, "1", "2")) == ["thorough", "short", "long"]
    assert not suite.tests_of(Mutant(types, 3, 3, 0, "1", "2"))


@pytest.mark.landing
def test_what_no_test_notices_is_told_and_the_rest_is_not():
    options = ("--jobs", "1", "--tests", "tests/unit/command/messages/test_event.py")
    files = ("bridge/command/messages/event.py", "bridge/canopen/abort.py")
    command = (sys.executable, "-m", "tools.mutants", *options, *files)
    done = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    head, *told, of_event, of_abort, _ = done.stdout.splitlines()
    assert head.startswith(f"{len(told) + 5} mutants, ")
    assert of_event == "bridge/command/messages/event.py: 0 of 5 were not noticed"
    assert of_abort == f"bridge/canopen/abort.py: {len(told)} of {len(told)} were not noticed"
    assert all(line.startswith("bridge/canopen/abort.py:") for line in told)
