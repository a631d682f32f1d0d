"""Identity of a device by its file: the demands on a node, and the file that fits a node."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.derive import derive_family
from bridge.derive.device_family import is_of, wanted_identity
from bridge.eds import Description, read_device
from bridge.sim.core.nmt_slave import SlaveState
from tests.support.invented_eds import (
    BASIC,
    SPIN,
    U32,
    DerivedBench,
    Section,
    described,
    eds,
    family_of,
    record,
    var,
)

VENDOR, PRODUCT = 0xACE, 0x3000
WITHOUT = {name: keys for name, keys in SPIN.items() if not name.startswith("1018")}


def number(value: int | None) -> Section:
    return var("number", U32, "ro", "" if value is None else hex(value))


def file(identity: dict[str, Section], info: tuple[int, int] | None) -> Description:
    content = eds({**WITHOUT, **identity}).decode()
    if info is not None:
        numbers = f"[DeviceInfo]\nVendorNumber={info[0]}\nProductNumber={info[1]}"
        content = content.replace("[DeviceInfo]", numbers, 1)
    return read_device(content.encode(), "spin.eds")


@pytest.mark.landing(8)
@pytest.mark.parametrize(
    ("identity", "info", "wanted"),
    [
        (record("1018", "identity", number(VENDOR)), (VENDOR, 1), (VENDOR, None)),
        (record("1018", "identity", number(None)), (VENDOR, 1), (VENDOR, None)),
        (record("1018", "identity", number(None), number(None)), (VENDOR, PRODUCT), (VENDOR, PRODUCT)),
        (record("1018", "identity", number(VENDOR), number(PRODUCT)), (1, 2), (VENDOR, PRODUCT)),
        (record("1018", "identity", number(VENDOR), number(0)), None, (VENDOR, None)),
        (record("1018", "identity", number(0), number(0)), (0, 0), (None, None)),
        ({}, (VENDOR, PRODUCT), (None, None)),
        ({}, None, (None, None)),
    ],
)
def test_nothing_is_demanded_that_the_file_does_not_describe(
    tmp_path: Path,
    identity: dict[str, Section],
    info: tuple[int, int] | None,
    wanted: tuple[int | None, int | None],
) -> None:
    description = file(identity, info)
    assert wanted_identity(description) == wanted
    rule = family_of(tmp_path, derive_family(description, "spin.eds")).identity
    assert (rule.vendor_id, rule.product_code) == wanted
    bench = DerivedBench(tmp_path, description)
    assert bench.generic.slave.state is SlaveState.OPERATIONAL


@pytest.mark.parametrize(
    ("identity", "node", "is_its_file"),
    [
        (record("1018", "identity", number(VENDOR), number(PRODUCT)), (VENDOR, PRODUCT), True),
        (record("1018", "identity", number(VENDOR), number(PRODUCT)), (VENDOR, 1), False),
        (record("1018", "identity", number(VENDOR), number(PRODUCT)), (VENDOR, None), False),
        (record("1018", "identity", number(VENDOR)), (VENDOR, None), True),
        (record("1018", "identity", number(VENDOR)), (VENDOR, PRODUCT), True),
        (record("1018", "identity", number(VENDOR)), (VENDOR, 1), False),
        (record("1018", "identity", number(VENDOR)), (1, None), False),
        (record("1018", "identity", number(0), number(0)), (0, 0), False),
        ({}, (VENDOR, PRODUCT), True),
        ({}, (None, None), False),
    ],
)
def test_a_file_is_that_of_a_node(
    identity: dict[str, Section], node: tuple[int | None, int | None], is_its_file: bool
) -> None:
    info = (0, 0) if identity and identity["1018sub1"].get("DefaultValue") == "0x0" else (VENDOR, PRODUCT)
    assert is_of(file(identity, info), *node) is is_its_file


def test_an_identity_of_zeros_is_said() -> None:
    nothing = record("1018", "identity", number(0), number(0))
    for sections in (SPIN, {**BASIC, "1000": var("type", U32, "ro", "0x196")}):
        text = derive_family(described({**sections, **nothing}), "spin.eds").text
        assert (
            "\n# The file has neither vendor nor product (0/0): any node is taken for this device.\n" in text
        )
        assert "0/0" not in derive_family(described(sections), "spin.eds").text
