"""The schedule of the faults: each as often as asked for, spread over the cycles."""

from __future__ import annotations

from itertools import pairwise

import pytest

from tests.proof.faults import FAULTS, Fault


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
@pytest.mark.parametrize("cycles", [1, 2, 25, 50])
def test_every_fault_is_injected_as_often_as_there_are_cycles(fault: Fault, cycles: int) -> None:
    due = [cycle for cycle in range(cycles) if fault.is_due(cycle, cycles)]
    assert len(due) == fault.rounds(cycles)
    assert len(due) * fault.at_once >= cycles > (len(due) - 1) * fault.at_once
    gaps = [after - before for before, after in pairwise(due)]
    assert not gaps or max(gaps) - min(gaps) <= 1


def test_all_faults_of_the_plan_are_there() -> None:
    assert len({fault.name for fault in FAULTS}) == len(FAULTS) == 15
