"""PDOs of a derived drive: fixed ones are taken as they are, and without any there is no drive."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

from bridge.base.errors import OperationFailed
from bridge.derive import derive_family
from bridge.mapping import Family
from tests.support.invented_eds import (
    FIXED,
    SPIN,
    Section,
    described,
    family_of,
    pdo,
)


def derived(folder: Path, sections: Mapping[str, Section] = SPIN, mode: str | None = None) -> Family:
    return family_of(folder, derive_family(described(sections), "spin.eds", mode))


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
