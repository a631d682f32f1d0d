"""Types and their subtypes in the address space, which no longer changes once clients are let in."""

from __future__ import annotations

from collections.abc import Iterator

from asyncua.server.address_space import AddressSpace

from bridge.northbound.opcua.library import ObjectIds, get, node_id, ua


def related(
    space: AddressSpace, start: ua.NodeId, reference: int, *, forward: bool = True
) -> Iterator[ua.ReferenceDescription]:
    """The references of exactly this type that leave ``start``, or lead to it."""
    node = space.get(start)
    wanted = node_id(reference)
    for found in node.references if node else ():
        if get(found, "IsForward") == forward and get(found, "ReferenceTypeId") == wanted:
            yield found


def subtypes(space: AddressSpace, root: ua.NodeId) -> set[ua.NodeId]:
    """``root`` and every type below it."""
    found = {root}
    waiting = [root]
    while waiting:
        for reference in related(space, waiting.pop(), ObjectIds.HasSubtype):
            below: ua.NodeId = get(reference, "NodeId")
            if below not in found:
                found.add(below)
                waiting.append(below)
    return found


def supertypes(space: AddressSpace, start: ua.NodeId) -> list[ua.NodeId]:
    """``start`` and every type above it, upwards."""
    found = [start]
    while above := next(related(space, found[-1], ObjectIds.HasSubtype, forward=False), None):
        where: ua.NodeId = get(above, "NodeId")
        if where in found:
            break
        found.append(where)
    return found
