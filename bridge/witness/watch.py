"""The judgement of the witness: frames, telegrams' numbers and the time in, stops and alarms out. Sans-IO.

A stop is recorded with its time and what is promised of it; an alarm is raised as soon as a promise is
broken, whether or not the drive stops in the end. Times are seconds of one monotonic clock, those of frames
their reception.

The owner's telegrams are known only by their number, which is read now and then, with the time-out in force.
A telegram is assumed to be as young as possible, so a stop may have come up to one reading later than it
seems, and never earlier. Without readings nothing is known of the owner, which is reported.
"""

from __future__ import annotations

from collections import deque
from typing import Final

from bridge.witness.findings import Alarm, Cause, Finding, Kind, Sight, Stop
from bridge.witness.jogging import Jogs
from bridge.witness.plan import RAMP_MS, WatchedBus, WatchedDrive
from bridge.witness.services import Services

_TURNS_S: Final = 0.5
_MOST_TURNS: Final = 4
"""An RPDO that turns from "run" to "stop" and back so often in ``_TURNS_S`` has two senders."""
UNKNOWN_MS: Final = 3000
"""From the last RPDO to a drive that has stopped, where its own time-out is not known."""
_BOOT_UP, _STOPPED = 0x00, 0x04
"""States that a node says (CiA 301 §7.2.8.3.2.2)."""
_TAKES_OUT: Final = (0x02, 0x80, 0x81, 0x82)
"""NMT commands after which a node says nothing of its drives (CiA 301 §7.2.8.3.1)."""
_BEAT_WINDOW_S: Final = 2.0
_BEAT_LOAD: Final = 1.5
_BEAT_SPARE: Final = 5
"""What comes beside the beat when it changes."""
_READING_MS: Final = 150
"""A telegram may seem so much younger than it is."""
_UNSEEN_S: Final = 1.0
"""An enabled drive gets its RPDO more often than that."""
BLIND_S: Final = 5.0
"""Without a reading for so long the witness says that it sees nothing of the owner."""


class _Track:
    """What is known of one drive."""

    def __init__(self, drive: WatchedDrive) -> None:
        self.drive = drive
        self.timeout_ms = drive.timeout_ms
        """The owner's time-out that is in force."""
        self.timeout_at = float("-inf")
        """It has been told at this time for the first time."""
        self.answered_at: float | None = None
        """When its number was told last, or telling it was waited for first."""
        self.number: int | None = None
        self.telegram_at: float | None = None
        """When the owner's last telegram had come at the latest."""
        self.read_at: float | None = None
        """The last reading of its number was asked for at this time."""
        self.rpdo_at: float | None = None
        self.late_at: float | None = None
        """The first RPDO that enables later than promised after that telegram."""
        self.stopped_at: float | None = None
        """The first RPDO that does not enable, of those that go on with it."""
        self.tells_run = False
        self.turns: deque[float] = deque()
        self.is_enabled = False
        self.tpdo_at: float | None = None
        self.enabled_since: float | None = None
        self.jogs = Jogs(RAMP_MS / 1000, drive.follow_ms / 1000)
        self.rpdo = b""
        self.repeats: deque[float] = deque()
        """When an RPDO came that says what the one before it said."""
        self.node_at: float | None = None
        """Its node's error control was heard last."""
        self.taken_out_at: float | None = None
        """Its node was taken out of operation by NMT while it said "enabled"."""
        self.told: set[Kind] = set()
        """Alarms of what goes on are raised once."""

    def may_run_until(self, telegram_at: float) -> float | None:
        """The last time for an RPDO that enables; None where nothing is promised. A time-out that has been
        made shorter holds from when that is known."""
        stop_ms = self.drive.stop_ms(self.timeout_ms)
        if not stop_ms:
            return None
        beside_s = (stop_ms - self.timeout_ms) / 1000
        return max(telegram_at + stop_ms / 1000, self.timeout_at + beside_s)


class Watch:
    """One bus. ``findings`` are taken by whoever tells them. Whether it ``asks`` for telegrams' numbers."""

    def __init__(self, bus: WatchedBus, *, asks: bool = True) -> None:
        self._name = bus.name
        self._asks = asks
        self._why_blind = ""
        self._blind: list[_Track] = []
        self._tracks = {drive.name: _Track(drive) for drive in bus.drives}
        self._by_rpdo = {track.drive.rpdo: track for track in self._tracks.values()}
        self._by_tpdo = {track.drive.tpdo: track for track in self._tracks.values()}
        self._services = Services(bus.nodes, self._is_told_to_run)
        self._by_guard: dict[int, list[_Track]] = {}
        for track in self._tracks.values():
            if track.drive.node_id:
                self._by_guard.setdefault(0x700 + track.drive.node_id, []).append(track)
        self._beats = bus.beats
        self._beaten: dict[int, deque[float]] = {can_id: deque() for can_id in bus.beats}
        self._findings: list[Finding] = []

    @property
    def identifiers(self) -> list[int]:
        """What it has to see."""
        services = self._services.identifiers
        return sorted({*self._by_rpdo, *self._by_tpdo, *self._beats, *self._by_guard, *services})

    def _is_told_to_run(self, node_id: int) -> bool:
        return any(one.tells_run for one in self._tracks.values() if one.drive.node_id == node_id)

    def take_findings(self) -> list[Finding]:
        findings, self._findings = self._findings, []
        return findings

    # what comes

    def on_frame(self, can_id: int, data: bytes, at: float) -> None:
        if (track := self._by_rpdo.get(can_id)) is not None:
            self._on_rpdo(track, data, at)
        elif (track := self._by_tpdo.get(can_id)) is not None:
            self._on_tpdo(track, data, at)
        elif can_id in self._beats:
            self._on_beat(can_id, at)
        elif can_id in self._by_guard:
            for track in self._by_guard[can_id]:
                self._on_guard(track, data, at)
        elif can_id in self._services.identifiers:
            if why := self._services.on_frame(can_id, data, at):
                self._alarm(self._name, Kind.INTRUDER, at, why)
            if can_id == 0x000 and len(data) == 2 and data[0] in _TAKES_OUT:
                for track in self._tracks.values():
                    if track.is_enabled and data[1] in (0, track.drive.node_id):
                        track.taken_out_at = at

    def _on_guard(self, track: _Track, data: bytes, at: float) -> None:
        """Heartbeat or guarding answer of its node: the lower seven bits are the state."""
        track.node_at = at
        state = data[0] & 0x7F if data else None
        if state == _BOOT_UP or (state == _STOPPED and track.drive.nmt_stops):
            track.is_enabled, track.enabled_since, track.taken_out_at = False, None, None
            track.told -= {Kind.RUNS_ON, Kind.IGNORED, Kind.UNTOLD, Kind.UNHEARD}

    def on_number(
        self, name: str, number: int, asked_at: float, answered_at: float, timeout_ms: int | None = None
    ) -> None:
        """The number of the owner's last telegram, as it was between these times, and the time-out in force;
        None where that was not told."""
        track = self._tracks[name]
        track.answered_at = answered_at
        timeout_ms = track.drive.timeout_ms if timeout_ms is None else timeout_ms
        if timeout_ms != track.timeout_ms:
            track.timeout_ms, track.timeout_at = timeout_ms, answered_at
        if number != track.number:
            # The first reading says only that there may have been one just now.
            track.telegram_at = answered_at
            track.number = number
            track.late_at = None
            track.told.discard(Kind.LATE)
        track.read_at = asked_at

    def on_numbers_lost(self, why: str = "") -> None:
        """Nobody tells the numbers (any more): nothing is known of the owners."""
        self._why_blind = why
        for track in self._tracks.values():
            track.number = track.telegram_at = track.read_at = track.late_at = None

    def _on_rpdo(self, track: _Track, data: bytes, at: float) -> None:
        enables = track.drive.control.enables(data)
        self._on_repeat(track, data, at)
        track.rpdo_at = at
        if enables is None:
            return
        track.jogs.on_turn(at, stops=not enables)
        if enables:
            track.stopped_at = None
            if track.late_at is None and _is_late(track, at):
                track.late_at = at
        elif track.stopped_at is None:
            track.stopped_at = at
            track.told.discard(Kind.IGNORED)
        if enables != track.tells_run:
            track.tells_run = enables
            self._on_turn(track, at)

    def _on_repeat(self, track: _Track, data: bytes, at: float) -> None:
        """The bridge repeats an RPDO so often, and no more: beside that it sends what is new."""
        is_same, track.rpdo, period_ms = data == track.rpdo, data, track.drive.rpdo_ms
        if not is_same or not period_ms:
            return
        times = track.repeats
        times.append(at)
        while times[0] < at - _BEAT_WINDOW_S:
            times.popleft()
        if len(times) > _BEAT_LOAD * _BEAT_WINDOW_S * 1000 / period_ms + _BEAT_SPARE:
            times.clear()
            message = f"RPDO {track.drive.rpdo:03X}h comes too often: somebody else sends it, too"
            self._alarm(track.drive.name, Kind.INTRUDER, at, message)

    def _on_turn(self, track: _Track, at: float) -> None:
        turns = track.turns
        turns.append(at)
        while turns[0] < at - _TURNS_S:
            turns.popleft()
        if len(turns) > _MOST_TURNS:
            turns.clear()
            self._alarm(
                track.drive.name,
                Kind.INTRUDER,
                at,
                f"RPDO {track.drive.rpdo:03X}h says run and stop by turns: somebody else sends it, too",
            )

    def _on_tpdo(self, track: _Track, data: bytes, at: float) -> None:
        enabled = track.drive.status.enables(data)
        if enabled is None:
            return
        was_enabled, track.is_enabled = track.is_enabled, enabled
        track.tpdo_at = at
        track.taken_out_at = track.taken_out_at if enabled else None
        track.told.discard(Kind.UNHEARD)
        self._on_speed(track, data, at)
        if enabled and not was_enabled:
            track.enabled_since = at
        elif was_enabled and not enabled:
            self._findings.append(self._stop_of(track, at))
            track.told -= {Kind.RUNS_ON, Kind.IGNORED, Kind.UNTOLD}
            track.enabled_since = None

    def _on_speed(self, track: _Track, data: bytes, at: float) -> None:
        """Whether it brakes, where its owner jogs."""
        if not track.is_enabled:
            track.jogs.on_obeyed()
            return
        speed = track.drive.speed.of(data) if track.drive.speed is not None else None
        if speed is not None and (found := track.jogs.on_speed(speed, at)):
            self._alarm(track.drive.name, Kind.IGNORED, at, found)

    def _on_beat(self, can_id: int, at: float) -> None:
        what, period_ms = self._beats[can_id]
        times = self._beaten[can_id]
        times.append(at)
        while times[0] < at - _BEAT_WINDOW_S:
            times.popleft()
        if len(times) > _BEAT_LOAD * _BEAT_WINDOW_S * 1000 / period_ms + _BEAT_SPARE:
            times.clear()
            message = f"{what}, {can_id:03X}h, comes too often: somebody else sends it, too"
            self._alarm(self._name, Kind.INTRUDER, at, message)

    # judging

    def _stop_of(self, track: _Track, at: float) -> Stop:
        drive = track.drive
        if track.stopped_at is not None:
            silence_s = None if track.telegram_at is None else track.stopped_at - track.telegram_at
            is_silent = (
                silence_s is not None
                and track.timeout_ms
                and _ms(silence_s) + _READING_MS >= track.timeout_ms
            )
            return Stop(
                drive.name,
                Cause.CONTROLLER if is_silent else Cause.COMMAND,
                at,
                bus_ms=_ms(silence_s) if is_silent and silence_s is not None else None,
                bus_bound_ms=_bound_ms(track) if is_silent else None,
                drive_ms=_ms(at - track.stopped_at),
                drive_bound_ms=drive.follow_ms,
            )
        since = at if track.rpdo_at is None else track.rpdo_at
        is_bridge = at - since > _UNSEEN_S / 4
        return Stop(
            drive.name,
            Cause.BRIDGE if is_bridge else Cause.DRIVE,
            at,
            bus_ms=None,
            bus_bound_ms=None,
            drive_ms=_ms(at - since),
            drive_bound_ms=(drive.silent_ms or None) if is_bridge else None,
        )

    def on_time(self, now: float) -> None:
        """Call it when everything that had come by ``now`` has been handed over."""
        for track in self._tracks.values():
            self._judge_controller(track, now)
            self._judge_drive(track, now)
            self._judge_unheard(track, now)
        if self._asks:
            self._judge_sight(now)

    def _judge_sight(self, now: float) -> None:
        """Who is promised something of its owner, and nobody tells the owner's telegrams."""
        blind: list[_Track] = []
        for track in self._tracks.values():
            if track.drive.beside_ms is None:
                continue
            if track.answered_at is None:
                track.answered_at = now
            if now - track.answered_at > BLIND_S:
                blind.append(track)
        if added := [track for track in blind if track not in self._blind]:
            why = f": {self._why_blind}" if self._why_blind else ""
            message = f"the bridge does not tell the owner's telegrams{why}; not judged: {_names(added)}"
            self._alarm(self._name, Kind.BLIND, now, message)
        if gone := [track for track in self._blind if track not in blind]:
            message = f"the owner's telegrams are told again: {_names(gone)}"
            self._findings.append(Sight(self._name, now, message))
        self._blind = blind

    def _judge_controller(self, track: _Track, now: float) -> None:
        """An enabling RPDO later than promised, of an owner that had sent nothing when it was asked again."""
        telegram, late, read = track.telegram_at, track.late_at, track.read_at
        if telegram is None or late is None or read is None or read < late:
            return
        if not _is_late(track, late):
            # The time-out had been changed meanwhile.
            track.late_at = None
            return
        told = f"told to run {_ms(late - telegram)} ms after its owner's last telegram"
        self._once(track, Kind.LATE, now, f"{told}; promised: {_bound_ms(track)}")

    def _judge_drive(self, track: _Track, now: float) -> None:
        """A drive that says "enabled" longer than it may."""
        drive, seen = track.drive, track.tpdo_at
        if not track.is_enabled or seen is None or track.enabled_since is None:
            return
        if track.stopped_at is not None:
            since = max(track.stopped_at, track.enabled_since)
            if _ms(seen - since) > drive.follow_ms:
                after = f"enabled {_ms(seen - since)} ms after it was told to stop"
                self._once(track, Kind.IGNORED, now, f"{after}; expected: {drive.follow_ms}")
        elif track.rpdo_at is None:
            if seen - track.enabled_since > _UNSEEN_S:
                message = f"enabled, and nobody sends its RPDO {drive.rpdo:03X}h"
                self._once(track, Kind.UNTOLD, now, message)
        elif _ms(seen - track.rpdo_at) > (drive.silent_ms or UNKNOWN_MS):
            promised = f"promised: {drive.silent_ms}" if drive.silent_ms else "its own time-out is not known"
            message = f"enabled {_ms(seen - track.rpdo_at)} ms after its last RPDO; {promised}"
            self._once(track, Kind.RUNS_ON, now, message)

    def _judge_unheard(self, track: _Track, now: float) -> None:
        """A drive that said "enabled" last, and cannot say any more whether it stops."""
        if not track.is_enabled or track.tpdo_at is None:
            return
        if (out_at := track.taken_out_at) is not None and _ms(now - out_at) > track.drive.follow_ms:
            message = (
                "may run on: it said that it is enabled before its node was taken out of operation by NMT"
            )
            self._once(track, Kind.UNHEARD, now, message)
        heard_at = max(track.tpdo_at, track.node_at or 0.0)
        if track.drive.lost_ms and _ms(now - heard_at) > track.drive.lost_ms:
            message = f"may run on: enabled when it was heard last, {_ms(now - heard_at)} ms ago"
            self._once(track, Kind.UNHEARD, now, message)

    def _once(self, track: _Track, kind: Kind, now: float, message: str) -> None:
        if kind not in track.told:
            track.told.add(kind)
            self._alarm(track.drive.name, kind, now, message)

    def _alarm(self, source: str, kind: Kind, at: float, message: str) -> None:
        self._findings.append(Alarm(source, kind, at, message))


def _is_late(track: _Track, at: float) -> bool:
    """Whether an RPDO at this time must not enable any more."""
    until = None if track.telegram_at is None else track.may_run_until(track.telegram_at)
    return until is not None and _ms(at - until) > 0


def _bound_ms(track: _Track) -> int | None:
    """What is promised after the owner's last telegram; None for nothing."""
    if track.telegram_at is None or (until := track.may_run_until(track.telegram_at)) is None:
        return None
    return _ms(until - track.telegram_at)


def _names(tracks: list[_Track]) -> str:
    return ", ".join(track.drive.name for track in tracks)


def _ms(seconds: float) -> int:
    return round(seconds * 1000)
