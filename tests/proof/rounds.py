"""One round: all drives move, one fault, every drive it concerns is measured, and brought back."""

from __future__ import annotations

import random
import time
from collections.abc import Callable
from contextlib import suppress
from typing import Final

from tests.proof import measure
from tests.proof.drives import DRIVES, OWNER_PERIOD_S, REACTION_MS, RPDO_PERIOD_MS, Drive
from tests.proof.faults import Fault
from tests.proof.measure import Sample
from tests.proof.rig import BRIDGE, SIMULATION, Rig, Stuck
from tests.proof.waits import paused_ms, waited_ms

_STOPPED_S: Final = 5.0
_QUIET_S: Final = 0.4
"""How long is waited that something does *not* stop the drives."""
_TALKS_S: Final = 60.0
_LOOKS: Final = 5
_LOOK_S: Final = 1.0
_BEFORE_MS: Final = RPDO_PERIOD_MS + REACTION_MS
"""The bridge, or the drive, has to begin its stop that long before its bound."""
_HOLD_S: Final = 0.45
"""How long the owners go on writing "run" after everything is back: nothing may start by that."""


def run_round(rig: Rig, fault: Fault, say: Callable[[str], None]) -> list[Sample]:
    """The samples of one round. Raises ``Stuck`` where the plant does not come back."""
    _all_move(rig, say)
    if fault.steady:
        fault.steady(rig)
        since = time.monotonic()
        time.sleep(_QUIET_S)
        _wait_handed_on(rig, fault, since, say)
    concerned = [drive for drive in DRIVES if drive.protocol in fault.protocols]
    others = [drive for drive in DRIVES if drive.protocol not in fault.protocols]
    began = time.monotonic()
    # At any time between two telegrams.
    time.sleep(random.uniform(0.0, OWNER_PERIOD_S))
    moment = fault.inject(rig)
    _let_pass(rig, fault, concerned, moment)
    still = [drive for drive in concerned if not measure.was_moving(rig, drive, moment)]
    rig.by_themselves += len(still)
    stopped = _wait_stopped(rig, fault, [drive for drive in concerned if drive not in still], moment)
    ways_ms = _ways_ms(rig, fault, list(stopped), moment)
    _all_go_on(rig, others, fault, "of another protocol")
    fault.undo(rig)
    _wait_talking(rig, concerned)
    time.sleep(_HOLD_S)
    restarted = {drive: measure.was_enabled(rig, drive, *times) for drive, times in stopped.items()}
    samples = [
        _sample(rig, fault, drive, moment, ways_ms.get(drive), restarted=restarted[drive])
        for drive in stopped
    ]
    for drive, sample in zip(stopped, samples, strict=True):
        if sample.verdict != "ok":
            say(f"{sample.verdict.upper()}: {sample}\n{measure.trace(rig, drive, moment)}")
    missing = [drive for drive in concerned if drive not in stopped and drive not in still]
    if missing:
        raise Stuck(
            f"{fault.name}: not stopped: {', '.join(f'{one.path} ({one.protocol})' for one in missing)}"
        )
    rig.run_all()
    say(f"{fault.name}: {time.monotonic() - began:.1f} s")
    return samples


def _all_move(rig: Rig, say: Callable[[str], None]) -> None:
    """A slow machine may have stopped some of them before: they are brought back, and it is told."""
    still = [drive for drive in DRIVES if not rig.moves(drive)]
    if still:
        say(f"stopped by themselves: {', '.join(drive.path for drive in still)}")
        rig.by_themselves += len(still)
        rig.run_all()


def _all_go_on(rig: Rig, drives: list[Drive] | tuple[Drive, ...], fault: Fault, which: str) -> None:
    rig.stopped_in_vain += [
        f"{fault.name}: {drive.path} ({drive.protocol}), {which}" for drive in drives if not rig.moves(drive)
    ]


def _wait_handed_on(rig: Rig, fault: Fault, since: float, say: Callable[[str], None]) -> None:
    """Every drive moves by a telegram that its owner sent after ``since``. One that is stopped meanwhile,
    be it by a slow machine, gets none: that is told, and it is brought back."""
    for _ in range(_LOOKS):
        _all_go_on(rig, DRIVES, fault, "whose owners were there")
        _all_move(rig, say)
        with suppress(Stuck):
            rig.wait(lambda: all(_was_handed_on(rig, drive, since) for drive in DRIVES), _LOOK_S, "telegrams")
            return
    raise Stuck("drives have no telegram that their owners sent after the fault")


def _was_handed_on(rig: Rig, drive: Drive, since: float) -> bool:
    """The drive is enabled by a telegram that its owner sent after ``since``."""
    told = rig.told.last(drive.rpdo)
    return told is not None and drive.enabling(told.data) and measure.sent_at(rig, drive, told) > since


def _let_pass(rig: Rig, fault: Fault, drives: list[Drive], moment: float) -> None:
    """The last bound. Who looks takes time from those who are to stop, and does not see yet what happened
    just before the fault: so nobody looks before that."""
    bound = fault.drive_bound or fault.bus_bound
    last_ms = max(bound(rig, drive) for drive in drives)
    time.sleep(max(0.0, moment + last_ms / 1000 - time.monotonic()))


def _wait_stopped(
    rig: Rig, fault: Fault, drives: list[Drive], moment: float
) -> dict[Drive, tuple[float, float]]:
    """When each drive was stopped for good, on the bus and in itself."""
    stopped: dict[Drive, tuple[float, float]] = {}
    end = time.monotonic() + _STOPPED_S
    while len(stopped) < len(drives) and time.monotonic() < end:
        for drive in drives:
            bus = measure.bus_stop(rig, drive, moment, silent=fault.leaves_silence)
            own = measure.drive_stop(rig, drive, moment)
            if fault.drive_bound is None:
                own = measure.boot_up(rig, drive, moment)
            if bus is not None and own is not None:
                stopped.setdefault(drive, (bus[0], own))
        time.sleep(0.1)
    return stopped


def _wait_talking(rig: Rig, drives: list[Drive]) -> None:
    rig.wait(lambda: all(rig.talks(drive) for drive in drives), _TALKS_S, "process data flow again")


def _ways_ms(rig: Rig, fault: Fault, drives: list[Drive], moment: float) -> dict[Drive, float]:
    """How long each last telegram was on its way: before new owners number theirs from the start."""
    if fault.reference != "telegram":
        return {}
    stops = {drive: measure.bus_stop(rig, drive, moment, silent=False) for drive in drives}
    return {drive: measure.way(rig, drive, stop[1]) * 1000 for drive, stop in stops.items() if stop}


def _sample(
    rig: Rig, fault: Fault, drive: Drive, moment: float, way_ms: float | None, *, restarted: bool
) -> Sample:
    bus = measure.bus_stop(rig, drive, moment, silent=fault.leaves_silence)
    own = measure.drive_stop(rig, drive, moment) if fault.drive_bound else None
    begin = moment
    if bus is not None and fault.reference == "telegram":
        begin = bus[1].first
    elif fault.reference == "sign of life":
        begin = measure.last_sign(rig, drive, moment)
    elif fault.reference == "boot-up":
        begin = measure.boot_up(rig, drive, moment) or moment
    assert bus is not None
    bus_bound_ms = fault.bus_bound(rig, drive)
    drive_bound_ms = fault.drive_bound(rig, drive) if fault.drive_bound else None
    paused, waited = _held_up_ms(rig, begin, (bus[0], bus_bound_ms), (own, drive_bound_ms))
    return Sample(
        fault.name,
        drive.family.name,
        drive.protocol,
        drive.path,
        bus_ms=(bus[0] - begin) * 1000,
        bus_bound_ms=bus_bound_ms,
        drive_ms=None if own is None else (own - begin) * 1000,
        drive_bound_ms=drive_bound_ms,
        way_ms=way_ms,
        paused_ms=paused,
        waited_ms=waited,
        noise_ms=rig.noise_ms,
        restarted=restarted,
        recovered=True,
    )


def _held_up_ms(
    rig: Rig, begin: float, bus: tuple[float, float], drive: tuple[float | None, float | None]
) -> tuple[float, float]:
    """The pauses of the machine, and the waiting of bridge and drives, from ``_BEFORE_MS`` before a bound
    that was exceeded until the stop; the least of them where both bounds were, 0 where none was."""
    found: list[tuple[float, float]] = []
    for stop, bound_ms, watched in ((*bus, (BRIDGE,)), (*drive, (BRIDGE, SIMULATION))):
        if stop is None or bound_ms is None or (stop - begin) * 1000 <= bound_ms:
            continue
        since = begin + (bound_ms - _BEFORE_MS) / 1000
        waited = sum(waited_ms(rig.watched, name, since, stop) for name in watched)
        found.append((paused_ms(rig.watched, since, stop), waited))
    return min(found, key=max, default=(0.0, 0.0))
