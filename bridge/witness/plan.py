"""What the witness looks at: the drives of a site, their frames, and when they have to stand."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any, Final

from bridge.config import IGNORE_ALL_S, BusTable, DriveTable, NodeTable, Site

REACTION_MS: Final = 20
"""How late the bridge may be itself (docs/explanation/dead-man-chain.md, "How long it takes")."""
_TPDO_MS: Final = 500
"""How often a drive says what it does, where the site file does not tell."""
_RAMP_MS: Final = 5000
"""How long a drive may take to stand, where the site file does not tell."""
_FIRST_UNITS: Final = range(1, 248)


@dataclass(frozen=True, slots=True)
class Word:
    """A word in a PDO, and the bits by which it says "enabled"."""

    byte: int
    bytes: int
    mask: int
    value: int

    def enables(self, data: bytes) -> bool | None:
        """None where the frame is too short to hold the word."""
        part = data[self.byte : self.byte + self.bytes]
        if len(part) < self.bytes:
            return None
        return int.from_bytes(part, "little") & self.mask == self.value


@dataclass(frozen=True, slots=True)
class WatchedDrive:
    """One drive. Times are in ms; 0 where nothing is promised.

    ``stop_ms``: from the owner's last telegram to the last enabling RPDO. ``silent_ms``: from the last RPDO
    to a drive that says that it is not enabled. ``follow_ms``: from a stop in an RPDO to the same.
    """

    name: str
    unit_id: int
    rpdo: int
    tpdo: int
    control: Word
    status: Word
    timeout_ms: int
    stop_ms: int
    silent_ms: int
    follow_ms: int


@dataclass(frozen=True, slots=True)
class WatchedBus:
    """``beats`` has what is sent by the bridge alone, with its period in ms, by identifier."""

    name: str
    channel: str
    drives: tuple[WatchedDrive, ...]
    beats: dict[int, tuple[str, int]]


class UnknownFamily(Exception):
    """The witness does not know the drives of this mapping."""


@cache
def _families() -> list[dict[str, Any]]:
    text = resources.files("bridge.witness").joinpath("families.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)["family"]


def _family(mapping: str) -> dict[str, Any]:
    for family in _families():
        for name in family["mappings"]:
            if mapping == name or (name.endswith("/") and mapping.startswith(name)):
                return family
    raise UnknownFamily(mapping)


def plan(site: Site, *, own_timeout_ms: int | None = None) -> list[WatchedBus]:
    """The buses of a site. ``own_timeout_ms``: what the drives' own time-outs are, where the site file does
    not set them. Raises ``UnknownFamily``."""
    units = _unit_ids(site)
    return [_bus(bus, units, own_timeout_ms) for bus in site.bus]


def _bus(bus: BusTable, units: dict[tuple[str, int], int], own_timeout_ms: int | None) -> WatchedBus:
    drives = [
        _drive(bus, node, table, _family(node.mapping), units[node.name, place], own_timeout_ms)
        for node in bus.node
        if node.enabled
        for place, table in enumerate(node.drive)
    ]
    beats: dict[int, tuple[str, int]] = {}
    if bus.sync_period_ms:
        beats[0x080] = ("SYNC", bus.sync_period_ms)
    if bus.heartbeat_ms:
        beats[0x700 + bus.master_node_id] = ("the bridge's heartbeat", bus.heartbeat_ms)
    return WatchedBus(bus.name, bus.channel or "", tuple(drives), beats)


def _drive(
    bus: BusTable,
    node: NodeTable,
    table: DriveTable,
    family: dict[str, Any],
    unit_id: int,
    own_timeout_ms: int | None,
) -> WatchedDrive:
    slot = family["slots"].get(table.slot) or next(iter(family["slots"].values()))
    period_ms = round(bus.rpdo_period_s * 1000)
    tpdo_ms = _tpdo_ms(table)
    timeout_ms = table.fieldbus_timeout_ms or 0
    is_watched = timeout_ms and table.telegram_downtime_s != IGNORE_ALL_S and table.on_expiry != "hold"
    own_ms = node.own_timeout_ms or own_timeout_ms or 0
    return WatchedDrive(
        name=f"{node.name}/{table.name or (table.slot if len(node.drive) > 1 else 'drive')}",
        unit_id=unit_id,
        rpdo=_cob_id(table, "rpdo", slot["rpdo"] + node.id),
        tpdo=_cob_id(table, "tpdo", slot["tpdo"] + node.id),
        control=Word(**family["control"]),
        status=Word(**family["status"]),
        timeout_ms=timeout_ms,
        stop_ms=timeout_ms + 2 * period_ms + REACTION_MS if is_watched else 0,
        silent_ms=own_ms + tpdo_ms if own_ms else 0,
        follow_ms=3 * tpdo_ms + _RAMP_MS,
    )


def _cob_id(table: DriveTable, kind: str, factory: int) -> int:
    for pdo in getattr(table, kind):
        if pdo.cob_id is not None:
            return int(pdo.cob_id)
    return factory


def _tpdo_ms(table: DriveTable) -> int:
    times = [pdo.event_ms for pdo in table.tpdo if pdo.event_ms]
    return max(times, default=table.tpdo_deadline_ms or _TPDO_MS)


def _unit_ids(site: Site) -> dict[tuple[str, int], int]:
    """As docs/reference/modbus.md says: those of the site file, the others in order from 1."""
    places = [
        (node.name, place, drive.unit_id)
        for bus in site.bus
        for node in bus.node
        for place, drive in enumerate(node.drive)
    ]
    given = {unit for _, _, unit in places if unit}
    free: Iterator[int] = (unit for unit in _FIRST_UNITS if unit not in given)
    return {(name, place): unit or next(free) for name, place, unit in places}
