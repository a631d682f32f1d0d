"""The proof in short (``make proof`` and ``make proof-mutants`` are the long ones), with all families and all
protocols on the bus: of the faults that need no new process an eighth each day, once. By night a quarter, and
one of the seeded faults, each day another."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

from tests.proof.faults import FAULTS
from tests.proof.mutants import load as load_mutants
from tests.proof.report import load
from tests.support.nightly import IS_NIGHTLY
from tests.support.process import REPOSITORY

_NOISE_MS = "150"
"""For a machine that is busy, as in ``test_dead_man``. ``make proof`` allows nothing."""
_LITTLE_NOISE_MS = "60"
"""Where something has to be found: more than that would hide what is late by a tenth of a second."""
_HOLD_S = "1"
"""Three telegrams of each owner."""
_DAY_S = 86_400
_PARTS = 4 if IS_NIGHTLY else 8


def today() -> int:
    """Number of the day."""
    return int(time.time() // _DAY_S)


def proof(*arguments: str, noise_ms: str, out: Path) -> dict[str, Any]:
    """What ``python -m tests.proof`` has found."""
    command = [sys.executable, "-m", "tests.proof", *arguments, "--noise", noise_ms, "--out", str(out)]
    # A mount namespace of its own, for the disk that is filled up; one of processes: they end with the test.
    alone = ["unshare", "--mount", "--pid", "--fork", "--kill-child", "--mount-proc"]
    done = subprocess.run([*alone, *command], cwd=REPOSITORY, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr + _bridges_said(out)
    return load(out)


def _bridges_said(out: Path) -> str:
    """The machine of the lab is gone afterwards, and the logs with it."""
    logs = sorted((out.parent / f"{out.stem}-logs").glob("run_*.log"))
    return "".join(f"\n-- {log.name}\n{log.read_text(encoding='utf-8', errors='replace')}" for log in logs)


@pytest.mark.timeout(700)
def test_no_fault_keeps_a_drive_running_longer_than_published(tmp_path: Path) -> None:
    names = [fault.name for fault in FAULTS if fault.possible() and not fault.new_process]
    names = names[today() % _PARTS :: _PARTS]
    faults = ("--cycles", "1", "--hold", _HOLD_S, "--faults", ",".join(names))
    found = proof("run", *faults, noise_ms=_NOISE_MS, out=tmp_path / "proof.json")
    assert {sample["fault"] for sample in found["samples"]} == set(names)


@pytest.mark.nightly
@pytest.mark.timeout(700)
def test_the_proof_finds_a_seeded_fault(tmp_path: Path) -> None:
    names = [mutant.name for mutant in load_mutants()]
    chosen = names[today() % len(names)]
    mutants = ("--only", "--mutants", chosen)
    found = proof("hunt", *mutants, noise_ms=_LITTLE_NOISE_MS, out=tmp_path / "kills.json")
    assert {kill["mutant"] for kill in found["kills"]} == {chosen}
    assert [kill["mutant"] for kill in found["kills"] if not kill["judgement"]] == []
