"""The proof in short (``make proof`` is the long one): every fault that needs no new process, once, with all
families and all protocols on the bus."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.proof.faults import FAULTS
from tests.proof.report import load
from tests.support.process import REPOSITORY

_NOISE_MS = "150"
"""For a machine that is busy, as in ``test_dead_man``. ``make proof`` allows nothing."""
_LONG = ("front killed", "bus process killed")
"""``test_dead_man`` and ``test_fronts`` kill them."""


@pytest.mark.timeout(300)
def test_no_fault_keeps_a_drive_running_longer_than_published(tmp_path: Path) -> None:
    names = [fault.name for fault in FAULTS if fault.possible() and fault.name not in _LONG]
    out = tmp_path / "proof.json"
    command = [sys.executable, "-m", "tests.proof", "run", "--cycles", "1", "--faults", ",".join(names)]
    # A mount namespace of its own, for the disk that is filled up.
    done = subprocess.run(
        ["unshare", "--mount", *command, "--noise", _NOISE_MS, "--out", str(out)],
        cwd=REPOSITORY,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    measured = {sample["fault"] for sample in load(out)["samples"]}
    assert measured == set(names)
