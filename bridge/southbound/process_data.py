"""Process data of one drive: its two PDOs as the node has them."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from typing import Final

from bridge.command import Drive
from bridge.command.plant import Node
from bridge.config import BusTable
from bridge.southbound.boot import BootResult, PdoPlan
from bridge.southbound.bus.frame import Frame
from bridge.southbound.canopen.sync import LAST_SYNCHRONOUS, REMOTE_SYNCHRONOUS, REMOTE_TYPES, tpdo_deadline_s

_WORD_BITS: Final = 16
_WORD_MASK: Final = 0xFFFF


class DrivePdos:
    """Unpacks a drive's TPDO into its words and packs its RPDO from the channel's output.

    Words have 16 bits. An object that is longer fills several, the low word first; one that is shorter
    fills its word with its sign or with zeros.
    """

    __slots__ = (
        "_codec",
        "_drive",
        "_fill",
        "_last",
        "_order",
        "_packed",
        "_packed_words",
        "_reject",
        "_rpdo",
        "_rpdo_fill",
        "_words",
        "is_synchronous",
        "rtr_poll_s",
        "tpdo",
        "tpdo_id",
    )

    def __init__(
        self, drive: Drive, rpdo: PdoPlan, tpdo: PdoPlan, reject: Callable[[Frame, str], None]
    ) -> None:
        self._drive = drive
        self._reject = reject
        self.tpdo = tpdo
        self.rtr_poll_s = drive.table.rtr_poll_ms / 1000
        self.tpdo_id = tpdo.cob_id
        self.is_synchronous = tpdo.transmission_type <= LAST_SYNCHRONOUS
        self._codec = tpdo.codec
        self._fill = _fill(tpdo, len(drive.words))
        plain = all(entry.bits <= _WORD_BITS for entry in tpdo.codec.entries) and not tpdo.codec.has_signed
        self._order = plain and tpdo.words == tuple(range(len(drive.words)))
        """The codec's values are the words as they are."""
        self._words = [0] * len(drive.words)
        self._last: bytes | None = None
        self._rpdo = rpdo
        self._rpdo_fill = _fill(rpdo, len(drive.family.process.rpdo))
        self._packed_words: tuple[int, ...] = ()
        self._packed = Frame(rpdo.cob_id)

    def on_tpdo(self, frame: Frame) -> None:
        data = frame.data
        if data == self._last:
            self._drive.on_unchanged_data(frame.time)
            return
        length = self._codec.length
        if len(data) != length:
            self._reject(frame, f"{length} bytes are mapped")
            if len(data) < length:
                return
            # CiA 301 §7.2.2.5: of a PDO that is too long the mapped bytes count.
            data = data[:length]
            self._last = None
        else:
            self._last = data
        values = self._codec.unpack(data)
        if self._order:
            self._drive.on_process_data(values, frame.time)
            return
        words = self._words
        for place, entry, shift in self._fill:
            words[place] = values[entry] >> shift & _WORD_MASK
        self._drive.on_process_data(words, frame.time)

    @property
    def is_silent(self) -> bool:
        return self._drive.channel.output.silent

    @property
    def cob_id(self) -> int:
        return self._rpdo.cob_id

    def rpdo(self) -> Frame:
        """The frame that belongs on the bus now."""
        words = self._drive.channel.output.words
        if words != self._packed_words:
            self._packed_words, self._packed = words, self.rpdo_with(words)
        return self._packed

    def rpdo_with(self, words: Sequence[int]) -> Frame:
        """The frame that carries these words, the control word first; what is mapped beside them is 0."""
        values = [0] * len(self._rpdo.words)
        for place, entry, shift in self._rpdo_fill:
            values[entry] |= words[place] << shift
        return Frame(self._rpdo.cob_id, self._rpdo.codec.pack(values))


def _fill(plan: PdoPlan, words: int) -> tuple[tuple[int, int, int], ...]:
    """Which word is found where: place of the word, number of the entry, shift in its value."""
    mapped = enumerate(zip(plan.words, plan.codec.entries, strict=True))
    return tuple(
        (first + part, number, part * _WORD_BITS)
        for number, (first, entry) in mapped
        if first is not None and not entry.is_dummy
        for part in range((entry.bits + _WORD_BITS - 1) // _WORD_BITS)
        if first + part < words
    )


def connect(
    node: Node,
    result: BootResult,
    reject: Callable[[Frame, str], None],
    is_taken: Callable[[int], bool],
    now: float,
) -> dict[str, DrivePdos]:
    """Give the drives what the boot-up has found: identity, scales, PDOs. Those without PDOs that can be
    used are left out, and those whose identifiers another node of the bus has (``is_taken``)."""
    connected: dict[str, DrivePdos] = {}
    for drive in node.drives:
        drive.on_identification(result.identification, now)
        for name, full in result.scales.get(drive.name, {}).items():
            drive.on_scale(name, full)
        plan = result.drives[drive.name]
        if plan.rpdo is None or plan.tpdo is None or plan.problem:
            continue
        if is_taken(plan.rpdo.cob_id) or is_taken(plan.tpdo.cob_id):
            plan.problem = "another node has its PDO on the same identifier"
            result.notes.append(f"{drive.slot.name}: {plan.problem}")
            continue
        connected[drive.name] = DrivePdos(drive, plan.rpdo, plan.tpdo, reject)
        _set_times(drive, node.bus, plan.rpdo, plan.tpdo)
        missing = _without_effect(node.bus, plan.rpdo, plan.tpdo)
        result.notes += [f"{drive.slot.name}: {why}" for why in missing]
    return connected


def _set_times(drive: Drive, bus: BusTable, rpdo: PdoPlan, tpdo: PdoPlan) -> None:
    """When the drive's TPDO is late, and how long its RPDO may take."""
    given_ms = drive.table.tpdo_deadline_ms
    if given_ms is None:
        drive.channel.link.pdo_deadline_s = tpdo_deadline_s(
            tpdo.transmission_type, tpdo.event_timer_ms, bus.sync_period_ms, drive.table.rtr_poll_ms
        )
    else:
        drive.channel.link.pdo_deadline_s = given_ms / 1000 or None
    # A synchronous RPDO is taken over with the next SYNC (CiA 301 §7.5.2.35).
    waits_ms = bus.sync_period_ms if rpdo.transmission_type <= LAST_SYNCHRONOUS else 0
    drive.rpdo_period_ms = round(bus.rpdo_period_s * 1000) + waits_ms


def _without_effect(bus: BusTable, rpdo: PdoPlan, tpdo: PdoPlan) -> list[str]:
    """What these PDOs wait for and will not get from us."""
    found: list[str] = []
    for name, plan, last in (("RPDO", rpdo, LAST_SYNCHRONOUS), ("TPDO", tpdo, REMOTE_SYNCHRONOUS)):
        kind = plan.transmission_type
        if not bus.sync_period_ms and (kind <= LAST_SYNCHRONOUS or kind == last):
            found.append(f"{name} of type {kind} waits for SYNC, which the bridge does not send")
    if tpdo.transmission_type in REMOTE_TYPES and not tpdo.remote_allowed:
        found.append(f"TPDO of type {tpdo.transmission_type} with a COB-ID that allows no remote frames")
    return found


def stopped_frames(node: Node, connected: Mapping[str, DrivePdos]) -> list[Frame]:
    """A stopped word for every drive, by its PDO where that is known, else by the factory's COB-ID."""
    frames: list[Frame] = []
    for drive in node.drives:
        words = (drive.channel.words.stopped, *([0] * (len(drive.family.process.rpdo) - 1)))
        pdos = connected.get(drive.name)
        if pdos:
            frames.append(pdos.rpdo_with(words))
        else:
            data = struct.pack(f"<{len(words)}H", *words)
            frames.append(Frame(drive.slot.rpdo.cob_id + node.table.id, data))
    return frames
