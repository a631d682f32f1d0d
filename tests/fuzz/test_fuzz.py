"""A minute of fuzzing for each protocol, two at a time. ``make fuzz`` takes longer, and other seeds."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.fuzz.rig import Rig, running_rig
from tests.fuzz.run import fuzz

SECONDS = float(os.environ.get("FUZZ_SECONDS", "60"))
SEED = int(os.environ.get("FUZZ_SEED", "13"))
"""The same each time: a test suite that finds something new each day is no test of a change."""


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    folder: Path = tmp_path_factory.mktemp("fuzz")
    with running_rig(folder) as rig:
        yield rig


@pytest.mark.timeout(300 + 2 * SECONDS)
@pytest.mark.parametrize("protocols", [("opcua", "can"), ("modbus", "zenoh")], ids="+".join)
def test_what_is_thrown_at_it_is_borne(
    rig: Rig, protocols: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    report = fuzz(rig, protocols, SECONDS, SEED)
    with capsys.disabled():
        print(f"\n{report.told()}")
    assert not report.faults, report.told()
    assert all(report.thrown.values())
