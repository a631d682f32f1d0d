"""The schedule of the faults: each as often as asked for, spread over the cycles."""

from __future__ import annotations

import subprocess
import sys
from itertools import pairwise
from pathlib import Path
from typing import get_args

import pytest

from bridge.config import Reaction
from tests.proof.drives import ALL, PROTOCOLS
from tests.proof.families import CIA402, LENZE, STOEBER
from tests.proof.fault import Fault
from tests.proof.faults import FAULTS
from tests.proof.settings import FIRST, FIRST_DEFAULTS, SECOND, SECOND_DEFAULTS, Settings
from tests.support.process import REPOSITORY

_PROOF = Path(REPOSITORY) / "tests" / "proof"
_PROGRAMS = ("__main__", "owner", "__init__")
"""They do something when they are imported."""


@pytest.mark.landing(4)
@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
@pytest.mark.parametrize("cycles", [1, 2, 25, 50])
def test_every_fault_is_injected_as_often_as_there_are_cycles(fault: Fault, cycles: int) -> None:
    due = [cycle for cycle in range(cycles) if fault.is_due(cycle, cycles)]
    assert len(due) == fault.rounds(cycles)
    assert len(due) * fault.per_round >= cycles > (len(due) - 1) * fault.per_round
    gaps = [after - before for before, after in pairwise(due)]
    assert not gaps or max(gaps) - min(gaps) <= 1


def test_all_faults_of_the_plan_are_there() -> None:
    assert len({fault.name for fault in FAULTS}) == len(FAULTS) >= 20


@pytest.mark.parametrize("fault", FAULTS, ids=lambda fault: fault.name)
def test_a_fault_is_judged_by_a_bound_or_by_yes_or_no(fault: Fault) -> None:
    assert fault.subjects
    if fault.examine:
        assert fault.demand
        assert not (fault.bus_bound or fault.drive_bound)
    else:
        assert not fault.demand
        assert fault.bus_bound or fault.drive_bound


def test_every_reaction_and_every_kind_of_rpdo_is_there() -> None:
    assert {drive.reaction for drive in ALL} == set(get_args(Reaction))
    assert any(drive.syncs for drive in ALL)
    assert any(drive.setpoint_rpdo for drive in ALL)


def _deaf_is_possible(plant: Settings) -> bool:
    """Its CiA 402 drive has an RPDO that waits for SYNC."""
    return bool(next(drive for drive in ALL if drive.family is CIA402 and drive.node in plant.nodes).syncs)


def test_each_half_has_every_protocol_and_both_have_every_drive() -> None:
    assert set(FIRST.nodes) | set(SECOND.nodes) == {drive.node for drive in ALL}
    assert not set(FIRST.nodes) & set(SECOND.nodes)
    for plant in (FIRST, SECOND):
        here = [drive for drive in ALL if drive.node in plant.nodes]
        assert {drive.protocol for drive in here} == set(PROTOCOLS)
        assert sum(drive.protocol == "modbus" for drive in here) > 1
        assert _deaf_is_possible(plant)


def test_default_settings_are_tried_with_every_protocol_and_with_outputs() -> None:
    plants = (FIRST_DEFAULTS, SECOND_DEFAULTS)
    here = [[drive for drive in ALL if drive.node in plant.nodes] for plant in plants]
    assert {drive.protocol for drives in here for drive in drives} == set(PROTOCOLS)
    assert {drive.family for drives in here for drive in drives} == {LENZE, STOEBER, CIA402}
    # The outputs beside the drives are a Modbus owner's.
    assert all(any(drive.protocol == "modbus" for drive in drives) for drives in here)
    assert all(map(_deaf_is_possible, plants))


def test_who_judges_imports_nothing_of_what_is_judged() -> None:
    """The harness runs the program; it shares no code with it, not even by way of others."""
    modules = [f"tests.proof.{path.stem}" for path in _PROOF.glob("*.py") if path.stem not in _PROGRAMS]
    script = f"import sys; import {', '.join(modules)}; print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", script], cwd=REPOSITORY, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert [name for name in done.stdout.split() if name.partition(".")[0] == "bridge"] == []
    assert {"tests.proof.witness", "tests.proof.measure", "tests.proof.drives"} <= set(modules)
