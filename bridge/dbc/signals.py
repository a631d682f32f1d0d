"""The signals of one PDO: values, enumerations and bits where the words have a meaning, else raw words.

Signals of a DBC message must not overlap. So a word that is a value with a unit is that signal alone (its
raw value is the word), and a word with named bits is its bits, in a group with the word's name.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from bridge.canopen.pdo import PdoEntry
from bridge.dbc.model import MessageSignal
from bridge.dbc.object_format import kind_of
from bridge.dbc.pdo_fields import Field, WordLayout
from bridge.drive import ValueCodec
from bridge.eds import Description
from bridge.node.places.word_map import WORD_BITS

Groups = dict[str, tuple[str, ...]]


class PdoSignals:
    """``process`` are the names of all words of the drive, ``bits`` the names of the bits of its control or
    status word, ``codecs`` its values with their scales, ``given`` what the site file says of them,
    ``dictionary`` the device description, if there is one."""

    def __init__(
        self,
        layout: WordLayout,
        process: Sequence[str],
        bits: Sequence[str],
        codecs: Sequence[ValueCodec],
        given: Mapping[str, float],
        dictionary: Description | None = None,
    ) -> None:
        self._layout = layout
        self._process = process
        self._bits = bits
        self._codecs = codecs
        self._given = given
        self._dictionary = dictionary
        self._taken: set[int] = set()
        self.groups: Groups = {}

    def words(self) -> list[MessageSignal]:
        """Every word as the number that it is."""
        found = [signal for place in self._layout.words for signal in self._raw(place)]
        return [*found, *self._others()]

    def values(self) -> list[MessageSignal]:
        """Signals of the values that the words carry."""
        found: list[MessageSignal] = []
        for codec in self._codecs:
            if not codec.model.bits and codec.model.bit is None:
                found += self._value(codec)
        for place in self._layout.words:
            if place not in self._taken:
                found += self._bits_of(place) or self._raw(place)
        return [*found, *self._others()]

    def _field(self, places: Sequence[int]) -> Field | None:
        """All the words of a value as one field, where they are one."""
        fields: list[Field] = []
        for number, place in enumerate(places):
            parts = self._layout.words.get(place, [])
            is_last = number == len(places) - 1
            if len(parts) != 1 or parts[0].shift or (parts[0].length < WORD_BITS and not is_last):
                return None
            fields += parts
        first = fields[0]
        if any(field.start != first.start + n * WORD_BITS for n, field in enumerate(fields)):
            return None
        return Field(first.start, sum(field.length for field in fields), any(f.is_signed for f in fields))

    def _value(self, codec: ValueCodec) -> Iterator[MessageSignal]:
        field = self._field(codec.places)
        if field is None or not self._taken.isdisjoint(codec.places):
            return
        self._taken.update(codec.places)
        model = codec.model
        low, high = codec.range
        yield MessageSignal(
            model.name,
            field.start,
            field.length,
            # A shorter object fills its word with zeros, unless the mapping file says that it has a sign.
            field.is_signed or (field.length % WORD_BITS == 0 and model.is_signed),
            codec.scale.full / codec.scale.at if codec.scale else 1.0,
            codec.scale.offset if codec.scale else 0.0,
            low,
            high,
            "" if codec.is_unknown else model.unit,
            model.is_real,
            model.states,
            self._comment(codec),
        )

    def _comment(self, codec: ValueCodec) -> str:
        model = codec.model
        said = [f"{model.leaf}: {model.description}" if model.description else model.leaf]
        scale = model.scale
        if scale is not None and scale.full is not None:
            full = self._given.get(scale.full)
            if full is None:
                said.append(
                    f"the number on the wire, to be multiplied by {scale.full} / {scale.at}: {scale.full} is "
                    "read from the drive; give it in the site file's parameters to have it here"
                )
            else:
                said.append(
                    f"{scale.full} / {scale.at} with {scale.full} = {full:g} by the site file; "
                    "where the bridge reads another one from the drive, that counts"
                )
        shared = [
            f"{other.model.leaf} is bit {other.model.bit}"
            for other in self._codecs
            if other.model.bit is not None and other.places[0] in codec.places
        ]
        return "; ".join([*said, *shared])

    def _bits_of(self, place: int) -> list[MessageSignal]:
        """A word as its bits; empty where none has a name."""
        named = self._bit_names(place)
        found: list[MessageSignal] = []
        for part in self._layout.words[place]:
            for offset in range(part.length):
                bit = part.shift + offset
                if bit in named:
                    name, comment = named[bit]
                    found.append(MessageSignal(name, part.start + offset, 1, low=0, high=1, comment=comment))
        if found:
            self.groups[self._process[place]] = tuple(signal.name for signal in found)
        return found

    def _bit_names(self, place: int) -> dict[int, tuple[str, str]]:
        """Name and comment of each bit of a word: a value of its own, a bit of one, or of the word."""
        word = self._process[place]
        names = {
            bit: (f"{word}_{name or f'bit_{bit}'}", f"bit {bit} of {word}")
            for bit, name in enumerate(self._bits if place == 0 else ())
        }
        for model, places in ((codec.model, codec.places) for codec in self._codecs):
            if place not in places:
                continue
            first = places.index(place) * WORD_BITS
            for bit, name in enumerate(model.bits[first : first + WORD_BITS]):
                names[bit] = (f"{model.name}_{name or f'bit_{bit}'}", f"bit {first + bit} of {model.leaf}")
            if model.bit is not None:
                names[model.bit] = (model.name, f"{model.leaf}: {model.description}".rstrip(": "))
        return names

    def _raw(self, place: int) -> list[MessageSignal]:
        word = self._process[place]
        group = "command" if self._process[0] == "control_word" else "status" if place == 0 else "actual"
        parts = self._layout.words[place]
        whole = len(parts) == 1 and not parts[0].shift
        return [
            MessageSignal(
                word if whole else f"{word}_{part.shift}",
                part.start,
                part.length,
                part.is_signed,
                comment=f"{group}/{word}" + ("" if whole else f" from bit {part.shift} on"),
            )
            for part in parts
        ]

    def _others(self) -> list[MessageSignal]:
        return [self._other(entry, field) for entry, field in self._layout.others]

    def _other(self, entry: PdoEntry, field: Field) -> MessageSignal:
        kind = kind_of(self._dictionary, entry.index, entry.sub, field.length)
        title = f" {kind.title}" if kind.title else ""
        return MessageSignal(
            f"object_{entry.index:04x}_{entry.sub:02x}",
            field.start,
            field.length,
            field.is_signed or kind.is_signed,
            is_float=kind.is_float,
            comment=f"{entry.index:04X}h:{entry.sub:02X}{title}, no word that the mapping file knows",
        )
