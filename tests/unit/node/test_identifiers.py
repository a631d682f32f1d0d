"""Identifiers of the nodes of one bus, as one node asks for those of the others."""

from __future__ import annotations

from bridge.node.identifiers import BusIdentifiers


class Node:
    def __init__(self, used: int, given: int) -> None:
        self.used = used
        self.given_ids = frozenset({given})

    def uses(self, cob_id: int) -> bool:
        return cob_id == self.used


def bus(*nodes: Node) -> BusIdentifiers:
    identifiers = BusIdentifiers()
    for node in nodes:
        identifiers.add(node)
    return identifiers


def test_what_another_node_uses_is_taken_and_foreign() -> None:
    first, second = Node(0x181, 0x201), Node(0x182, 0x202)
    identifiers = bus(first, second)
    assert identifiers.is_taken(first, 0x182)
    assert identifiers.is_foreign(first, 0x182)


def test_what_the_files_give_to_another_node_is_foreign_though_nobody_uses_it() -> None:
    first, second = Node(0x181, 0x201), Node(0x182, 0x202)
    identifiers = bus(first, second)
    assert not identifiers.is_taken(first, 0x202)
    assert identifiers.is_foreign(first, 0x202)


def test_its_own_identifiers_are_nobody_elses() -> None:
    first, second = Node(0x181, 0x201), Node(0x182, 0x202)
    identifiers = bus(first, second)
    for cob_id in (0x181, 0x201, 0x080):
        assert not identifiers.is_taken(first, cob_id)
        assert not identifiers.is_foreign(first, cob_id)
