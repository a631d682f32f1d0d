"""Parameters of a derived mapping: names, types, ranges, defaults and access, and what contradicts itself."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from bridge.derive import derive_family
from bridge.mapping import Family
from bridge.parameter import Names, ObjectRef
from bridge.parameter.write_effect import Effect
from tests.support.invented_eds import (
    SPIN,
    U16,
    U32,
    Section,
    described,
    family_of,
    mapped,
    var,
)


def derived(folder: Path, sections: Mapping[str, Section] = SPIN, mode: str | None = None) -> Family:
    return family_of(folder, derive_family(described(sections), "spin.eds", mode))


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
