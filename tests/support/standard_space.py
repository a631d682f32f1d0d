"""The standard's own address space, which takes a second to make: made once, and copied."""

from __future__ import annotations

import copy
import gc
from functools import cache

from asyncua.server.address_space import AddressSpace, AttributeValue, NodeData, NodeManagementService
from asyncua.server.standard_address_space import standard_address_space


def standard_space() -> AddressSpace:
    """One that nobody else has. Values and references are shared, so they are replaced, not changed."""
    made = AddressSpace()
    for where, held in _filled()._nodes.items():  # pyright: ignore[reportPrivateUsage]
        node = NodeData(held.nodeid)
        node.references = list(held.references)
        node.attributes = {kind: _copied(value) for kind, value in held.attributes.items()}
        node.call = held.call
        made[where] = node
    return made


@cache
def _filled() -> AddressSpace:
    made = AddressSpace()
    standard_address_space.fill_address_space(NodeManagementService(made))
    # A quarter of a million objects that every collection of garbage would look at.
    gc.freeze()
    return made


def _copied(held: AttributeValue) -> AttributeValue:
    made = copy.copy(held)
    made.datachange_callbacks = {}
    return made
