"""The table of seeded faults fits the program as it is."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

from tests.proof.fault import Fault
from tests.proof.faults import FAULTS
from tests.proof.mutants import Edit, Mutant, Tree, files_of, load
from tests.support.process import REPOSITORY

MUTANTS = load()


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.name)
def test_a_mutant_has_one_place_in_the_program_and_compiles(mutant: Mutant) -> None:
    for file, text in files_of(mutant).items():
        compile(text, file, "exec")
        original = (REPOSITORY / "bridge" / file).read_text(encoding="utf-8")
        assert ast.dump(ast.parse(text)) != ast.dump(ast.parse(original)), f"{file} does what it did"
    assert mutant.first in {fault.name for fault in FAULTS}


@pytest.mark.landing
def test_no_mutant_uses_a_name_that_is_not_there() -> None:
    """It would not even start, and nothing be proven by that."""
    texts = [(mutant.name, file, text) for mutant in MUTANTS for file, text in files_of(mutant).items()]
    for name, file, text in texts:
        command = [sys.executable, "-m", "ruff", "check", "--select", "F821", "--stdin-filename", file, "-"]
        done = subprocess.run(command, input=text, capture_output=True, text=True, check=False)
        assert done.returncode == 0, f"{name}: {done.stdout}{done.stderr}"


def test_there_are_enough_of_them_and_each_is_another() -> None:
    assert len({mutant.name for mutant in MUTANTS}) == len(MUTANTS) >= 20
    assert len({mutant.edits for mutant in MUTANTS}) == len(MUTANTS)


@pytest.mark.parametrize("fault", [one for one in FAULTS if one.examine], ids=lambda fault: fault.name)
def test_what_is_judged_by_yes_or_no_says_no_to_a_mutant(fault: Fault) -> None:
    assert fault.name in {mutant.first for mutant in MUTANTS}


def test_a_text_that_has_no_place_or_several_is_an_error() -> None:
    with pytest.raises(ValueError, match="there 0 times"):
        Edit("a.py", "nothing", "").apply("text")
    with pytest.raises(ValueError, match="there 2 times"):
        Edit("a.py", "te", "").apply("te te")


@pytest.mark.landing
def test_a_tree_holds_one_mutant_at_a_time(tmp_path: Path) -> None:
    tree = Tree(tmp_path)
    first, second = MUTANTS[0], next(one for one in MUTANTS if one.edits[0].file != MUTANTS[0].edits[0].file)
    changed = tmp_path / "bridge" / first.edits[0].file
    original = changed.read_bytes()
    tree.hold(first)
    assert changed.read_bytes() != original
    tree.hold(second)
    assert changed.read_bytes() == original
    tree.hold(None)
    for mutant in (first, second):
        file = Path("bridge") / mutant.edits[0].file
        assert (tmp_path / file).read_bytes() == (REPOSITORY / file).read_bytes()
