"""Bits of a PDO that words stand in: signs, long objects, objects that share a word."""

from __future__ import annotations

import pytest

from bridge.canopen.pdo import PdoEntry
from bridge.dbc.pdo_fields import Field, lay_out
from bridge.node.places.word_map import WordPlace

WORD, LONG, BYTE = PdoEntry(0x6041, 0, 16), PdoEntry(0x6064, 0, 32), PdoEntry(0x2000, 1, 8)
OTHER = PdoEntry(0x2000, 2, 8)


def test_words_follow_each_other_in_the_order_of_the_entries() -> None:
    layout = lay_out((WORD, WORD), (WordPlace(1), WordPlace(0)), frozenset())
    assert layout.words == {1: [Field(0, 16)], 0: [Field(16, 16)]}


def test_a_long_object_has_a_field_in_each_of_its_words() -> None:
    layout = lay_out((WORD, LONG), (WordPlace(0), WordPlace(1, 2)), frozenset())
    assert layout.words[1] == [Field(16, 16)]
    assert layout.words[2] == [Field(32, 16)]


@pytest.mark.parametrize("is_signed", [True, False])
def test_a_short_object_alone_in_its_word_has_its_sign(is_signed: bool) -> None:
    signed = frozenset({(0x2000, 1)}) if is_signed else frozenset[tuple[int, int]]()
    assert lay_out((BYTE,), (WordPlace(0),), signed).words == {0: [Field(0, 8, is_signed)]}


def test_objects_that_share_a_word_and_follow_each_other_are_one_field() -> None:
    layout = lay_out((BYTE, OTHER), (WordPlace(0, 1, 0, 8), WordPlace(0, 1, 8, 8)), frozenset())
    assert layout.words == {0: [Field(0, 16)]}
    apart = lay_out((BYTE, WORD, OTHER), (WordPlace(0, 1, 0, 8), None, WordPlace(0, 1, 8, 8)), frozenset())
    assert apart.words == {0: [Field(0, 8), Field(24, 8, shift=8)]}
    assert apart.others == [(WORD, Field(8, 16))]


def test_a_dummy_takes_its_room_and_is_nothing() -> None:
    layout = lay_out((PdoEntry(0x0005, 0, 8), WORD), (None, WordPlace(0)), frozenset())
    assert layout.words == {0: [Field(8, 16)]}
    assert layout.others == []


def test_fields_join_where_the_second_follows_in_frame_and_word_and_neither_has_a_sign() -> None:
    first = Field(0, 8)
    assert first.then(Field(8, 8, shift=8)) == Field(0, 16)
    assert first.then(Field(16, 8, shift=8)) is None
    assert first.then(Field(8, 8)) is None
    assert first.then(Field(8, 8, True, 8)) is None
    assert Field(0, 8, True).then(Field(8, 8, shift=8)) is None
