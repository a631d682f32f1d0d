"""The unit tests find each fault that is seeded into the gate for parameters."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.process import REPOSITORY
from tests.support.seeded import Seeded, load

TABLE = Path(__file__).with_name("seeded.toml")
FAULTS = load(TABLE)
_LIMIT_S = 600.0


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_fault_has_one_place_in_the_program_and_compiles(fault: Seeded) -> None:
    compile(fault.source(), fault.edit.file, "exec")


@pytest.mark.landing
def test_every_fault_is_found_by_the_tests_that_are_named_for_it() -> None:
    command = [sys.executable, "-m", "tests.support.seeded", str(TABLE)]
    done = subprocess.run(
        command, cwd=REPOSITORY, capture_output=True, text=True, check=False, timeout=_LIMIT_S
    )
    assert done.returncode == 0, done.stdout + done.stderr
