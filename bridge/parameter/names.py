"""Names of parameters by the vendors, and the objects that hold them, by the rules of the mapping file.

``P102``, ``P102[2].3``, ``C00039/1``, ``E08``, ``2066:01`` and the names of points (``p102_2_3``) all lead
to an ``ParameterEntry``. A name that fits the vendor's pattern is taken whether or not the file lists it.
"""

from __future__ import annotations

import difflib
import re
import string
from collections.abc import Iterator
from typing import Final

from bridge.mapping.model import Family, ObjectRef, Parameter
from bridge.mapping.parameters import indices, object_of
from bridge.parameter.definition import ParameterEntry
from bridge.parameter.error import ParameterError, Why
from bridge.parameter.protection import Protection
from bridge.text import Text

_OBJECT: Final = re.compile(r"(?:0x)?([0-9a-f]{4})h?:(?:0x)?([0-9a-f]{1,2})h?", re.IGNORECASE | re.ASCII)
_SPELLINGS: Final = (
    "{name}[{element}].{set}", "{name}[{element}]", "{name}.{set}", "{name}/{element}", "{name}.{element}",
)  # fmt: skip
"""Spellings of elements and sets by the vendors; the one that the family's own pattern reads is used."""
_PUNCTUATION: Final = re.compile(r"[^0-9A-Za-z]+$")
_NEAREST: Final = 3
_MOST_SUB: Final = 0xFF
_MOST_NUMBER: Final = 99_999


class Names:
    """The parameters of one drive family by name, at the objects of the axis that the family is of
    (``Family.of_axis``). ``definitions`` are in the order of the file.

    Raises ValueError where a listed parameter has no object; the mapping's own checks find that first.
    """

    def __init__(self, family: Family) -> None:
        rule = self._rule = family.parameter_names
        self._pattern = re.compile(rule.pattern, re.IGNORECASE | re.ASCII) if rule else None
        self._first = rule.element_first if rule else 1
        self._family = family
        self.definitions = tuple(_as_read(parameter) for parameter in family.parameter)
        self._by_name = {definition.name.upper(): definition for definition in self.definitions}
        self._by_leaf: dict[str, ParameterEntry] = {}
        self._by_address: dict[ObjectRef, ParameterEntry] = {}
        for entry in self.entries():
            self._by_leaf.setdefault(entry.leaf, entry)
            self._by_address.setdefault(entry.address, entry)
        for definition in self.definitions:
            # Without element and set it is the first of each.
            self._by_leaf.setdefault(definition.leaf, self._entry(definition, None, None))

        self.protection = Protection(
            family, [(self._entry(one, None, None).address.index, one) for one in self.definitions]
        )

    def resolve(self, text: str) -> ParameterEntry:
        """The entry that ``text`` means. Raises ``ParameterError`` with the nearest names."""
        wanted = text.strip()
        match = _OBJECT.fullmatch(wanted)
        if match:
            address = self._family.place(ObjectRef(int(match[1], 16), int(match[2], 16)))
            return self._by_address.get(address) or ParameterEntry(str(address), address)
        definition = self._by_name.get(wanted.upper())
        if definition is not None:
            return self._entry(definition, None, None)
        found = self._by_pattern(wanted) or self._by_leaf.get(wanted.lower())
        if found is None:
            said = Text.of("parameter.unknown", name=text, hints=self.hints(wanted))
            raise ParameterError(Why.UNKNOWN_NAME, said)
        return found

    def entries(self) -> Iterator[ParameterEntry]:
        """Every value that the file lists: each element in each set."""
        for definition in self.definitions:
            for element in self._elements(definition):
                for number in range(1, definition.sets + 1) if definition.sets else (None,):
                    yield self._entry(definition, element, number)

    def points(self) -> Iterator[ParameterEntry]:
        """Every value that is shown as a point: each element, of the first set."""
        for definition in self.definitions:
            if definition.point and definition.readable:
                for element in self._elements(definition):
                    yield self._entry(definition, element, None)

    @property
    def settings(self) -> list[int]:
        """The indices among which the drive keeps its settings, whether or not the file lists them."""
        spans = self._rule.settings if self._rule else []
        return [index for span in spans for index in indices(span)]

    @property
    def widest_gap(self) -> int:
        """So many sub-indices of an object in turn may be missing before one that is there: an array
        without sets has its elements that far apart."""
        return max(1, abs(self._rule.element_step)) if self._rule else 1

    def at(self, address: ObjectRef) -> ParameterEntry:
        """The entry at ``address``, by the vendor's name where that leads back to it."""
        if listed := self._by_address.get(address):
            return listed
        name = self._vendors(address)
        try:
            leads_back = bool(name) and self.resolve(name).address == address
        except ParameterError:
            # Such as P120.2, where the file has P120 without parameter sets.
            leads_back = False
        return ParameterEntry(name if leads_back else str(address), address)

    def _vendors(self, address: ObjectRef) -> str:
        """Spelling of ``address`` by the vendor, in the shape of the family's example; empty if there is
        none."""
        rule = self._rule
        shape = re.match(r"([A-Z])(\d+)", rule.example) if rule else None
        if rule is None or shape is None or rule.hexadecimal or not rule.number_step:
            return ""
        letters = string.ascii_uppercase if rule.letter_step else shape[1]
        for letter in letters:
            offset = rule.letter_step * (ord(letter) - ord("A"))
            number, rest = divmod(address.index - rule.index - offset, rule.number_step)
            if rest or not 0 <= number <= _MOST_NUMBER:
                continue
            for name in self._candidates(f"{letter}{number:0{len(shape[2])}}", address.sub):
                try:
                    if self._family.place(object_of(rule, name)) == address:
                        return name
                except ValueError:
                    continue
        return ""

    def _candidates(self, name: str, sub: int) -> Iterator[str]:
        """The names under ``name`` that may stand for the sub-index, the shortest first."""
        yield name
        rule = self._rule
        if rule is None:
            return
        in_set = range(1, abs(rule.element_step) + 1) if rule.set_step else (None,)
        for number in in_set:
            left = sub - rule.sub - rule.set_step * (number or 0)
            place, rest = divmod(left, rule.element_step or 1)
            if rest or place < 0:
                continue
            if number is not None and not place:
                yield self._spelled(name, None, number)
            yield self._spelled(name, place + rule.element_first, number)

    def hints(self, text: str) -> tuple[Text, ...]:
        """The nearest names and how names look."""
        names = {definition.name.upper(): definition.name for definition in self.definitions}
        near = difflib.get_close_matches(text.upper(), names, _NEAREST, 0.5)
        parts = [Text.of("parameter_name.near", names=tuple(names[name] for name in near))] if near else []
        if self._rule:
            parts.append(Text.of("parameter_name.example", example=self._rule.example))
        return (*parts, Text.of("parameter_name.object"))

    def set_hints(self, name: str) -> tuple[Text, ...]:
        """Hint on how to write a parameter that the file does not list, where each parameter set has its
        own; none elsewhere."""
        if self._rule is None or not self._rule.set_step or self._pattern is None:
            return ()
        example = f"{name}.1"
        return (Text.of("parameter_name.of_set", example=example),) * bool(self._pattern.fullmatch(example))

    def _elements(self, definition: Parameter) -> range | tuple[None]:
        return range(self._first, self._first + definition.elements) if definition.elements else (None,)

    def _by_pattern(self, text: str) -> ParameterEntry | None:
        match = self._pattern.fullmatch(text) if self._pattern else None
        if match is None or self._rule is None:
            return None
        parts = match.groupdict()
        element, number = _number(parts.get("element")), _number(parts.get("set"))
        begins = [match.start(group) for group in ("element", "set") if parts.get(group) is not None]
        name = _PUNCTUATION.sub("", text[: min(begins)]).upper() if begins else ""
        definition = self._by_name.get(name)
        if definition is not None:
            self._check(definition, element, number)
            return self._entry(definition, element, number)
        try:
            found = self._family.place(object_of(self._rule, text.upper()))
        except ValueError:
            return None
        listed = self._by_address.get(found)
        return ParameterEntry(text.upper(), found, listed.definition if listed else None)

    def _check(self, definition: Parameter, element: int | None, number: int | None) -> None:
        """Raises ``ParameterError`` where the parameter has no such element or set."""
        name, first, count = definition.name, self._first, definition.elements
        if element is not None and not first <= element < first + count:
            last = first + count - 1
            raise ParameterError(
                Why.UNKNOWN_NAME,
                Text.of("parameter.elements", parameter=name, low=first, high=last, given=element)
                if count
                else Text.of("parameter.no_elements", parameter=name, given=element),
            )
        if number is not None and not 1 <= number <= definition.sets:
            raise ParameterError(
                Why.UNKNOWN_NAME,
                Text.of("parameter.sets", parameter=name, high=definition.sets, given=number)
                if definition.sets
                else Text.of("parameter.no_sets", parameter=name, given=number),
            )

    def _entry(self, definition: Parameter, element: int | None, number: int | None) -> ParameterEntry:
        name = self._spelled(definition.name, element, number)
        base = definition.object
        if base is not None:
            place = self._first if element is None else element
            sub = base.sub + max(definition.sets, 1) * (place - self._first) + (number or 1) - 1
            return ParameterEntry(
                name, self._family.place(ObjectRef(base.index, min(sub, _MOST_SUB))), definition
            )
        if self._rule is None:
            raise ValueError(f"{definition.name} has no object")
        found = object_of(self._rule, name, definition.sets, definition.elements)
        return ParameterEntry(name, self._family.place(found), definition)

    def _spelled(self, name: str, element: int | None, number: int | None) -> str:
        """The name of one element in one set, as the family's pattern reads it."""
        if element is None and number is None:
            return name
        for form in _SPELLINGS:
            if ("{element}" in form) is (element is not None) and ("{set}" in form) is (number is not None):
                text = form.format(name=name, element=element, set=number)
                match = self._pattern.fullmatch(text) if self._pattern else None
                parts = match.groupdict() if match else {}
                if (_number(parts.get("element")), _number(parts.get("set"))) == (element, number):
                    return text
        return "_".join(str(part) for part in (name, element, number) if part is not None)


class AxisNames:
    """The names of a family for each axis of a node."""

    def __init__(self, family: Family) -> None:
        self._family = family
        self._made: dict[int, Names] = {}

    def of(self, axis: int = 1) -> Names:
        """Names of an axis. What is no axis has the names of the first."""
        if axis not in self._made:
            self._made[axis] = Names(self._family.of_axis(axis))
        return self._made[axis]


def _number(text: str | None) -> int | None:
    return None if text is None else int(text)


def _as_read(parameter: Parameter) -> Parameter:
    """Parameter without its unit where it is not to be read as a scale: then it holds something else than the
    unit says."""
    return parameter if parameter.read else parameter.model_copy(update={"factor": 1.0, "unit": ""})
