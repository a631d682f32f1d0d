"""Always the same cases, at two protocols at a time. ``make fuzz`` takes longer, and other seeds."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

import pytest

from tests.fuzz.rig import Rig, running_rig
from tests.fuzz.run import fuzz

CASES: Final = ({"opcua": 1600, "can": 1800}, {"modbus": 1300, "zenoh": 18_000})
"""What a machine of two cores throws in 20 s each."""
SEED: Final = 13
"""The same each time: a test suite that finds something new each day is no test of a change."""
LIMIT_S: Final = 300.0


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    folder: Path = tmp_path_factory.mktemp("fuzz")
    with running_rig(folder) as rig:
        yield rig


@pytest.mark.timeout(LIMIT_S + 180)
@pytest.mark.parametrize("cases", CASES, ids="+".join)
def test_what_is_thrown_at_it_is_borne(
    rig: Rig, cases: dict[str, int], capsys: pytest.CaptureFixture[str]
) -> None:
    report = fuzz(rig, tuple(cases), LIMIT_S, SEED, most=cases)
    with capsys.disabled():
        print(f"\n{report.told()}")
    assert not report.faults, report.told()
    assert report.thrown == cases
