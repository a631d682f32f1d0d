"""RPDOs of a device that is no drive: its outputs."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

from bridge.canopen.frame import Frame
from bridge.canopen.sync import LAST_SYNCHRONOUS
from bridge.command.output_words import ACTIVE
from bridge.command.outputs import Outputs
from bridge.mapping.entry_types import ObjectRef
from bridge.node.boot import BootResult, PdoPlan, SignalPlan
from bridge.node.process.held import held_s
from bridge.node.process.process_data import DriveTpdo, Repetition
from bridge.text import Text


class OutputRpdo:
    """One RPDO, packed from the words of the outputs."""

    def __init__(self, plan: PdoPlan, outputs: Outputs) -> None:
        self.cob_id = plan.cob_id
        self.is_synchronous = plan.transmission_type <= LAST_SYNCHRONOUS
        self._words = outputs.words
        self._channel = outputs.channel
        self._codec = plan.codec
        places = {place.output.object: place for place in outputs.words.places.values()}
        self._places = [
            None if entry.is_dummy else places.get(ObjectRef(entry.index, entry.sub))
            for entry in plan.codec.entries
        ]
        self._packed: dict[tuple[int, ...], Frame] = {}

    def frame(self, wired: tuple[int, ...]) -> Frame:
        """Frame that carries these words to the outputs; the same object while they stay."""
        known = self._packed.get(wired)
        if known is None:
            values = [self._words.raw(wired, place) if place else 0 for place in self._places]
            known = Frame(self.cob_id, self._codec.pack(values))
            self._packed = {wired: known}
        return known

    def last_frame(self) -> Frame:
        """Frame in which a burst ends."""
        return self.frame(self._channel.on_wire(self._channel.output_then()))

    def control_word(self, data: bytes) -> int | None:
        """Control word as if it were a drive's: 0 if a frame with this data leaves every output safe, else
        ACTIVE; None if the data are too short."""
        if len(data) < self._codec.length:
            return None
        values = self._codec.unpack(data[: self._codec.length])
        for value, place in zip(values, self._places, strict=True):
            if place and place.safe is not None and value & ((1 << place.output.size) - 1) != place.safe:
                return ACTIVE
        return 0


class OutputPdos:
    """All RPDOs of one device, used like those of a drive. Whether they are followed is read back
    (``read_back.py``), or told by TPDOs that are its inputs'."""

    tpdos: tuple[DriveTpdo, ...] = ()
    is_silent = False

    def __init__(self, outputs: Outputs, plans: Sequence[PdoPlan]) -> None:
        self._channel = outputs.channel
        self.control_words = outputs.channel.words
        """Control words by which a telegram says whether it is active."""
        self.rpdos = tuple(OutputRpdo(plan, outputs) for plan in plans)
        kind = min(plan.transmission_type for plan in plans)
        self.rpdo_type = kind
        self._held_s = held_s(outputs.bus, kind)
        self.needs_sync = kind <= LAST_SYNCHRONOUS
        self.handlers: dict[int, Callable[[Frame], None]] = {}

    def repetitions(self, period_s: float) -> list[Repetition]:
        """Frames that belong on the bus now."""
        channel = self._channel
        wired, until = channel.on_wire(channel.output), channel.until
        hold_at = (until - self._held_s,) if until is not None and self._held_s else ()
        return [
            Repetition((one.frame(wired),), period_s, until, partial(_last, one), hold_at)
            for one in self.rpdos
        ]

    def frames_with_stop(self) -> list[Frame]:
        """Frames that make every output safe."""
        safe = self._channel.output_words.safe(self._channel.output_words.held)
        return [rpdo.frame(safe) for rpdo in self.rpdos]


def _last(rpdo: OutputRpdo) -> Frame | None:
    return rpdo.last_frame()


def connect_outputs(
    outputs: Outputs, plan: SignalPlan, result: BootResult, is_taken: Callable[[int], bool], now: float
) -> OutputPdos | None:
    """Tell ``outputs`` what the boot-up has found; returns their RPDOs, None where there is none that can be
    used."""
    plans: list[PdoPlan] = []
    for one in plan.pdos:
        if is_taken(one.cob_id):
            why = Text.of("boot.pdo_id_taken", pdo=one.name, id=f"{one.cob_id:03X}h")
            result.notes.append(why)
            carried = (ObjectRef(entry.index, entry.sub) for entry in one.codec.entries)
            plan.unserved |= dict.fromkeys(carried, why)
        else:
            plans.append(one)
    pdos = OutputPdos(outputs, plans) if plans else None
    kind = pdos.rpdo_type if pdos else outputs.rpdo_type
    outputs.own = result.own.get(outputs.name)
    outputs.on_pdos(kind, plan.unserved, result.held, result.bridge_stop, now)
    return pdos
