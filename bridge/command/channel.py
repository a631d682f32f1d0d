"""One drive's command channel: requests in, RPDO words and outcomes out.

Puts the controller leg and the drive leg of one drive together. Sans-IO: every entry takes ``now``
(monotonic seconds). A request lets the controller's timers run first, so a telegram that waited in a
buffer while the process hung cannot save a drive whose time was up. The drive's own timers are judged
in ``on_time`` alone, which is called after the bus has been drained: a late process must not look like
a dead drive.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from bridge.command.controller import ControllerLeg
from bridge.command.event import Event, Kind
from bridge.command.link import Link, NodeState
from bridge.command.output import Output
from bridge.command.request import Code, Identity, Outcome, Reply, Request
from bridge.command.status import DriveStatus
from bridge.command.watchdog import Stimulus, WatchdogState
from bridge.config import DriveTable
from bridge.drive import DriveState, LinearScale, Told, scale_of
from bridge.mapping.model import Family


class DriveChannel:
    """The command side of one drive.

    ``report`` gets the events. After any call the caller compares ``output`` and sends it. ``settled``
    is called when what others may see has changed beyond the status word, before outcomes are told:
    who reads on an outcome reads what it is about.
    """

    def __init__(
        self,
        name: str,
        family: Family,
        settings: DriveTable,
        hold_ms: int,
        report: Callable[[Event], None],
    ) -> None:
        self.name = name
        self.family = family
        self.settings = settings
        self.scales: dict[str, LinearScale] = {}
        """Known scales by the value's leaf (``actual/frequency``); from the mapping and the site file, and
        at boot-up."""
        self.unserved: dict[str, str] = {}
        """Points that the node cannot serve, by their leaf, with the reason; known after boot-up."""
        for value in family.value:
            scale = scale_of(value)
            if scale is not None:
                self.scales[value.leaf] = scale
        self.settled: Callable[[float], None] = lambda now: None
        self._report = report
        self._status = status = DriveStatus(family)
        self.link = Link(settings.telegram_downtime_s, hold_ms)
        self._leg = leg = ControllerLeg(
            name, family, settings, self.link, status, self.scales, self.unserved, self._tell
        )
        self.authority = leg.authority
        self.watchdog = leg.watchdog
        self.words = leg.words
        self._gate = leg.gate

    def look_up(self, why_lacking: Callable[[frozenset[int], float], str]) -> None:
        """Ask this why actual words, by their places in ``process.tpdo``, are not known at a time; it says
        nothing where they are."""
        self._leg.why_lacking = why_lacking

    def on_trip(self, tripped: Callable[[float], None]) -> None:
        """Call this with the deadline whenever the watchdog trips."""
        self._leg.tripped = tripped

    # what others may see

    @property
    def output(self) -> Output:
        """The words that belong on the bus now."""
        return self._gate.sent

    @property
    def until(self) -> float | None:
        """Until when ``output`` may be on the bus if nothing more is heard of the owner; None where no time
        ends it."""
        return self._leg.until

    def output_then(self) -> Output:
        """What belongs on the bus from ``until`` on."""
        return self._leg.output_then()

    @property
    def control_word(self) -> int:
        return self._leg.control_word

    @property
    def setpoints(self) -> tuple[int, ...]:
        return self._gate.setpoints

    @property
    def silence_stops(self) -> bool:
        """The drive is known to stop by itself when it gets no RPDO any more, or nobody has asked it yet."""
        return self._gate.silence_stops

    @property
    def restart_interlock(self) -> bool:
        return self._gate.interlocked

    @property
    def owner(self) -> Identity | None:
        return self.authority.owner

    @property
    def trips(self) -> int:
        return self._leg.trips

    @property
    def refused_writes(self) -> int:
        return self._leg.refused_writes

    @property
    def is_tripped(self) -> bool:
        return self.watchdog.state is WatchdogState.TRIPPED

    @property
    def drive_status_word(self) -> int:
        """The status word as the drive sent it."""
        return self._status.word

    @property
    def status_word(self) -> int:
        """The status word as served: *fault* while tripped, as a bus interface would show it."""
        status = self._status
        if self.watchdog.state is WatchdogState.TRIPPED:
            return status.words.as_fault(status.word)
        return status.word

    @property
    def state(self) -> DriveState:
        """The state as the drive reports it."""
        return self._status.state

    @property
    def served_state(self) -> DriveState:
        return DriveState.FAULT if self.watchdog.state is WatchdogState.TRIPPED else self._status.state

    @property
    def emcy_code(self) -> int:
        return self._status.emcy_code

    @property
    def last_fault(self) -> float:
        return self._status.last_fault

    @property
    def current_fault(self) -> float:
        """Present fault: the bridge's own such as 10.3, else the one that the drive tells; 0 where there is
        none."""
        return self._bridge_fault or self._status.drive_fault

    @property
    def _bridge_fault(self) -> float:
        return self.family.faults.controller_silent if self.is_tripped else self._status.link_fault

    @property
    def fault_text(self) -> str:
        return self._status.fault_text(self._bridge_fault)

    # from the drive

    def on_own_watch(self, why_not: str, now: float) -> None:
        """Whether the drive stops by itself when it gets no RPDO any more: ``why_not``, or an empty text."""
        stops = not why_not
        if stops is self._gate.silence_stops:
            return
        self._gate.silence_stops = stops
        if why_not and self.settings.falls_silent:
            message = f"silence does not stop the drive, it gets disable voltage instead: {why_not}"
            self._tell(now, Kind.WATCHDOG, 700, message)
        self._settle(now)

    def on_status_word(self, word: int, now: float) -> None:
        """A TPDO brought this status word."""
        status = self._status
        status.word = word
        state = status.words.state(word)
        is_awaited = self._gate.on_status_word(word)
        if state is status.state and not (is_awaited or self._gate.awaits_rest):
            self._on_same_state(now)
            return
        status.state = state
        self._gate.on_state(state)
        self._leg.start.on_state(state, now, self.fault_text)
        self._settle(now)

    def _on_same_state(self, now: float) -> None:
        start = self._leg.start
        if start.awaits_report:
            start.on_report(self._status.state, now)
            self._settle(now)

    def on_unchanged(self, now: float) -> None:
        """A TPDO arrived that says what the last one said."""
        self.on_pdo(now)
        self._on_same_state(now)

    def on_actual_words(self, words: Sequence[int], now: float) -> None:
        """What TPDOs have brought, the status word first, in the order of ``process.tpdo``."""
        if self._gate.follow(words):
            self._settle(now)

    def on_pdo(self, now: float) -> None:
        """A TPDO arrived; what it says comes after this."""
        if self.link.on_pdo(now):
            self._status.link_fault = 0.0
            self._settle(now)

    def on_emcy(self, told: Told, now: float) -> None:
        """An emergency message about this drive."""
        self._status.on_emcy(told)
        severity = 100 if told.is_gone else 700
        self._tell(now, Kind.EMERGENCY, severity, f"emergency {told.code:04X}h: {told.text}")
        self._settle(now)

    def on_drive_fault(self, current: float | None, last: float | None, now: float) -> None:
        """The drive has been asked for its present and its last fault; None for what it did not tell."""
        if self._status.on_drive_fault(current, last):
            self._settle(now)

    def on_node(self, state: NodeState, now: float) -> None:
        """The node behind the drive is in another state now."""
        before = self.link.node
        self.link.on_node(state, now)
        if state is not before:
            if state is NodeState.OPERATIONAL:
                # It may have been switched off and on: whatever it was told before does not count.
                self._gate.interlocked = True
                self._leg.start.end(Outcome(Code.CANCELLED, "the node has restarted"))
            if state in (NodeState.OPERATIONAL, NodeState.DISABLED):
                self._status.link_fault = 0.0
            if state is NodeState.LOST:
                self._link_is_lost(self.family.faults.node_missing, "the node is lost", now)
        self._settle(now)

    def _link_is_lost(self, fault: float, reason: str, now: float) -> None:
        self._status.link_fault = self._status.last_fault = fault
        self._tell(now, Kind.WATCHDOG, 700, f"{self.family.faults.prefix}{fault:.1f}: {reason}")

    # time

    def on_time(self, now: float) -> None:
        """Let everything happen that is due by ``now``. Call it when the bus has been drained."""
        self._leg.judge(now)
        if self.link.on_time(now):
            self._link_is_lost(self.family.faults.telegram_downtime, "no process data from the drive", now)
        self._leg.start.on_time(self._status.state, now)
        self._settle(now)

    def next_deadline(self, now: float) -> float | None:
        """When ``on_time`` is to be called; ``now`` where something is due already, None for never."""
        earliest = self.link.next_deadline()
        for time in self._leg.next_deadlines():
            if time is not None and (earliest is None or time < earliest):
                earliest = time
        return None if earliest is None else max(earliest, now)

    def on_bridge_gap(self, now: float) -> None:
        """The bridge itself was not there for longer than the dead-man time: start as if anew."""
        self._leg.judge(now)
        if self.is_tripped:
            # Still tripped; but a "hold" does not outlive the one who held.
            self._gate.stop(self.words.stop(self._gate.sent.words[0]))
        else:
            self._leg.leave(Stimulus.STARTED, now)
        self._settle(now)

    def start_anew(self, now: float) -> None:
        """The bus was gone, or the node was stopped or has restarted: whatever the drive was told does not
        count any more, not even where communication errors are ignored."""
        self._leg.start.end(Outcome(Code.CANCELLED, "the drive has to be enabled anew"))
        self._gate.stop(self.words.stop(self._gate.sent.words[0]))
        self._settle(now)
        self._gate.forget()

    # requests

    def handle(self, request: Request, now: float, reply: Reply) -> None:
        """Do what ``request`` asks; ``reply`` is called exactly once, now or later."""
        self._leg.handle(request, now, reply)
        self._settle(now)

    def on_refused(self, now: float) -> None:
        """A request about this drive was refused elsewhere, and counts as one that is refused here."""
        self._leg.refused_writes += 1
        self.settled(now)

    def _settle(self, now: float) -> None:
        """The end of every entry: what is sent and seen is brought up to date, then outcomes are told."""
        leg = self._leg
        may_enable = leg.may_enable(now)
        if not may_enable:
            self._gate.interlocked = True
            if leg.start.is_going_on:
                leg.start.end(Outcome(Code.NOT_READY, leg.why_blocked(now)))
        self._gate.compute(now, may_enable=may_enable)
        if self._gate.take_untaken():
            self._tell(
                now,
                Kind.REFUSED,
                500,
                "the drive has not taken the position that was written: no answer within 1 s",
            )
        self.settled(now)
        while leg.outcomes:
            reply, outcome = leg.outcomes.pop(0)
            reply(outcome)

    def _tell(self, now: float, kind: Kind, severity: int, message: str) -> None:
        self._report(Event(now, kind, self.name, severity, message))
