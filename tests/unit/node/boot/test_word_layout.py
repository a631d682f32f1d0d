"""Mapped objects and the words of a drive: layouts of a mapping file, parts of a word, differences."""

from __future__ import annotations

from bridge.canopen.pdo import PdoEntry
from bridge.mapping.model import Pdo
from bridge.node.boot.word_layout import (
    Missing,
    differences,
    factory_entries,
    layouts,
    match_words,
    missing_parts,
)
from bridge.node.places.word_map import WordPlace
from bridge.text import render


def pdo(*objects: list[str], words: list[str] | None = None) -> Pdo:
    keys = {"number": 1, "cob_id": 0x200, "objects": list(objects)}
    return Pdo.model_validate({**keys, **({} if words is None else {"words": words})})


def entries(*texts: tuple[int, int, int]) -> tuple[PdoEntry, ...]:
    return tuple(PdoEntry(*text) for text in texts)


NAMES = ("control_word", "speed", "position", "position_high")
ONE = pdo(["6040:00"], ["6042:00"])
LONG = pdo(["6040:00"], ["607A:00"], ["607A:00"])
SHARED = pdo(["6040:00"], ["2000:01/8+2000:02/8"])
KNOWN = layouts([ONE], [["control_word", "speed"]], NAMES)


def test_words_stand_by_their_places_among_the_process_data() -> None:
    two = pdo(["607A:00"], ["607A:00"])
    known = layouts([ONE, two], [["control_word", "speed"], ["position", "position_high"]], NAMES)
    assert sorted(known) == [0, 1, 2, 3]
    assert known[2] == two.objects[0]


def test_a_factory_mapping_has_16_bits_for_each_word_and_one_object_for_several() -> None:
    assert factory_entries(ONE) == entries((0x6040, 0, 16), (0x6042, 0, 16))
    assert factory_entries(LONG) == entries((0x6040, 0, 16), (0x607A, 0, 32))


def test_the_parts_of_a_word_are_mapped_one_after_the_other() -> None:
    assert factory_entries(SHARED) == entries((0x6040, 0, 16), (0x2000, 1, 8), (0x2000, 2, 8))


def test_an_entry_has_the_place_of_its_word_and_others_have_none() -> None:
    found = match_words(entries((0x6042, 0, 16), (0x2345, 0, 16), (0x6040, 0, 16)), KNOWN)
    assert found == (WordPlace(1), None, WordPlace(0))


def test_an_object_of_several_words_begins_with_the_first() -> None:
    known = layouts([LONG], [["control_word", "position", "position_high"]], NAMES)
    assert match_words(entries((0x607A, 0, 32)), known) == (WordPlace(2, 2),)


def test_parts_share_the_word_from_its_low_bit_on() -> None:
    known = layouts([SHARED], [["control_word", "speed"]], NAMES)
    assert match_words(entries((0x2000, 2, 8), (0x2000, 1, 8)), known) == (
        WordPlace(1, 1, 8, 8),
        WordPlace(1, 1, 0, 8),
    )


def test_the_layout_counts_that_explains_the_most() -> None:
    either = pdo(["6040:00", "2000:01"], ["6042:00", "2000:02"])
    known = layouts([either], [["control_word", "speed"]], NAMES)
    assert match_words(entries((0x2000, 1, 16), (0x2000, 2, 16)), known) == (WordPlace(0), WordPlace(1))
    assert match_words(entries((0x6040, 0, 16), (0x2000, 2, 16)), known) == (WordPlace(0), None)
    assert match_words((), known) == ()


def test_a_word_lacks_the_bits_that_no_object_fills() -> None:
    refs = SHARED.objects[1]
    (part,) = missing_parts(refs, {(0x2000, 1)})
    assert part == Missing(refs[0].parts[1], 0xFF00)
    assert missing_parts(refs, {(0x2000, 1), (0x2000, 2)}) == []
    assert missing_parts(refs, set()) == [], "none of it is mapped: the word is not there at all"


def test_what_the_node_has_otherwise_is_told_entry_by_entry() -> None:
    have = entries((0x6040, 0, 16), (0x6042, 0, 32), (0x2345, 1, 8), (0x0005, 0, 8))
    told = differences(have, factory_entries(ONE), (WordPlace(0), WordPlace(1), None, None))
    assert [*map(render, told)] == [
        "6042:00/32 has 16 bits in the mapping file",
        "2345:01/8 is no word that the mapping file knows",
    ]
