"""Values of a node's outputs as the words that the leg carries, and their safe values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, NamedTuple, Self

from bridge.command.messages.request import Code
from bridge.command.messages.telegram import Refusal, Telegram, not_taken
from bridge.config import NodeTable, SafeValue
from bridge.image import Value
from bridge.image.limits import ValueNotTaken
from bridge.mapping.device_signals import Output
from bridge.mapping.model import Family
from bridge.text import Text

_BITS: Final = 16
_MASK: Final = (1 << _BITS) - 1
ACTIVE: Final = 1
"""Control word of a telegram by which an output is anything but safe; that of one that stops is 0."""


class OutputPlace(NamedTuple):
    """Place of an output: ``span`` words from ``word`` on, the low one first."""

    output: Output
    word: int
    span: int
    safe: int | None
    """Value that it gets when nobody commands it, as an integer; None: it holds its last value."""


class OutputWords:
    """Codec of the outputs of one node, called ``name``. ``held`` are the words that were sent last: the
    values that outputs hold. Words are 16-bit integers."""

    def __init__(self, name: str, outputs: Sequence[Output], on_expiry: Mapping[str, SafeValue]) -> None:
        self._name = name
        self.places: dict[str, OutputPlace] = {}
        word = 0
        for output in outputs:
            span = -(-output.size // _BITS)
            safe = on_expiry.get(output.name, output.on_expiry)
            raw = None if safe == "hold" else output.encode(safe)
            self.places[output.name] = OutputPlace(output, word, span, raw)
            word += span
        self.count = word
        self.held: tuple[int, ...] = self.safe([0] * word)
        self.has_let_go = False
        """They have been stopped by a command since they got values: one that holds has a value, too."""

    @classmethod
    def of(cls, node: NodeTable, family: Family) -> Self:
        """The outputs of a node, safe as the site file says, else its mapping. Drives have none."""
        return cls(node.name, family.output, node.outputs.on_expiry)

    @property
    def all_hold(self) -> bool:
        return all(place.safe is None for place in self.places.values())

    def raw(self, words: Sequence[int], place: OutputPlace) -> int:
        """Integer of the output among these words, without sign."""
        return sum(words[place.word + n] << n * _BITS for n in range(place.span))

    def value(self, words: Sequence[int], place: OutputPlace) -> Value:
        raw, output = self.raw(words, place), place.output
        if output.is_signed and raw >> output.size - 1:
            raw -= 1 << output.size
        return output.decode(raw)

    def put(self, words: list[int], place: OutputPlace, raw: int) -> None:
        for n in range(place.span):
            words[place.word + n] = raw >> n * _BITS & _MASK

    def safe(self, held: Sequence[int]) -> tuple[int, ...]:
        """Words that the outputs get when nobody commands them, after the words ``held``."""
        words = list(held)
        for place in self.places.values():
            if place.safe is not None:
                self.put(words, place, place.safe)
        return tuple(words)

    def take(self, words: tuple[int, ...]) -> None:
        """Take over the values of an owner that are sent: an output that holds keeps these."""
        self.held = words
        self.has_let_go = False

    def hold(self, raw: Mapping[str, int]) -> None:
        """Take over what the node holds: integers without sign, by the name of an output that holds. Outputs
        that somebody has stopped, perhaps while the node was booting, hold nothing."""
        if self.has_let_go:
            return
        words = list(self.held)
        for name, number in raw.items():
            self.put(words, self.places[name], number)
        self.take(tuple(words))

    def let_go(self) -> None:
        """Hold nothing any more: an output that holds its last value gets 0, or the value nearest to it."""
        self.has_let_go = True
        words = list(self.held)
        for place in self.places.values():
            if place.safe is None:
                self.put(words, place, _off(place.output))
        self.held = tuple(words)

    def on_wire(self, words: tuple[int, ...]) -> tuple[int, ...]:
        """Words that outputs get by those of the leg, the control word first."""
        return words[1:] if words[0] & ACTIVE else self.safe(self.held)

    def decode(self, values: Mapping[str, Value], before: tuple[int, ...], held: int) -> Telegram:
        """Words of a telegram; outputs that are not written stay as ``before``, and those that hold as they
        are. A name with a number behind a dot is one bit of an output. A telegram that leaves every output
        safe or as it is stops. Raises ``Refusal``."""
        words = list(before)
        for place in self.places.values():
            if place.safe is None:
                self.put(words, place, self.raw(self.held, place))
        # The whole output first: its bits are written over it.
        for leaf, value in sorted(values.items(), key=lambda item: "." in item[0]):
            name, _, bit = leaf.partition(".")
            place = self.places.get(name)
            if place is None:
                known = ", ".join(self.places)
                said = Text.of("telegram.no_output", node=self._name, leaf=name, known=known)
                raise Refusal(Code.UNKNOWN_POINT, said)
            try:
                raw = self._with_bit(words, place, bit, value) if bit else place.output.encode(value)
            except ValueNotTaken as error:
                raise not_taken(leaf, error, place.output.unit) from None
            self.put(words, place, raw)
        return Telegram(0 if tuple(words) == self.safe(self.held) else ACTIVE, tuple(words))

    def _with_bit(self, words: Sequence[int], place: OutputPlace, bit: str, value: Value) -> int:
        if not bit.isdecimal() or int(bit) >= place.output.size:
            said = Text.of("telegram.no_bit", leaf=f"{place.output.name}.{bit}", bits=place.output.size)
            raise Refusal(Code.OUT_OF_RANGE, said)
        if value not in (0, 1):
            raise ValueNotTaken(Text.of("takes.bool", value=repr(value)))
        mask = 1 << int(bit)
        raw = self.raw(words, place)
        return raw | mask if value else raw & ~mask


def _off(output: Output) -> int:
    """Integer of the value nearest to 0 that the output takes."""
    low, high = output.low, output.high
    value = max(0.0 if low is None else low, min(0.0 if high is None else high, 0.0))
    try:
        return output.encode(value)
    except ValueNotTaken:
        # Its scale has an offset that leaves 0 out.
        return 0
