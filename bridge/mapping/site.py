"""What a site file asks of the mappings it names."""

from __future__ import annotations

import difflib
from pathlib import Path
from typing import cast

from bridge.config import Site, read_site
from bridge.errors import Fault, FileFaults
from bridge.mapping.loader import family_names, load_family
from bridge.mapping.model import Family
from bridge.tomlfile import RawTable, TomlFile


def load_site_and_families(path: Path) -> tuple[Site, dict[str, Family]]:
    """A site file and every mapping it names. Raises ``FileFaults`` with all faults of all files."""
    file, site = read_site(path)
    families: dict[str, Family] = {}
    of_families: list[Fault] = []
    known = family_names()
    for node in _nodes(file):
        name = node.text("mapping")
        if name is None or name in families:
            continue
        if name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            hint = f'did you mean "{near[0]}"?' if near else f"there are: {', '.join(known)}"
            file.fault((*node.key, "mapping"), f"there is no mapping {name!r}", hint)
            continue
        try:
            families[name] = load_family(name)
        except FileFaults as error:
            of_families += [fault for fault in error.faults if fault not in of_families]
    _check(file, families)
    faults = sorted(file.faults, key=lambda fault: fault.line) + of_families
    if faults or site is None:
        raise FileFaults(faults)
    return site, families


def _nodes(file: TomlFile) -> list[RawTable]:
    return [node for bus in file.root.tables("bus") for node in bus.tables("node")]


def _check(file: TomlFile, families: dict[str, Family]) -> None:
    for node in _nodes(file):
        family = families.get(node.text("mapping") or "")
        if family is not None:
            _check_node(node, family, file)
            for drive in node.tables("drive"):
                _check_drive(drive, family, file)


def _check_node(node: RawTable, family: Family, file: TomlFile) -> None:
    facts = family.family
    node_id = node.whole("id")
    if node_id is not None and not facts.node_id_low <= node_id <= facts.node_id_high:
        allowed = f"{facts.node_id_low}…{facts.node_id_high}"
        file.fault((*node.key, "id"), f"{facts.name} has addresses {allowed}, not {node_id}")
    _check_sdo_channels(node, family, file)


def _check_sdo_channels(node: RawTable, family: Family, file: TomlFile) -> None:
    """The further SDO channels that are to be opened must be ones the family has."""
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
    scales = {value.scale.full for value in family.value}
    given = drive.table("parameters")
    for name in given.content:
        if name not in scales:
            message = f"{family.family.name} does not scale with {name!r}"
            file.fault((*given.key, name), message, f"it scales with {', '.join(sorted(scales))}")
