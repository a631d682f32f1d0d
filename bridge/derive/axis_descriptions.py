"""A device with several axes, as each of them would be described alone.

The objects of an axis change places with those of the first logical device (CiA 301 §7.4.1), so that what is
made of a drive with one axis is made of each; what the node has in common stays.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from typing import Final

from bridge.derive.modes import CONTROL_WORD, PROFILE_402, STATUS_WORD, bits_of
from bridge.eds import Description, Entry, Value
from bridge.eds.model import Object
from bridge.eds.pdos import PdoSummary, pdos
from bridge.mapping.axes import MOST_AXES, axis_of, on_axis, profile_of
from bridge.text import Fact, Text, Words

_DEVICE_TYPE: Final = 0x1000
_DEVICE_TYPE_OF_AXIS: Final = 0x67FF
"""CiA 301 §7.5.2.1: what each of several logical devices is."""
_COMMUNICATION: Final = {True: 0x1400, False: 0x1800}
_MAPPING: Final = 0x200
_PROFILE: Final = 0xFFFF
_NAMED: Final = re.compile(r"\b[6-9][0-9A-F]{3}(?=h|:[0-9A-F]{2})")


@dataclass(frozen=True, slots=True)
class AxisDescription:
    """The device as an axis has it: ``alone`` describes it as if there were no other. ``shared`` are the
    PDOs that carry objects of other axes too and cannot be mapped otherwise, by their names."""

    axis: int
    alone: Description
    shared: tuple[str, ...] = ()

    def index(self, index: int) -> int:
        """The index that the node has for an object of the view, and the other way round."""
        if index in profile_of(1):
            return on_axis(index, self.axis)
        return index - profile_of(self.axis).start + profile_of(1).start if self._is_own(index) else index

    def reference(self, ref: str) -> str:
        """An object of the view, such as ``6061:00/8``, as the node has it."""
        return f"{self.index(int(ref[:4], 16)):04X}{ref[4:]}"

    def of_node(self, said: Text) -> Text:
        """A text about the view, with the objects among its facts as the node has them."""
        return replace(said, facts=tuple((name, self._of_node(fact)) for name, fact in said.facts))

    def _of_node(self, fact: Fact) -> Fact:
        match fact:
            case Text() | str():
                return self._words_of_node(fact)
            case tuple():
                return tuple(map(self._words_of_node, fact))
            case _:
                return fact

    def _words_of_node(self, words: Words) -> Words:
        if isinstance(words, Text):
            return self.of_node(words)
        return _NAMED.sub(lambda found: self.reference(found[0]), words)

    def _is_own(self, index: int) -> bool:
        return index in profile_of(self.axis)


def axes_of(description: Description) -> list[int]:
    """The logical devices that are drives of the profile CiA 402: control and status word decide, as many
    files leave 1000h at 0."""
    return [axis for axis in range(1, MOST_AXES + 1) if _is_drive(description, axis)]


def _is_drive(description: Description, axis: int) -> bool:
    device_type = description.number(on_axis(_DEVICE_TYPE_OF_AXIS, axis))
    if device_type is None and axis == 1:
        device_type = description.number(_DEVICE_TYPE)
    if device_type and device_type & _PROFILE not in (0, PROFILE_402):
        return False
    words = (on_axis(word, axis) for word in (CONTROL_WORD, STATUS_WORD))
    return all(bits_of(description, word) == 16 for word in words)


def view_of(
    description: Description, axis: int, axes: Collection[int], taken: Collection[tuple[bool, int]]
) -> AxisDescription:
    """The device as ``axis`` of ``axes`` has it, without the PDOs that are ``taken``: by direction, True for
    RPDOs, and number."""
    view = AxisDescription(axis, description)
    others = {one for one in axes if one != axis}
    gone: set[int] = set()
    unmapped: set[int] = set()
    shared: list[str] = []
    for pdo in pdos(description):
        carried = {axis_of(one.index) for one in pdo.mapped}
        communication = _COMMUNICATION[pdo.receives] + pdo.number - 1
        mapping = communication + _MAPPING
        if (pdo.receives, pdo.number) in taken or (carried & others and axis not in carried):
            gone |= {communication, mapping}
        elif carried & others and _can_be_mapped(description, mapping):
            unmapped.add(mapping)
        elif carried & others:
            gone |= {communication, mapping}
            shared.append(pdo.name)
    objects = [
        _seen(view, one, is_unmapped=one.index in unmapped)
        for one in description.objects
        if one.index not in gone and axis_of(one.index) not in others
    ]
    objects = [_as_type(description, axis, one) if one.index == _DEVICE_TYPE else one for one in objects]
    alone = replace(description, objects=tuple(sorted(objects, key=lambda one: one.index)))
    return AxisDescription(axis, alone, tuple(shared))


def left_over(description: Description, axes: Collection[int]) -> Iterator[PdoSummary]:
    """PDOs that carry objects of other logical devices, and nothing of an axis."""
    for pdo in pdos(description):
        carried = {axis_of(one.index) for one in pdo.mapped}
        if carried - {None} and not carried & set(axes):
            yield pdo


def _can_be_mapped(description: Description, mapping: int) -> bool:
    entry = description.entry(mapping, 0)
    return entry is not None and entry.access.writable


def _seen(view: AxisDescription, one: Object, *, is_unmapped: bool) -> Object:
    is_mapping = 0x1600 <= one.index < 0x1800 or 0x1A00 <= one.index < 0x1C00
    index = view.index(one.index)

    def seen(entry: Entry) -> Entry:
        if not is_mapping:
            return replace(entry, index=index)
        if is_unmapped and not entry.sub:
            return replace(entry, default=Value(0), parameter_value=None)
        if not entry.sub:
            return entry
        return replace(
            entry, default=_mapped(view, entry.default), parameter_value=_mapped(view, entry.parameter_value)
        )

    return replace(one, index=index, entries=tuple(seen(entry) for entry in one.entries))


def _mapped(view: AxisDescription, value: Value | None) -> Value | None:
    if value is None or not isinstance(value.plain, int):
        return value
    return replace(value, plain=view.index(value.plain >> 16 & 0xFFFF) << 16 | value.plain & 0xFFFF)


def _as_type(description: Description, axis: int, one: Object) -> Object:
    """1000h of an axis is what its own 67FFh says."""
    told = description.number(on_axis(_DEVICE_TYPE_OF_AXIS, axis))
    if not told:
        return one
    entries = (replace(entry, default=Value(told), parameter_value=None) for entry in one.entries)
    return replace(one, entries=tuple(entries))
