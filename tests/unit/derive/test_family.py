"""What ``family new`` makes of a device description."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

from bridge.base.errors import OperationFailed
from bridge.command import Outcome, Request, Start
from bridge.derive import derive_family
from bridge.drive import DriveState
from bridge.eds import read_device
from bridge.mapping import Family
from bridge.parameter import Names, ObjectRef
from bridge.parameter.effect import Effect
from tests.support.bench import PLC
from tests.support.invented_eds import (
    FIXED,
    I8,
    I32,
    SPIN,
    U16,
    U32,
    DerivedBench,
    Section,
    described,
    eds,
    family_of,
    mapped,
    pdo,
    var,
)


def derived(folder: Path, sections: Mapping[str, Section] = SPIN, mode: str | None = None) -> Family:
    return family_of(folder, derive_family(described(sections), "spin.eds", mode))


def without(*names: str) -> Mapping[str, Section]:
    return {name: section for name, section in SPIN.items() if name not in names}


def test_the_mapping_says_who_the_drive_is(tmp_path: Path) -> None:
    made = derive_family(described(), "spin.eds")
    family = family_of(tmp_path, made)
    assert made.name == "acme-gmbh/spin-3000"
    assert family.extends == "cia402/velocity"
    assert (family.family.name, family.family.vendor, family.family.source) == (
        "Spin 3000",
        "Acme GmbH",
        "spin.eds",
    )
    assert (family.identity.vendor_id, family.identity.product_code) == (0xACE, 0x3000)
    assert family.identity.revision is None
    assert "\n# revision = 0x00010002\n" in made.text


def test_what_the_file_does_not_say_is_a_comment() -> None:
    text = derive_family(described({**SPIN, "1018sub1": var("vendor", U32, "ro")}), "spin.eds").text
    assert "\n# vendor_id = 0x\n" in text
    assert '\n# unit = ""\n' in text


def test_parameters_have_names_types_ranges_defaults_and_access(tmp_path: Path) -> None:
    family = derived(tmp_path)
    facts = {
        one.name: (one.title, one.data_type, one.low, one.high, one.default, one.access)
        for one in family.parameter
        if one.name.startswith("2")
    }
    assert facts == {
        "2001": ("Überlast", "uint16", 10.0, 100.0, 40, "rw"),
        "2002:01": ("gains: P", "real32", None, None, 1.5, "rw"),
        "2002:02": ("gains: offset", "int16", None, None, -3, "rw"),
        "2003": ("tag", "string", None, None, "spin", "ro"),
        "2004": ("temperature", "int16", None, None, None, "ro"),
    }
    assert family.object_of(family.parameter_named("2002:02")).sub == 2


def test_what_the_device_has_not_is_left_out(tmp_path: Path) -> None:
    names = {one.name for one in derived(tmp_path).parameter}
    assert "6083" not in names
    assert {"603F", "6007"} <= names
    assert not derived(tmp_path).own_supervision


def test_what_can_be_mapped_is_not_written_while_the_drive_is_enabled(tmp_path: Path) -> None:
    sections = {
        **SPIN,
        "2008": mapped("torque limit", U16),
        "60E0": mapped("positive torque limit", U16),
        "60FE": mapped("outputs", U32),
    }
    family = derived(tmp_path, sections)
    protection = Names(family).protection
    assert family.parameter_named("2008").protected == "may_move"
    assert family.parameter_named("60E0").protected == "while_enabled"
    assert protection.effect(ObjectRef(0x60FE, 0)) is Effect.COMMANDS


def test_a_limit_that_contradicts_the_other_is_a_comment(tmp_path: Path) -> None:
    wrong = {**SPIN, "2001": var("load", U16, "rw", "70000", LowLimit="9", HighLimit="3")}
    family = derived(tmp_path, wrong)
    load = family.parameter_named("2001")
    assert (load.low, load.high, load.default) == (None, None, None)


def test_a_default_beyond_its_own_limits_is_a_comment(tmp_path: Path) -> None:
    wrong = {**SPIN, "2001": var("load", U16, "rw", "7", LowLimit="10", HighLimit="100")}
    assert derived(tmp_path, wrong).parameter_named("2001").default is None
    assert "\n# default = 7: the file contradicts itself" in derive_family(described(wrong), "spin.eds").text


def test_an_identity_that_the_file_has_otherwise_elsewhere_is_said(tmp_path: Path) -> None:
    content = eds().replace(b"VendorName", b"VendorNumber=0x1234\nProductNumber=0x3000\nVendorName")
    made = derive_family(read_device(content, "spin.eds"), "spin.eds")
    assert family_of(tmp_path, made).identity.vendor_id == 0xACE
    assert "\n# The file contradicts itself: [DeviceInfo] has vendor_id 0x1234, 1018h counts.\n" in made.text
    assert "product_code 0x" not in made.text


def test_names_cannot_leave_their_line(tmp_path: Path) -> None:
    odd = {**SPIN, "2001": var('a "quoted"\x7f\\ name \x1b[2J', U16)}
    title = derived(tmp_path, odd).parameter_named("2001").title
    assert title == 'a "quoted" \\ name [2J'


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


def test_a_drive_that_cannot_be_reached_by_pdos_is_refused() -> None:
    fixed = {**SPIN, **pdo("1400", "$NODEID+0x200", "0x60400010", access="const")}
    with pytest.raises(OperationFailed, match="no RPDO of the device carries 6042h"):
        derive_family(described(fixed), "spin.eds")


def test_fixed_pdos_are_taken_as_they_are(tmp_path: Path) -> None:
    sections = {**FIXED, **pdo("1800", "$NODEID+0x180", "0x60410010", access="const")}
    family = derived(tmp_path, sections)
    assert family.extends == "cia402/profile-velocity"
    (slot,) = family.slot
    assert [(one.number, one.cob_id, one.words) for one in slot.rpdo] == [
        (4, 0x510, ["control_word", "setpoint_1", "setpoint_2", "setpoint_3"])
    ]
    assert [(one.number, one.cob_id, one.words) for one in slot.tpdo] == [
        (2, 0x290, ["status_word", "value_1", "value_2", "value_3"])
    ]


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
