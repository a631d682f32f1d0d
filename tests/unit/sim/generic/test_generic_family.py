"""Mapping files as plans of simulated nodes."""

from __future__ import annotations

import pytest

from bridge.mapping import family_names, load_family
from bridge.mapping.model import IdentityRule
from bridge.sim.core.dictionary import IntegerType
from bridge.sim.generic.generic_family import identity_of, pattern, plan_of_family


@pytest.mark.parametrize("name", family_names())
def test_every_family_has_a_plan_that_fits_into_its_pdos(name: str) -> None:
    family = load_family(name)
    plan = plan_of_family(family, 5)
    assert len(plan.axes) == len(family.slot)
    places = [one.at for one in plan.objects]
    assert len(places) == len(set(places))
    for pdo in (*plan.rpdo, *plan.tpdo):
        assert sum(word & 0xFF for word in pdo.mapping) <= 64


def test_it_is_taken_for_one_of_the_family() -> None:
    rule = IdentityRule(vendor_id=0xACE, product_code=7)
    made = identity_of(rule, "Spin Größe", device_type=0x192)
    assert (made.vendor_id, made.product_code, made.revision, made.device_type) == (0xACE, 7, 1, 0x192)
    assert made.device_name == "Spin Gr??e"


def test_a_value_is_its_bit_pattern() -> None:
    assert pattern("real32", 1.0) == 0x3F80_0000
    assert IntegerType.INTEGER16.encode(pattern("int16", -2)) == b"\xfe\xff"
    with pytest.raises(ValueError, match=r"uint8|256"):
        pattern("uint8", 256)
