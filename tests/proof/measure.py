"""When a drive was stopped: on the bus, and by what the drive itself says."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Final

from tests.proof.board import NUMBERS
from tests.proof.drives import RPDO_PERIOD_MS, TPDO_MS, Drive
from tests.proof.rig import Rig
from tests.proof.witness import Run

_SILENT_S: Final = 3 * RPDO_PERIOD_MS / 1000
_BOOT_UP: Final = b"\0"
_BEFORE_S: Final = 2.0
_TINY_S: Final = 1e-6


@dataclass(frozen=True, slots=True)
class Sample:
    """One drive in one round. Times in ms from the reference; None where there is nothing to be measured."""

    fault: str
    family: str
    protocol: str
    drive: str
    bus_ms: float | None
    bus_bound_ms: float | None
    drive_ms: float | None
    drive_bound_ms: float | None
    way_ms: float | None
    """From the client's sending its last telegram to the RPDO by which the bridge handed it on."""
    paused_ms: float
    """How long the machine itself stood still from the reference to the stop in the drive."""
    restarted: bool
    """Something enabled the drive before its owner had acknowledged and enabled it anew."""
    recovered: bool

    @property
    def over_ms(self) -> float:
        """By how much a bound is exceeded; 0 where none is."""
        pairs = ((self.bus_ms, self.bus_bound_ms), (self.drive_ms, self.drive_bound_ms))
        found = [value - bound for value, bound in pairs if value is not None and bound is not None]
        return max(0.0, *found, 0.0)

    @property
    def verdict(self) -> str:
        if self.restarted or not self.recovered or self.over_ms > self.paused_ms:
            return "failed"
        return "machine paused" if self.over_ms else "ok"

    def record(self) -> dict[str, object]:
        return {**asdict(self), "verdict": self.verdict}


def bus_stop(rig: Rig, drive: Drive, since: float) -> tuple[float, Run] | None:
    """When the bus began to stop the drive, after ``since``: the first RPDO that does not enable, or the last
    one that does where it falls silent. With it the last words that enabled. None while it goes on."""
    enabling = None
    for run in rig.told.runs(drive.rpdo, since - _BEFORE_S):
        if drive.enabling(run.data):
            if enabling is not None and run.first - enabling.last > _SILENT_S and enabling.last >= since:
                break
            enabling = run
        elif enabling is not None:
            is_answer = run.first - enabling.last <= _SILENT_S
            at = run.first if is_answer else enabling.last
            if at >= since or run.first >= since:
                return at, enabling
            enabling = None
    if enabling is None or rig.now() - enabling.last <= 2 * _SILENT_S:
        return None
    return enabling.last, enabling


def drive_stop(rig: Rig, drive: Drive, since: float) -> float | None:
    """When the drive said after ``since`` that it is not enabled any more, or that it is in fault."""
    times = [run.first for run in rig.said.runs(drive.tpdo, since) if not drive.enabled(run.data)]
    times = [at for at in times if at >= since][:1]
    if drive.emcy is not None:
        emergencies = rig.said.runs(drive.emcy, since)
        times += [run.first for run in emergencies if run.first >= since and run.data[:2] != b"\0\0"][:1]
    return min(times, default=None)


def was_moving(rig: Rig, drive: Drive, at: float) -> bool:
    """The drive was enabled just then, on the bus and by its own word."""
    told = [run for run in rig.told.runs(drive.rpdo, at - _BEFORE_S) if run.first <= at]
    said = [run for run in rig.said.runs(drive.tpdo, at - _BEFORE_S) if run.first <= at]
    return bool(told and said) and drive.enabling(told[-1].data) and drive.enabled(said[-1].data)


def way(rig: Rig, drive: Drive, run: Run) -> float:
    """How long the telegram was on its way whose words these are, in seconds: from its client's sending it
    until the bridge sent them (a change goes out at once)."""
    return run.first - rig.board.sent_at(drive.place, drive.telegram(run.data) % NUMBERS)


def last_sign(rig: Rig, drive: Drive, until: float) -> float:
    """The last that the bridge has heard of the node before ``until``."""
    tracks = (drive.tpdo, 0x700 + drive.node_id)
    runs = [run for can_id in tracks for run in rig.heard.runs(can_id, until - _BEFORE_S)]
    return max(min(run.last, until) for run in runs if run.first <= until)


def boot_up(rig: Rig, drive: Drive, since: float) -> float | None:
    """The node's boot-up message after ``since``."""
    runs = rig.heard.runs(0x700 + drive.node_id, since)
    return next((run.first for run in runs if run.data == _BOOT_UP and run.first >= since), None)


def was_enabled(rig: Rig, drive: Drive, bus: float, own: float) -> bool:
    """The bus has enabled the drive after it was stopped there, or the drive says that it is enabled, later
    than what it had to say before its stop can be on the bus."""
    told = any(run.last > bus + _TINY_S and drive.enabling(run.data) for run in rig.told.runs(drive.rpdo, bus))
    late = max(bus, own) + 2 * TPDO_MS / 1000
    said = any(run.last > late and drive.enabled(run.data) for run in rig.said.runs(drive.tpdo, late))
    return told or said
