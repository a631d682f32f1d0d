"""Check for words of the process data that no PDO carries, and those sent as 0 where 0 means something."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from bridge.eds.pdos import PdoSummary, pdos
from bridge.lint.checked_bus import CheckedBus, CheckedDrive, CheckedNode, CheckedPdo
from bridge.lint.report import LintReport
from bridge.mapping.entry_types import MappedObject
from bridge.mapping.model import Family, ObjectRef, Pdo, Slot
from bridge.parameter.profiles import effect_of
from bridge.parameter.write_effect import Effect
from bridge.text import Text

_PROFILE: Final = range(0x6000, 0x6800)
_CIA_402: Final = 402
_MODE: Final = 0x6060


def check_words(bus: CheckedBus, report: LintReport) -> None:
    for node in bus.nodes:
        known = pdos(node.dictionary, node.table.id) if node.dictionary else ()
        described = {(one.receives, one.number): one for one in known}
        for drive in node.drives:
            slot = node.family.slot_named(drive.table.slot)
            _check_carried(node, drive, report)
            for view in (*drive.rpdos, *drive.tpdos):
                _check_on(drive, slot, view, described.get((view.receives, view.number)), report)
            _check_zeros(node, drive, slot, report)


def _check_carried(node: CheckedNode, drive: CheckedDrive, report: LintReport) -> None:
    """Check that each word that a value is made from has a PDO, of this drive or of another one behind the
    node: a word that only one of several has is the mapping file's choice. Words of no value may keep the
    registers where they are in every variant of a family."""
    process, slots = node.family.process, node.family.slot
    for name, group, words, pdos_of in (
        ("rpdo", "command", process.rpdo, [pdo for one in slots for pdo in one.rpdo]),
        ("tpdo", "actual", process.tpdo, [pdo for one in slots for pdo in one.tpdo]),
    ):
        meant = {word for one in node.family.value if one.group == group for word in one.word_names}
        carried = {word for pdo in pdos_of for word in pdo.words or words}
        if missing := [word for word in words if word in meant - carried]:
            one = len(missing) == 1
            report.error(
                (*node.key, "mapping"),
                Text.of(
                    "check.word_not_carried" if one else "check.words_not_carried",
                    words=", ".join(missing),
                    drive=drive.name,
                    pdo=name.upper(),
                ),
                Text.of("check.words_advice", mapping=node.table.mapping, kind=name),
            )


def _check_on(
    drive: CheckedDrive, slot: Slot, view: CheckedPdo, described: PdoSummary | None, report: LintReport
) -> None:
    """Check that a PDO that is off in the device is switched on: by the site's table for it, a download, or
    the mapping file."""
    pdo = _of(slot, view)
    is_switched = pdo.write or pdo.optional or view.cob_id_key is not None or view.key != drive.key
    if described is None or described.enabled or is_switched:
        return
    kind = "rpdo" if view.receives else "tpdo"
    report.error(
        (*drive.key, kind),
        Text.of("check.off_in_device", pdo=view.name, drive=drive.name),
        Text.of("check.off_in_device_advice", kind=kind),
    )


def _of(slot: Slot, view: CheckedPdo) -> Pdo:
    return next(pdo for pdo in (slot.rpdo if view.receives else slot.tpdo) if pdo.number == view.number)


def _check_zeros(node: CheckedNode, drive: CheckedDrive, slot: Slot, report: LintReport) -> None:
    """Check that an object that is a setting by the profile is not sent as 0, unless that is its value."""
    for pdo, words, ref in _resting_at_zero(node.family, slot):
        entry = node.dictionary.entry(ref.index, ref.sub) if node.dictionary else None
        value = entry.current.at(node.table.id) if entry and entry.current else None
        is_mode = ref.index == _MODE
        if value == 0 and not is_mode:
            continue
        (report.error if is_mode else report.warning)(
            (*node.key, "mapping"),
            Text.of(
                "check.sends_no_mode" if is_mode else "check.sends_zero",
                pdo=f"RPDO{pdo.number}",
                drive=drive.name,
                object=f"{ref.index:04X}h:{ref.sub:02X}",
            ),
            Text.of("check.sends_zero_advice", mapping=node.table.mapping, word=words[0]),
        )


def _resting_at_zero(family: Family, slot: Slot) -> Iterator[tuple[Pdo, tuple[str, ...], ObjectRef]]:
    """The objects of CiA 402 that command no movement and are 0 while nobody commands their words: the PDO,
    the words that they are in, and the object. Where several may stand for a word the drive tells which."""
    for pdo in slot.rpdo:
        found: dict[ObjectRef, list[tuple[str, int]]] = {}
        for word, mapped in zip(pdo.words or family.process.rpdo, pdo.objects, strict=False):
            for ref, rest in _parts(mapped, family.process.rest.get(word, 0)):
                found.setdefault(ref, []).append((word, rest))
        for ref, places in found.items():
            is_setting = ref.index in _PROFILE and effect_of(ref.index, _CIA_402) is not Effect.COMMANDS
            if is_setting and not any(rest for _, rest in places):
                yield pdo, tuple(word for word, _ in places), ref


def _parts(mapped: Sequence[MappedObject], rest: int) -> Iterator[tuple[ObjectRef, int]]:
    """Objects in a word, each with its value at rest."""
    if len(mapped) != 1:
        return
    (only,) = mapped
    shift = 0
    for ref, length in zip(only.parts, only.lengths, strict=True):
        yield ref, rest >> shift & ((1 << length) - 1)
        shift += length
