"""Plan of the witness: a site's drives and outputs, their frames, and the times within which they must
stop."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, Final

from bridge.config import IGNORE_ALL_S, BusTable, DriveTable, NodeTable, PdoTable, Site
from bridge.witness.output_plan import OutputFrames, Values, output_frames

REACTION_MS: Final = 20
"""Greatest lateness of the bridge itself, ms (docs/explanation/dead-man-chain.md, "How long it takes")."""
_FRAME_BITS: Final = 135
"""Bits of a data frame of eight bytes with all its stuff bits, and the pause after it (ISO 11898-1)."""
_BEFORE_OF_EACH: Final = 5
"""Frames that each node and each drive may have waiting before one of ours, with all that is sent meanwhile
(docs/explanation/dead-man-chain.md, "The witness")."""
_IDLE_LEAST: Final = 0.2
"""Least idle share of a bus that is assumed."""
_QUEUE_MS: Final = 50
"""Longest wait of a frame for an interface that is none of the kernel's, ms."""
_TPDO_MS: Final = 500
"""Period of a drive's TPDO in ms, where the site file sets none."""
RAMP_MS: Final = 5000
"""Longest time for a drive to stand still in ms, where the site file sets none."""
UNKNOWN_MS: Final = 3000
"""Longest time in ms from the last RPDO to a stopped drive, where its own time-out is not known."""
FRESH_S: Final = 0.5
"""Silence in seconds after which the bridge may have been restarted."""
_SWITCH_MS: Final = 500
"""Longest time for an output to switch, ms."""
_LOST_MS: Final = 1000
"""Time in ms by which a node may be silent for longer than its supervision: it may have been told to
restart."""
_FIRST_UNITS: Final = range(1, 248)
_NUMBERS: Final = {base + 0x100 * place: place + 1 for base in (0x180, 0x200) for place in range(4)}
"""PDO numbers by identifier without node id (CiA 301 §7.3.5)."""


@dataclass(frozen=True, slots=True)
class EnableWord:
    """A word in a PDO, and the bits by which it says "enabled"."""

    byte: int
    bytes: int
    mask: int
    value: int

    def enables(self, data: bytes) -> bool | None:
        """True if the word in ``data`` says "enabled"; None where the frame is too short to hold it."""
        part = data[self.byte : self.byte + self.bytes]
        if len(part) < self.bytes:
            return None
        return int.from_bytes(part, "little") & self.mask == self.value


@dataclass(frozen=True, slots=True)
class Speed:
    """A signed number in a PDO."""

    byte: int
    bytes: int

    def of(self, data: bytes) -> int | None:
        part = data[self.byte : self.byte + self.bytes]
        return int.from_bytes(part, "little", signed=True) if len(part) == self.bytes else None


@dataclass(frozen=True, slots=True)
class WatchedDrive:
    """One drive. Times are in ms.

    ``timeout_ms`` is the owner's time-out as long as the bridge does not tell the one in force. From the
    owner's last telegram to the last enabling RPDO it takes ``beside_ms`` more, None where no stop is
    promised. ``silent_ms``: from the last RPDO to a drive that says that it is not enabled, 0 where that is
    not promised. ``follow_ms``: from a stop in an RPDO to the same.
    """

    name: str
    unit_id: int
    rpdo: int
    tpdo: int
    control: EnableWord
    status: EnableWord
    timeout_ms: int
    beside_ms: int | None
    silent_ms: int
    follow_ms: int
    node_id: int = 0
    rpdo_ms: float = 0.0
    """Period in ms at which the bridge repeats its RPDO."""
    speed: Speed | None = None
    """Speed in its TPDO, None where there is none."""
    nmt_stops: bool = False
    """True if it does not run in the NMT state Stopped."""
    lost_ms: int = 0
    """Silence of its node in ms after which it counts as cut off; 0 where that is not known."""

    def stop_ms(self, timeout_ms: int) -> int:
        """Longest time in ms from the owner's last telegram to the last enabling RPDO, with this time-out in
        force; 0 where nothing is promised."""
        return promised_ms(timeout_ms, self.beside_ms)

    def promise(self, *, has_numbers: bool) -> str:
        """The bounds to which it is held; without telegrams' numbers a silent controller is not judged."""
        stop_ms = self.stop_ms(self.timeout_ms) if has_numbers else 0
        controller = f"{stop_ms} ms" if stop_ms else "not judged"
        own = "" if self.silent_ms else " (the drive's own time-out is not known, give --own-timeout-ms)"
        return (
            f"{self.name}: dead controller: {controller}, "
            f"dead bridge: {self.silent_ms or UNKNOWN_MS} ms{own}, stop followed within {self.follow_ms} ms"
        )


@dataclass(frozen=True, slots=True)
class WatchedOutputs:
    """The outputs of one node. Times are in ms, those of ``WatchedDrive``.

    ``silent_ms``: from the last RPDO to a node that is no longer operational, 0 where that is not promised.
    ``follow_ms``: from safe values in an RPDO to a TPDO that shows them. ``why_active``: why outputs stay as
    they are when their node is stopped or hears nothing; nothing where they become safe. ``why_unknown``: why
    they cannot be judged.
    """

    name: str
    unit_id: int
    node_id: int
    rpdos: Mapping[int, Values] = field(default_factory=dict[int, Values])
    tpdos: Mapping[int, Values] = field(default_factory=dict[int, Values])
    timeout_ms: int = 0
    beside_ms: int | None = None
    rpdo_ms: float = 0.0
    silent_ms: int = 0
    follow_ms: int = 0
    lost_ms: int = 0
    why_active: str = ""
    why_unknown: str = ""
    written: frozenset[int] = frozenset()
    """Objects that move them or make them safe."""

    @property
    def stop_ms(self) -> int:
        """Longest time in ms from the owner's last telegram to the last RPDO with active values; 0 where
        nothing is promised."""
        return promised_ms(self.timeout_ms, self.beside_ms)

    def promise(self, *, has_numbers: bool) -> str:
        """The bounds to which they are held; without telegrams' numbers a silent controller is not judged."""
        if self.why_unknown:
            return f"{self.name}: its outputs are not judged: {self.why_unknown}"
        controller = f"{self.stop_ms} ms" if has_numbers and self.stop_ms else "not judged"
        own = "" if self.silent_ms else " (the node's own time-out is not known, give --own-timeout-ms)"
        bridge = self.why_active or f"{self.silent_ms or UNKNOWN_MS} ms{own}"
        return f"{self.name}: outputs: dead controller: {controller}, dead bridge: {bridge}"


def promised_ms(timeout_ms: int, beside_ms: int | None) -> int:
    """Longest time in ms from an owner's last telegram to the last RPDO that enables; 0 where nothing is
    promised."""
    return timeout_ms + beside_ms if timeout_ms and beside_ms is not None else 0


@dataclass(frozen=True, slots=True)
class WatchedBus:
    """``beats`` has what is sent by the bridge alone, with its period in ms, by identifier; ``nodes`` the SDO
    time-out of each node in s."""

    name: str
    channel: str
    drives: tuple[WatchedDrive, ...]
    beats: dict[int, tuple[str, int]]
    nodes: dict[int, float] = field(default_factory=dict[int, float])
    outputs: tuple[WatchedOutputs, ...] = ()

    @property
    def watched(self) -> tuple[WatchedDrive | WatchedOutputs, ...]:
        """All that is commanded on it."""
        return (*self.drives, *self.outputs)

    @property
    def written(self) -> dict[int, frozenset[int]]:
        """Objects that move outputs or make them safe, by the node's id."""
        return {one.node_id: one.written for one in self.outputs}

    @property
    def judged_outputs(self) -> list[WatchedOutputs]:
        """Outputs of which enough is known."""
        return [one for one in self.outputs if not one.why_unknown]


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


def plan(site: Site, folder: Path, *, own_timeout_ms: int | None = None) -> list[WatchedBus]:
    """The buses of a site, whose file is in ``folder``. ``own_timeout_ms``: what the drives' own time-outs
    are, where the site file does not set them. Raises ``UnknownFamily``."""
    units = _unit_ids(site)
    return [_bus(bus, folder, units, own_timeout_ms) for bus in site.bus]


def _bus(
    bus: BusTable, folder: Path, units: dict[tuple[str, int], int], own_timeout_ms: int | None
) -> WatchedBus:
    used = [node for node in bus.node if node.enabled]
    known = [(node, frames) for node in used if (frames := output_frames(bus, node, folder))]
    beside_ms = _beside_ms(bus, sum(len(frames.rpdos) for _, frames in known))
    outputs = [
        _outputs(bus, node, frames, units[node.name, 0], beside_ms, own_timeout_ms) for node, frames in known
    ]
    drives = [
        _drive(bus, node, table, _family(node.mapping), units[node.name, place], beside_ms, own_timeout_ms)
        for node in used
        for place, table in enumerate(node.drive)
    ]
    beats: dict[int, tuple[str, int]] = {}
    if bus.sync_period_ms:
        beats[0x080] = ("SYNC", bus.sync_period_ms)
    if bus.heartbeat_ms:
        beats[0x700 + bus.master_node_id] = ("the bridge's heartbeat", bus.heartbeat_ms)
    nodes = {node.id: node.sdo_timeout_ms / 1000 for node in bus.node}
    return WatchedBus(bus.name, bus.channel or "", tuple(drives), beats, nodes, tuple(outputs))


def _drive(
    bus: BusTable,
    node: NodeTable,
    table: DriveTable,
    family: dict[str, Any],
    unit_id: int,
    beside_ms: int,
    own_timeout_ms: int | None,
) -> WatchedDrive:
    slot = family["slots"].get(table.slot) or next(iter(family["slots"].values()))
    tpdo_ms = _tpdo_ms(table)
    # What the owner may set is not known before the bridge tells: it is held to the longest.
    timeout_ms = table.timeout_range_ms[1] if table.fieldbus_timeout_writable else table.fieldbus_timeout_ms
    is_watched = timeout_ms and table.telegram_downtime_s != IGNORE_ALL_S and table.on_expiry != "hold"
    own_ms = node.own_timeout_ms or own_timeout_ms or 0
    return WatchedDrive(
        name=f"{node.name}/{table.name or (table.slot if len(family['slots']) > 1 else 'drive')}",
        unit_id=unit_id,
        rpdo=_cob_id(table.rpdo, slot["rpdo"], node.id),
        tpdo=_cob_id(table.tpdo, slot["tpdo"], node.id),
        control=EnableWord(**family["control"]),
        status=EnableWord(**family["status"]),
        timeout_ms=timeout_ms or 0,
        beside_ms=beside_ms if is_watched else None,
        silent_ms=own_ms + tpdo_ms if own_ms else 0,
        follow_ms=3 * tpdo_ms + RAMP_MS,
        node_id=node.id,
        rpdo_ms=1000 * bus.rpdo_period_s,
        speed=_speed(family, node.mapping),
        nmt_stops=family.get("nmt_stops", False),
        lost_ms=_lost_ms(node, table),
    )


def _outputs(
    bus: BusTable,
    node: NodeTable,
    frames: OutputFrames,
    unit_id: int,
    beside_ms: int,
    own_timeout_ms: int | None,
) -> WatchedOutputs:
    timeout_ms = node.outputs.fieldbus_timeout_ms or 0
    is_watched = timeout_ms and any(values.mask for values in frames.rpdos.values())
    own_ms = frames.own_ms or own_timeout_ms or 0
    # It begins to count with the last heartbeat, and what it does is seen by the node's own.
    begins_ms = max(bus.deadman_ms, bus.heartbeat_ms)
    return WatchedOutputs(
        name=node.name,
        unit_id=unit_id,
        node_id=node.id,
        rpdos=frames.rpdos,
        tpdos=frames.tpdos,
        timeout_ms=timeout_ms,
        beside_ms=beside_ms if is_watched else None,
        rpdo_ms=1000 * bus.rpdo_period_s,
        silent_ms=begins_ms + own_ms + node.supervision_ms if own_ms else 0,
        follow_ms=3 * frames.event_ms + _SWITCH_MS,
        lost_ms=0 if node.supervision == "none" else _LOST_MS + _supervised_ms(node),
        why_active=frames.why_active,
        why_unknown=frames.why_unknown,
        written=frames.written,
    )


def _speed(family: dict[str, Any], mapping: str) -> Speed | None:
    place = family.get("speed", {}).get(mapping)
    return Speed(*place) if place else None


def _lost_ms(node: NodeTable, table: DriveTable) -> int:
    """Silence in ms after which the drive's node counts as cut off: by its error control, or by its TPDO
    where the site file sets its period."""
    if node.supervision == "none":
        return _LOST_MS + 3 * _tpdo_ms(table) if any(pdo.event_ms for pdo in table.tpdo) else 0
    return _LOST_MS + _supervised_ms(node)


def _supervised_ms(node: NodeTable) -> int:
    return node.supervision_ms * (node.life_time_factor if node.supervision == "guarding" else 1)


def _beside_ms(bus: BusTable, output_rpdos: int) -> int:
    """Longest time in ms that bridge, kernel and bus take beside the time-out: two periods, lateness, frames
    sent before ours, and the interface's queue."""
    period_ms = 1000 * bus.rpdo_period_s
    frame_ms = 1000 * _FRAME_BITS / bus.bitrate
    nodes = [node for node in bus.node if node.enabled]
    rpdos = sum(len(node.drive) for node in nodes) + output_rpdos
    # Each period each RPDO, and SYNC: what comes in while frames wait may go first, too.
    idle = max(_IDLE_LEAST, 1 - (rpdos + 1) * frame_ms / period_ms)
    before_ms = _BEFORE_OF_EACH * (1 + len(nodes) + rpdos) * frame_ms / idle
    queue_ms = 0 if bus.interface in ("socketcan", "virtual") else _QUEUE_MS
    return math.ceil(2 * period_ms + REACTION_MS + before_ms + queue_ms)


def _cob_id(tables: Sequence[PdoTable], base: int, node_id: int) -> int:
    """The identifier of the PDO with the word: the maker's, or the one that the site file gives it. Without
    a number a table of the site file is that PDO's (docs/reference/site-file.md)."""
    number = _NUMBERS[base]
    given = (table.cob_id for table in tables if (table.number or number) == number)
    return next((cob_id for cob_id in given if cob_id is not None), base + node_id)


def _tpdo_ms(table: DriveTable) -> int:
    times = [pdo.event_ms for pdo in table.tpdo if pdo.event_ms]
    return max(times, default=table.tpdo_deadline_ms or _TPDO_MS)


def _unit_ids(site: Site) -> dict[tuple[str, int], int]:
    """Unit ids as in docs/reference/modbus.md: those of the site file, the others in order from 1. A node
    without drives has one, too."""
    places = [
        (node.name, place, drive.unit_id)
        for bus in site.bus
        for node in bus.node
        for place, drive in enumerate(node.drive or [node])
    ]
    given = {unit for _, _, unit in places if unit}
    free: Iterator[int] = (unit for unit in _FIRST_UNITS if unit not in given)
    return {(name, place): unit or next(free) for name, place, unit in places}
