"""One round: all drives move, one fault, every drive it concerns is measured, and brought back."""

from __future__ import annotations

import math
import random
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Final

from tests.proof import measure
from tests.proof.drives import CLIENT_MS, DRIVES, WAY_MS, Drive
from tests.proof.examine import Examine
from tests.proof.fault import Fault
from tests.proof.measure import Sample, Span
from tests.proof.rig import BRIDGE, FRONTS, SIMULATION, NotStopped, Rig, Stuck
from tests.proof.settings import PLANT, REACTION_MS
from tests.proof.waits import longest_wait_ms, most_paused_ms, most_waited_ms, paused_ms, waited_ms

_STOPPED_S: Final = 5.0
_QUIET_S: Final = 0.4
"""How long is waited that something does *not* stop the drives."""
_LOOKS: Final = 5
_LOOK_S: Final = 1.0
_BEFORE_MS: Final = PLANT.rpdo_period_ms + REACTION_MS
"""The bridge, or the drive, has to begin its stop that long before its bound."""
_SURELY: Final = 0.8
_WRITES_S: Final = 30.0
_TO_HOLD: Final = "with `hold` the drive moves on all the time"


def run_round(rig: Rig, fault: Fault, say: Callable[[str], None]) -> list[Sample]:
    """The samples of one round. Raises ``Stuck`` where the plant does not come back."""
    _all_move(rig, say)
    if fault.examine:
        return _examined(rig, fault, fault.examine, say)
    if fault.steady:
        fault.steady(rig)
        since = time.monotonic()
        time.sleep(_QUIET_S)
        _wait_handed_on(rig, fault, since, say)
    concerned = [drive for drive in DRIVES if not fault.goes_on(drive)]
    others = [drive for drive in DRIVES if not (fault.concerns(drive) or fault.others_may_stop)]
    holding = [drive for drive in DRIVES if fault.concerns(drive) and fault.goes_on(drive)]
    # Where somebody else speaks on the bus, the drive alone tells whether it moved.
    moved = measure.was_moving if fault.bus_bound else measure.says_enabled
    began = time.monotonic()
    # At any time between two telegrams.
    time.sleep(random.uniform(0.0, PLANT.owner_period_s))
    moment = fault.inject(rig)
    _let_pass(rig, fault, concerned, moment)
    if fault.ends_soon:
        fault.undo(rig)
    still = [drive for drive in concerned + holding if not moved(rig, drive, moment)]
    if still:
        say(f"stopped by themselves as it began: {', '.join(drive.path for drive in still)}")
    rig.by_themselves += len(still)
    stopped = _wait_stopped(rig, fault, [drive for drive in concerned if drive not in still], moment)
    missing = [drive for drive in concerned if drive not in stopped and drive not in still]
    if missing:
        raise NotStopped(
            f"{fault.name}: not stopped: {', '.join(f'{one.path} ({one.protocol})' for one in missing)}"
        )
    ways = _ways(rig, fault, list(stopped), moment)
    words = {drive: measure.stopping(rig, drive, times[0]) for drive, times in stopped.items()}
    _all_go_on(rig, others, fault, "which it does not concern", began, say)
    ends: dict[Drive, float] = {}
    if fault.brings_back or fault.speaks_on:
        # Until now it may have turned now and then; from now on it may not.
        ends = dict.fromkeys(stopped, rig.now())
        stopped = {
            drive: (bus, _turned_until(rig, fault, drive, moment)) for drive, (bus, _) in stopped.items()
        }
    before = {drive: rig.board.accepted(drive.place)[0] for drive in concerned}
    undone = rig.now()
    if not fault.ends_soon:
        fault.undo(rig)
    _wait_talking(rig, concerned)
    _wait_writing(rig, before)
    time.sleep(rig.hold_s)
    samples: list[Sample] = []
    for drive, times in stopped.items():
        if _was_stopped_before(rig, fault, drive, times[0], _last_telegram(drive, ways, moment)):
            say(f"stopped by itself: {drive.path}, before its owner's time was up")
            rig.by_themselves += 1
            continue
        wrong = _wrong(rig, fault, drive, (times[0], ends.get(drive, times[1])), words[drive])
        wrong = wrong or fault.lacks(rig, drive, moment)
        samples.append(_sample(rig, fault, drive, moment, times[1], ways.get(drive), wrong))
    held_until = undone if fault.hands_over else rig.now()
    samples += _held(rig, fault, [drive for drive in holding if drive not in still], moment, held_until)
    for sample in samples:
        if sample.verdict != "ok":
            drive = next(drive for drive in DRIVES if drive.path == sample.drive)
            say(f"{sample.verdict.upper()}: {sample}\n{measure.trace(rig, drive, moment)}")
    rig.run_all(anew=holding)
    say(f"{fault.name}: {time.monotonic() - began:.1f} s")
    return samples


def _examined(rig: Rig, fault: Fault, examine: Examine, say: Callable[[str], None]) -> list[Sample]:
    """The samples of a fault that is judged by yes or no. Where the machine was so slow that drives had to
    be stopped, a no proves nothing, and the fault is injected once more."""
    began = time.monotonic()
    found = examine(rig)
    others = [drive for drive in DRIVES if not (fault.concerns(drive) or fault.others_may_stop)]
    _all_go_on(rig, others, fault, "which it does not concern", began, say)
    samples: list[Sample] = []
    for finding in found:
        of, spans = finding.of, finding.spans
        if finding.wrong and _was_held_up(rig, of if isinstance(of, Drive) else None, began):
            say(f"the machine was slow: {fault.name}: {of.path}: {finding.wrong}")
            rig.by_themselves += 1
            rig.excused.append(f"{of.path}: {finding.wrong}")
            continue
        paused, waited = _held_up_ms(rig, spans)
        sample = Sample(
            fault.name,
            of.family_name + PLANT.label,
            of.protocol,
            of.path,
            bus_ms=spans[0].ms if spans else None,
            bus_bound_ms=spans[0].bound_ms if spans else None,
            paused_ms=paused,
            waited_ms=waited,
            noise_ms=rig.noise_ms,
            demand=fault.demand,
            wrong=finding.wrong,
        )
        if sample.verdict != "ok":
            trace = measure.trace(rig, of, began) if isinstance(of, Drive) else ""
            say(f"{sample.verdict.upper()}: {sample}\n{trace}")
        samples.append(sample)
    fault.undo(rig)
    rig.run_all()
    say(f"{fault.name}: {time.monotonic() - began:.1f} s")
    return samples


def _turned_until(rig: Rig, fault: Fault, drive: Drive, moment: float) -> float:
    """As if it had turned without a pause from ``moment`` on, where somebody brings it back."""
    if fault.brings_back:
        return moment + measure.longest_turn(rig, drive, moment)
    return measure.last_turn_end(rig, drive, moment)


def _wrong(rig: Rig, fault: Fault, drive: Drive, times: tuple[float, float], word: bytes | None) -> str:
    """What no time excuses. ``word`` is the first RPDO that did not enable, before the fault was undone."""
    if measure.was_enabled(rig, drive, *times):
        return "it was enabled again before its owner had acknowledged and enabled it anew"
    if not fault.of_controller:
        return ""
    if drive.reaction == "silence":
        word = measure.spoken_to(rig, drive, *times)
        return f"stopped by {word.hex()}, and not by silence" if word else ""
    if not fault.leaves_silence and (word is None or not drive.reacts(word)):
        return f"stopped by {word.hex() if word else 'nothing'}, and not by {drive.reaction}"
    return "its setpoint goes on" if measure.keeps_setpoint(rig, drive, times[0]) else ""


def _last_telegram(drive: Drive, ways: dict[Drive, tuple[float, float]], moment: float) -> float:
    """When it was handed on, or at the latest is to have been: a slow owner's may be older."""
    return ways[drive][1] if drive in ways else moment - PLANT.owner_period_s


def _was_stopped_before(rig: Rig, fault: Fault, drive: Drive, bus: float, since: float) -> bool:
    """A slow machine stopped the drive before its controller's time was up, which counts from ``since``: that
    is no reaction to it."""
    early = bus < since + PLANT.fieldbus_timeout_ms / 1000 * _SURELY
    return fault.of_controller and early and _was_slow(rig, drive, since)


def _held(rig: Rig, fault: Fault, drives: list[Drive], moment: float, until: float) -> list[Sample]:
    """Drives whose reaction is to hold. One that stops because the machine was slow for its bridge or itself
    counts as stopped in vain."""
    samples: list[Sample] = []
    for drive in drives:
        wrong = measure.held(rig, drive, moment, until)
        if wrong and _was_held_up(rig, drive, moment):
            rig.stopped_in_vain.append(f"{fault.name}: {drive.path} ({drive.protocol}), which is to hold")
            continue
        text = f"it is to hold, and {wrong}" if wrong else ""
        samples.append(
            Sample(
                fault.name,
                drive.family_name + PLANT.label,
                drive.protocol,
                drive.path,
                demand=_TO_HOLD,
                wrong=text,
            )
        )
    return samples


def _was_slow(rig: Rig, drive: Drive, since: float) -> bool:
    """The bridge hung for longer than its dead-man time, or the drive was not heard for as long."""
    now = time.monotonic()
    waited = max(paused_ms(rig.watched, since, now), waited_ms(rig.watched, BRIDGE, since, now))
    return max(waited, measure.longest_pause(rig, drive, since) * 1000) >= PLANT.deadman_ms


def _was_held_up(rig: Rig, drive: Drive | None, since: float) -> bool:
    """The same at a stretch, in what takes seconds, or those who keep the drive moving were; ``drive``: None
    for outputs, which say nothing."""
    now = time.monotonic()
    hung = longest_wait_ms(rig.watched, BRIDGE, since, now)
    if drive is None:
        return hung >= PLANT.deadman_ms
    silent = measure.longest_pause(rig, drive, since) * 1000
    # It may have been silent for a while when this began.
    since -= PLANT.fieldbus_timeout_ms / 1000
    return max(hung, silent) >= PLANT.deadman_ms or _was_starved(rig, drive, since)


def _all_move(rig: Rig, say: Callable[[str], None]) -> None:
    """A slow machine may have stopped some of them before, and others while these came back: they are brought
    back, and it is told."""
    for _ in range(_LOOKS):
        still = [drive for drive in DRIVES if not rig.moves(drive)]
        if not still:
            return
        say(f"stopped by themselves: {', '.join(drive.path for drive in still)}")
        rig.by_themselves += len(still)
        rig.run_all()


def _all_go_on(
    rig: Rig,
    drives: Sequence[Drive],
    fault: Fault,
    which: str,
    since: float,
    say: Callable[[str], None],
) -> None:
    """One that the machine itself has stopped since then is none of the fault's, which is told."""
    for drive in drives:
        if rig.moves(drive):
            continue
        if _was_starved(rig, drive, since):
            say(f"stopped by itself: {drive.path}, beside {fault.name}")
            rig.by_themselves += 1
        else:
            rig.stopped_in_vain.append(f"{fault.name}: {drive.path} ({drive.protocol}), {which}")


def _was_starved(rig: Rig, drive: Drive, since: float) -> bool:
    """Those who keep it moving waited for the CPU for as long as stops it: the bridge, the drives, or its
    owner, who may be late by what its time-out is longer than its period."""
    now = time.monotonic()
    owner_ms = PLANT.fieldbus_timeout_ms - PLANT.owner_period_s * 1000
    stops = {BRIDGE: PLANT.deadman_ms, SIMULATION: PLANT.heartbeat_ms / 2, drive.protocol: owner_ms}
    if drive.protocol in FRONTS:
        stops[FRONTS[drive.protocol]] = owner_ms
    # At a stretch: of a long round the little pauses of a slow machine would add up to any excuse.
    deadman_s = PLANT.deadman_ms / 1000
    return most_paused_ms(rig.watched, since, now, 2 * deadman_s) >= PLANT.deadman_ms or any(
        most_waited_ms(rig.watched, name, since, now, 2 * stop_ms / 1000) >= stop_ms
        for name, stop_ms in stops.items()
    )


def _wait_handed_on(rig: Rig, fault: Fault, since: float, say: Callable[[str], None]) -> None:
    """Every drive moves by a telegram that its owner sent after ``since``. One that is stopped meanwhile,
    be it by a slow machine, gets none: that is told, and it is brought back. So is one that has tripped and
    is to hold: it moves on, and not by its owner."""
    for _ in range(_LOOKS):
        _all_go_on(rig, DRIVES, fault, "whose owners were there", since, say)
        _all_move(rig, say)
        with suppress(Stuck):
            rig.wait(lambda: all(_was_handed_on(rig, drive, since) for drive in DRIVES), _LOOK_S, "telegrams")
            return
        held = [one for one in DRIVES if one.reaction == "hold" and not _was_handed_on(rig, one, since)]
        if held:
            say(f"on hold by themselves: {', '.join(drive.path for drive in held)}")
            rig.by_themselves += len(held)
            rig.run_all(anew=held)
    lacking = ", ".join(
        f"{one.path} ({one.protocol})" for one in DRIVES if not _was_handed_on(rig, one, since)
    )
    raise Stuck(f"{fault.name}: drives have no telegram that their owners sent after it: {lacking}")


def _was_handed_on(rig: Rig, drive: Drive, since: float) -> bool:
    """The drive is enabled by a telegram that its owner sent after ``since``."""
    told, number = rig.told.last(drive.rpdo), rig.told.last(drive.number_id)
    if told is None or number is None or not drive.enabling(told.data):
        return False
    return measure.sent_at(rig, drive, number) > since


def _let_pass(rig: Rig, fault: Fault, drives: list[Drive], moment: float) -> None:
    """The last bound. Who looks takes time from those who are to stop, and does not see yet what happened
    just before the fault: so nobody looks before that."""
    bound = fault.drive_bound or fault.bus_bound
    assert bound
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
            bus = measure.bus_stop(rig, drive, moment, silent=fault.falls_silent(drive))
            own = measure.drive_stop(rig, drive, moment)
            if fault.drive_bound is None:
                own = measure.boot_up(rig, drive, moment)
            if own is not None and fault.bus_bound is None:
                # Somebody else speaks there.
                stopped.setdefault(drive, (math.inf, own))
            elif bus is not None and own is not None:
                stopped.setdefault(drive, (bus[0], own))
        time.sleep(0.1)
    return stopped


def _wait_talking(rig: Rig, drives: list[Drive]) -> None:
    """One that has tripped into silence is told nothing until it is acknowledged."""

    def waiting() -> list[Drive]:
        return [
            drive
            for drive in drives
            if not (rig.says(drive) and (drive.reaction == "silence" or rig.talks(drive)))
        ]

    _wait_none(rig, waiting, rig.patience_s, "process data flow again")


def _wait_none(rig: Rig, waiting: Callable[[], list[Drive]], limit_s: float, what: str) -> None:
    try:
        rig.wait(lambda: not waiting(), limit_s, what)
    except Stuck as stuck:
        raise Stuck(f"{stuck}: {', '.join(drive.path for drive in waiting())}") from None


def _wait_writing(rig: Rig, before: dict[Drive, int]) -> None:
    """Every owner's telegrams are taken again, which move nothing."""

    def waiting() -> list[Drive]:
        return [drive for drive, count in before.items() if rig.board.accepted(drive.place)[0] <= count]

    _wait_none(rig, waiting, _WRITES_S, "telegrams are taken again")


def _ways(rig: Rig, fault: Fault, drives: list[Drive], moment: float) -> dict[Drive, tuple[float, float]]:
    """When each last telegram was sent, and when it was handed on: before new owners number theirs from the
    start."""
    if fault.reference != "telegram":
        return {}
    found: dict[Drive, tuple[float, float]] = {}
    for drive in drives:
        stop = measure.bus_stop(rig, drive, moment, silent=fault.falls_silent(drive))
        if stop:
            run = measure.handed_on(rig, drive, stop[1])
            found[drive] = measure.sent_at(rig, drive, run), run.first
    return found


def _sample(
    rig: Rig,
    fault: Fault,
    drive: Drive,
    moment: float,
    stopped: float,
    way: tuple[float, float] | None,
    wrong: str,
) -> Sample:
    """``stopped``: when the drive showed it."""
    bus = measure.bus_stop(rig, drive, moment, silent=fault.falls_silent(drive))
    own = stopped if fault.drive_bound else None
    begin = moment
    if way is not None:
        begin = way[1]
    elif fault.reference == "sign of life":
        begin = measure.last_sign(rig, drive, moment)
    elif fault.reference == "boot-up":
        begin = measure.boot_up(rig, drive, moment) or moment
    spans: list[Span] = []
    if bus is not None and fault.bus_bound:
        spans.append(Span(begin, bus[0], fault.bus_bound(rig, drive), (BRIDGE,)))
    on_bus = spans[0] if spans else None
    sent: Span | None = None
    if own is not None and fault.drive_bound:
        spans.append(Span(begin, own, fault.drive_bound(rig, drive), (BRIDGE, SIMULATION)))
    if way is not None:
        busy = (BRIDGE, drive.protocol, *([FRONTS[drive.protocol]] if drive.protocol in FRONTS else []))
        spans.append(Span(*way, WAY_MS[drive.protocol], busy))
        if on_bus:
            sent = Span(way[0], on_bus.end, on_bus.bound_ms + CLIENT_MS, busy)
            spans.append(sent)
    paused, waited = _held_up_ms(rig, spans)
    return Sample(
        fault.name,
        drive.family_name + PLANT.label,
        drive.protocol,
        drive.path,
        bus_ms=on_bus.ms if on_bus else None,
        bus_bound_ms=on_bus.bound_ms if on_bus else None,
        drive_ms=None if own is None else (own - begin) * 1000,
        drive_bound_ms=fault.drive_bound(rig, drive) if fault.drive_bound else None,
        way_ms=None if way is None else (way[1] - way[0]) * 1000,
        way_bound_ms=None if way is None else WAY_MS[drive.protocol],
        sent_ms=sent.ms if sent else None,
        sent_bound_ms=sent.bound_ms if sent else None,
        paused_ms=paused,
        waited_ms=waited,
        noise_ms=rig.noise_ms,
        wrong=wrong,
    )


def _held_up_ms(rig: Rig, spans: list[Span]) -> tuple[float, float]:
    """The pauses of the machine, and the waiting of those who were busy, from ``_BEFORE_MS`` before a bound
    that was exceeded until the end; the least of them where several were, 0 where none was."""
    found: list[tuple[float, float]] = []
    for span in spans:
        if span.ms <= span.bound_ms:
            continue
        since = max(span.begin, span.begin + (span.bound_ms - _BEFORE_MS) / 1000)
        waited = sum(waited_ms(rig.watched, name, since, span.end) for name in span.busy)
        found.append((paused_ms(rig.watched, since, span.end), waited))
    return min(found, key=max, default=(0.0, 0.0))
