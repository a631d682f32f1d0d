"""Match of a family with a node that was found: by all of its rules, and by the most of them."""

from __future__ import annotations

import pytest

from bridge.mapping import Family, load_family
from bridge.mapping.match import Found, Match, best_match
from bridge.mapping.model import IdentityRule

PLAIN = load_family("nord/sk-tu4-cao")


def family(*, preferred: bool = False, **rule: object) -> Family:
    table = PLAIN.family.model_copy(update={"preferred": preferred})
    return PLAIN.model_copy(update={"identity": IdentityRule.model_validate(rule), "family": table})


NODE = Found(
    device_type=0x0002_0192, vendor=0x38, product=0x1234, revision=0x0001_0002, device_name="SK TU4-CAO"
)


def best(found: Found = NODE, **families: Family) -> Match | None:
    return best_match(found, families)


def test_a_family_that_says_nothing_fits_nobody() -> None:
    assert best(a=family()) is None
    assert best() is None


@pytest.mark.parametrize(
    ("rule", "fits"),
    [
        ({"vendor_id": 0x38}, True),
        ({"vendor_id": 0x39}, False),
        ({"vendor_id": 0x38, "product_code": 0x1235}, False),
        ({"product_code": 0x1235, "product_code_mask": 0xFFFE}, True),
        ({"revision": 0x0001_0000, "revision_mask": 0xFFFF_0000}, True),
        ({"device_type": 0x192, "device_type_mask": 0xFFFF}, True),
        ({"device_name": "tu4"}, True),
        ({"device_name": "^TU4"}, False),
    ],
)
def test_all_of_its_rules_have_to_fit(rule: dict[str, object], fits: bool) -> None:
    found = best(a=family(**rule))
    assert (found is not None) is fits
    if found:
        assert set(found.by) == {key for key in rule if not key.endswith("_mask")}


def test_what_the_node_does_not_say_fits_no_rule() -> None:
    assert best(Found(), a=family(vendor_id=0x38)) is None
    assert best(Found(), a=family(device_name="SK")) is None


def test_the_most_rules_win_and_a_profile_alone_is_the_least() -> None:
    profile, vendor = family(device_type=0x192, device_type_mask=0xFFFF), family(vendor_id=0x38)
    both = family(vendor_id=0x38, product_code=0x1234)
    assert best(a=profile, b=vendor) == Match("b", ("vendor_id",))
    assert best(a=vendor, b=both, c=profile) == Match("b", ("vendor_id", "product_code"))


def test_of_two_that_fit_equally_the_preferred_and_then_the_first_is_taken() -> None:
    one, other = family(vendor_id=0x38), family(vendor_id=0x38, preferred=True)
    assert best(a=one, b=one) == Match("a", ("vendor_id",))
    assert best(a=one, b=other) == Match("b", ("vendor_id",))
