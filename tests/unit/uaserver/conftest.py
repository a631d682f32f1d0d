"""The standard's own address space."""

from __future__ import annotations

import pytest
from asyncua.server.address_space import AddressSpace, NodeManagementService
from asyncua.server.standard_address_space import standard_address_space

from bridge.uaserver.hierarchy import EventTypes


@pytest.fixture(scope="module")
def space() -> AddressSpace:
    made = AddressSpace()
    standard_address_space.fill_address_space(NodeManagementService(made))
    return made


@pytest.fixture(scope="module")
def types(space: AddressSpace) -> EventTypes:
    found = EventTypes(space)
    found.look()
    return found
