"""A bus of the site file as the linter sees it: each node with its family, each PDO with what is known of it.

The site file comes first, then the configuration that is downloaded, then the factory settings in the
family's own dictionary (an EDS beside the mapping file), then the mapping file. The node itself may differ;
the boot-up reads that.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from bridge.canopen import cobid
from bridge.canopen.sync import LAST_SYNCHRONOUS, REMOTE_TYPES
from bridge.config import BusTable, DriveTable, NodeTable, PdoTable
from bridge.config.download import Download
from bridge.eds import Description
from bridge.eds.pdos import PdoSummary, pdos
from bridge.lint.node_downloads import RPDO, TPDO, NodeDownloads, pdo_cob_id
from bridge.mapping.model import Family, ObjectRef, Pdo
from bridge.node.boot import factory_entries
from bridge.tomlfile import Key

EVENT_DRIVEN: Final = 254
_FACTORY_TYPE: Final = 255
_EMCY: Final = 0x1014
_WORD_BITS: Final = 16

Downloads = Mapping[str, Sequence[Download]]
"""Downloads of the configuration files, by the node's name."""


@dataclass(frozen=True, slots=True)
class CheckedPdo:
    """One PDO of a node. ``length`` is in bytes; ``sent`` says whether the bridge uses it.

    ``cob_id_key`` and ``type_key`` are the keys that give it its COB-ID and its transmission type; None
    where those are the factory's.
    """

    name: str
    key: Key
    receives: bool
    enabled: bool = False
    cob_id: int = 0
    length: int = 0
    transmission_type: int = _FACTORY_TYPE
    inhibit_ms: float = 0.0
    event_ms: int = 0
    sent: bool = False
    rtr_poll_ms: int = 0
    number: int = 0
    words: int = 0
    """Number of the drive's words that it carries by the mapping file."""
    is_optional: bool = False
    cob_id_key: Key | None = None
    type_key: Key | None = None

    @property
    def is_synchronous(self) -> bool:
        return self.transmission_type <= LAST_SYNCHRONOUS

    @property
    def is_polled(self) -> bool:
        """True if the bridge asks for it by remote frame."""
        return self.transmission_type in REMOTE_TYPES and bool(self.rtr_poll_ms)

    def period_s(self, sync_s: float) -> float | None:
        """Longest time between two TPDOs in seconds, None where nothing makes it regular."""
        kind = self.transmission_type
        if 1 <= kind <= LAST_SYNCHRONOUS and sync_s:
            return kind * sync_s
        if self.is_polled:
            return self.rtr_poll_ms / 1000
        if kind >= EVENT_DRIVEN and self.event_ms:
            return self.event_ms / 1000
        return None

    def shortest_s(self, sync_s: float) -> float | None:
        """Shortest time between two TPDOs in seconds, None where nothing limits it."""
        if self.is_synchronous:
            return max(1, self.transmission_type) * sync_s or None
        if self.is_polled:
            return self.rtr_poll_ms / 1000
        return self.inhibit_ms / 1000 or self.period_s(sync_s)


@dataclass(frozen=True, slots=True)
class CheckedDrive:
    table: DriveTable
    key: Key
    name: str
    rpdos: tuple[CheckedPdo, ...]
    tpdos: tuple[CheckedPdo, ...]
    """TPDOs in use, those with control and status word first."""


@dataclass(frozen=True, slots=True)
class CheckedNode:
    table: NodeTable
    family: Family
    dictionary: Description | None
    key: Key
    drives: tuple[CheckedDrive, ...]
    pdos: tuple[CheckedPdo, ...]
    """All PDOs of the node, including those of drives that the site file does not name."""
    settings: NodeDownloads
    emcy_id: int | None = None
    """Identifier of its emergency messages (1014h), None where they are off."""


@dataclass(frozen=True, slots=True)
class CheckedBus:
    table: BusTable
    key: Key
    nodes: tuple[CheckedNode, ...]

    @property
    def sync_s(self) -> float:
        """Period of SYNC in seconds, 0 without one."""
        return self.table.sync_period_ms / 1000


def view_bus(
    bus: BusTable,
    key: Key,
    families: Mapping[str, Family],
    dictionaries: Mapping[str, Description],
    downloads: Downloads,
) -> CheckedBus:
    nodes: list[CheckedNode] = []
    for n, table in enumerate(bus.node):
        node_key = (*key, "node", n)
        family = families[table.mapping_key]
        settings = NodeDownloads(table, family, node_key, downloads.get(table.name, ()))
        dictionary = dictionaries.get(table.mapping_key)
        nodes.append(_node(table, node_key, family, dictionary, settings))
    return CheckedBus(bus, key, tuple(nodes))


def _node(
    table: NodeTable, key: Key, family: Family, dictionary: Description | None, settings: NodeDownloads
) -> CheckedNode:
    known = {(one.receives, one.number): one for one in pdos(dictionary, table.id)} if dictionary else {}
    by_slot = {drive.slot: (d, drive) for d, drive in enumerate(table.drive)}
    drives: list[CheckedDrive] = []
    found: list[CheckedPdo] = []
    used: set[tuple[bool, int]] = set()
    for slot in family.slot:
        d, drive = by_slot.get(slot.name, (None, None))
        drive_key: Key = key if d is None else (*key, "drive", d)
        views: dict[bool, list[CheckedPdo]] = {True: [], False: []}
        for receives, pdos_of in ((True, slot.rpdo), (False, slot.tpdo)):
            process = family.process.rpdo if receives else family.process.tpdo
            for pdo in sorted(pdos_of, key=lambda pdo: process[0] not in (pdo.words or process)):
                used.add((receives, pdo.number))
                summary = known.get((receives, pdo.number))
                view = _slot_pdo(pdo, receives, summary, table.id, drive_key)
                view = _downloaded(view, pdo.number, _entry_bits(summary, len(pdo.objects)), settings)
                is_first = pdo is pdos_of[0]
                views[receives].append(_from_site(view, drive, is_first=is_first) if drive else view)
        found += [*views[True], *views[False]]
        if drive:
            name = f"{table.name}/{family.leaf_of(drive)}"
            drives.append(CheckedDrive(drive, drive_key, name, tuple(views[True]), tuple(views[False])))
    # PDOs that no drive uses may still collide, and are those of a node that is no drive.
    others = {place: _other_pdo(one, key, family) for place, one in known.items() if place not in used}
    for place in settings.pdos():
        if place not in used:
            others.setdefault(place, _unknown_pdo(*place, key))
    for place, view in others.items():
        found.append(_downloaded(view, place[1], _entry_bits(known.get(place), 0), settings))
    emcy_id = dictionary.number(_EMCY, 0, table.id) if dictionary else None
    return CheckedNode(
        table,
        family,
        dictionary,
        key,
        tuple(drives),
        tuple(found),
        settings,
        settings.emcy_id(cobid.EMCY + table.id if emcy_id is None else emcy_id),
    )


def _slot_pdo(pdo: Pdo, receives: bool, summary: PdoSummary | None, node_id: int, key: Key) -> CheckedPdo:
    """A drive's PDO as the factory has it, or as the mapping file writes it."""
    kind = summary.transmission_type if summary else None
    inhibit_ms = summary.inhibit_100us / 10 if summary else 0.0
    event_ms = summary.event_timer_ms if summary else 0
    bits = sum(entry.bits for entry in factory_entries(pdo))
    if summary and summary.bits and not pdo.write:
        bits = summary.bits
    return CheckedPdo(
        name=f"{'RPDO' if receives else 'TPDO'}{pdo.number}",
        key=key,
        receives=receives,
        number=pdo.number,
        words=len(pdo.objects),
        is_optional=pdo.optional,
        enabled=pdo.write or not pdo.optional,
        cob_id=pdo.cob_id + node_id,
        length=(bits + 7) // 8,
        transmission_type=_either(pdo.transmission_type, _FACTORY_TYPE if kind is None else kind),
        inhibit_ms=inhibit_ms if pdo.inhibit_ms is None else pdo.inhibit_ms,
        event_ms=_either(pdo.event_ms, event_ms),
    )


def _entry_bits(summary: PdoSummary | None, words: int) -> list[int]:
    """The lengths of a PDO's objects at the factory: by the dictionary, else that many words."""
    if summary and summary.mapped:
        return [one.bits for one in summary.mapped]
    return [_WORD_BITS] * words


def _downloaded(view: CheckedPdo, number: int, have: Sequence[int], settings: NodeDownloads) -> CheckedPdo:
    """``view`` with what is downloaded to its communication and its mapping object."""
    index, mapping = (base + number - 1 for base in (RPDO if view.receives else TPDO))
    cob_id, kind = settings[index, 1], settings[index, 2]
    is_mapped = any(True for _ in settings.of(mapping))
    return replace(
        view,
        enabled=view.enabled if cob_id is None else not cob_id.value & cobid.PDO_DISABLED,
        cob_id=view.cob_id if cob_id is None else pdo_cob_id(cob_id.value),
        cob_id_key=cob_id.key if cob_id else None,
        length=(settings.mapped_bits(mapping, have) + 7) // 8 if is_mapped else view.length,
        transmission_type=view.transmission_type if kind is None else kind.value,
        type_key=kind.key if kind else None,
        inhibit_ms=settings.number(index, 3, round(10 * view.inhibit_ms)) / 10,
        event_ms=settings.number(index, 5, view.event_ms),
    )


def _from_site(view: CheckedPdo, drive: DriveTable, *, is_first: bool) -> CheckedPdo:
    """``view`` with what the site file's table for this PDO sets; one without a number is for the first."""
    tables = drive.rpdo if view.receives else drive.tpdo
    poll_ms = 0 if view.receives else drive.rtr_poll_ms
    numbers = (view.number, None) if is_first else (view.number,)
    place = next((place for place, table in enumerate(tables) if table.number in numbers), None)
    if place is None:
        return replace(view, sent=view.enabled, rtr_poll_ms=poll_ms)
    own = tables[place]
    name = "rpdo" if view.receives else "tpdo"
    key = (*view.key, name, place) if len(tables) > 1 else (*view.key, name)
    return replace(
        view,
        key=key,
        enabled=own.enable,
        cob_id=own.cob_id or view.cob_id,
        cob_id_key=(*key, "cob_id") if own.cob_id else view.cob_id_key,
        length=_bytes(own) or view.length,
        transmission_type=_either(own.transmission_type, view.transmission_type),
        type_key=view.type_key if own.transmission_type is None else (*key, "transmission_type"),
        inhibit_ms=view.inhibit_ms if own.inhibit_ms is None else own.inhibit_ms,
        event_ms=_either(own.event_ms, view.event_ms),
        sent=own.enable,
        rtr_poll_ms=poll_ms,
    )


def _bytes(own: PdoTable) -> int:
    return (sum(one.bits for one in own.mapping) + 7) // 8


def _either(own: int | None, other: int) -> int:
    return other if own is None else own


def _other_pdo(summary: PdoSummary, key: Key, family: Family) -> CheckedPdo:
    """A PDO that the family's dictionary has and no drive uses. The bridge sends those with outputs."""
    outputs = {output.object for output in family.output}
    is_sent = summary.receives and any(ObjectRef(one.index, one.sub) in outputs for one in summary.mapped)
    return CheckedPdo(
        summary.name,
        key,
        summary.receives,
        summary.enabled and summary.cob_id is not None,
        summary.cob_id or 0,
        (summary.bits + 7) // 8,
        _FACTORY_TYPE if summary.transmission_type is None else summary.transmission_type,
        summary.inhibit_100us / 10,
        summary.event_timer_ms,
        number=summary.number,
        sent=summary.enabled and is_sent,
    )


def _unknown_pdo(receives: bool, number: int, key: Key) -> CheckedPdo:
    """A PDO that only the configuration mentions."""
    name = f"{'RPDO' if receives else 'TPDO'}{number}"
    return CheckedPdo(name, key, receives)
