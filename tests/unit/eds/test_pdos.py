"""PDOs of a device description: identifiers, flags, mapped objects, and those that CompactPDO leaves out."""

from __future__ import annotations

import pytest

from bridge.eds.pdos import PdoSummary, pdos
from tests.support.invented_eds import U16, described, mapped, pdo, var

WORDS = {"6041": mapped("statusword", U16, "ro"), "6040": mapped("controlword", U16)}


def found(sections: dict[str, dict[str, str]], node_id: int | None = 5) -> list[PdoSummary]:
    return list(pdos(described({**WORDS, **sections}), node_id))


def test_rpdos_come_first_with_what_they_carry() -> None:
    first, second = found(
        {**pdo("1801", "$NODEID+0x280", "0x60410010"), **pdo("1400", "$NODEID+0x200", "0x60400010")}
    )
    assert (first.receives, first.number, first.name, first.cob_id) == (True, 1, "RPDO1", 0x205)
    assert (second.receives, second.number, second.name, second.cob_id) == (False, 2, "TPDO2", 0x285)
    (one,) = first.mapped
    assert (one.index, one.sub, one.bits, one.name) == (0x6040, 0, 16, "controlword")
    assert first.bits == 16


@pytest.mark.parametrize(
    ("cob_id", "identifier", "enabled"),
    [
        ("$NODEID+0x200", 0x205, True),
        ("$NODEID+0x80000200", 0x205, False),
        ("0x80000000", 0, False),
        ("$NODEID+0x40000200", 0x205, True),
        ("0x301", 0x301, True),
    ],
)
def test_the_flags_are_no_part_of_the_identifier(cob_id: str, identifier: int, enabled: bool) -> None:
    """CiA 301 §7.5.2.35: bit 31 is "not valid", bit 30 "no RTR"."""
    (one,) = found(pdo("1400", cob_id, "0x60400010"))
    assert (one.cob_id, one.enabled) == (identifier, enabled)


def test_what_depends_on_an_unknown_node_is_not_known() -> None:
    (one,) = found(pdo("1400", "$NODEID+0x200", "0x60400010"), node_id=None)
    assert one.cob_id is None


def test_an_object_that_the_file_does_not_describe_has_no_name() -> None:
    (one,) = found(pdo("1400", "$NODEID+0x200", "0x23450108"))
    assert [(item.index, item.sub, item.bits, item.name) for item in one.mapped] == [(0x2345, 1, 8, "")]


def test_a_device_without_pdos_has_none() -> None:
    assert found({"2000": var("x", U16)}) == []
