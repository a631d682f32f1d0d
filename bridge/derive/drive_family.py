"""A mapping file for a drive of the profile CiA 402, line by line."""

from __future__ import annotations

from collections.abc import Iterator, Sequence, Set
from dataclasses import dataclass
from typing import Final

from bridge.derive.axis_descriptions import AxisDescription, left_over
from bridge.derive.device_family import identity_lines
from bridge.derive.modes import MODE, MODE_DISPLAY, PROFILE_402, Mode
from bridge.derive.parameter_tables import FURTHER_AXES, entries_of, parameter_lines
from bridge.derive.pdo_words import PdoLayout
from bridge.derive.profile_layout import ProfileLayout
from bridge.derive.titles import name_of, title_of
from bridge.derive.toml import one_line, string, strings, value, word
from bridge.eds import Description, Entry, StaticDataType
from bridge.mapping import Family, load_family
from bridge.mapping.axes import axis_of
from bridge.mapping.checks import NODE_POINTS
from bridge.mapping.process import REAL, Slot

_NEEDED: Final = ("603F", "6007")
"""Parameters that the base itself speaks of beside those that decide its values; a device without them
refuses to be asked."""
_VALUE_TYPES: Final = {
    StaticDataType.INTEGER8: "int16",
    StaticDataType.INTEGER16: "int16",
    StaticDataType.INTEGER32: "int32",
    StaticDataType.UNSIGNED8: "uint16",
    StaticDataType.UNSIGNED16: "uint16",
    StaticDataType.UNSIGNED32: "uint32",
    StaticDataType.REAL32: "real32",
}
"""The types of values in words; a signed byte fills its word with its sign (``signed`` of the PDO)."""
_POLLED: Final = {
    StaticDataType.UNSIGNED8: "uint8",
    StaticDataType.UNSIGNED16: "uint16",
    StaticDataType.UNSIGNED32: "uint32",
    StaticDataType.INTEGER16: "int16",
    StaticDataType.INTEGER32: "int32",
}
_EVERY_MS: Final = 1000
"""The time between two questions for an input that no TPDO brings."""
_INTERPOLATION: Final = 0x60C2
_CYCLIC: Final = (8, 9)


@dataclass(frozen=True, slots=True)
class Axis:
    """An axis of the device, or its one drive, and how it is driven."""

    view: AxisDescription
    layout: ProfileLayout


def words_of(drives: Sequence[Axis]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """The words of RPDOs and of TPDOs that the axes have: those of the mode first."""
    return (
        tuple(dict.fromkeys(word for drive in drives for word in drive.layout.rpdo_words)),
        tuple(dict.fromkeys(word for drive in drives for word in drive.layout.tpdo_words)),
    )


def drive_text(
    description: Description, source: str, mode: Mode, drives: Sequence[Axis], modes: Sequence[Mode]
) -> str:
    return "\n".join(_lines(description, source, mode, drives, [one for one in modes if one is not mode]))


def _lines(
    description: Description, source: str, mode: Mode, drives: Sequence[Axis], others: Sequence[Mode]
) -> Iterator[str]:
    base = load_family(mode.mapping)
    info = description.device_info
    axes = [drive.view.axis for drive in drives]
    yield f"# Made of {one_line(source)} by `drivebridge family new`. A key behind a # is what the file does"
    yield "# not say: fill it in from the manual, and compare the rest with the device."
    for other in others:
        yield f"# The device has the mode {other.number} too: {other.mapping}."
    yield from _left_out(description, axes)
    yield f"extends = {string(mode.mapping)}"
    known = {one.name: one for one in base.parameter}
    entries = _entries(description, drives)
    without = [f"slot:{slot.name}" for slot in base.slot] if axes != [1] else []
    without += _without([drive.view.alone for drive in drives], base, set(entries))
    if not any(drive.layout.tells_mode for drive in drives):
        without.append("value:actual/mode")
    if without:
        yield f"without = [{''.join(f'{chr(10)}  {string(one)},' for one in without)}"
        yield "]"
    yield ""
    yield "[family]"
    yield f"name = {string(info.product or source)}"
    yield f"vendor = {string(info.vendor or 'unknown')}"
    yield f"source = {string(source)}"
    yield ""
    yield from _identity(description)
    yield from _process(drives)
    if axes == [1]:
        yield from _slot(drives[0], mode)
    else:
        for drive in drives:
            yield from _axis_slot(drive, base.slot[0])
    yield from _mode_word(drives)
    yield from _inputs(description, axes)
    yield from _further(drives, {(one.group, one.name) for one in base.value})
    carried = {(index, 0) for index, _ in (*mode.commanded, *mode.told)}
    for name, (entry, title) in entries.items():
        yield from parameter_lines(name, entry, title, known, carried, PROFILE_402)


def _left_out(description: Description, axes: Sequence[int]) -> Iterator[str]:
    """Comments on RPDOs that the mapping says nothing of."""
    for pdo in left_over(description, axes):
        if pdo.receives:
            carried = ", ".join(f"{one.index:04X}h:{one.sub:02X}" for one in pdo.mapped)
            yield f"# Left out: {pdo.name}, which commands {carried} and no drive."


def _inputs(description: Description, axes: Sequence[int]) -> Iterator[str]:
    """Points of the node: the objects of TPDOs that are of no axis."""
    tpdos = [pdo for pdo in left_over(description, axes) if not pdo.receives]
    names: set[str] = set(NODE_POINTS)
    for one in dict.fromkeys((one.index, one.sub) for pdo in tpdos for one in pdo.mapped):
        entry = description.entry(*one)
        kind = _POLLED.get(entry.data_type) if entry and entry.data_type else None
        if entry is None or kind is None:
            yield f"# Left out: {one[0]:04X}h:{one[1]:02X}, which no point of a node can have."
            continue
        title = title_of(description, entry)
        name = name_of(title, entry)
        name = f"{name}_{entry.index:04x}_{entry.sub:02x}" if name in names else name
        names.add(name)
        yield "[[poll]]"
        yield f"name = {string(name)}"
        yield f'object = "{entry.index:04X}:{entry.sub:02X}"'
        yield f"data_type = {string(kind)}"
        yield f"every_ms = {_EVERY_MS}"
        yield f"description = {string(title)}"
        yield ""
    for pdo in tpdos:
        yield "[[node_tpdo]]"
        yield f"number = {pdo.number}"
        yield ""


def _entries(description: Description, drives: Sequence[Axis]) -> dict[str, tuple[Entry, str]]:
    """Every entry that can be a parameter, with its title: of all axes, by the name that it has in each."""
    found: dict[str, tuple[Entry, str]] = {}
    views = [drive.view.alone for drive in drives]
    axes = {drive.view.axis for drive in drives}
    for view in views:
        for name, entry in entries_of(view):
            found.setdefault(name, (entry, _title(view, name, entry)))
    for name, entry in entries_of(description, (FURTHER_AXES,)):
        if axis_of(entry.index) not in axes:
            found[name] = entry, _title(description, name, entry)
    return found


def _title(description: Description, name: str, entry: Entry) -> str:
    one = description.object(entry.index)
    return f"{one.name}: {entry.name}" if one and ":" in name else entry.name


def _without(views: Sequence[Description], base: Family, there: Set[str]) -> Iterator[str]:
    """Parameters and own supervision that the base has and this device has not."""
    needed = {*_NEEDED, *(one.parameter for one in base.meaning)}
    needed.update(name for value in base.value for name in (*value.scaled_by, *value.when, *value.steady))
    for parameter in base.parameter:
        if parameter.name not in there and parameter.name not in needed:
            yield f"parameter:{parameter.name}"
    for own in base.own_supervision:
        if own.object and all(view.entry(own.object.index, own.object.sub) is None for view in views):
            yield f"own_supervision:{own.name}"


def _identity(description: Description) -> Iterator[str]:
    """The identity, with the profile that 1000h has where the first logical device is no drive."""
    profile = (description.number(0x1000) or 0) & 0xFFFF
    for line in identity_lines(description):
        yield line
        if line == "[identity]" and profile not in (0, PROFILE_402):
            yield f"device_type = {word(profile, 4)}"


def _start(description: Description, mode: Mode) -> str | None:
    """Boot-up write of the mode of operation in place of the base's; None where the base's fits."""
    has_mode = _is_writable(description, MODE, 0)
    has_period = all(_is_writable(description, _INTERPOLATION, sub) for sub in (1, 2))
    if has_mode and (has_period or mode.number not in _CYCLIC):
        return None
    mode_write = f'{{ object = "{MODE:04X}:00", type = "int8", value = {mode.number} }}'
    return mode_write if has_mode else ""


def _is_writable(description: Description, index: int, sub: int) -> bool:
    entry = description.entry(index, sub)
    return entry is not None and entry.access.writable


def _process(drives: Sequence[Axis]) -> Iterator[str]:
    """The words, where they are not the base's."""
    rpdo_words, tpdo_words = words_of(drives)
    rpdo = [pdo for drive in drives for pdo in drive.layout.rpdo]
    tpdo = [pdo for drive in drives for pdo in drive.layout.tpdo]
    if rpdo or tpdo:
        yield "[process]"
        if rpdo:
            yield f"rpdo = {strings(rpdo_words)}"
        if tpdo:
            yield f"tpdo = {strings(tpdo_words)}"
        yield from _rest(rpdo)
        yield ""


def _slot(drive: Axis, mode: Mode) -> Iterator[str]:
    """The PDOs of the one drive, where they are not the base's, and what is written at start, where the
    device has less."""
    layout = drive.layout
    start = _start(drive.view.alone, mode)
    if layout.is_base and start is None:
        return
    yield "[[slot]]"
    yield 'name = "drive"'
    if start is not None:
        yield f"start = [{start}]"
    yield from _pdos(drive)
    yield ""


def _axis_slot(drive: Axis, base: Slot) -> Iterator[str]:
    """An axis, which has of the base's start writes those that it can take."""
    view = drive.view
    yield "[[slot]]"
    yield f'name = "axis{view.axis}"'
    yield f"axis = {view.axis}"
    yield "parameters_by_sdo = true"
    has_period = all(_is_writable(view.alone, _INTERPOLATION, sub) for sub in (1, 2))
    writes = [
        f"{{ object = {string(view.reference(str(one.object)))}, type = {string(one.type)}, "
        f"value = {value(one.value)} }}"
        for one in base.start
        if _is_writable(view.alone, one.object.index, one.object.sub)
        and (one.object.index != _INTERPOLATION or has_period)
    ]
    if writes:
        yield f"start = [{', '.join(writes)}]"
    yield from _pdos(drive)
    yield ""


def _pdos(drive: Axis) -> Iterator[str]:
    for direction, own in (("rpdo", drive.layout.rpdo), ("tpdo", drive.layout.tpdo)):
        for pdo in own:
            yield from pdo.of_node(drive.view).lines(direction)


def _mode_word(drives: Sequence[Axis]) -> Iterator[str]:
    """Lines of the value ``mode``, with the word that carries it."""
    ref = f"{MODE_DISPLAY:04X}:"
    named = (
        (name, one)
        for drive in drives
        for pdo in drive.layout.tpdo
        for name, one in zip(pdo.words, pdo.objects, strict=True)
    )
    name = next((name for name, one in named if one.startswith(ref)), None)
    if name is not None:
        yield "[[value]]"
        yield 'name = "mode"'
        yield 'group = "actual"'
        yield f"word = {string(name)}"
        yield ""


def _rest(rpdo: Sequence[PdoLayout]) -> Iterator[str]:
    """Values that RPDOs send in words that nobody commands."""
    words = {
        word: one.rest >> 16 * n & 0xFFFF
        for pdo in rpdo
        for one in pdo.further
        for n, word in enumerate(one.words)
    }
    if resting := ", ".join(f"{word} = {value}" for word, value in words.items() if value):
        yield f"rest = {{ {resting} }}"


def _further(drives: Sequence[Axis], taken: Set[tuple[str, str]]) -> Iterator[str]:
    """A value for each further object of the PDOs, by the type that the file has for it. Booleans, strings
    and the like have their words alone. ``taken`` are the base's values."""
    seen = set(taken)
    for group in ("command", "actual"):
        of_layouts = (one.layout.rpdo if group == "command" else one.layout.tpdo for one in drives)
        named = [one for pdos in of_layouts for pdo in pdos for one in pdo.further]
        for one in {one.words: one for one in reversed(named)}.values():
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
