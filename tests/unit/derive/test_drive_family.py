"""Drives of CiA 402 by their description: the mode they are driven in, and what is none."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

from bridge.base.errors import OperationFailed
from bridge.command import Outcome, Request, Start
from bridge.derive import derive_family
from bridge.drive import DriveState
from bridge.mapping import Family
from tests.support.bench import PLC
from tests.support.invented_eds import (
    FIXED,
    I8,
    I32,
    SPIN,
    U32,
    DerivedBench,
    Section,
    described,
    family_of,
    mapped,
    var,
)


def derived(folder: Path, sections: Mapping[str, Section] = SPIN, mode: str | None = None) -> Family:
    return family_of(folder, derive_family(described(sections), "spin.eds", mode))


def without(*names: str) -> Mapping[str, Section]:
    return {name: section for name, section in SPIN.items() if name not in names}


@pytest.mark.landing(5)
@pytest.mark.parametrize(
    ("kind", "modes", "mapping"),
    [
        ("0x10192", "0x7", "cia402/velocity"),
        ("0x20192", "0x7", "cia402/profile-velocity"),
        ("0x20192", "0x2", "cia402/velocity"),
        ("0x20192", "0x1", "cia402/profile-position"),
        ("0", "0", "cia402/profile-velocity"),
    ],
)
def test_the_mode_is_one_that_the_device_has(tmp_path: Path, kind: str, modes: str, mapping: str) -> None:
    sections = {
        **SPIN,
        "1000": var("device type", U32, "ro", kind),
        "60FF": mapped("target", I32),
        "606C": mapped("actual", I32, "ro"),
        "607A": mapped("target", I32),
        "6064": mapped("actual", I32, "ro"),
        "6502": var("modes", U32, "ro", modes),
    }
    assert derived(tmp_path, sections).extends == mapping


def test_another_mode_can_be_asked_for(tmp_path: Path) -> None:
    with pytest.raises(OperationFailed, match="has not the mode homing; it has velocity"):
        derived(tmp_path, mode="homing")


@pytest.mark.parametrize(
    ("sections", "message"),
    [
        (
            without("6041"),
            "6041h is not described, though 1A00h:01 in line [0-9]+ maps it: it is a UNSIGNED16",
        ),
        (
            {**SPIN, "6040": mapped("control word", U32)},
            "6040h in line [0-9]+ is a UNSIGNED32, not a UNSIGNED16",
        ),
    ],
)
def test_what_is_no_drive_is_refused(sections: Mapping[str, Section], message: str) -> None:
    with pytest.raises(OperationFailed, match=message):
        derive_family(described(sections), "spin.eds")


@pytest.mark.landing(3)
@pytest.mark.parametrize("sections", [SPIN, FIXED, {**SPIN, "6061": var("mode display", I8, "ro")}])
def test_the_device_is_driven_by_its_mapping(tmp_path: Path, sections: Mapping[str, Section]) -> None:
    bench = DerivedBench(tmp_path, described(sections))
    (drive,) = bench.plant.drives.values()
    outcomes: list[Outcome] = []
    bench.view.submit(Request(PLC, drive.name, Start(direction=0)), outcomes.append)
    bench.run(0.7)
    assert [one.ok for one in outcomes] == [True], outcomes
    assert drive.channel.state is DriveState.OPERATION_ENABLED
    assert bench.write(drive.name, velocity=700.0).ok
    bench.run(0.3)
    assert bench.value(f"{drive.name}/actual/velocity") == 700.0
    bench.generic.fail(0x4310)
    bench.run(0.3)
    assert drive.channel.state is DriveState.FAULT
    assert "temperature" in str(bench.value(f"{drive.name}/status/fault_text"))
