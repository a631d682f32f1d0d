"""Mends that are taken back: each fits the program as it is, and plans lean to what it breaks."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from tests.plant.leaning import LEANS
from tests.plant.mutants import TAKEN_BACK, tables
from tests.plant.plan import KINDS
from tests.proof.mutants import TABLE, Mutant, files_of, load
from tests.support.process import REPOSITORY

MUTANTS = tables(TAKEN_BACK)


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant.name)
def test_a_mend_has_one_place_in_the_program_and_compiles(mutant: Mutant) -> None:
    for file, text in files_of(mutant).items():
        compile(text, file, "exec")
        original = (REPOSITORY / "bridge" / file).read_text(encoding="utf-8")
        assert ast.dump(ast.parse(text)) != ast.dump(ast.parse(original)), f"{file} does what it did"
    assert mutant.first in LEANS or mutant.first.partition(": ")[0] in KINDS


def test_each_is_another() -> None:
    names = [mutant.name for mutant in (*MUTANTS, *load())]
    assert len(set(names)) == len(names)
    assert len({mutant.edits for mutant in MUTANTS}) == len(MUTANTS)


def test_tables_are_those_of_a_file_or_of_a_folder(tmp_path: Path) -> None:
    assert tables(TABLE) == load()
    for name in ("b", "a"):
        (tmp_path / f"{name}.toml").write_text(
            f"[[mutant]]\nname = '{name}'\nbreaks = ''\nfirst = ''\n[[mutant.edit]]\n"
            "file = ''\nfind = ''\nreplace = ''\n",
            encoding="utf-8",
        )
    assert [mutant.name for mutant in tables(tmp_path)] == ["a", "b"]
