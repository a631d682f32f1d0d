"""Names do not matter, objects do: what may not be written is refused under every name, on every way in."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.canopen.frame import Frame
from bridge.command import Action, Code, Identity, Outcome, Request, Role, Source, Start, WriteParameter
from bridge.config import load_site
from bridge.drive import DriveState
from bridge.mapping import load_family
from bridge.mapping.alias_places import aliases
from bridge.mapping.aliases import COMMUNICATION
from bridge.mapping.loader import family_names
from bridge.parameter import (
    DriveParameters,
    Ledger,
    Names,
    ObjectRef,
    ParameterEntry,
    ParameterError,
    backups,
)
from bridge.parameter.definition import leaf_of
from bridge.parameter.error import Why
from bridge.sim.catalogue import simulate_node
from tests.support import sites
from tests.support.bench import PLC, Bench
from tests.support.gates import ENGINEER_AT_REST

FAMILIES: Final = tuple(family_names())
ENGINEER = Identity(Source.OPCUA, "eve", Role.ENGINEER)
CONTROLLER = Identity(PLC.source, PLC.user, sets_parameters=True)

LENZE, STOEBER, TU4 = "lenze/8400-motec", "stoeber/5000", "nord/sk-tu4-cao"


# what the manuals list

MANUALS: Final = [
    # EDS84DMOTCAN 3.0, §12.2, §12.3 and the table of the objects in §13
    *((LENZE, f"C00322/{n}", f"{0x1800 + n - 1:04X}:02") for n in (1, 2)),
    *((LENZE, f"C00323/{n}", f"{0x1400 + n - 1:04X}:02") for n in (1, 2)),
    (LENZE, "C00324/2", "1800:03"),
    (LENZE, "C00324/3", "1801:03"),
    (LENZE, "C00353/1", "1400:01"),
    (LENZE, "C00353/2", "1801:01"),
    (LENZE, "C00354/1", "1400:01"),
    (LENZE, "C00354/2", "1800:01"),
    (LENZE, "C00354/3", "1401:01"),
    (LENZE, "C00354/4", "1801:01"),
    (LENZE, "C00356/2", "1801:05"),
    (LENZE, "C00356/5", "1800:05"),
    (LENZE, "C00366", "1201:01"),
    (LENZE, "C00367", "1005:00"),
    (LENZE, "C00368", "1005:00"),
    (LENZE, "C00369", "1006:00"),
    (LENZE, "C00381", "1017:00"),
    (LENZE, "C00385/1", "1016:01"),
    (LENZE, "C00386/1", "1016:01"),
    (LENZE, "C00389/1", "1400:01"),
    (LENZE, "C00409/1", "1600:01"),
    (LENZE, "C00409/8", "1601:04"),
    # ID 441684.06, §11.1
    (STOEBER, "A00.0", "1010:01"),
    (STOEBER, "A200", "1005:00"),
    (STOEBER, "A201", "1006:00"),
    (STOEBER, "A203", "100C:00"),
    (STOEBER, "A204", "100D:00"),
    (STOEBER, "A207", "1014:00"),
    (STOEBER, "A208", "1015:00"),
    (STOEBER, "A210", "1017:00"),
    (STOEBER, "A211", "1020:01"),
    (STOEBER, "A212", "1020:02"),
    *((STOEBER, f"A{217 + n}.{s}", f"{0x1200 + n:04X}:{s + 1:02X}") for n in (1, 2, 3) for s in range(3)),
    *((STOEBER, f"A{221 + n}.{s}", f"{0x1400 + n:04X}:{s + 1:02X}") for n in range(4) for s in range(2)),
    *((STOEBER, f"A{225 + n}.{s}", f"{0x1600 + n:04X}:{s + 1:02X}") for n in range(4) for s in range(6)),
    *(
        (STOEBER, f"A{229 + n}.{s}", f"{0x1800 + n:04X}:{sub:02X}")
        for n in range(4)
        for s, sub in enumerate((1, 2, 3, 5))
    ),
    *((STOEBER, f"A{233 + n}.{s}", f"{0x1A00 + n:04X}:{s + 1:02X}") for n in range(4) for s in range(6)),
    # BU 2500 §7.1.2
    (TU4, "20A0:01", "1005:00"),
    (TU4, "20A0:06", "1400:01"),
    (TU4, "20A0:0A", "1804:01"),
    (TU4, "20A1:01", "1005:00"),
    (TU4, "20A1:05", "1201:01"),
    (TU4, "20A1:0A", "1800:01"),
    (TU4, "20A1:0B", "1400:01"),
    (TU4, "20A1:13", "1404:01"),
    (TU4, "20A2:01", "1800:02"),
    (TU4, "20A2:02", "1400:02"),
    (TU4, "20A2:0A", "1404:02"),
    (TU4, "20A3:05", "1804:03"),
    (TU4, "20A4:01", "1800:05"),
    (TU4, "20A5:01", "1600:01"),
    (TU4, "20A5:05", "1A00:01"),
    (TU4, "20A5:21", "1A04:01"),
    (TU4, "20A5:22", "1604:01"),
    (TU4, "20A6:01", "100C:00"),
    (TU4, "20A6:02", "1017:00"),
    (TU4, "20A7:01", "100D:00"),
]


@pytest.mark.landing(34)
@pytest.mark.parametrize(("mapping", "name", "target"), MANUALS)
def test_what_a_manual_calls_another_name_of_an_object_is_known_as_one(
    mapping: str, name: str, target: str
) -> None:
    names = Names(load_family(mapping))
    entry = names.resolve(name)
    assert target in {str(ref) for ref in names.protection.stands_for(entry.address)}
    why = str(names.protection.why_never(entry))
    assert target in why
    assert entry.name in why


ENGINEERS: Final = [
    # §12.1, §12.2: node address, bit rate, who starts whom, control mode, what the drive watches
    *((LENZE, name) for name in ("C00007", "C00350", "C00351", "C00352", "C00357/1", "C00357/2")),
    *((LENZE, f"C00592/{n}") for n in range(1, 6)),
    *((LENZE, name) for name in ("C00593/1", "C00593/2", "C01501/1", "C01501/2", "C01503/1")),
    # ID 441684.06 §4.1, §8.2.1
    *((STOEBER, name) for name in ("A11.1", "A11.2", "A82", "A83")),
    # BU 2500 §7.1.1, §7.1.2, §7.2, §8.1
    *((TU4, name) for name in ("P120[1]", "P151", "P152", "P168[1]", "P509", "P510[1]", "P510[2]", "P513")),
    *((TU4, name) for name in ("P514", "P515[1]", "P543[1].1", "P546[1].1")),
    *(("nord/sk-5xxe-rj45", f"P{number}.1") for number in (543, 544, 545, 546, 547, 548)),
]


@pytest.mark.landing(38)
@pytest.mark.parametrize(("mapping", "name"), ENGINEERS)
def test_what_commands_watches_or_addresses_a_drive_is_an_engineers(mapping: str, name: str) -> None:
    names = Names(load_family(mapping))
    assert names.protection.level(names.resolve(name).address) == "communication"


# every name, every spelling


def protected(names: Names, mapping: str) -> Iterator[ParameterEntry]:
    """Entries that nobody writes: by the vendor's names, by the file's list, and as objects."""
    family = load_family(mapping)
    for alias in aliases(family):
        yield names.resolve(str(alias.ref))
        yield names.resolve(alias.name.removesuffix(" …"))
        yield from (names.resolve(str(ref)) for ref in alias.objects)
    for entry in names.entries():
        if names.protection.why_never(entry):
            yield entry
    for slot in family.slot:
        for pdo in slot.rpdo:
            for mapped in (one for objects in pdo.objects for one in objects):
                yield from (names.resolve(str(part)) for part in mapped.parts)


def spellings(names: Names, entry: ParameterEntry) -> Iterator[str]:
    index, sub = entry.address.index, entry.address.sub
    yield from (f"{index:04X}:{sub:02X}", f"{index:04x}:{sub:x}", f"0x{index:04X}:{sub:02X}")
    yield from (f"{index:04X}h:{sub:02X}h", f" {index:04X}:0x{sub:X} ")
    if not re.fullmatch(r"[0-9A-F]{4}:[0-9A-F]{2}", entry.name):
        yield from (entry.name, entry.name.lower(), entry.name.upper(), f" {entry.name}\t")
    if names.definitions and entry.definition:
        yield leaf_of(entry.name)
    if re.fullmatch(r"[A-Z]\d+", entry.name):
        yield from (f"{entry.name}.0", f"{entry.name}.1", f"{entry.name[0]}0{entry.name[1:]}")


def access_to(mapping: str) -> DriveParameters:
    family = load_family(mapping)
    return DriveParameters("n/d", "n", family, Names(family), Ledger())


def refused(access: DriveParameters, text: str, address: ObjectRef) -> bool:
    """Whether nothing is sent to a drive. A spelling that means another object, or none, is no case."""
    try:
        entry = access.names.resolve(text)
    except ParameterError:
        return True
    steps = access.write(entry, 1, 0.0, ENGINEER_AT_REST)
    try:
        next(steps)
    except ParameterError as error:
        return error.why in (Why.PROTECTED, Why.READ_ONLY)
    return entry.address != address


@pytest.mark.landing(22)
@pytest.mark.parametrize("mapping", FAMILIES)
def test_no_spelling_of_what_is_protected_is_written(mapping: str) -> None:
    access = access_to(mapping)
    entries = {entry.address: entry for entry in protected(access.names, mapping)}
    assert entries
    for entry in entries.values():
        for text in spellings(access.names, entry):
            assert refused(access, text, entry.address), f"{text} writes {entry.address}"


_ACCESS: Final = {mapping: access_to(mapping) for mapping in FAMILIES}
_TEXTS: Final = st.one_of(
    st.builds(lambda n, s: f"C{n:05d}/{s}", st.integers(320, 420), st.integers(0, 16)),
    st.builds(lambda n: f"c{n:05d}", st.integers(320, 420)),
    st.builds(lambda n, s: f"A{n}.{s}", st.integers(195, 250), st.integers(0, 40)),
    st.builds(lambda n: f"a{n:03d}", st.integers(195, 250)),
    st.builds(lambda n, s: f"p{n}[{s}]", st.integers(150, 180), st.integers(1, 40)),
    st.builds(lambda n, s: f"P{n}.{s}", st.integers(150, 180), st.integers(1, 4)),
    st.builds(lambda i, s: f"{i:04X}:{s:02X}", st.integers(0x1000, 0x60FF), st.integers(0, 255)),
)


@given(st.sampled_from(FAMILIES), _TEXTS)
def test_a_write_that_is_let_through_touches_no_communication_object(mapping: str, text: str) -> None:
    """Judged by the table of the manuals alone."""
    access = _ACCESS[mapping]
    base = mapping if mapping in (LENZE, STOEBER, TU4) else ""
    listed = {access.names.resolve(name).address.index for one, name, _ in MANUALS if one == base}
    try:
        entry = access.names.resolve(text)
        next(access.write(entry, 1, 0.0, ENGINEER_AT_REST))
    except (ParameterError, StopIteration):
        return
    assert entry.address.index not in COMMUNICATION
    assert entry.address.index not in listed


# whole sets


@pytest.mark.parametrize(("mapping", "name"), [(LENZE, "C00323/1"), (STOEBER, "A221.1"), (TU4, "20A2:02")])
def test_a_parameter_set_with_one_is_refused_before_anything_is_written(mapping: str, name: str) -> None:
    access = access_to(mapping)
    harmless = "C00011" if mapping == LENZE else "C01" if mapping == STOEBER else "P102"
    steps = backups.restore(access, {harmless: 100, name: 1}, backups.Restored(), 0.0, ENGINEER_AT_REST)
    with pytest.raises(ParameterError) as raised:
        next(steps)
    assert raised.value.why in (Why.PROTECTED, Why.READ_ONLY)


@pytest.mark.parametrize("mapping", FAMILIES)
def test_no_backup_has_what_cannot_be_restored(mapping: str) -> None:
    access = access_to(mapping)
    for entry in backups.settings(access.names):
        access.check_writable(entry)


# a drive that runs, and what the write would do to it

DEAF: Final = {
    # what makes it deaf, as objects on the wire (index, sub, data), after EDS84DMOTCAN §12.2 and §8.2
    LENZE: [("C00367", 200, 0x5E90, 0, "c800"), ("C00323/1", 1, 0x5EBC, 1, "01")],
    STOEBER: [("A221.1", 1, 0x20DD, 1, "01")],
}


def running(folder: Path, mapping: str) -> tuple[Bench, str]:
    slot = load_family(mapping).slot[0].name
    kind = "guarding" if mapping == STOEBER else "heartbeat"
    drive = sites.drive(slot, "modbus", 20_000, "telegram_downtime_s = 0")
    node = sites.node(drive, name="n", mapping=mapping, more=f'supervision = "{kind}"')
    site = load_site(sites.write(folder, sites.bus(node), sites.modbus()))
    simulated: Any = simulate_node(mapping, 5, {})
    bench = Bench(site, family=load_family(mapping), mapping=mapping, node=simulated)
    bench.run(2.5)
    (name,) = bench.plant.drives
    outcomes: list[Outcome] = []
    bench.view.submit(Request(PLC, name, Start()), outcomes.append)
    bench.run(1.0)
    assert bench.value(f"{name}/status/state") == DriveState.OPERATION_ENABLED
    return bench, name


def state(bench: Bench, name: str) -> object:
    bench.run(1.0)
    return bench.value(f"{name}/status/state")


@pytest.mark.landing(4)
@pytest.mark.parametrize("mapping", DEAF)
@pytest.mark.parametrize("who", [ENGINEER, CONTROLLER], ids=str)
def test_a_drive_is_not_made_deaf_by_another_name(tmp_path: Path, mapping: str, who: Identity) -> None:
    bench, name = running(tmp_path, mapping)
    for parameter, value, *_ in DEAF[mapping]:
        outcomes: list[Outcome] = []
        request = Request(who, name, WriteParameter(parameter=parameter, value=value))
        bench.view.submit(request, outcomes.append)
        bench.run(0.5)
        (outcome,) = outcomes
        assert outcome.code is Code.NOT_ALLOWED
        assert outcome.message.startswith(parameter)
        assert "stands for 1" in outcome.message
    bench.ask(Action.DISABLE_VOLTAGE, name)
    assert state(bench, name) != DriveState.OPERATION_ENABLED


@pytest.mark.parametrize("mapping", DEAF)
def test_a_write_that_reached_the_drive_would_have_made_it_deaf(tmp_path: Path, mapping: str) -> None:
    """Somebody else's: the simulated drive does what the manual says."""
    bench, name = running(tmp_path, mapping)
    for _, _, index, sub, data in DEAF[mapping]:
        size = len(data) // 2
        head = bytes((0x23 | (4 - size) << 2,)) + index.to_bytes(2, "little") + bytes((sub,))
        bench.node.on_frame(Frame(0x605, (head + bytes.fromhex(data)).ljust(8, b"\0")), bench.now)
        bench.run(0.1)
    bench.ask(Action.DISABLE_VOLTAGE, name)
    assert state(bench, name) == DriveState.OPERATION_ENABLED
