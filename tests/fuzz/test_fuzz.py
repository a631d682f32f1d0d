"""Always the same cases, at all protocols at a time. ``make fuzz`` takes longer, and other seeds."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import pytest

from tests.fuzz.rig import running_rig
from tests.fuzz.run import fuzz
from tests.fuzz.targets import PROTOCOLS

CASES: Final = {"opcua": 1000, "modbus": 1000, "zenoh": 1000, "can": 1000}
"""What a machine of two cores throws in half a minute."""
SEED: Final = 13
"""The same each time: a test suite that finds something new each day is no test of a change."""
LIMIT_S: Final = 600.0


@pytest.mark.timeout(LIMIT_S + 180)
def test_what_is_thrown_at_it_is_borne(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with running_rig(tmp_path) as rig:
        report = fuzz(rig, PROTOCOLS, LIMIT_S, SEED, most=CASES)
    with capsys.disabled():
        print(f"\n{report.told()}")
    assert not report.faults, report.told()
    assert report.thrown == CASES
