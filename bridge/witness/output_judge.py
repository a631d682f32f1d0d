"""Judge of a node's outputs, as ``bus_judge`` is of drives. Sans-IO.

Outputs seldom say what they do. So what counts is what they are told, what the node says of its own state,
and what the files say that it does with them in that state. Where a TPDO shows them, that counts.
"""

from __future__ import annotations

from collections import deque
from typing import Final

from bridge.witness.findings import Alarm, AlarmKind, Cause, Finding, Stop
from bridge.witness.foreign_services import RESET, RESET_COMMUNICATION, START, STOP, TAKES_OUT
from bridge.witness.output_plan import Values
from bridge.witness.owner import WatchedOwner
from bridge.witness.plan import FRESH_S, RAMP_MS, UNKNOWN_MS, WatchedOutputs
from bridge.witness.rate import SPARE, Rate

_BOOT_UP, _OPERATIONAL = 0x00, 0x05
"""NMT states in a heartbeat (CiA 301 §7.2.8.3.2.2)."""
_UNSEEN_S: Final = 1.0
"""Time in seconds within which commanded outputs get their next RPDO."""


class _Rpdo:
    """Latest content of one RPDO."""

    def __init__(self, values: Values, period_ms: float) -> None:
        self.values = values
        self.data = b""
        self.is_active = False
        self.repeats = Rate(period_ms)
        self.changes: deque[float] = deque()
        """Times at which it came with other values than before."""


class OutputJudge:
    """The outputs of one node. The caller takes the ``findings``."""

    def __init__(self, watched: WatchedOutputs) -> None:
        self._watched = watched
        self.owner = WatchedOwner(watched.name, watched.timeout_ms, watched.beside_ms)
        self._rpdos = {can_id: _Rpdo(values, watched.rpdo_ms) for can_id, values in watched.rpdos.items()}
        self._guard = 0x700 + watched.node_id
        self._rpdo_at: float | None = None
        self._safe_at: float | None = None
        """Time of the first RPDO of the present run by which all outputs are safe."""
        self._unheard_at: float | None = None
        """Time at which they were told to be safe, while the node has sent nothing since."""
        self._shows = dict.fromkeys(watched.tpdos, False)
        self._shown_at = 0.0
        """Time of the last TPDO that showed active outputs."""
        self._shown_since: float | None = None
        self._heard_at: float | None = None
        self._state: int | None = None
        self._operational_at: float | None = None
        self._out: int | None = None
        """NMT command by which the node was taken out of operation."""
        self._active_out_at: float | None = None
        """Time of that command, if they were told to be active then."""
        self._told: set[tuple[AlarmKind, str]] = set()
        """Alarms raised for a state that lasts: each is raised once."""
        self._findings: list[Finding] = []

    @property
    def node_id(self) -> int:
        return self._watched.node_id

    @property
    def identifiers(self) -> set[int]:
        """Identifiers of the frames that it needs."""
        return {*self._rpdos, *self._shows, self._guard}

    @property
    def _is_active(self) -> bool:
        """True if the last RPDOs tell one of them to be active."""
        return any(one.is_active for one in self._rpdos.values())

    def is_told(self, at: float) -> bool:
        """True if one of them is kept active."""
        return self._is_active and self._rpdo_at is not None and at - self._rpdo_at <= FRESH_S

    def take_findings(self) -> list[Finding]:
        findings, self._findings = self._findings, []
        return findings

    # what comes

    def on_frame(self, can_id: int, data: bytes, at: float) -> None:
        """Take a frame with one of the ``identifiers``."""
        if (rpdo := self._rpdos.get(can_id)) is not None:
            self._on_rpdo(can_id, rpdo, data, at)
        elif can_id in self._shows:
            self._on_tpdo(can_id, data, at)
        else:
            self._on_guard(data, at)

    def _on_rpdo(self, can_id: int, rpdo: _Rpdo, data: bytes, at: float) -> None:
        active = rpdo.values.are_active(data)
        if active is None:
            message = f"RPDO {can_id:03X}h has {len(data)} bytes, and {rpdo.values.bytes} by the files"
            self._once(AlarmKind.BLIND, "length", at, f"{message}: its outputs are not judged")
            return
        if data != rpdo.data:
            rpdo.changes.append(at)
            rpdo.data = data
        elif rpdo.repeats.is_too_often(at):
            self._alarm(
                AlarmKind.INTRUDER, at, f"RPDO {can_id:03X}h comes too often: somebody else sends it, too"
            )
        was_active, rpdo.is_active, self._rpdo_at = self._is_active, active, at
        self._told.discard((AlarmKind.UNHEARD, "silence"))
        if active:
            self._safe_at = None
            self.owner.on_enabling(at)
        elif not self._is_active and self._safe_at is None:
            self._safe_at = at
            self._told.discard((AlarmKind.IGNORED, ""))
            if was_active:
                self._unheard_at = at
                self._on_safe(at)

    def _on_safe(self, at: float) -> None:
        """Note that all of them are told to be safe, and were not before."""
        silence_ms = self.owner.silence_ms(at)
        if silence_ms is not None:
            bound_ms = self.owner.bound_ms
            self._findings.append(
                Stop(self._watched.name, Cause.CONTROLLER, at, silence_ms, bound_ms, None, None)
            )

    def _on_tpdo(self, can_id: int, data: bytes, at: float) -> None:
        active = self._watched.tpdos[can_id].are_active(data)
        if active is None:
            return
        self._on_heard(at)
        self._shows[can_id] = active
        if not any(self._shows.values()):
            self._shown_since = None
            self._told -= {(kind, "") for kind in (AlarmKind.RUNS_ON, AlarmKind.IGNORED, AlarmKind.UNTOLD)}
        elif active:
            self._shown_at = at
            if self._shown_since is None:
                self._shown_since = at

    def _on_heard(self, at: float) -> None:
        self._heard_at = at
        self._unheard_at = None
        self._told.discard((AlarmKind.UNHEARD, "cut"))

    def _on_guard(self, data: bytes, at: float) -> None:
        """Take a heartbeat or guarding answer of its node: the lower seven bits are the state."""
        if not data:
            return
        self._on_heard(at)
        was, state = self._state, data[0] & 0x7F
        self._state = state
        if state == _OPERATIONAL:
            self._operational_at = at
        elif state == _BOOT_UP:
            # A reset of its communication leaves the outputs as they are (CiA 301 §7.3.2.2.1).
            if self._out != RESET_COMMUNICATION:
                self._on_off()
        elif state != was and not self._watched.why_active and self._out in (None, STOP):
            self._on_off_by_itself(at)

    def _on_off_by_itself(self, at: float) -> None:
        """Note that the node is not operational any more, and makes them safe then."""
        silent_s = 0.0 if self._rpdo_at is None else at - self._rpdo_at
        if self._is_active and silent_s > FRESH_S / 2:
            bound_ms = self._watched.silent_ms or None
            self._findings.append(
                Stop(self._watched.name, Cause.BRIDGE, at, None, None, _ms(silent_s), bound_ms)
            )
        self._on_off()

    def _on_off(self) -> None:
        for rpdo in self._rpdos.values():
            rpdo.is_active = False
        self._shows = dict.fromkeys(self._shows, False)
        self._shown_since = self._unheard_at = self._active_out_at = self._out = None
        self._told.clear()

    def on_nmt(self, command: int, at: float) -> None:
        """Take an NMT command to its node, or to all."""
        if command == START:
            self._out = self._active_out_at = None
            self._told -= {(AlarmKind.UNHEARD, "out"), (AlarmKind.IGNORED, "out")}
        elif command in TAKES_OUT:
            self._out = command
            if self._is_active and self._active_out_at is None:
                self._active_out_at = at

    # judging

    def on_time(self, now: float) -> None:
        """Judge the time: called when all frames received by ``now`` have been handed over."""
        if lateness := self.owner.lateness():
            self._alarm(AlarmKind.LATE, now, f"told to be active {lateness}")
        self._judge_senders(now)
        self._judge_shown(now)
        self._judge_silence(now)
        self._judge_unheard(now)

    def _judge_senders(self, now: float) -> None:
        """Judge RPDOs that change more often than telegrams come."""
        told = self.owner.telegrams()
        for can_id, rpdo in self._rpdos.items():
            if told is None:
                rpdo.changes.clear()
                continue
            telegrams, first_at, last_at = told
            while rpdo.changes and rpdo.changes[0] <= first_at:
                rpdo.changes.popleft()
            if sum(at < last_at for at in rpdo.changes) > telegrams + SPARE:
                rpdo.changes.clear()
                message = f"RPDO {can_id:03X}h changes more often than its owner sends telegrams"
                self._alarm(AlarmKind.INTRUDER, now, f"{message}: somebody else sends it, too")

    def _judge_shown(self, now: float) -> None:
        """Judge a TPDO that shows active outputs longer than it may."""
        seen, since, watched = self._shown_at, self._shown_since, self._watched
        if since is None:
            return
        if self._rpdo_at is None:
            if seen - since > _UNSEEN_S:
                self._once(AlarmKind.UNTOLD, "", now, "active, and nobody sends its RPDOs")
        elif self._safe_at is not None:
            after_ms = _ms(seen - max(self._safe_at, since))
            if after_ms > watched.follow_ms:
                message = f"active {after_ms} ms after it was told to be safe; expected: {watched.follow_ms}"
                self._once(AlarmKind.IGNORED, "", now, message)
        elif _ms(seen - self._rpdo_at) > self._silent_ms:
            self._once(AlarmKind.RUNS_ON, "", now, self._runs_on("active", seen - self._rpdo_at))

    def _judge_silence(self, now: float) -> None:
        """Judge the silence of the bridge for outputs that are not seen."""
        if self._shows or not self._is_active or self._rpdo_at is None:
            return
        if self._watched.why_active:
            if _ms(now - self._rpdo_at) > self._silent_ms:
                message = f"may stay active: its last RPDO, {_ms(now - self._rpdo_at)} ms ago, was"
                self._once(AlarmKind.UNHEARD, "silence", now, f"{message}; {self._watched.why_active}")
        elif self._operational_at is not None and _ms(self._operational_at - self._rpdo_at) > self._silent_ms:
            told = self._runs_on("operational", self._operational_at - self._rpdo_at)
            self._once(AlarmKind.RUNS_ON, "", now, told)

    def _judge_unheard(self, now: float) -> None:
        """Judge outputs that were told to be active last and whose node takes no RPDOs or cannot be heard."""
        watched, why = self._watched, self._watched.why_active
        if self._active_out_at is not None:
            if self._out != STOP:
                why = "it need not make them safe by that"
            limit_ms = RAMP_MS if self._out in (RESET, RESET_COMMUNICATION) else watched.follow_ms
            if why and _ms(now - self._active_out_at) > limit_ms:
                message = "may stay active: told so before its node was taken out of operation by NMT"
                self._once(AlarmKind.UNHEARD, "out", now, f"{message}; {why}")
            after_ms = _ms((self._operational_at or 0.0) - self._active_out_at)
            if after_ms > limit_ms:
                message = f"operational {after_ms} ms after its node was taken out of operation by NMT"
                self._once(AlarmKind.IGNORED, "out", now, f"{message}; expected: {limit_ms}")
        if self._heard_at is None or not (self._is_active or self._unheard_at is not None):
            return
        why = watched.why_active or ("" if watched.silent_ms else "its own time-out is not known")
        if watched.lost_ms and why and _ms(now - self._heard_at) > watched.lost_ms:
            message = f"may stay active: told so when it was heard last, {_ms(now - self._heard_at)} ms ago"
            self._once(AlarmKind.UNHEARD, "cut", now, f"{message}; {why}")

    @property
    def _silent_ms(self) -> int:
        return self._watched.silent_ms or UNKNOWN_MS

    def _runs_on(self, what: str, after_s: float) -> str:
        promised = f"promised: {self._watched.silent_ms}" if self._watched.silent_ms else ""
        return f"{what} {_ms(after_s)} ms after its last RPDO; {promised or 'its own time-out is not known'}"

    def _once(self, kind: AlarmKind, what: str, now: float, message: str) -> None:
        if (kind, what) not in self._told:
            self._told.add((kind, what))
            self._alarm(kind, now, message)

    def _alarm(self, kind: AlarmKind, at: float, message: str) -> None:
        self._findings.append(Alarm(self._watched.name, kind, at, message))


def _ms(seconds: float) -> int:
    return round(seconds * 1000)
