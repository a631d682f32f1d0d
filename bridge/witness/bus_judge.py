"""Judge of one bus for the witness: frames, telegrams' numbers and the time in, stops and alarms out.
Sans-IO.

A stop is recorded with its time and what is promised of it; an alarm is raised as soon as a promise is
broken, whether or not the drive stops in the end. Times are seconds of one monotonic clock, those of frames
their reception.

Without readings of their telegrams' numbers nothing is known of the owners, which is reported.
"""

from __future__ import annotations

from collections import deque
from typing import Final

from bridge.witness.findings import Alarm, AlarmKind, Cause, Finding, Sight, Stop
from bridge.witness.foreign_services import TAKES_OUT, Services
from bridge.witness.jogging import Jogs
from bridge.witness.output_judge import OutputJudge
from bridge.witness.owner import WatchedOwner
from bridge.witness.plan import FRESH_S, RAMP_MS, UNKNOWN_MS, WatchedBus, WatchedDrive
from bridge.witness.rate import Rate

_TURNS_S: Final = 0.5
_MOST_TURNS: Final = 4
"""Most turns of an RPDO from "run" to "stop" and back in ``_TURNS_S``: with more it has two senders."""
_BOOT_UP, _STOPPED = 0x00, 0x04
"""NMT states in a heartbeat (CiA 301 §7.2.8.3.2.2)."""
_UNSEEN_S: Final = 1.0
"""Time in seconds within which an enabled drive gets its next RPDO."""
_WAITED_S: Final = 0.1
"""Longest time in seconds for which a TPDO may have waited for the bus."""
BLIND_S: Final = 5.0
"""Time in seconds without a reading after which the witness reports that it sees nothing of the owner."""


class _Track:
    """Knowledge of one drive."""

    def __init__(self, drive: WatchedDrive) -> None:
        self.drive = drive
        self.owner = WatchedOwner(drive.name, drive.timeout_ms, drive.beside_ms)
        self.rpdo_at: float | None = None
        self.stopped_at: float | None = None
        """Time of the first RPDO of the present run that does not enable."""
        self.tells_run = False
        self.turns: deque[float] = deque()
        self.is_enabled = False
        self.tpdo_at: float | None = None
        self.enabled_since: float | None = None
        self.jogs = Jogs(RAMP_MS / 1000, drive.follow_ms / 1000)
        self.rpdo = b""
        self.repeats = Rate(drive.rpdo_ms)
        """Rate of RPDOs with the same content as the one before."""
        self.node_at: float | None = None
        """Time of its node's last error control message."""
        self.taken_out_at: float | None = None
        """Time at which its node was taken out of operation by NMT while it said "enabled"."""
        self.told: set[AlarmKind] = set()
        """Alarms raised for a state that lasts: each is raised once."""

    def is_told_to_run(self, at: float) -> bool:
        """True if its RPDOs keep it running."""
        fresh_s = max(FRESH_S, 2 * self.drive.rpdo_ms / 1000)
        return self.tells_run and self.rpdo_at is not None and at - self.rpdo_at <= fresh_s


class BusJudge:
    """One bus. The caller takes the ``findings``. ``asks`` is true where telegrams' numbers are asked for."""

    def __init__(self, bus: WatchedBus, *, asks: bool = True) -> None:
        self._name = bus.name
        self._asks = asks
        self._why_blind = ""
        self._blind: list[WatchedOwner] = []
        self._tracks = {drive.name: _Track(drive) for drive in bus.drives}
        self._by_rpdo = {track.drive.rpdo: track for track in self._tracks.values()}
        self._by_tpdo = {track.drive.tpdo: track for track in self._tracks.values()}
        self._outputs = [OutputJudge(one) for one in bus.judged_outputs]
        self._by_outputs = {can_id: one for one in self._outputs for can_id in one.identifiers}
        owners = [track.owner for track in self._tracks.values()] + [one.owner for one in self._outputs]
        self._owners = {owner.name: owner for owner in owners}
        self._services = Services(bus.nodes, self._told_to_run, bus.written)
        self._by_guard: dict[int, list[_Track]] = {}
        for track in self._tracks.values():
            if track.drive.node_id:
                self._by_guard.setdefault(0x700 + track.drive.node_id, []).append(track)
        self._beats = bus.beats
        self._beaten = {can_id: Rate(period_ms) for can_id, (_, period_ms) in bus.beats.items()}
        self._findings: list[Finding] = []

    @property
    def identifiers(self) -> list[int]:
        """Identifiers of the frames that it needs."""
        services = self._services.identifiers
        drives = {*self._by_rpdo, *self._by_tpdo, *self._by_guard}
        return sorted({*drives, *self._by_outputs, *self._beats, *services})

    def _told_to_run(self, node_id: int, at: float) -> str:
        """Text on a drive that is told to run, or outputs told to be active, of a node; empty where there are
        none."""
        if any(one.is_told_to_run(at) for one in self._tracks.values() if one.drive.node_id == node_id):
            return "a drive of it is told to run"
        is_active = any(one.is_told(at) for one in self._outputs if one.node_id == node_id)
        return "its outputs are told to be active" if is_active else ""

    def take_findings(self) -> list[Finding]:
        findings, self._findings = self._findings, []
        for one in self._outputs:
            findings += one.take_findings()
        return findings

    # what comes

    def on_frame(self, can_id: int, data: bytes, at: float) -> None:
        if can_id > 0x700 and data[:1] == b"\0":
            self._services.on_restart(can_id - 0x700)
        if (track := self._by_rpdo.get(can_id)) is not None:
            self._on_rpdo(track, data, at)
        elif (track := self._by_tpdo.get(can_id)) is not None:
            self._on_tpdo(track, data, at)
        elif (outputs := self._by_outputs.get(can_id)) is not None:
            outputs.on_frame(can_id, data, at)
        elif can_id in self._beats:
            self._on_beat(can_id, at)
        elif can_id in self._by_guard:
            for track in self._by_guard[can_id]:
                self._on_guard(track, data, at)
        elif can_id in self._services.identifiers:
            if why := self._services.on_frame(can_id, data, at):
                self._alarm(self._name, AlarmKind.INTRUDER, at, why)
            if can_id == 0x000 and len(data) == 2:
                self._on_nmt(data[0], data[1], at)

    def _on_nmt(self, command: int, node_id: int, at: float) -> None:
        for track in self._tracks.values():
            if command in TAKES_OUT and track.is_enabled and node_id in (0, track.drive.node_id):
                track.taken_out_at = at
        for outputs in self._outputs:
            if node_id in (0, outputs.node_id):
                outputs.on_nmt(command, at)

    def _on_guard(self, track: _Track, data: bytes, at: float) -> None:
        """Take a heartbeat or guarding answer of its node: the lower seven bits are the state."""
        track.node_at = at
        state = data[0] & 0x7F if data else None
        if state == _BOOT_UP or (state == _STOPPED and track.drive.nmt_stops):
            track.is_enabled, track.enabled_since, track.taken_out_at = False, None, None
            track.told -= {AlarmKind.RUNS_ON, AlarmKind.IGNORED, AlarmKind.UNTOLD, AlarmKind.UNHEARD}

    def on_number(
        self, name: str, number: int, asked_at: float, answered_at: float, timeout_ms: int | None = None
    ) -> None:
        """Take the number of the owner's last telegram, as it was between these times, and the time-out in
        force; None where that was not read."""
        self._owners[name].on_number(number, asked_at, answered_at, timeout_ms)

    def on_numbers_lost(self, why: str = "") -> None:
        """Note that the numbers cannot be read (any more): nothing is known of the owners."""
        self._why_blind = why
        for owner in self._owners.values():
            owner.on_numbers_lost()

    def _on_rpdo(self, track: _Track, data: bytes, at: float) -> None:
        enables = track.drive.control.enables(data)
        self._on_repeat(track, data, at)
        track.rpdo_at = at
        if enables is None:
            return
        track.jogs.on_turn(at, stops=not enables)
        if enables:
            track.stopped_at = None
            track.owner.on_enabling(at)
        elif track.stopped_at is None:
            track.stopped_at = at
            track.told.discard(AlarmKind.IGNORED)
        if enables != track.tells_run:
            track.tells_run = enables
            self._on_turn(track, at)

    def _on_repeat(self, track: _Track, data: bytes, at: float) -> None:
        """Judge the rate of an RPDO: the bridge repeats it so often and no more, and sends new content beside
        that."""
        is_same, track.rpdo = data == track.rpdo, data
        if is_same and track.repeats.is_too_often(at):
            message = f"RPDO {track.drive.rpdo:03X}h comes too often: somebody else sends it, too"
            self._alarm(track.drive.name, AlarmKind.INTRUDER, at, message)

    def _on_turn(self, track: _Track, at: float) -> None:
        turns = track.turns
        turns.append(at)
        while turns[0] < at - _TURNS_S:
            turns.popleft()
        if len(turns) > _MOST_TURNS:
            turns.clear()
            self._alarm(
                track.drive.name,
                AlarmKind.INTRUDER,
                at,
                f"RPDO {track.drive.rpdo:03X}h says run and stop by turns: somebody else sends it, too",
            )

    def _on_tpdo(self, track: _Track, data: bytes, at: float) -> None:
        enabled = track.drive.status.enables(data)
        if enabled is None:
            return
        was_enabled, track.is_enabled = track.is_enabled, enabled
        track.tpdo_at = at
        if track.taken_out_at is not None and (not enabled or at > track.taken_out_at + _WAITED_S):
            # Its node is back in operation: what it says counts again.
            track.taken_out_at = None
        track.told.discard(AlarmKind.UNHEARD)
        self._on_speed(track, data, at)
        if enabled and not was_enabled:
            track.enabled_since = at
        elif was_enabled and not enabled:
            self._findings.append(self._stop_of(track, at))
            track.told -= {AlarmKind.RUNS_ON, AlarmKind.IGNORED, AlarmKind.UNTOLD}
            track.enabled_since = None

    def _on_speed(self, track: _Track, data: bytes, at: float) -> None:
        """Judge whether it brakes, where its owner jogs."""
        if not track.is_enabled:
            track.jogs.on_obeyed()
            return
        speed = track.drive.speed.of(data) if track.drive.speed is not None else None
        if speed is not None and (found := track.jogs.on_speed(speed, at)):
            self._alarm(track.drive.name, AlarmKind.IGNORED, at, found)

    def _on_beat(self, can_id: int, at: float) -> None:
        if self._beaten[can_id].is_too_often(at):
            message = f"{self._beats[can_id][0]}, {can_id:03X}h, comes too often: somebody else sends it, too"
            self._alarm(self._name, AlarmKind.INTRUDER, at, message)

    # judging

    def _stop_of(self, track: _Track, at: float) -> Stop:
        drive = track.drive
        if track.stopped_at is not None:
            silence_ms = track.owner.silence_ms(track.stopped_at)
            return Stop(
                drive.name,
                Cause.COMMAND if silence_ms is None else Cause.CONTROLLER,
                at,
                bus_ms=silence_ms,
                bus_bound_ms=None if silence_ms is None else track.owner.bound_ms,
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
        """Judge the time: called when all frames received by ``now`` have been handed over."""
        for track in self._tracks.values():
            if lateness := track.owner.lateness():
                self._alarm(track.drive.name, AlarmKind.LATE, now, f"told to run {lateness}")
            self._judge_drive(track, now)
            self._judge_unheard(track, now)
        for outputs in self._outputs:
            outputs.on_time(now)
        if self._asks:
            self._judge_sight(now)

    def _judge_sight(self, now: float) -> None:
        """Judge the sight of owners: report promises for which the owner's telegrams cannot be read."""
        blind: list[WatchedOwner] = []
        for owner in self._owners.values():
            if not owner.is_promised:
                continue
            if owner.answered_at is None:
                owner.answered_at = now
            if now - owner.answered_at > BLIND_S:
                blind.append(owner)
        if added := [owner for owner in blind if owner not in self._blind]:
            why = f": {self._why_blind}" if self._why_blind else ""
            message = f"the bridge does not tell the owner's telegrams{why}; not judged: {_names(added)}"
            self._alarm(self._name, AlarmKind.BLIND, now, message)
        if gone := [owner for owner in self._blind if owner not in blind]:
            message = f"the owner's telegrams are told again: {_names(gone)}"
            self._findings.append(Sight(self._name, now, message))
        self._blind = blind

    def _judge_drive(self, track: _Track, now: float) -> None:
        """Judge a drive that says "enabled" longer than it may."""
        drive, seen = track.drive, track.tpdo_at
        if not track.is_enabled or seen is None or track.enabled_since is None:
            return
        if track.stopped_at is not None:
            since = max(track.stopped_at, track.enabled_since)
            if _ms(seen - since) > drive.follow_ms:
                after = f"enabled {_ms(seen - since)} ms after it was told to stop"
                self._once(track, AlarmKind.IGNORED, now, f"{after}; expected: {drive.follow_ms}")
        elif track.rpdo_at is None:
            if seen - track.enabled_since > _UNSEEN_S:
                message = f"enabled, and nobody sends its RPDO {drive.rpdo:03X}h"
                self._once(track, AlarmKind.UNTOLD, now, message)
        elif _ms(seen - track.rpdo_at) > (drive.silent_ms or UNKNOWN_MS):
            promised = f"promised: {drive.silent_ms}" if drive.silent_ms else "its own time-out is not known"
            message = f"enabled {_ms(seen - track.rpdo_at)} ms after its last RPDO; {promised}"
            self._once(track, AlarmKind.RUNS_ON, now, message)

    def _judge_unheard(self, track: _Track, now: float) -> None:
        """Judge a drive that said "enabled" last, and is cut off while it stops."""
        if not track.is_enabled or track.tpdo_at is None:
            return
        if (out_at := track.taken_out_at) is not None and _ms(now - out_at) > track.drive.follow_ms:
            message = (
                "may run on: it said that it is enabled before its node was taken out of operation by NMT"
            )
            self._once(track, AlarmKind.UNHEARD, now, message)
        heard_at = max(track.tpdo_at, track.node_at or 0.0)
        if track.drive.lost_ms and _ms(now - heard_at) > track.drive.lost_ms:
            message = f"may run on: enabled when it was heard last, {_ms(now - heard_at)} ms ago"
            self._once(track, AlarmKind.UNHEARD, now, message)

    def _once(self, track: _Track, kind: AlarmKind, now: float, message: str) -> None:
        if kind not in track.told:
            track.told.add(kind)
            self._alarm(track.drive.name, kind, now, message)

    def _alarm(self, source: str, kind: AlarmKind, at: float, message: str) -> None:
        self._findings.append(Alarm(source, kind, at, message))


def _names(owners: list[WatchedOwner]) -> str:
    return ", ".join(owner.name for owner in owners)


def _ms(seconds: float) -> int:
    return round(seconds * 1000)
