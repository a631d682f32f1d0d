"""Setpoints in force whose word means another value since somebody has changed a parameter of the drive."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from bridge.drive import ValueCodec
from bridge.text import Said, Text


class InForce(NamedTuple):
    """One scaled command: the places of its words, the words that are held, and the value that they mean."""

    places: tuple[int, ...]
    words: tuple[int, ...]
    value: float
    unit: str

    @property
    def text(self) -> str:
        return f"{self.value:g} {self.unit}".rstrip()


class SetpointDoubts:
    """Commands in doubt. The word stays, for the drive acts on it, but nobody has asked for its new value: a
    point is in doubt until its command is written anew, or another word has taken its place."""

    def __init__(self) -> None:
        self._doubts: dict[str, tuple[InForce, Text]] = {}

    def note(self, name: str, before: InForce, after: InForce) -> Said:
        """Note that command ``name`` means another value; gives the doubt, empty where nobody would
        notice."""
        if before.words != after.words or before.value == after.value:
            return ""
        first = self._doubts.get(name)
        written = first[0] if first and first[0].words == after.words else before
        why = Text.of("meaning.means_otherwise", written=written.text, now=after.text)
        self._doubts[name] = (written, why)
        return why

    def why(self, name: str, setpoints: Sequence[int]) -> Said:
        """Reason why a command is in doubt, with these words in force; empty where it is not."""
        if not self._doubts or name not in self._doubts:
            return ""
        written, why = self._doubts[name]
        return why if words_of(written.places, setpoints) == written.words else ""

    def has_any(self, setpoints: Sequence[int]) -> bool:
        """Whether a command is in doubt with these words in force."""
        return any(self.why(name, setpoints) for name in self._doubts)

    def forget(self, names: Iterable[str], written: Iterable[int]) -> None:
        """Forget doubts about these commands and those of the words at these places, now written anew."""
        if not self._doubts:
            return
        names, places = set(names), set(written)
        gone = [
            name
            for name, (one, _) in self._doubts.items()
            if name in names or not places.isdisjoint(one.places)
        ]
        for name in gone:
            del self._doubts[name]


def words_of(places: Iterable[int], setpoints: Sequence[int]) -> tuple[int, ...]:
    return tuple(setpoints[place] for place in places)


def in_force(codec: ValueCodec, setpoints: Sequence[int]) -> InForce:
    """Command that has a place, as it is in force with these words."""
    value = codec.from_words(setpoints)
    return InForce(codec.places, words_of(codec.places, setpoints), float(value), codec.model.unit)
