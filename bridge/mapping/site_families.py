"""Mappings that a site file names: loaded, and the file checked against them."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final, cast

from bridge.base.errors import Fault, FileFaults
from bridge.config import MODULES, Site, mapping_key, read_site
from bridge.image.limits import ValueNotTaken
from bridge.mapping.loader import (
    family_names,
    is_family,
    load_family,
    mapping_folders,
    missing,
    template_names,
)
from bridge.mapping.model import Family
from bridge.mapping.own_places import impossible
from bridge.mapping.process import SYNC_PERIOD
from bridge.tomlfile import RawTable, TomlFile

DESCRIBED: Final = "eds:"
"""Prefix that marks the name of a device description in the place of a mapping."""
Describe = Callable[[Path, Sequence[Path], Sequence[str]], Family]
"""Gives the family of a device description, with the folders of mappings and the modules that are plugged in.
Raises ``FileFaults``."""


def described_file(site: Path, key: str) -> Path | None:
    """Device description that a node of the site file in ``site`` has in the place of a mapping; ``key`` is
    its ``mapping_key``."""
    mapping = key.partition("\n")[0]
    return site.parent / mapping.removeprefix(DESCRIBED) if mapping.startswith(DESCRIBED) else None


def modules_of(key: str) -> tuple[str, ...]:
    """Modules that are plugged into a node with this ``mapping_key``, in their order."""
    return tuple(key.split("\n")[1:])


def load_site_and_families(path: Path, describe: Describe | None = None) -> tuple[Site, dict[str, Family]]:
    """Site file and every mapping it names; ``describe`` gives those of device descriptions. Raises
    ``FileFaults`` with all faults of all files."""
    file, site = read_site(path)
    families: dict[str, Family] = {}
    of_families: list[Fault] = []
    folders = mapping_folders(path)
    for node in _nodes(file):
        name, key = node.text("mapping"), _key(node)
        if name is None or key in families:
            continue
        file_of_it = described_file(path, name)
        if MODULES in node.content and file_of_it is None:
            hint = f'a coupler has its EDS as its mapping, "{DESCRIBED}FILE"'
            file.fault((*node.key, MODULES), f"{name} knows of no modules", hint)
            continue
        if file_of_it is not None and not file_of_it.is_file():
            file.fault((*node.key, "mapping"), f"there is no file {file_of_it}", _near(file_of_it))
            continue
        if describe and file_of_it is not None:
            try:
                families[key] = describe(file_of_it, folders, modules_of(key))
            except FileFaults as error:
                for fault in error.faults:
                    if fault.key == MODULES:
                        file.fault((*node.key, MODULES), f"{file_of_it}: {fault.message}", fault.hint)
                    elif fault not in of_families:
                        of_families.append(fault)
            continue
        if not is_family(name, folders):
            known, templates = family_names(folders), template_names(folders)
            near = difflib.get_close_matches(name, known, n=1)
            hint = f'did you mean "{near[0]}"?' if near else f"there are: {', '.join(known)}"
            if (path.parent / name).is_file():
                hint = f'a device description is "{DESCRIBED}{name}"'
            file.fault((*node.key, "mapping"), missing(name, template=name in templates), hint)
            continue
        try:
            families[name] = load_family(name, folders)
        except FileFaults as error:
            of_families += [fault for fault in error.faults if fault not in of_families]
    _check(file, families)
    faults = sorted(file.faults, key=lambda fault: fault.line) + of_families
    if faults or site is None:
        raise FileFaults(faults)
    return site, families


def _near(missing: Path) -> str:
    """Hint to a file of nearly that name, else to how such a name is meant."""
    there = [one.name for one in missing.parent.glob("*") if one.is_file()]
    near = difflib.get_close_matches(missing.name, there, n=1)
    return f"did you mean {near[0]}?" if near else "a name is relative to the site file"


def _nodes(file: TomlFile) -> list[RawTable]:
    return [node for bus in file.root.tables("bus") for node in bus.tables("node")]


def _key(node: RawTable) -> str:
    """The node's ``mapping_key``, as far as the table tells it."""
    modules: object = node.content.get(MODULES)
    named = cast("list[object]", modules) if isinstance(modules, list) else []
    return mapping_key(node.text("mapping") or "", [one for one in named if isinstance(one, str)])


def _check(file: TomlFile, families: dict[str, Family]) -> None:
    for bus in file.root.tables("bus"):
        for node in bus.tables("node"):
            family = families.get(_key(node))
            if family is not None:
                _check_node(node, family, file)
                for drive in node.tables("drive"):
                    _check_drive(drive, family, file)
                    _check_sync_period(bus, drive, family, file)


def _check_node(node: RawTable, family: Family, file: TomlFile) -> None:
    facts = family.family
    node_id = node.whole("id")
    if node_id is not None and not facts.node_id_low <= node_id <= facts.node_id_high:
        allowed = f"{facts.node_id_low}…{facts.node_id_high}"
        file.fault((*node.key, "id"), f"{facts.name} has addresses {allowed}, not {node_id}")
    _check_sdo_channels(node, family, file)
    drives = list(node.tables("drive"))
    if family.is_device and drives:
        file.fault(drives[0].key, f"{facts.name} is no drive and has none", "leave [[bus.node.drive]] out")
    if not family.is_device and not drives:
        slots = ", ".join(slot.name for slot in family.slot)
        file.fault((*node.key, "drive"), "is missing", f"a [[bus.node.drive]] for each drive; slots: {slots}")
    if not family.is_device and "unit_id" in node.content:
        file.fault((*node.key, "unit_id"), "each drive has its own", "put it into [[bus.node.drive]]")
    for key in ("own_timeout_ms", "enforce"):
        if family.is_device and not family.output and key in node.content:
            file.fault((*node.key, key), f"{facts.name} has no outputs: has no effect")
    _check_outputs(node, family, file)
    time_ms = node.whole("own_timeout_ms")
    why = impossible(family, time_ms) if time_ms is not None and 1 <= time_ms <= 0xFFFF else ""
    if why:
        file.fault((*node.key, "own_timeout_ms"), why)


def _check_outputs(node: RawTable, family: Family, file: TomlFile) -> None:
    """Check the names and values of ``[bus.node.outputs]``."""
    if "outputs" not in node.content:
        return
    outputs = node.table("outputs")
    if not family.output:
        file.fault(outputs.key, f"{family.family.name} has no outputs", "leave [bus.node.outputs] out")
        return
    known = {output.name: output for output in family.output}
    for name, value in outputs.table("on_expiry").content.items():
        key = (*outputs.key, "on_expiry", name)
        if name not in known:
            file.fault(key, f"there is no output {name!r}", f"there are {', '.join(known)}")
        elif value != "hold":
            try:
                known[name].encode(value)
            except ValueNotTaken as error:
                file.fault(key, error.said, 'a value, or "hold"')


def _check_sdo_channels(node: RawTable, family: Family, file: TomlFile) -> None:
    """Check that the further SDO channels to be opened are ones the family has."""
    known = [server.number for server in family.sdo]
    asked: object = node.content.get("sdo_channels")
    if not isinstance(asked, list):
        return
    numbers = cast("list[object]", asked)
    for place, number in enumerate(numbers):
        if isinstance(number, int) and number >= 2 and number not in known:
            hint = f"it has {', '.join(map(str, known))}" if known else "it has the first one only"
            message = f"{family.family.name} has no SDO channel {number}"
            file.fault((*node.key, "sdo_channels"), message, hint)
        elif number in numbers[:place]:
            file.fault((*node.key, "sdo_channels"), f"SDO channel {number} is there twice")


def _check_drive(drive: RawTable, family: Family, file: TomlFile) -> None:
    slot = drive.text("slot")
    slots = [slot.name for slot in family.slot]
    if slot is not None and slot not in slots:
        message = f"{family.family.name} has no slot {slot!r}"
        file.fault((*drive.key, "slot"), message, f"it has {', '.join(slots)}")
    if slot in slots:
        _check_pdos(drive, family, slot, file)
    scales = {name for value in family.value for name in value.scaled_by}
    given = drive.table("parameters")
    for name in given.content:
        parameter, in_set = family.parameter_and_set(name)
        if parameter not in scales or not 1 <= in_set <= family.sets:
            message = f"{family.family.name} does not scale with {name!r}"
            hint = f"it scales with {', '.join(sorted(scales))}" if scales else ""
            file.fault((*given.key, name), message, hint)


def _check_sync_period(bus: RawTable, drive: RawTable, family: Family, file: TomlFile) -> None:
    """Check that the SYNC period can be written into the drive, where its family asks for that."""
    period_ms = bus.whole(SYNC_PERIOD)
    if period_ms is None:
        return
    for start in (start for slot in family.slot if slot.name == drive.text("slot") for start in slot.start):
        if not start.is_sync_period:
            continue
        written = f"{family.family.name} writes it into {start.object} of {start.type}"
        try:
            start.download(period_ms)
        except ValueError as error:
            file.fault((*bus.key, SYNC_PERIOD), f"{written}: {error}")
        if period_ms == 0:
            file.fault((*bus.key, SYNC_PERIOD), f"must not be 0: {written}")


def _check_pdos(drive: RawTable, family: Family, slot: str, file: TomlFile) -> None:
    """Check that each table for a PDO is for one that the drive has, and that no PDO has two."""
    it = family.slot_named(slot)
    for name, pdos in (("rpdo", it.rpdo), ("tpdo", it.tpdo)):
        numbers = [pdo.number for pdo in pdos]
        tables = list(drive.tables(name)) or [drive.table(name)] * (name in drive.content)
        seen: list[int] = []
        for table in tables:
            number = table.whole("number")
            place = numbers[0] if number is None else number
            key = (*table.key, "number")
            if place not in numbers:
                hint = f"it has {', '.join(map(str, numbers))}"
                file.fault(key, f"{slot} of {family.family.name} has no {name.upper()}{place}", hint)
            elif place in seen:
                file.fault(key, f"there are two tables for {name.upper()}{place}")
            seen.append(place)
