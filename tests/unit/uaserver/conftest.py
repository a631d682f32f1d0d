"""The standard's own address space."""

from __future__ import annotations

import pytest
from asyncua.server.address_space import AddressSpace

from bridge.uaserver.hierarchy import EventTypes
from tests.support.standard_space import standard_space


@pytest.fixture(scope="module")
def space() -> AddressSpace:
    return standard_space()


@pytest.fixture(scope="module")
def types(space: AddressSpace) -> EventTypes:
    found = EventTypes(space)
    found.look()
    return found
