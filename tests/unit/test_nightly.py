"""Long trials: left out by day, they run where a change lands or by night, with all that runs by day."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import settings

from tests.support import nightly
from tests.support.nightly import IS_NIGHTLY, by_night, by_night_of, examples
from tests.support.process import REPOSITORY

MAKEFILE = (REPOSITORY / "Makefile").read_text(encoding="utf-8")
TESTS = """
import pytest
from tests.support.nightly import by_night, by_night_of, examples

def test_always():
    pass

@pytest.mark.nightly
def test_long():
    pass

@pytest.mark.landing
def test_rather_long():
    pass

@pytest.mark.landing(2)
@pytest.mark.parametrize("place", range(5))
def test_each_second(place):
    pass

@pytest.mark.parametrize("seed", by_night_of(range(3), 2))
def test_seeds(seed):
    pass

@pytest.mark.parametrize(("one", "other"), by_night((a, b) for a in range(3) for b in range(3)))
def test_rows(one, other):
    pass

def test_examples():
    assert examples(100, 7) == EXAMPLES
"""


def ran(folder: Path, expected: int, only: str = "", **extent: str) -> set[str]:
    """The tests that passed of a run with these variables, or of one that names a test; none may fail."""
    (folder / "test_it.py").write_text(TESTS.replace("EXAMPLES", str(expected)), encoding="utf-8")
    options = ("-v", "-p", "tests.support.nightly", "-p", "no:cacheprovider", "--strict-markers")
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-c",
        "/dev/null",
        f"--rootdir={folder}",
        *options,
        f"{folder}/test_it.py::{only}" if only else str(folder),
    ]
    done = subprocess.run(
        command,
        cwd=REPOSITORY,
        env={"PYTHONPATH": str(REPOSITORY), **extent},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return set(re.findall(r"::(\S+) PASSED", done.stdout))


@pytest.mark.landing
def test_by_night_all_is_tried_and_by_day_a_part_of_it(tmp_path: Path) -> None:
    day, night = ran(tmp_path, 7), ran(tmp_path, 100, NIGHTLY="1", LANDING="rest")
    rows = {f"test_rows[{one}-{other}]" for one in range(3) for other in range(3)}
    places = {f"test_each_second[{place}]" for place in range(5)}
    seeds = {f"test_seeds[{seed}]" for seed in range(3)}
    assert night == {"test_always", "test_long", "test_rather_long", "test_examples"} | rows | places | seeds
    assert day - rows == {
        *("test_always", "test_examples", "test_seeds[0]"),
        *(f"test_each_second[{place}]" for place in (0, 2, 4)),
    }
    assert day & rows < rows


@pytest.mark.landing
def test_what_has_to_pass_before_a_change_lands_is_what_day_takes_and_leaves_out(tmp_path: Path) -> None:
    day, rest = ran(tmp_path, 7, LANDING="0"), ran(tmp_path, 7, LANDING="rest")
    assert ran(tmp_path, 7, LANDING="1") == day | rest
    assert not day & rest
    assert {"test_rather_long", "test_seeds[1]", "test_each_second[1]", "test_each_second[3]"} < rest
    assert not rest & {"test_long", "test_seeds[2]"}


def test_who_names_a_test_gets_it(tmp_path: Path) -> None:
    assert ran(tmp_path, 7, "test_rather_long") == {"test_rather_long"}


def test_no_test_of_this_run_is_one_that_should_not_be_in_it(request: pytest.FixtureRequest) -> None:
    marked = [item.nodeid for item in request.session.items if item.get_closest_marker("nightly")]
    assert IS_NIGHTLY or not marked


def test_what_runs_before_a_change_lands_is_make_test_and_what_that_leaves_out() -> None:
    runs = (REPOSITORY / ".ci" / "run").read_text(encoding="utf-8").splitlines()
    makes = [line for line in runs if line.startswith("make")]
    assert makes == ["make check", "make test", "make landing", "make fuzz-guided"]
    assert re.search(r"^landing: export LANDING := rest$", MAKEFILE, re.MULTILINE)
    mark = re.compile(r"pytest\.mark\.landing|\bby_night")
    tests = REPOSITORY / "tests"
    files = [path for path in tests.rglob("test_*.py") if mark.search(path.read_text(encoding="utf-8"))]
    own = {"tests/wire/test_docs.py": "pages", "tests/fuzz": "fuzz-short"}
    marked = {
        next((lane for place, lane in own.items() if str(path).startswith(f"{REPOSITORY}/{place}")), None)
        or path.relative_to(tests).parts[0]
        for path in files
    }
    assert marked == lanes("landing")


def test_nothing_is_left_out_by_night() -> None:
    """Tests ask whether it is night only to try more: none is left out for that reason."""
    asks = re.compile(r"skipif\([^)]*NIGHTLY|not nightly|-m [\"']?nightly")
    here = Path(__file__)
    files = [path for path in (REPOSITORY / "tests").rglob("*.py") if path != here]
    assert not [path for path in files if asks.search(path.read_text(encoding="utf-8"))]
    assert not asks.search(MAKEFILE)


def lanes(target: str) -> set[str]:
    """The targets that its recipe names."""
    recipe = re.search(rf"^{target}:.*\n((?:\t.*\n)+)", MAKEFILE, re.MULTILINE)
    assert recipe
    return set(re.findall(r"^[a-z-]+(?=:)", MAKEFILE, re.MULTILINE)) & set(re.findall(r"[a-z-]+", recipe[1]))


def test_make_nightly_runs_whatever_make_test_runs() -> None:
    assert lanes("nightly") == lanes("test") >= {"unit", "foreign", "wire", "lab", "pages", "browser"}
    assert re.search(r"^nightly: export NIGHTLY := 1$", MAKEFILE, re.MULTILINE)


def test_something_runs_make_nightly() -> None:
    runs = REPOSITORY / ".ci" / "nightly"
    assert "make nightly" in runs.read_text(encoding="utf-8").splitlines()
    assert runs.stat().st_mode & 0o111


def test_each_value_of_a_column_is_there_by_day() -> None:
    rows = [(family, kind, way) for family in "abcdefgh" for kind in (1, 10, 255) for way in "xyz"]
    by_day = [row for row in by_night(rows) if isinstance(row, tuple) and len(row) == 3 and row in rows]
    assert len(by_day) < len(rows) / 2
    for column in range(3):
        told = [row[column] for row in by_day]
        assert {*told} == {row[column] for row in rows}


def test_who_is_there_once_is_there_by_day() -> None:
    assert by_night([("a", 1), ("b", 2)]) == [("a", 1), ("b", 2)]
    assert by_night_of("a", 2) == ["a"]


def test_by_day_there_are_fewer_examples_and_never_more(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nightly, "IS_NIGHTLY", False)
    assert [examples(n) for n in (300, 60, 12, 3)] == [50, 10, 5, 3]
    assert [examples(n, 20) for n in (300, 12)] == [20, 12]
    monkeypatch.setattr(nightly, "IS_NIGHTLY", True)
    assert [examples(n) for n in (300, 3)] == [300, 3]
    assert examples(300, 20) == 300


def test_the_profile_is_that_of_the_time_of_day() -> None:
    assert settings.get_profile("nightly").max_examples == 100
    assert settings.get_profile("quick").max_examples == examples(100, 30)
    assert settings().max_examples == (100 if IS_NIGHTLY else 30)
