"""When a drive was stopped: on the bus, and by what the drive itself says."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Final

from tests.proof.board import NUMBERS
from tests.proof.drives import RPDO_PERIOD_MS, Drive
from tests.proof.rig import Rig
from tests.proof.witness import Run

_SILENT_S: Final = 3 * RPDO_PERIOD_MS / 1000
_BOOT_UP: Final = b"\0"
_BEFORE_S: Final = 2.0
_TINY_S: Final = 1e-6
_SLOWER: Final = 0.98
"""The telegrams' numbers lie above the setpoint: who turns slower than that gets slower."""
_MOST_SHOWN: Final = 16


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
    """How long the machine itself stood still, from shortly before a bound that was exceeded until the stop.
    What was before that did not make it late."""
    waited_ms: float
    """How long the bridge, and for the drive's bound the drives too, waited for the CPU in this time."""
    noise_ms: float
    """What is allowed beyond that on a machine that is busy with other things; 0 in the long proof."""
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
        """``void``: the machine stood still, or bridge and drives waited for its CPU, for as long as the
        bound was exceeded. It is shown, and made again."""
        excused_ms = max(self.paused_ms, self.waited_ms) + self.noise_ms
        if self.restarted or not self.recovered or self.over_ms > excused_ms:
            return "failed"
        return "void" if self.over_ms > self.noise_ms else "ok"

    def record(self) -> dict[str, object]:
        return {**asdict(self), "verdict": self.verdict}


def bus_stop(rig: Rig, drive: Drive, since: float, *, silent: bool) -> tuple[float, Run] | None:
    """When the bus began to stop the drive, after ``since``, and the last words that enabled it: the first
    RPDO that does not enable; with ``silent``, where nobody is there to send one, the last that does. None
    while the bus goes on enabling."""
    enabling = None
    for run in rig.told.runs(drive.rpdo, since - _BEFORE_S):
        if drive.enabling(run.data):
            fell_silent = silent and enabling is not None and run.first - enabling.last > _SILENT_S
            if fell_silent and run.first > since:
                break
            enabling = run
        elif enabling is not None:
            if run.first >= since:
                return (enabling.last if silent else run.first), enabling
            enabling = None
    if not silent or enabling is None or rig.now() - enabling.last <= 2 * _SILENT_S:
        return None
    return enabling.last, enabling


def drive_stop(rig: Rig, drive: Drive, since: float) -> float | None:
    """When the drive showed after ``since`` that it stops: it is not enabled any more, it is in fault, or it
    gets slower. On a ramp it stays enabled until it stands still, which takes as long as it takes."""
    times: list[float] = []
    slow = _SLOWER * drive.family.speed
    before = None
    for run in rig.said.runs(drive.tpdo, since - _BEFORE_S):
        speed = abs(drive.speed(run.data))
        falls = before is not None and speed < min(before, slow)
        before = speed
        if run.first >= since and (falls or not drive.enabled(run.data)):
            times.append(run.first)
            break
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
    return run.first - sent_at(rig, drive, run)


def sent_at(rig: Rig, drive: Drive, run: Run) -> float:
    """When its client sent the telegram whose words these are."""
    return rig.board.sent_at(drive.place, drive.telegram(run.data) % NUMBERS)


def last_sign(rig: Rig, drive: Drive, until: float) -> float:
    """The last heartbeat or guarding answer that the bridge had of the node before ``until``."""
    return rig.heard.last_before(0x700 + drive.node_id, until) or until


def boot_up(rig: Rig, drive: Drive, since: float) -> float | None:
    """The node's boot-up message after ``since``."""
    runs = rig.heard.runs(0x700 + drive.node_id, since)
    return next((run.first for run in runs if run.data == _BOOT_UP and run.first >= since), None)


def was_enabled(rig: Rig, drive: Drive, bus: float, own: float) -> bool:
    """The bus has enabled the drive after it was stopped there, or the drive turned again after it had come
    to its end. (One that stands still in its quick stop may say "operation enabled", as Lenze's does.)"""
    told = any(
        run.last > bus + _TINY_S and drive.enabling(run.data) for run in rig.told.runs(drive.rpdo, bus)
    )
    least = (1 - _SLOWER) * drive.family.speed
    turns = [
        drive.enabled(run.data) and abs(drive.speed(run.data)) > least
        for run in rig.said.runs(drive.tpdo, own)
        if run.first >= own
    ]
    return told or (False in turns and True in turns[turns.index(False) :])


def trace(rig: Rig, drive: Drive, moment: float) -> str:
    """What the bus and the drive said about a sample that failed: ms from ``moment``, data."""
    lines: list[str] = []
    for name, runs in (
        ("told", rig.told.runs(drive.rpdo, moment - _BEFORE_S / 4)),
        ("says", rig.said.runs(drive.tpdo, moment - _BEFORE_S / 4)),
        ("node", rig.heard.runs(0x700 + drive.node_id, moment - _BEFORE_S / 4)),
        ("emcy", rig.said.runs(0x080 + drive.node_id, moment - _BEFORE_S / 4)),
    ):
        shown = [
            f"{(run.first - moment) * 1000:.0f}…{(run.last - moment) * 1000:.0f} {run.data.hex()}"
            for run in runs
        ]
        lines.append(f"  {name} {', '.join(shown[:_MOST_SHOWN])}")
    return "\n".join([f"{drive.path} ({drive.protocol})", *lines])
