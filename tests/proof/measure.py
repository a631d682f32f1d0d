"""When a drive was stopped: on the bus, and by what the drive itself says."""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from itertools import pairwise
from typing import Final

from tests.proof.board import NUMBERS
from tests.proof.drives import Drive
from tests.proof.rig import Rig
from tests.proof.settings import PLANT
from tests.proof.waits import FROM_S
from tests.proof.witness import Run

_SILENT_S: Final = max(0.1, 3 * PLANT.rpdo_period_ms / 1000)
_STOPPED: Final = 0x04
_OPERATIONAL: Final = 0x05
"""NMT states, in a heartbeat or, with the toggle bit, in an answer to node guarding."""
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
    bus_ms: float | None = None
    bus_bound_ms: float | None = None
    drive_ms: float | None = None
    drive_bound_ms: float | None = None
    way_ms: float | None = None
    """From the client's sending its last telegram to the RPDO by which the bridge handed it on."""
    way_bound_ms: float | None = None
    sent_ms: float | None = None
    """From the same to the stop on the bus."""
    sent_bound_ms: float | None = None
    paused_ms: float = 0.0
    """How long the machine itself stood still, from shortly before a bound that was exceeded until the stop.
    What was before that did not make it late."""
    waited_ms: float = 0.0
    """How long the bridge, and for the drive's bound the drives too, waited for the CPU in this time."""
    noise_ms: float = 0.0
    """What is allowed beyond that on a machine that is busy with other things; 0 in the long proof."""
    demand: str = ""
    """What has to hold, where that is judged by yes or no."""
    wrong: str = ""
    """What happened that no time excuses: a wrong reaction, a restart. Empty where nothing did."""

    @property
    def over_ms(self) -> float:
        """By how much a bound is exceeded; 0 where none is."""
        pairs = (
            (self.way_ms, self.way_bound_ms),
            (self.sent_ms, self.sent_bound_ms),
            (self.bus_ms, self.bus_bound_ms),
            (self.drive_ms, self.drive_bound_ms),
        )
        found = [value - bound for value, bound in pairs if value is not None and bound is not None]
        return max(0.0, *found, 0.0)

    @property
    def verdict(self) -> str:
        """``void``: the machine stood still, or bridge and drives waited for its CPU, for as long as the
        bound was exceeded; or that was so short that nobody sees whether they did. It is shown, and made
        again."""
        excused_ms = max(self.paused_ms, self.waited_ms, FROM_S * 1000) + self.noise_ms
        if self.wrong or self.over_ms > excused_ms:
            return "failed"
        return "void" if self.over_ms > self.noise_ms else "ok"

    @property
    def complaint(self) -> str:
        """What is wrong with it, in a few words."""
        if self.wrong:
            return self.wrong
        triples = (
            ("on its way", self.way_ms, self.way_bound_ms),
            ("from the client's send", self.sent_ms, self.sent_bound_ms),
            ("on the bus", self.bus_ms, self.bus_bound_ms),
            ("the drive", self.drive_ms, self.drive_bound_ms),
        )
        late = [
            f"{name} after {value:.0f} ms, {bound:.0f} allowed"
            for name, value, bound in triples
            if value is not None and bound is not None and value > bound
        ]
        return "; ".join(late)

    def record(self) -> dict[str, object]:
        return {**asdict(self), "verdict": self.verdict}


@dataclass(frozen=True, slots=True)
class Span:
    """From ``begin`` to ``end``, which may take ``bound_ms``; ``busy`` may have waited for the CPU in it."""

    begin: float
    end: float
    bound_ms: float
    busy: tuple[str, ...]

    @property
    def ms(self) -> float:
        return (self.end - self.begin) * 1000


def bus_stop(rig: Rig, drive: Drive, since: float, *, silent: bool) -> tuple[float, Run] | None:
    """When the bus began to stop the drive, after ``since``, and the last words that enabled it: the first
    RPDO that does not enable; with ``silent``, where nobody is there to send one, the last that does. So it
    is, too, where a drive that stops by silence is left alone meanwhile: a slow machine may have kept its
    controller from writing in time beside any fault. None while the bus goes on enabling."""
    enabling = None
    for run in rig.told.runs(drive.rpdo, since - _BEFORE_S):
        if drive.enabling(run.data):
            fell_silent = silent and enabling is not None and run.first - enabling.last > _SILENT_S
            if fell_silent and run.first > since:
                break
            enabling = run
        elif enabling is not None:
            if run.first >= since:
                is_left = drive.reaction == "silence" and run.first - enabling.last > _SILENT_S
                return (enabling.last if silent or is_left else run.first), enabling
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
    # CiA 301 §7.3.2.2.4: no process data any more; CiA 402's 6007h says what the motor does.
    signs = rig.said.runs(0x700 + drive.node_id, since)
    times += [run.first for run in signs if run.first >= since and run.data[0] & 0x7F == _STOPPED][:1]
    return min(times, default=None)


def was_moving(rig: Rig, drive: Drive, at: float) -> bool:
    """The drive was enabled just then, on the bus and by its own word."""
    told = [run for run in rig.told.runs(drive.rpdo, at - _BEFORE_S) if run.first <= at]
    return bool(told) and drive.enabling(told[-1].data) and says_enabled(rig, drive, at)


def says_enabled(rig: Rig, drive: Drive, at: float) -> bool:
    """The drive was enabled just then, by its own word."""
    said = [run for run in rig.said.runs(drive.tpdo, at - _BEFORE_S) if run.first <= at]
    return bool(said) and drive.enabled(said[-1].data)


def handed_on(rig: Rig, drive: Drive, enabling: Run) -> Run:
    """The RPDO by which the bridge handed on the owner's last telegram: a change goes out at once. It is
    ``enabling``, the last one that did; where its setpoint has an RPDO of its own, the number is in that."""
    if not drive.setpoint_rpdo:
        return enabling
    runs = rig.told.runs(drive.setpoint_rpdo, enabling.first - _BEFORE_S)
    carried = [run for run in runs if run.first <= enabling.last + _TINY_S and drive.setpoint(run.data)]
    return carried[-1] if carried else enabling


def sent_at(rig: Rig, drive: Drive, run: Run) -> float:
    """When its client sent the telegram whose number this RPDO carries."""
    return rig.board.sent_at(drive.place, drive.telegram(run.data) % NUMBERS)


def stopping(rig: Rig, drive: Drive, bus: float, until: float = math.inf) -> bytes | None:
    """The first RPDO that did not enable, from the moment ``bus`` on when the bus began to stop the drive."""
    run = _stopping(rig, drive, bus, until)
    return run.data if run else None


def _stopping(rig: Rig, drive: Drive, bus: float, until: float = math.inf) -> Run | None:
    for run in rig.told.runs(drive.rpdo, bus):
        if bus <= run.first < until and not drive.enabling(run.data):
            return run
    return None


def spoken_to(rig: Rig, drive: Drive, bus: float, own: float) -> bytes | None:
    """The first RPDO that did not enable a drive which silence was to stop, and which stopped at ``own``. A
    machine that stood still meanwhile may have lost the node: its new boot-up begins with a stop."""
    states = rig.heard.runs(0x700 + drive.node_id, own)
    has_left = any(run.last >= own and run.data[0] & 0x7F != _OPERATIONAL for run in states)
    return stopping(rig, drive, bus, own if has_left else math.inf)


def keeps_setpoint(rig: Rig, drive: Drive, bus: float) -> bool:
    """An RPDO of the setpoint alone has one, after the drive was stopped: it goes before the stop. Where the
    last enabling word counts as that, the kernel's other burst may send once more in the same period."""
    if not drive.setpoint_rpdo:
        return False
    stop = _stopping(rig, drive, bus)
    since = stop.first if stop else bus + PLANT.rpdo_period_ms / 1000
    runs = rig.told.runs(drive.setpoint_rpdo, bus)
    return any(run.last > since + _TINY_S and drive.setpoint(run.data) for run in runs)


def longest_pause(rig: Rig, drive: Drive, since: float) -> float:
    """The longest time without process data of the drive on the bridge's side since then, in seconds."""
    times = [since, *rig.heard.times(drive.tpdo, since), rig.now()]
    return max(after - before for before, after in pairwise(times))


def held(rig: Rig, drive: Drive, since: float, until: float | None = None) -> str:
    """What a drive did since then that is to go on all the time, or until then; empty where it did."""
    until = rig.now() if until is None else until
    told = [run for run in rig.told.runs(drive.rpdo, since) if run.first <= until]
    if not all(drive.enabling(run.data) for run in told) or not told:
        return "the bus has stopped it"
    if until - told[-1].last > _SILENT_S:
        return "the bus is silent"
    said = [run for run in rig.said.runs(drive.tpdo, since) if run.first <= until]
    if not all(drive.enabled(run.data) for run in said):
        return "it has stopped"
    return ""


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


def longest_turn(rig: Rig, drive: Drive, since: float) -> float:
    """For how long, in seconds, the drive was enabled and turned at a stretch after ``since``."""
    return max(end - begin for begin, end in _turns(rig, drive, since))


def last_turn_end(rig: Rig, drive: Drive, since: float) -> float:
    """When the drive had turned for the last time after ``since``; now, if it still turns."""
    return _turns(rig, drive, since)[-1][1]


def _turns(rig: Rig, drive: Drive, since: float) -> list[tuple[float, float]]:
    """When the drive was enabled and turned after ``since``, at which it did, by what it reports: to its
    first report that it does not, or that its node is not in operation. What a drive gains that is stopped as
    soon as it starts is no turning."""
    least = (1 - _SLOWER) * drive.family.speed
    looks = [
        (at, drive.enabled(run.data) and abs(drive.speed(run.data)) > least)
        for run in rig.said.runs(drive.tpdo, since)
        for at in (max(run.first, since), run.last)
    ]
    signs = rig.said.runs(0x700 + drive.node_id, since)
    looks += [(run.first, False) for run in signs if run.first >= since and _is_left(run.data)]
    found: list[tuple[float, float]] = []
    began: float | None = since
    for at, turns in sorted(looks):
        if began is None and turns:
            began = at
        elif began is not None and not turns:
            found.append((began, at))
            began = None
    return found if began is None else [*found, (began, rig.now())]


def _is_left(sign: bytes) -> bool:
    """A heartbeat or guarding answer of a node that is not in operation."""
    return sign[0] & 0x7F != _OPERATIONAL


def trace(rig: Rig, drive: Drive, moment: float) -> str:
    """What the bus and the drive said about a sample that failed: ms from ``moment``, data."""
    lines: list[str] = []
    for name, runs in (
        ("told", rig.told.runs(drive.rpdo, moment - _BEFORE_S / 4)),
        ("numbers", rig.told.runs(drive.number_id, moment - _BEFORE_S / 4)),
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
