"""Self-description of the server, in the standard's own address space."""

from __future__ import annotations

import pytest
from asyncua import ua
from asyncua.server.address_space import AddressSpace

from bridge.uaserver.address_space import is_empty
from bridge.uaserver.selfdescription import LOCALES, NOT_DONE, VALUES, describe
from tests.support.standard_space import standard_space

Ids = ua.AttributeIds


@pytest.fixture(scope="module")
def described() -> AddressSpace:
    made = standard_space()
    describe(made, ("en", "de"))
    return made


def node(name: str) -> ua.NodeId:
    return ua.NodeId(getattr(ua.ObjectIds, name))


@pytest.mark.landing
def test_each_value_stands_in_its_node(described: AddressSpace) -> None:
    for name, value in VALUES.items():
        found = described.read_attribute_value(node(name), Ids.Value)
        assert found.Value == value, name
        assert found.StatusCode is None or found.StatusCode.is_good(), name


def test_the_languages_are_those_of_the_texts(described: AddressSpace) -> None:
    assert described.read_attribute_value(node(LOCALES), Ids.Value).Value.Value == ["en", "de"]


def test_what_is_not_done_has_no_value(described: AddressSpace) -> None:
    for name in NOT_DONE:
        found = described.read_attribute_value(node(name), Ids.Value)
        assert found.StatusCode.value == ua.StatusCodes.BadNotSupported, name


def test_nothing_is_good_and_null(described: AddressSpace) -> None:
    for where in list(described.keys()):
        empty = [one for one, held in described[where].attributes.items() if is_empty(held)]
        assert empty == [], where
