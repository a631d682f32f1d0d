"""A mapping file for the device that a description describes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence, Set
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bridge.derive.device import GENERIC, device_lines, identity_lines
from bridge.derive.layout import Layout, NoLayout, PdoLayout, layout_of
from bridge.derive.modes import (
    CONTROL_WORD,
    MODE,
    MODE_DISPLAY,
    PROFILE_402,
    STATUS_WORD,
    Mode,
    bits_of,
    is_drive,
    modes_of,
)
from bridge.derive.parameters import FURTHER_AXES, entries_of, parameter_lines
from bridge.derive.titles import name_of
from bridge.derive.toml import file_name, one_line, string, strings
from bridge.eds import DataType, Description, read_whole_device_file
from bridge.errors import Fault, FileFaults, OperationFailed
from bridge.mapping import Family, load_family
from bridge.mapping.loader import family_of
from bridge.mapping.process import REAL

_NEEDED: Final = ("603F", "6007")
"""Parameters that the base itself speaks of beside those that decide its values; a device without them
refuses to be asked."""
_VALUE_TYPES: Final = {
    DataType.INTEGER8: "int16",
    DataType.INTEGER16: "int16",
    DataType.INTEGER32: "int32",
    DataType.UNSIGNED8: "uint16",
    DataType.UNSIGNED16: "uint16",
    DataType.UNSIGNED32: "uint32",
    DataType.REAL32: "real32",
}
"""The types of values in words; a signed byte fills its word with its sign (``signed`` of the PDO)."""
_HAVE_OWN_WORDS: Final = (408,)
"""Profiles with a control and a status word of their own at 6040h and 6041h."""
_INTERPOLATION: Final = 0x60C2
_CYCLIC: Final = (8, 9)


@dataclass(frozen=True, slots=True)
class Derived:
    """``name`` is what the mapping may be called, such as ``acme/spin-3000``; ``base`` is the mapping that it
    extends, ``text`` is the file. ``read_only`` is why nothing is written into the device; mostly empty."""

    name: str
    base: str
    text: str
    read_only: str = ""

    @property
    def is_drive(self) -> bool:
        return self.base != GENERIC


def derive_family(description: Description, source: str, mode: str | None = None) -> Derived:
    """The mapping of a drive of the profile CiA 402, or of a device that is no drive; ``source`` is the name
    of the file. ``mode`` is the part of a drive's mapping behind ``cia402/``; left out, the first that the
    drive has.

    Raises ``OperationFailed`` for a drive that has not that mode, or of which half is missing.
    """
    if not is_drive(description) and mode is None and not _is_half_a_drive(description):
        read_only = _why_read_only(description)
        text = "\n".join(device_lines(description, source, read_only))
        return Derived(_name(description, source), GENERIC, text, read_only)
    if not is_drive(description):
        raise OperationFailed(
            f"{source} describes no drive that follows CiA 402 ({_why_not(description)}): its mapping has to "
            "be written by hand"
        )
    there = modes_of(description)
    refused: list[str] = []
    for one in there if mode is None else [one for one in there if one.name == mode]:
        try:
            layout = layout_of(description, one)
        except NoLayout as error:
            refused.append(f"{one.name}: {error}")
            continue
        others = [other for other in there if other is not one]
        text = "\n".join(_lines(description, source, one, layout, others))
        return Derived(_name(description, source), one.mapping, text)
    if refused:
        raise OperationFailed(f"{source}: {'; '.join(refused)}")
    what = ", ".join(one.name for one in there) or "none that a mapping of ours drives"
    raise OperationFailed(f"{source}: the device has not the mode {mode or 'asked for'}; it has {what}")


def _is_half_a_drive(description: Description) -> bool:
    """Its number does not speak against a drive, and it has the control word: who made it can be asked for
    the rest."""
    return _profile(description) in (0, PROFILE_402) and _has(description, CONTROL_WORD)


def _why_read_only(description: Description) -> str:
    """Why nothing is written into a device that is no drive; empty where it is one of its own kind. What may
    be a drive moves by objects that nobody knows, without a control word that would stop it."""
    profile = _profile(description)
    if profile in (0, PROFILE_402):
        seems_drive = profile == PROFILE_402 or _has(description, STATUS_WORD)
    else:
        words = bits_of(description, CONTROL_WORD), bits_of(description, STATUS_WORD)
        seems_drive = profile not in _HAVE_OWN_WORDS and words == (16, 16)
    return f"it seems to be a drive, and does not follow CiA 402: {_why_not(description)}" * seems_drive


def _profile(description: Description) -> int:
    return (description.number(0x1000) or 0) & 0xFFFF


def _has(description: Description, word: int) -> bool:
    """A word of a drive is described, or a PDO carries it."""
    return description.entry(word) is not None or bool(_carrier(description, word))


def _why_not(description: Description) -> str:
    """What is there instead of a drive, and what would be one."""
    device_type = description.entry(0x1000)
    profile = _profile(description)
    if device_type and profile and profile != PROFILE_402:
        return f"1000h in line {device_type.line} has the profile {profile}, not {PROFILE_402}"
    wrong = [word for word in (CONTROL_WORD, STATUS_WORD) if bits_of(description, word) != 16]
    missing = [word for word in wrong if description.entry(word) is None]
    carriers = [text for word in missing if (text := _carrier(description, word))]
    if missing and carriers:
        return "; ".join(carriers)
    if missing:
        names = " and ".join(f"{word:04X}h" for word in missing)
        return f"{names} {'are' if len(missing) > 1 else 'is'} not described"
    entry = description.entry(wrong[0])
    line, kind = (entry.line, entry.data_type) if entry else (0, None)
    found = f"is a {kind.name}" if kind else "has no type that we know"
    return f"{wrong[0]:04X}h in line {line} {found}, not a UNSIGNED16"


def _carrier(description: Description, word: int) -> str:
    """A contradiction of the file: a PDO maps the word, which nothing describes."""
    for one in description.objects:
        if one.index & 0xFE00 in (0x1600, 0x1A00):
            for entry in one.entries[1:]:
                mapped = description.number(entry.index, entry.sub) or 0
                if mapped >> 16 == word:
                    return (
                        f"{word:04X}h is not described, though {entry.index:04X}h:{entry.sub:02X} "
                        f"in line {entry.line} maps it: it is a UNSIGNED16"
                    )
    return ""


def _name(description: Description, source: str) -> str:
    device = description.device
    vendor = file_name(device.vendor) or "unknown"
    return f"{vendor}/{file_name(device.product) or file_name(source.rpartition('.')[0]) or 'device'}"


def _lines(
    description: Description, source: str, mode: Mode, layout: Layout, others: Sequence[Mode]
) -> Iterator[str]:
    base = load_family(mode.mapping)
    device = description.device
    yield f"# Made of {one_line(source)} by `drivebridge family new`. A key behind a # is what the file does"
    yield "# not say: fill it in from the manual, and compare the rest with the device."
    for other in others:
        yield f"# The device has the mode {other.number} too: {other.mapping}."
    further = sum(1 for one in description.objects if one.index in FURTHER_AXES)
    if further:
        yield f"# Left out: {further} objects from {FURTHER_AXES.start:X}h on (further axes, other profiles)."
    yield f"extends = {string(mode.mapping)}"
    known = {one.name: one for one in base.parameter}
    entries = list(entries_of(description))
    without = list(_without(description, base, layout, {name for name, _ in entries}))
    if without:
        yield f"without = [{''.join(f'{chr(10)}  {string(one)},' for one in without)}"
        yield "]"
    yield ""
    yield "[family]"
    yield f"name = {string(device.product or source)}"
    yield f"vendor = {string(device.vendor or 'unknown')}"
    yield f"source = {string(source)}"
    yield ""
    yield from identity_lines(description)
    yield from _process(description, layout, mode)
    yield from _further(layout, {(one.group, one.name) for one in base.value})
    carried = {(index, 0) for index, _ in (*mode.commanded, *mode.told)}
    names = {one.index: one.name for one in description.objects}
    for name, entry in entries:
        title = f"{names[entry.index]}: {entry.name}" if ":" in name else entry.name
        yield from parameter_lines(name, entry, title, known, carried, PROFILE_402)


def _without(description: Description, base: Family, layout: Layout, there: Set[str]) -> Iterator[str]:
    """What the base has and this device has not."""
    needed = {*_NEEDED, *(one.parameter for one in base.meaning)}
    needed.update(name for value in base.value for name in (*value.scaled_by, *value.when, *value.steady))
    for parameter in base.parameter:
        if parameter.name not in there and parameter.name not in needed:
            yield f"parameter:{parameter.name}"
    for own in base.own_supervision:
        if own.object and description.entry(own.object.index, own.object.sub) is None:
            yield f"own_supervision:{own.name}"
    if not layout.tells_mode:
        yield "value:actual/mode"


def _start(description: Description, mode: Mode) -> str | None:
    """What the boot-up writes, where it is not what the base has it write."""
    has_mode = _is_writable(description, MODE, 0)
    has_period = all(_is_writable(description, _INTERPOLATION, sub) for sub in (1, 2))
    if has_mode and (has_period or mode.number not in _CYCLIC):
        return None
    mode_write = f'{{ object = "{MODE:04X}:00", type = "int8", value = {mode.number} }}'
    return mode_write if has_mode else ""


def _is_writable(description: Description, index: int, sub: int) -> bool:
    entry = description.entry(index, sub)
    return entry is not None and entry.access.writable


def _process(description: Description, layout: Layout, mode: Mode) -> Iterator[str]:
    """The PDOs, where they are not the base's, and what is written at start, where the device has less."""
    if not layout.is_base:
        yield "[process]"
        for direction, words, own in (
            ("rpdo", layout.rpdo_words, layout.rpdo),
            ("tpdo", layout.tpdo_words, layout.tpdo),
        ):
            if own:
                yield f"{direction} = {strings(words)}"
        yield from _rest(layout.rpdo)
        yield ""
    start = _start(description, mode)
    if layout.is_base and start is None:
        return
    yield "[[slot]]"
    yield 'name = "drive"'
    if start is not None:
        yield f"start = [{start}]"
    for direction, own in (("rpdo", layout.rpdo), ("tpdo", layout.tpdo)):
        for pdo in own:
            yield from pdo.lines(direction)
    yield ""
    if not layout.is_base and layout.tells_mode and layout.tpdo:
        # Where the word of the mode is called otherwise than in the base.
        name = next(
            name
            for pdo in layout.tpdo
            for name, ref in zip(pdo.words, pdo.objects, strict=True)
            if ref.startswith(f"{MODE_DISPLAY:04X}:")
        )
        yield "[[value]]"
        yield 'name = "mode"'
        yield 'group = "actual"'
        yield f"word = {string(name)}"
        yield ""


def _rest(rpdo: Sequence[PdoLayout]) -> Iterator[str]:
    """What RPDOs send in words that nobody commands."""
    words = {
        word: one.rest >> 16 * n & 0xFFFF
        for pdo in rpdo
        for one in pdo.further
        for n, word in enumerate(one.words)
    }
    if resting := ", ".join(f"{word} = {value}" for word, value in words.items() if value):
        yield f"rest = {{ {resting} }}"


def _further(layout: Layout, taken: Set[tuple[str, str]]) -> Iterator[str]:
    """A value for each further object of its PDOs, by the type that the file has for it. Booleans, strings
    and the like have their words alone. ``taken`` are the base's values."""
    seen = set(taken)
    for group, pdos in (("command", layout.rpdo), ("actual", layout.tpdo)):
        for one in (one for pdo in pdos for one in pdo.further):
            kind = _VALUE_TYPES.get(one.entry.data_type) if one.entry.data_type else None
            if kind is None:
                continue
            name = name_of(one.title, one.entry)
            if (group, name) in seen:
                name = f"{name}_{one.entry.index:04x}_{one.entry.sub:02x}"
            seen.add((group, name))
            yield "[[value]]"
            yield f"name = {string(name)}"
            yield f"group = {string(group)}"
            yield f"word = {string(one.words[0])}" if len(one.words) == 1 else f"words = {strings(one.words)}"
            yield f"data_type = {string(kind)}"
            yield '# unit = ""'
            if kind != REAL:
                yield "# scale = { factor = 1.0 }"
            yield f"description = {string(one.title)}"
            yield ""


def describe(path: Path, folders: Sequence[Path] = (), modules: Sequence[str] = ()) -> Family:
    """The family of the device that the description in ``path`` describes, with ``modules`` plugged in.
    Raises ``FileFaults``."""
    description = read_whole_device_file(path, modules)
    try:
        made = derive_family(description, path.name)
    except OperationFailed as error:
        raise FileFaults([Fault(str(path), 0, "", str(error), "a mapping file written by hand")]) from None
    return family_of(made.text, path, folders)
