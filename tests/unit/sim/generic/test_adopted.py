"""A drive of a known kind as one of a family that extends it."""

from __future__ import annotations

from bridge.mapping import load_family
from bridge.mapping.model import IdentityRule
from bridge.sim.cia402.cia402_drive import Cia402Drive
from bridge.sim.core.dictionary import Number
from bridge.sim.generic.adopted import adopt
from bridge.sim.generic.generic_family import objects_of_family


def number(node: Cia402Drive, index: int, sub: int) -> int:
    entry = node.dictionary.find(index, sub)
    assert isinstance(entry, Number) and entry.read
    return entry.read()


def test_it_says_what_the_family_asks_for_in_the_bits_that_count() -> None:
    family = load_family("cia402/velocity")
    rule = IdentityRule(vendor_id=0xACE, product_code=0x1234_0000, product_code_mask=0xFFFF_0000)
    node = Cia402Drive(5)
    before = number(node, 0x1018, 2)
    adopt(node, family.model_copy(update={"identity": rule}), {})
    assert number(node, 0x1018, 1) == 0xACE
    assert number(node, 0x1018, 2) == 0x1234_0000 | before & 0xFFFF


def test_objects_of_its_own_stay_its_own() -> None:
    node = Cia402Drive(5)
    before = node.dictionary.find(0x6083, 0)
    adopt(node, load_family("cia402/velocity"), {(0x6083, 0): 7})
    assert node.dictionary.find(0x6083, 0) is before


def test_what_it_lacks_is_a_variable_with_the_given_value() -> None:
    node = Cia402Drive(5)
    family = load_family("lenze/8400-motec")
    lacks = [one.at for one in objects_of_family(family) if not node.dictionary.has_object(one.at[0])]
    adopt(node, family, {lacks[0]: 1})
    assert number(node, *lacks[0]) == 1
    assert all(node.dictionary.has_object(index) for index, _ in lacks)
