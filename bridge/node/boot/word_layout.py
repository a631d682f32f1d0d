"""Assignment of mapped objects to words, by the layouts in the mapping file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from typing import NamedTuple

from bridge.canopen.pdo import PdoEntry
from bridge.mapping.entry_types import ObjectRef
from bridge.mapping.model import MappedObject, Pdo
from bridge.node.places.word_map import WORD_BITS, WordPlace
from bridge.text import Text

Layouts = Mapping[int, Sequence[MappedObject]]
"""Objects that may stand for each word, by the word's index; those at one position belong together."""
_Object = tuple[int, int]


def layouts(pdos: Sequence[Pdo], words: Sequence[Sequence[str]], process: Sequence[str]) -> Layouts:
    """Objects that may stand for each word of a drive. ``words`` has the word names of each PDO."""
    return {
        process.index(name): refs
        for pdo, names in zip(pdos, words, strict=True)
        for name, refs in zip(names, pdo.objects, strict=True)
    }


def factory_entries(pdo: Pdo) -> tuple[PdoEntry, ...]:
    """Mapping by the mapping file. An object that is named for several words in a row fills them all."""
    entries: list[PdoEntry] = []
    before: MappedObject | None = None
    for refs in pdo.objects:
        first = refs[0]
        if before is not None and before.parts == first.parts and not first.is_composite:
            last = entries[-1]
            if not first.bits[0]:
                entries[-1] = PdoEntry(last.index, last.sub, last.bits + WORD_BITS)
        else:
            for part, bits in zip(first.parts, first.lengths, strict=True):
                entries.append(PdoEntry(part.index, part.sub, bits))
        before = first
    return tuple(entries)


def match_words(entries: Sequence[PdoEntry], known: Layouts) -> tuple[WordPlace | None, ...]:
    """Place of each entry, by the layout in the mapping file that explains the most of them; None where it
    explains none."""
    best: tuple[WordPlace | None, ...] = (None,) * len(entries)
    for layout in range(max((len(refs) for refs in known.values()), default=0)):
        places = _places(known, layout)
        found = tuple(places.get((entry.index, entry.sub)) for entry in entries)
        if best.count(None) > found.count(None):
            best = found
    return best


def _places(known: Layouts, layout: int) -> dict[_Object, WordPlace]:
    places: dict[_Object, WordPlace] = {}
    for word in sorted(known):
        refs = known[word]
        mapped = refs[min(layout, len(refs) - 1)]
        shift = 0
        for part, bits in zip(mapped.parts, mapped.lengths, strict=True):
            key = (part.index, part.sub)
            first = places.get(key)
            if mapped.is_composite:
                places.setdefault(key, WordPlace(word, 1, shift, bits))
                shift += bits
            elif first is None:
                places[key] = WordPlace(word)
            elif first.word + first.span == word:
                # An object that fills several words begins with the first.
                places[key] = first._replace(span=first.span + 1)
    return places


class Missing(NamedTuple):
    """Part of a word made from several objects, and the bits that no object fills."""

    part: ObjectRef
    mask: int


def missing_parts(refs: Sequence[MappedObject], mapped: Set[_Object]) -> list[Missing]:
    """Missing parts of this word, by the layout that lacks least; none where no object of it is mapped."""
    found: list[list[Missing]] = []
    for ref in refs:
        lacks: list[Missing] = []
        shift = 0
        for part, bits in zip(ref.parts, ref.lengths, strict=True):
            if (part.index, part.sub) not in mapped:
                lacks.append(Missing(part, ((1 << bits) - 1) << shift))
            shift += bits
        if len(lacks) < len(ref.parts):
            found.append(lacks)
    return min(found, key=len) if found else []


def differences(
    entries: Sequence[PdoEntry], expected: Sequence[PdoEntry], places: Sequence[WordPlace | None]
) -> list[Text]:
    """Differences of the node's mapping from the mapping file, entry by entry."""
    told: list[Text] = []
    bits = {(entry.index, entry.sub): entry.bits for entry in expected}
    for entry, place in zip(entries, places, strict=True):
        wants = bits.get((entry.index, entry.sub))
        if place is None and not entry.is_dummy:
            told.append(Text.of("boot.no_word", entry=str(entry)))
        elif wants is not None and wants != entry.bits:
            told.append(Text.of("boot.other_bits", entry=str(entry), bits=wants))
    return told
