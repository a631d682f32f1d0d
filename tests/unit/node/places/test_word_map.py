"""Entries of a PDO and the 16-bit words of a drive: signs, long objects, several objects in one word."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.canopen.pdo import PdoEntry
from bridge.node.places.word_map import WordMap, WordPlace

CONTROL, SPEED, POSITION = PdoEntry(0x6040, 0, 16), PdoEntry(0x6042, 0, 16), PdoEntry(0x607A, 0, 32)


def unpacked(word_map: WordMap, values: list[int], words: int) -> list[int]:
    found = [0] * words
    word_map.unpack(values, found)
    return found


def test_words_stand_as_they_are_and_a_sign_is_their_top_bit() -> None:
    word_map = WordMap((CONTROL, SPEED), (WordPlace(0), WordPlace(1)), 2)
    assert unpacked(word_map, [0x047F, -1], 2) == [0x047F, 0xFFFF]
    assert word_map.pack([0x047F, 0xFFFF]) == [0x047F, 0xFFFF]
    assert word_map.in_order == 2


def test_a_long_object_fills_several_words_the_low_one_first() -> None:
    word_map = WordMap((POSITION,), (WordPlace(1, 2),), 3)
    assert unpacked(word_map, [0x12345678], 3) == [0, 0x5678, 0x1234]
    assert word_map.pack([9, 0x5678, 0x1234]) == [0x12345678]
    assert word_map.in_order == 0
    assert unpacked(word_map, [-2], 3) == [0, 0xFFFE, 0xFFFF]


def test_what_is_not_known_or_lies_beyond_the_words_is_left_out() -> None:
    word_map = WordMap((CONTROL, SPEED, POSITION), (None, WordPlace(2), WordPlace(1, 2)), 2)
    assert unpacked(word_map, [1, 2, 0x12345678], 2) == [0, 0x5678]
    assert word_map.pack([7, 8]) == [0, 0, 8]


def test_a_dummy_is_no_word() -> None:
    word_map = WordMap((PdoEntry(0x0005, 0, 8),), (WordPlace(0),), 1)
    assert unpacked(word_map, [255], 1) == [0]
    assert word_map.pack([0xFFFF]) == [0]


def test_several_objects_share_a_word() -> None:
    mode, valve = PdoEntry(0x6060, 0, 8), PdoEntry(0x2000, 1, 8)
    word_map = WordMap((mode, valve), (WordPlace(0, 1, 0, 8), WordPlace(0, 1, 8, 8)), 1)
    assert unpacked(word_map, [-1, 3], 1) == [0x03FF]
    assert word_map.pack([0x03FF]) == [0xFF, 3]
    found = [0xFFFF]
    word_map.unpack([1, 0], found)
    assert found == [1], "what was in the word before is gone"


def test_words_in_another_order_are_not_taken_as_they_are() -> None:
    assert WordMap((CONTROL, SPEED), (WordPlace(1), WordPlace(0)), 2).in_order == 0
    assert WordMap((SPEED,), (WordPlace(1),), 2).in_order == 0


@given(st.permutations(range(4)), st.lists(st.integers(0, 0xFFFF), min_size=4, max_size=4))
def test_what_is_packed_is_unpacked(order: list[int], words: list[int]) -> None:
    entries = [PdoEntry(0x2000 + number, 0, 16) for number in range(4)]
    word_map = WordMap(entries, [WordPlace(word) for word in order], 4)
    assert unpacked(word_map, word_map.pack(words), 4) == words


@pytest.mark.parametrize("words", [2, 3])
def test_a_long_object_at_the_end_is_cut(words: int) -> None:
    word_map = WordMap((PdoEntry(0x2000, 0, 64),), (WordPlace(1, 4),), words)
    assert unpacked(word_map, [0x4444_3333_2222_1111], words) == [0, 0x1111, 0x2222][:words]
