"""Process data of a site's drives, for a listener: words by name, state, values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from bridge.canopen.decode_sdo import Value
from bridge.canopen.pdo import PdoCodec
from bridge.config import NodeTable
from bridge.drive import ParameterSet, StatusWords, ValueCodec, default_codecs
from bridge.mapping.model import Family, Pdo, Slot
from bridge.node.boot import factory_entries, layouts, match_words
from bridge.node.places.word_map import WordMap

_DIGITS: Final = 6


@dataclass(frozen=True, slots=True)
class PdoView:
    """One PDO of a configured drive, as its mapping file has it. ``words`` are the places and names of the
    words that it carries, ``states`` decodes the status word, where it has that."""

    node_id: int
    label: str
    words: tuple[tuple[int, str], ...]
    ends: tuple[int, ...]
    """Bits of the frame up to which each of the words is complete."""
    places: int
    codec: PdoCodec
    map: WordMap
    states: StatusWords | None
    values: tuple[ValueCodec, ...]
    set: ParameterSet
    of_set: frozenset[str]
    """Values whose scale is known of parameter set 1 alone."""

    def said(self, data: bytes) -> tuple[str, tuple[tuple[str, Value | float], ...]]:
        """Sentence and values by name for the data of a frame. Data of any length is taken as far as it
        goes."""
        length = self.codec.length
        words = [0] * self.places
        self.map.unpack(self.codec.unpack(data[:length].ljust(length, b"\0")), words)
        there = {
            place: name
            for (place, name), end in zip(self.words, self.ends, strict=True)
            if end <= 8 * len(data)
        }
        parts = {place: f"{name} {words[place]:04X}h" for place, name in there.items()}
        values: list[tuple[str, Value | float]] = [(name, words[place]) for place, name in there.items()]
        if self.states and 0 in there:
            state = self.states.state(words[0]).label
            parts[0] += f" {state.replace('_', ' ')}"
            values.append(("state", state))
        is_other_set = 0 in there and words[0] & self.set.mask
        for codec in self.values:
            if is_other_set and codec.model.name in self.of_set:
                continue
            if there.keys() >= set(codec.places):
                value = codec.from_words(words)
                value = round(value, _DIGITS) if isinstance(value, float) else value
                parts[codec.places[0]] += f" ({_said(codec, value)})"
                values.append((codec.model.name, value))
        sentence = list(parts.values())
        if len(data) != length:
            sentence.append(f"{len(data)} bytes instead of {length}")
        return ", ".join(sentence), tuple(values)


def _said(codec: ValueCodec, value: float) -> str:
    model = codec.model
    shown = str(value).lower() if isinstance(value, bool) else f"{value:g}"
    text = model.states.get(int(value), "") if model.states else model.unit
    return f"{model.name} {shown} {text}".rstrip()


def views(node: NodeTable, family: Family) -> Mapping[int, PdoView]:
    """The PDOs of a node's drives by COB-ID, those of its family that the site leaves out included."""
    found: dict[int, PdoView] = {}
    tables = {drive.slot: drive for drive in node.drive}
    for slot in family.slot:
        drive = tables.get(slot.name)
        leaf = (drive.name if drive else None) or (slot.name if len(family.slot) > 1 else "drive")
        where = f"{node.name}/{leaf}"
        scales = drive.parameters if drive else {}
        for pdo in slot.rpdo:
            label = f"RPDO{pdo.number} {where}"
            found[pdo.cob_id + node.id] = _view(node.id, label, family, slot, pdo, "command", scales)
        for pdo in slot.tpdo:
            label = f"TPDO{pdo.number} {where}"
            found[pdo.cob_id + node.id] = _view(node.id, label, family, slot, pdo, "actual", scales)
    return found


def _view(
    node_id: int, label: str, family: Family, slot: Slot, pdo: Pdo, group: str, scales: Mapping[str, float]
) -> PdoView:
    is_command = group == "command"
    process = family.process.rpdo if is_command else family.process.tpdo
    names = family.rpdo_words(pdo) if is_command else family.tpdo_words(pdo)
    entries = factory_entries(pdo)
    places = match_words(entries, layouts([pdo], [names], process))
    codec = PdoCodec(entries, {(ref.index, ref.sub) for ref in pdo.signed})
    whole: dict[int, int] = {}
    begin = 0
    for entry, place in zip(entries, places, strict=True):
        for part in range(place.span if place else 0):
            if place:
                whole[place.word + part] = begin + min(entry.bits, 16 * (part + 1))
        begin += entry.bits
    words = tuple((process.index(name), name) for name in names)
    states = None if is_command else StatusWords(family.status_word)
    return PdoView(
        node_id,
        label,
        words,
        tuple(whole[place] for place, _ in words),
        len(process),
        codec,
        WordMap(entries, places, len(process)),
        states,
        # A monitor asks no drive for the parameters that scale the others.
        tuple(one for one in default_codecs(family, slot, group, process, scales) if not one.is_unknown),
        ParameterSet((family.control_word if is_command else family.status_word).parameter_set_bits),
        frozenset(
            one.name
            for one in family.value
            if one.group == group and (one.is_conditional or family.depends_on_set(one))
        ),
    )
