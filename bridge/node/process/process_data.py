"""Process data of one drive: its PDOs as the node has them."""

from __future__ import annotations

import struct
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

from bridge.canopen.frame import Frame
from bridge.canopen.sync import LAST_SYNCHRONOUS, REMOTE_SYNCHRONOUS, REMOTE_TYPES, tpdo_deadline_s
from bridge.command import Drive
from bridge.command.drive_channel import DriveChannel
from bridge.command.drive_link import FurtherTpdo
from bridge.command.leg.state import RpdoWords
from bridge.command.node import Node
from bridge.config import BusTable
from bridge.image import Quality
from bridge.node.boot import BootResult, PdoPlan
from bridge.node.places.word_map import WordMap
from bridge.node.process.held import held_s
from bridge.node.process.unfit_frames import UnfitFrames
from bridge.text import Text


class Repetition(NamedTuple):
    """Frames to be repeated in turn on one identifier, and their period. They may be on the bus no longer
    than ``until``; ``then`` gives the frame that follows, None for silence.

    A burst that is handed over at one of ``hold_at`` or later lasts as long as a drive needs to stop without
    us (``held.py``).
    """

    frames: tuple[Frame, ...]
    period_s: float
    until: float | None = None
    then: Callable[[], Frame | None] = lambda: None
    hold_at: tuple[float, ...] = ()


class RunningBurst(NamedTuple):
    """Present repetition of a bus: ``frames`` up to ``until``, and to ``ends`` at the latest if nobody renews
    it; handed over ``at`` that time."""

    frames: tuple[Frame, ...]
    until: float | None
    ends: float
    at: float

    def ends_as(self, wanted: Repetition, now: float) -> bool:
        """Whether it ends as ``wanted`` without being handed over again."""
        if any(self.at < at <= now for at in wanted.hold_at):
            return False
        earliest = min((time for time in (self.until, wanted.until) if time is not None), default=self.ends)
        return self.until == wanted.until or earliest >= self.ends


class DriveTpdo:
    """One TPDO of a drive, unpacked into the drive's words. ``further`` is None for the one with the status
    word, by which the drive's freshness is judged."""

    def __init__(self, drive: Drive, plan: PdoPlan, further: FurtherTpdo | None, unfit: UnfitFrames) -> None:
        self._drive = drive
        self._unfit = unfit
        self.plan = plan
        self.further = further
        self.cob_id = plan.cob_id
        self.rtr_poll_s = drive.table.rtr_poll_ms / 1000
        self._codec = plan.codec
        self._length = plan.codec.length
        self._map = WordMap(plan.codec.entries, plan.places, len(drive.words))
        self._in_order = self._map.in_order == len(drive.words) and not plan.codec.has_signed
        """True if the codec's values are the words as they are."""
        self._words = list(drive.words)
        self._last: bytes | None = None

    @property
    def is_synchronous(self) -> bool:
        return self.plan.transmission_type <= LAST_SYNCHRONOUS

    def on_frame(self, frame: Frame) -> None:
        """Take the TPDO with the status word."""
        data = frame.data
        if data == self._last:
            self._drive.on_unchanged_data(frame.time)
            return
        if self._in_order and len(data) == self._length:
            self._last = data
            self._drive.on_process_data(self._codec.unpack(data), frame.time)
            return
        values = self._values(frame)
        if values is None:
            return
        words = self._words
        words[:] = self._drive.words
        self._map.unpack(values, words)
        self._drive.on_process_data(words, frame.time)

    def on_further(self, frame: Frame) -> None:
        """Take another TPDO."""
        further = self.further
        if further is None:
            return
        if frame.data == self._last and further.quality is Quality.GOOD:
            further.last = frame.time
            return
        values = self._values(frame)
        if values is not None:
            self._map.unpack(values, self._drive.words)
            self._drive.on_further_data(further, frame.time)

    def _values(self, frame: Frame) -> tuple[int, ...] | None:
        """Values of a frame; None where it is too short."""
        data = frame.data
        length = self._length
        if len(data) != length:
            self._unfit.reject(frame, Text.of("frame.bytes_mapped", length=length))
            if len(data) < length:
                return None
            # CiA 301 §7.2.2.5: of a PDO that is too long the mapped bytes count.
            data = data[:length]
            self._last = None
        else:
            self._last = data
        return self._codec.unpack(data)


class DriveRpdo:
    """One RPDO of a drive, packed from the channel's output."""

    def __init__(self, plan: PdoPlan, words: int) -> None:
        self.cob_id = plan.cob_id
        self.is_synchronous = plan.transmission_type <= LAST_SYNCHRONOUS
        self._count = words
        self._has_control_word = any(place is not None and place.word == 0 for place in plan.places)
        self._codec = plan.codec
        self._map = WordMap(plan.codec.entries, plan.places, words)
        first = self._map.in_order
        self._in_order = struct.Struct(f"<{first}H") if first and plan.codec.length == 2 * first else None
        """Packer of the first words, where the PDO carries nothing else."""
        self._words: Sequence[int] = ()
        self._packed = (Frame(plan.cob_id),)
        self._last_words: Sequence[int] = ()
        self._last = Frame(plan.cob_id)

    def frames(self, words: Sequence[int]) -> tuple[Frame, ...]:
        """Burst that carries these words; the same object while they stay."""
        if words != self._words:
            self._words = words
            self._packed = (self.frame(words),)
        return self._packed

    def last_frame(self, output: RpdoWords) -> Frame | None:
        """Frame in which a burst ends, kept as well; None where it ends in silence."""
        if output.silent:
            return None
        if output.words != self._last_words:
            self._last_words = output.words
            self._last = self.frame(output.words)
        return self._last

    def frame(self, words: Sequence[int]) -> Frame:
        """Frame that carries these words, the control word first; anything else that is mapped is 0."""
        if self._in_order:
            first = words[: self._in_order.size // 2]
            return Frame(self.cob_id, self._in_order.pack(*[word & 0xFFFF for word in first]))
        return Frame(self.cob_id, self._codec.pack(self._map.pack(words)))

    def control_word(self, data: bytes) -> int | None:
        """Control word of a frame with this data; None where it has none."""
        if not self._has_control_word or len(data) < self._codec.length:
            return None
        words = [0] * self._count
        self._map.unpack(self._codec.unpack(data[: self._codec.length]), words)
        return words[0]


class DrivePdos:
    """All PDOs of one drive. The one with the status word is the first of ``tpdos``, the one with the control
    word the last of ``rpdos``: setpoints are there when an enable comes."""

    def __init__(
        self, drive: Drive, rpdos: Sequence[PdoPlan], tpdos: Sequence[PdoPlan], unfit: UnfitFrames
    ) -> None:
        self._drive = drive
        words = len(drive.family.process.rpdo)
        self.rpdos = tuple(DriveRpdo(plan, words) for plan in reversed(rpdos))
        self._endings = {rpdo: partial(_last_frame, rpdo, drive.channel) for rpdo in self.rpdos}
        kind = rpdos[0].transmission_type
        self._held_s = held_s(drive.bus, kind)
        self.needs_sync = kind <= LAST_SYNCHRONOUS
        """Whether a stop takes effect with SYNC only."""
        main, *others = tpdos
        self.tpdos = (
            DriveTpdo(drive, main, None, unfit),
            *(DriveTpdo(drive, plan, _further(drive, plan), unfit) for plan in others),
        )

    @property
    def handlers(self) -> dict[int, Callable[[Frame], None]]:
        """Handlers of the TPDOs, by COB-ID."""
        main, *others = self.tpdos
        return {main.cob_id: main.on_frame, **{tpdo.cob_id: tpdo.on_further for tpdo in others}}

    @property
    def further(self) -> list[FurtherTpdo]:
        return [tpdo.further for tpdo in self.tpdos if tpdo.further is not None]

    @property
    def is_silent(self) -> bool:
        return self._drive.channel.output.silent

    def repetitions(self, period_s: float) -> list[Repetition]:
        """Frames that belong on the bus now, those of each identifier together."""
        channel = self._drive.channel
        words, until = channel.output.words, channel.until
        hold_at = (until - self._held_s,) if until is not None and self._held_s else ()
        return [
            Repetition(one.frames(words), period_s, until, self._endings[one], hold_at) for one in self.rpdos
        ]

    def frames_with(self, words: Sequence[int]) -> list[Frame]:
        """Frames that carry these words."""
        return [rpdo.frame(words) for rpdo in self.rpdos]


def _last_frame(rpdo: DriveRpdo, channel: DriveChannel) -> Frame | None:
    return rpdo.last_frame(channel.output_then())


def _further(drive: Drive, plan: PdoPlan) -> FurtherTpdo:
    return FurtherTpdo(plan.name, plan.words, _deadline_s(drive, plan))


def _deadline_s(drive: Drive, tpdo: PdoPlan) -> float | None:
    """Time in seconds after which a TPDO is late; None where it never is."""
    given_ms = drive.table.tpdo_deadline_ms
    if given_ms is not None:
        return given_ms / 1000 or None
    return tpdo_deadline_s(
        tpdo.transmission_type, tpdo.event_timer_ms, drive.sync_period_ms, drive.table.rtr_poll_ms
    )


def connect(
    node: Node,
    result: BootResult,
    unfit: UnfitFrames,
    is_taken: Callable[[int], bool],
    now: float,
) -> dict[str, DrivePdos]:
    """Give the drives what the boot-up has found: identity, scales, PDOs. Those without usable PDOs are left
    out, and those whose identifiers another node of the bus has (``is_taken``)."""
    connected: dict[str, DrivePdos] = {}
    for drive in node.drives:
        drive.on_identification(result.identification, now)
        drive.on_own_supervision(result.own[drive.name], now)
        facts = result.words[drive.name]
        drive.channel.meanings.told_by_drive = set(facts.told)
        if drive.on_codes(facts.codes, facts.why_unread):
            drive.channel.start_anew(now)
        drive.news.on_boot_up(facts.parameters, now)
        result.notes += [_of(drive, what) for what in drive.channel.meanings.unknown()]
        plan = result.drives[drive.name]
        if not plan.rpdos or not plan.tpdos or plan.problem:
            continue
        if any(is_taken(pdo.cob_id) for pdo in (*plan.rpdos, *plan.tpdos)):
            why = Text.of("boot.id_taken")
            plan.leave_out(why)
            result.notes.append(_of(drive, why))
            continue
        pdos = connected[drive.name] = DrivePdos(drive, plan.rpdos, plan.tpdos, unfit)
        drive.on_pdos(
            plan.unserved,
            pdos.further,
            now,
            deadline_s=_deadline_s(drive, plan.tpdos[0]),
            rpdo_type=plan.rpdos[0].transmission_type,
        )
        missing = _without_effect(node.bus, plan.rpdos, plan.tpdos)
        result.notes += [_of(drive, why) for why in missing]
    return connected


def _of(drive: Drive, what: Text) -> Text:
    return Text.of("boot.of_slot", slot=drive.slot.name, what=what)


def _without_effect(bus: BusTable, rpdos: Sequence[PdoPlan], tpdos: Sequence[PdoPlan]) -> list[Text]:
    """Notes on PDOs that wait for something that they will not get from us."""
    found: list[Text] = []
    listed = [("RPDO", plan, LAST_SYNCHRONOUS) for plan in rpdos]
    listed += [("TPDO", plan, REMOTE_SYNCHRONOUS) for plan in tpdos]
    for name, plan, last in listed:
        kind = plan.transmission_type
        if not bus.sync_period_ms and (kind <= LAST_SYNCHRONOUS or kind == last):
            found.append(Text.of("boot.waits_for_sync", pdo=name, type=kind))
    for tpdo in tpdos:
        kind = tpdo.transmission_type
        if kind in REMOTE_TYPES and not tpdo.remote_allowed:
            found.append(Text.of("boot.no_remote_frames", type=kind))
    return found
