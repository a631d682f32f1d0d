"""Mappings that a site file names: loaded, and the file checked against them."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Final, cast

from bridge.base.data_type_texts import text_of_misfit
from bridge.base.errors import Fault, FileFaults
from bridge.canopen.datatypes import DataTypeError
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
from bridge.text import Text
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
            said = Text.of("mapping.no_modules", mapping=name)
            file.fault((*node.key, MODULES), said, Text.of("mapping.no_modules_advice", prefix=DESCRIBED))
            continue
        if file_of_it is not None and not file_of_it.is_file():
            said = Text.of("mapping.no_file", file=str(file_of_it))
            file.fault((*node.key, "mapping"), said, _near(file_of_it))
            continue
        if describe and file_of_it is not None:
            try:
                families[key] = describe(file_of_it, folders, modules_of(key))
            except FileFaults as error:
                for fault in error.faults:
                    if fault.key == MODULES:
                        said = Text.of("file.at", place=str(file_of_it), said=fault.said)
                        file.fault((*node.key, MODULES), said, fault.advice)
                    elif fault not in of_families:
                        of_families.append(fault)
            continue
        if not is_family(name, folders):
            said = missing(name, template=name in template_names(folders))
            is_description = (path.parent / name).is_file()
            hint = (
                Text.of("mapping.description_form", name=f"{DESCRIBED}{name}")
                if is_description
                else _near_family(name, family_names(folders))
            )
            file.fault((*node.key, "mapping"), said, hint)
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


def _near_family(missing: str, known: Sequence[str]) -> Text:
    """Hint to a mapping of nearly that name, else to all that there are."""
    near = difflib.get_close_matches(missing, known, n=1)
    if near:
        return Text.of("toml.did_you_mean", name=f'"{near[0]}"')
    return Text.of("mapping.there_are", names=tuple(known))


def _near(missing: Path) -> Text:
    """Hint to a file of nearly that name, else to how such a name is meant."""
    there = [one.name for one in missing.parent.glob("*") if one.is_file()]
    near = difflib.get_close_matches(missing.name, there, n=1)
    return Text.of("toml.did_you_mean", name=near[0]) if near else Text.of("mapping.no_file_advice")


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
        low, high = facts.node_id_low, facts.node_id_high
        said = Text.of("mapping.node_id_range", family=facts.name, low=low, high=high, id=node_id)
        file.fault((*node.key, "id"), said)
    _check_sdo_channels(node, family, file)
    drives = list(node.tables("drive"))
    if family.is_device and drives:
        said = Text.of("mapping.no_drives", family=facts.name)
        file.fault(drives[0].key, said, Text.of("mapping.no_drives_advice"))
    if not family.is_device and not drives:
        slots = tuple(slot.name for slot in family.slot)
        hint = Text.of("mapping.drives_missing_advice", slots=slots)
        file.fault((*node.key, "drive"), Text.of("toml.missing"), hint)
    if not family.is_device and "unit_id" in node.content:
        hint = Text.of("mapping.unit_id_of_drive_advice")
        file.fault((*node.key, "unit_id"), Text.of("mapping.unit_id_of_drive"), hint)
    for key in ("own_timeout_ms", "enforce"):
        if family.is_device and not family.output and key in node.content:
            file.fault((*node.key, key), Text.of("mapping.time_without_outputs", family=facts.name))
    _check_outputs(node, family, file)
    time_ms = node.whole("own_timeout_ms")
    why_not = impossible(family, time_ms) if time_ms is not None and 1 <= time_ms <= 0xFFFF else ""
    if why_not:
        file.fault((*node.key, "own_timeout_ms"), why_not)


def _check_outputs(node: RawTable, family: Family, file: TomlFile) -> None:
    """Check the names and values of ``[bus.node.outputs]``."""
    if "outputs" not in node.content:
        return
    outputs = node.table("outputs")
    if not family.output:
        said = Text.of("mapping.no_outputs", family=family.family.name)
        file.fault(outputs.key, said, Text.of("mapping.no_outputs_advice"))
        return
    known = {output.name: output for output in family.output}
    for name, value in outputs.table("on_expiry").content.items():
        key = (*outputs.key, "on_expiry", name)
        if name not in known:
            hint = Text.of("mapping.outputs_there", names=tuple(known))
            file.fault(key, Text.of("mapping.no_output", name=name), hint)
        elif value != "hold":
            try:
                known[name].encode(value)
            except ValueNotTaken as error:
                file.fault(key, error.said, Text.of("mapping.on_expiry_advice"))


def _check_sdo_channels(node: RawTable, family: Family, file: TomlFile) -> None:
    """Check that the further SDO channels to be opened are ones the family has."""
    known = [server.number for server in family.sdo]
    asked: object = node.content.get("sdo_channels")
    if not isinstance(asked, list):
        return
    numbers = cast("list[object]", asked)
    for place, number in enumerate(numbers):
        if isinstance(number, int) and number >= 2 and number not in known:
            there = tuple(map(str, known))
            hint = Text.of("mapping.it_has", names=there) if there else Text.of("mapping.first_channel_only")
            said = Text.of("mapping.no_sdo_channel", family=family.family.name, number=number)
            file.fault((*node.key, "sdo_channels"), said, hint)
        elif number in numbers[:place]:
            file.fault((*node.key, "sdo_channels"), Text.of("mapping.sdo_channel_twice", number=str(number)))


def _check_drive(drive: RawTable, family: Family, file: TomlFile) -> None:
    slot = drive.text("slot")
    slots = [slot.name for slot in family.slot]
    if slot is not None and slot not in slots:
        said = Text.of("mapping.family_without_slot", family=family.family.name, slot=slot)
        file.fault((*drive.key, "slot"), said, Text.of("mapping.it_has", names=tuple(slots)))
    if slot in slots:
        _check_pdos(drive, family, slot, file)
    scales = {name for value in family.value for name in value.scaled_by}
    given = drive.table("parameters")
    for name in given.content:
        parameter, in_set = family.parameter_and_set(name)
        if parameter not in scales or not 1 <= in_set <= family.sets:
            said = Text.of("mapping.no_scale", family=family.family.name, parameter=name)
            hint = Text.of("mapping.scales_with", parameters=tuple(sorted(scales))) if scales else ""
            file.fault((*given.key, name), said, hint)


def _check_sync_period(bus: RawTable, drive: RawTable, family: Family, file: TomlFile) -> None:
    """Check that the SYNC period can be written into the drive, where its family asks for that."""
    period_ms = bus.whole(SYNC_PERIOD)
    if period_ms is None:
        return
    for start in (start for slot in family.slot if slot.name == drive.text("slot") for start in slot.start):
        if not start.is_sync_period:
            continue
        written = Text.of(
            "mapping.sync_period_written",
            family=family.family.name,
            object=str(start.object),
            type=start.type,
        )
        try:
            start.download(period_ms)
        except DataTypeError as error:
            said = Text.of("mapping.sync_period_unfit", written=written, why=text_of_misfit(error))
            file.fault((*bus.key, SYNC_PERIOD), said)
        if period_ms == 0:
            file.fault((*bus.key, SYNC_PERIOD), Text.of("mapping.sync_period_zero", written=written))


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
            pdo = f"{name.upper()}{place}"
            if place not in numbers:
                said = Text.of("mapping.no_pdo", slot=slot, family=family.family.name, pdo=pdo)
                file.fault(key, said, Text.of("mapping.it_has", names=tuple(map(str, numbers))))
            elif place in seen:
                file.fault(key, Text.of("mapping.two_tables", pdo=pdo))
            seen.append(place)
