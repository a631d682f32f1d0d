"""The unit tests beside the dead-man chain find each fault that is seeded into it."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.process import REPOSITORY
from tests.support.seeded import Seeded, load

TABLE = Path(__file__).with_name("seeded.toml")
FAULTS = load(TABLE)
_LIMIT_S = 1500.0


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_fault_has_one_place_in_the_program_and_compiles(fault: Seeded) -> None:
    compile(fault.source(), fault.edit.file, "exec")


def test_each_fault_is_another() -> None:
    assert len({fault.name for fault in FAULTS}) == len({fault.edit for fault in FAULTS}) == len(FAULTS)


@pytest.mark.landing
@pytest.mark.timeout(1600)
def test_every_fault_is_found_by_the_tests_that_are_named_for_it() -> None:
    command = [sys.executable, "-m", "tests.support.seeded", str(TABLE)]
    done = subprocess.run(
        command, cwd=REPOSITORY, capture_output=True, text=True, check=False, timeout=_LIMIT_S
    )
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.landing
def test_a_fault_that_no_test_notices_is_named(tmp_path: Path) -> None:
    table = tmp_path / "seeded.toml"
    kept = ["[[file]]", 'file = "node/put_off.py"', 'tests = "tests/unit/node"', "fault = ["]
    for name, test, find, replace in (
        ("found", "test_put_off.py", "if not self._is_last:", "if False:"),
        ("lives", "test_put_off.py::test_it_goes_out_once", "> _LATE_S", ">= _LATE_S"),
    ):
        kept.append(f'{{ name = "{name}", tests = ["{test}"], find = "{find}", replace = "{replace}" }},')
    table.write_text("\n".join([*kept, "]"]), encoding="utf-8")
    command = [sys.executable, "-m", "tests.support.seeded", str(table)]
    done = subprocess.run(command, cwd=REPOSITORY, capture_output=True, text=True, check=False, timeout=120.0)
    assert (done.returncode, done.stdout) == (1, "lives: no test notices\n")
