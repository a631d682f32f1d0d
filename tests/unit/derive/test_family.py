"""Report of ``family new`` on a device: its identity, and what its file leaves open."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from bridge.derive import derive_family
from bridge.eds import read_device
from bridge.mapping import Family
from tests.support.invented_eds import (
    SPIN,
    U16,
    U32,
    Section,
    described,
    eds,
    family_of,
    var,
)


def derived(folder: Path, sections: Mapping[str, Section] = SPIN, mode: str | None = None) -> Family:
    return family_of(folder, derive_family(described(sections), "spin.eds", mode))


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
