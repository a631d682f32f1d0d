"""One PDO as a boot-up has found it: which words of its drive it carries, whole or in part."""

from __future__ import annotations

from bridge.canopen.pdo import PdoCodec, PdoEntry
from bridge.node.boot.pdo_plan import PdoPlan
from bridge.node.places.word_map import WordPlace

SIXTEEN, LONG, SHORT = PdoEntry(0x6040, 0, 16), PdoEntry(0x607A, 0, 32), PdoEntry(0x6060, 0, 8)


def plan(entries: tuple[PdoEntry, ...], places: tuple[WordPlace | None, ...]) -> PdoPlan:
    return PdoPlan(0x185, 255, 0, PdoCodec(entries), places)


def test_a_word_is_carried_wherever_its_object_stands() -> None:
    assert plan((SIXTEEN, SIXTEEN), (WordPlace(3), WordPlace(0))).words == {0, 3}


def test_an_object_of_32_bits_carries_two_words() -> None:
    assert plan((LONG,), (WordPlace(1, 2),)).words == {1, 2}


def test_what_is_not_known_carries_none_and_a_part_carries_its_word() -> None:
    assert plan((SIXTEEN, SHORT), (None, WordPlace(4, 1, 8, 8))).words == {4}


def test_a_pdo_may_be_asked_for_unless_the_node_says_otherwise() -> None:
    """CiA 301 §7.5.2.37: bit 30 of the COB-ID is 0 where a remote frame is allowed."""
    assert plan((), ()).remote_allowed
