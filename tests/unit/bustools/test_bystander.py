"""Before the command line writes to a drive: who commands the bus, and does the drive stand."""

from __future__ import annotations

from collections.abc import Generator
from functools import cache

import pytest

from bridge.bustools.bystander import Bystander, Standstill
from bridge.canopen.frame import Frame
from bridge.config import NodeTable
from bridge.drive import DriveState, StatusWords
from bridge.mapping import Family
from bridge.mapping import load_family as load_any
from bridge.mapping.loader import family_names
from bridge.mapping.own_places import places
from bridge.parameter import Names, ParameterEntry, ParameterError, Transfer, TransferFailed
from bridge.text import Text

load_family = cache(load_any)
FAMILIES = [(mapping, load_family(mapping).slot[-1].name) for mapping in family_names()]
PROTECTED = {
    "nord/sk-tu4-cao": ("P509", "P513", "P151", "P120", "P515", "P546"),
    "lenze/8400-motec": ("C00007", "C00357/1", "C00593/1", "C00002/26"),
    "cia402/velocity": ("6007:00",),
    "stoeber/5000": ("A83",),
}


@cache
def word_of(mapping: str, wanted: DriveState) -> int:
    words = StatusWords(load_family(mapping).status_word)
    return next(word for word in range(0x10000) if words.state(word) is wanted)


def answered(
    steps: Generator[Transfer, tuple[bytes, float], None], words: dict[tuple[int, int], bytes]
) -> ParameterError | None:
    """Carry ``steps`` out on a drive that holds ``words`` and no other object."""
    try:
        transfer = next(steps)
        while True:
            data = words.get((transfer.address.index, transfer.address.sub))
            if data is None:
                transfer = steps.throw(
                    TransferFailed(Text.plain("object does not exist"), 0x0602_0000, by_drive=True)
                )
            else:
                transfer = steps.send((data, 1.0))
    except StopIteration:
        return None
    except ParameterError as error:
        return error


def any_protected(names: Names, family: Family) -> ParameterEntry:
    """An entry that is not written while the drive is enabled; every family has one."""
    levels = ("communication", "while_enabled")
    objects = [names.resolve(str(ref)) for ref in own_objects(family)]
    known = [*names.entries(), *objects]
    return next(entry for entry in known if names.protection.level(entry.address) in levels)


def own_objects(family: Family) -> list[str]:
    return [str(place.ref) for place in places(family, link=True)]


@pytest.mark.landing(66)
@pytest.mark.parametrize(("mapping", "slot"), FAMILIES)
@pytest.mark.parametrize("state", [DriveState.OPERATION_ENABLED, DriveState.READY, DriveState.FAULT])
def test_what_is_protected_is_not_written_while_the_drive_is_enabled(
    mapping: str, slot: str, state: DriveState
) -> None:
    family = load_family(mapping)
    table, names = family.slot_named(slot), Names(family)
    word = word_of(mapping, state)
    data = word.to_bytes(2, "little")
    parts = table.tpdo[0].objects[0][0].parts
    each = 2 // len(parts)
    held = {(part.index, part.sub): data[place * each :][:each] for place, part in enumerate(parts)}
    is_asked = all(part.index for part in parts)
    guard = Standstill(names, family, table, None if is_asked else word, force=True)
    try:
        entry = any_protected(names, family)
    except StopIteration:
        pytest.skip("nothing of this family is protected so")
    error = answered(guard.check([entry]), held)
    assert (error is not None) is (state is DriveState.OPERATION_ENABLED)


@pytest.mark.parametrize(
    ("mapping", "name"), [(each, one) for each, all_ in PROTECTED.items() for one in all_]
)
def test_what_supervises_or_commands_takes_force_or_a_drive_that_stands(mapping: str, name: str) -> None:
    family = load_family(mapping)
    names = Names(family)
    entry = names.resolve(name)
    guard = Standstill(names, family, family.slot[0], None, force=False)
    assert names.protection.why_forced(entry) or guard.concerns(entry)


def test_all_that_is_not_written_is_named_and_an_unknown_state_takes_force() -> None:
    family = load_family("nord/sk-tu4-cao")
    names = Names(family)
    entries = [names.resolve(name) for name in ("P102", "P509", "P513")]
    error = answered(Standstill(names, family, family.slot[0], None, force=False).check(entries), {})
    assert error is not None
    assert "P509, P513: not written while the drive is enabled" in str(error)
    assert "P102" not in str(error)
    assert answered(Standstill(names, family, family.slot[0], None, force=True).check(entries), {}) is None
    heard = Standstill(names, family, family.slot[0], 0x0B37, force=True)
    assert answered(heard.check(entries), {}) is not None


@pytest.mark.parametrize("can_id", [0x77F, 0x000, 0x080, 0x205, 0x305, 0x245])
def test_who_commands_the_bus_is_heard(can_id: int) -> None:
    family = load_family("nord/sk-tu4-cao")
    node = NodeTable.model_validate(
        {"name": "n", "id": 5, "mapping": "nord/sk-tu4-cao", "drive": [{"slot": "fu1"}]}
    )
    bystander = Bystander(127, node, family, family.slot[0], 0.0, 1.0)
    bystander.on_frame(Frame(0x185, bytes.fromhex("37 0B 00 20"), 0.1))
    assert (bystander.found, bystander.status) == ("", 0x0B37)
    bystander.on_frame(Frame(can_id, bytes(2), 0.2))
    assert bystander.found


def test_nothing_of_a_whole_set_is_written_while_the_drive_is_known_to_be_enabled() -> None:
    family = load_family("nord/sk-tu4-cao")
    names = Names(family)
    entries = [names.resolve("P102")]
    enabled = Standstill(names, family, family.slot[0], 0x0B37, force=True, whole=True)
    assert "a set of parameters: not written while" in str(answered(enabled.check(entries), {}))
    unknown = Standstill(names, family, family.slot[0], None, force=False, whole=True)
    assert answered(unknown.check(entries), {}) is None
