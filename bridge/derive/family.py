"""A mapping file for the device that a description describes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from bridge.base.errors import Fault, FileFaults, OperationFailed
from bridge.derive.axis_descriptions import AxisDescription, axes_of, view_of
from bridge.derive.device_family import GENERIC, device_lines
from bridge.derive.drive_family import Axis, drive_text, words_of
from bridge.derive.modes import CONTROL_WORD, PROFILE_402, STATUS_WORD, Mode, bits_of, modes_of
from bridge.derive.pdo_words import NoLayout
from bridge.derive.profile_layout import Axes, layout_of
from bridge.derive.toml import file_name
from bridge.eds import Description, read_whole_device_file
from bridge.mapping import Family
from bridge.mapping.loader import family_of
from bridge.mapping.process import MOST_WORDS
from bridge.text import Said, Text

_HAVE_OWN_WORDS: Final = (408,)
"""Profiles with a control and a status word of their own at 6040h and 6041h."""


@dataclass(frozen=True, slots=True)
class Derived:
    """``name`` is what the mapping may be called, such as ``acme/spin-3000``; ``base`` is the mapping that it
    extends, ``text`` is the file. ``read_only`` is why nothing is written into the device; mostly empty."""

    name: str
    base: str
    text: str
    read_only: Said = ""

    @property
    def is_drive(self) -> bool:
        return self.base != GENERIC


class NotDerived(OperationFailed):
    """A drive of which no mapping can be made; ``said`` is why."""

    def __init__(self, said: Text) -> None:
        super().__init__(said)
        self.said = said


def derive_family(description: Description, source: str, mode: str | None = None) -> Derived:
    """The mapping of a drive of the profile CiA 402, or of a device that is no drive; ``source`` is the name
    of the file. ``mode`` is the part of a drive's mapping behind ``cia402/``; left out, the first that the
    drive has.

    Raises ``NotDerived`` for a drive that has not that mode, or of which half is missing.
    """
    axes = axes_of(description)
    if not axes and mode is None and not _is_half_a_drive(description):
        read_only = _why_read_only(description)
        text = "\n".join(device_lines(description, source, read_only))
        return Derived(_name(description, source), GENERIC, text, read_only)
    if not axes:
        raise NotDerived(Text.of("derive.half_a_drive", source=source, why=_why_not(description)))
    there = modes_of(view_of(description, axes[0], axes, ()).alone)
    refused: list[Text] = []
    for one in there if mode is None else [one for one in there if one.name == mode]:
        try:
            drives = _drives(description, one, axes)
        except NoLayout as error:
            refused.append(Text.of("derive.mode", mode=one.name, why=error.said))
            continue
        text = drive_text(description, source, one, drives, there)
        return Derived(_name(description, source), one.mapping, text)
    if refused:
        raise NotDerived(Text.of("derive.refused", source=source, modes=tuple(refused)))
    raise NotDerived(_without_mode(source, mode, tuple(one.name for one in there)))


def _without_mode(source: str, mode: str | None, modes: tuple[str, ...]) -> Text:
    """Text on a drive that has not ``mode``, or none at all that is known; it has ``modes``."""
    if mode is None:
        return Text.of("derive.no_mode", source=source)
    if not modes:
        return Text.of("derive.neither_mode", source=source, mode=mode)
    return Text.of("derive.other_modes", source=source, mode=mode, modes=modes)


def _drives(description: Description, mode: Mode, axes: Sequence[int]) -> list[Axis]:
    """All axes in the same mode. Raises ``NoLayout`` with the one that cannot be driven so."""
    if axes == [1]:
        return [Axis(AxisDescription(1, description), layout_of(description, mode))]
    common = Axes(description)
    taken: set[tuple[bool, int]] = set()
    found: list[Axis] = []
    for axis in axes:
        view = view_of(description, axis, axes, taken)
        try:
            if mode not in modes_of(view.alone):
                raise NoLayout(Text.of("derive.axis_without_mode"))
            layout = layout_of(view.alone, mode, common)
        except NoLayout as error:
            why = view.of_node(error.said)
            if view.shared:
                said = Text.of("derive.axis_shared", axis=axis, why=why, pdos=view.shared)
            else:
                said = Text.of("derive.axis", axis=axis, why=why)
            raise NoLayout(said) from None
        taken |= {(True, pdo.number) for pdo in layout.rpdo} | {(False, pdo.number) for pdo in layout.tpdo}
        found.append(Axis(view, layout))
    words = words_of(found)
    for direction in words:
        if len(direction) > MOST_WORDS:
            raise NoLayout(Text.of("derive.words_of_axes", words=len(direction), most=MOST_WORDS))
    return found


def _is_half_a_drive(description: Description) -> bool:
    """True if its number does not speak against a drive, and it has the control word: who made it can be
    asked for the rest."""
    return _profile(description) in (0, PROFILE_402) and _has(description, CONTROL_WORD)


def _why_read_only(description: Description) -> Said:
    """Reason why nothing is written into a device that is no drive; empty where it is one of its own kind.
    What may be a drive moves by objects that nobody knows, without a control word that would stop it."""
    profile = _profile(description)
    if profile in (0, PROFILE_402):
        seems_drive = profile == PROFILE_402 or _has(description, STATUS_WORD)
    else:
        words = bits_of(description, CONTROL_WORD), bits_of(description, STATUS_WORD)
        seems_drive = profile not in _HAVE_OWN_WORDS and words == (16, 16)
    return Text.of("derive.read_only", why=_why_not(description)) if seems_drive else ""


def _profile(description: Description) -> int:
    return (description.number(0x1000) or 0) & 0xFFFF


def _has(description: Description, word: int) -> bool:
    """A word of a drive is described, or a PDO carries it."""
    return description.entry(word) is not None or bool(_carrier(description, word))


def _why_not(description: Description) -> Text:
    """Reason why the device is no drive, with the object and line that tell."""
    device_type = description.entry(0x1000)
    profile = _profile(description)
    if device_type and profile and profile != PROFILE_402:
        return Text.of("derive.profile", line=device_type.line, profile=profile, wanted=PROFILE_402)
    wrong = [word for word in (CONTROL_WORD, STATUS_WORD) if bits_of(description, word) != 16]
    missing = [word for word in wrong if description.entry(word) is None]
    carriers = [said for word in missing if (said := _carrier(description, word))]
    if missing and carriers:
        return Text.of("derive.carriers", carriers=tuple(carriers))
    if missing:
        names = tuple(f"{word:04X}h" for word in missing)
        return Text.of("derive.missing_one" if len(names) == 1 else "derive.missing_many", objects=names)
    entry = description.entry(wrong[0])
    line, kind = (entry.line, entry.data_type) if entry else (0, None)
    if kind is None:
        return Text.of("derive.unknown_type", object=f"{wrong[0]:04X}h", line=line)
    return Text.of("derive.wrong_type", object=f"{wrong[0]:04X}h", line=line, type=kind.name)


def _carrier(description: Description, word: int) -> Said:
    """A contradiction of the file: a PDO maps the word, which nothing describes."""
    for one in description.objects:
        if one.index & 0xFE00 in (0x1600, 0x1A00):
            for entry in one.entries[1:]:
                mapped = description.number(entry.index, entry.sub) or 0
                if mapped >> 16 == word:
                    mapping = f"{entry.index:04X}h:{entry.sub:02X}"
                    return Text.of("derive.carried", object=f"{word:04X}h", mapping=mapping, line=entry.line)
    return ""


def _name(description: Description, source: str) -> str:
    info = description.device_info
    vendor = file_name(info.vendor) or "unknown"
    return f"{vendor}/{file_name(info.product) or file_name(source.rpartition('.')[0]) or 'device'}"


def describe(path: Path, folders: Sequence[Path] = (), modules: Sequence[str] = ()) -> Family:
    """The family of the device that the description in ``path`` describes, with ``modules`` plugged in.
    Raises ``FileFaults``."""
    description = read_whole_device_file(path, modules)
    try:
        made = derive_family(description, path.name)
    except NotDerived as error:
        raise FileFaults([Fault(str(path), 0, "", error.said, Text.of("derive.by_hand"))]) from None
    return family_of(made.text, path, folders)
