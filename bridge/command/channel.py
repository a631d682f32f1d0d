"""One drive's command channel: what the bus and the clients say becomes events of the leg, and what comes of
them becomes outcomes, events and words.

Sans-IO: every entry takes ``now`` (monotonic seconds). A request lets the controller's timers run first, so a
telegram that waited in a buffer while the process hung cannot save a drive whose time was up. The drive's own
timers are judged in ``on_time`` alone, which is called after the bus has been drained: a late process must
not look like a dead drive.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

from bridge.command.event import Event, Kind
from bridge.command.leg import event, owners
from bridge.command.leg.effect import Answer, Effect, Heard, Ignored, StartBegun, StartEnded, Tell, Tripped
from bridge.command.leg.outlook import next_deadline, output_then, until, watchdog_state
from bridge.command.leg.settings import leg_settings
from bridge.command.leg.state import AWAITS_REPORT, WANTS_STOP_WORD, LegState, Output, WatchdogState, Way
from bridge.command.leg.step import initial, step
from bridge.command.leg.turn import control_word
from bridge.command.link import Link, NodeState
from bridge.command.request import Identity, Outcome, Reply, Request
from bridge.command.status import DriveStatus
from bridge.command.telegram import TelegramDecoder
from bridge.config import DriveTable
from bridge.drive import FAULTED, DriveState, Explained, Meanings, Told
from bridge.image import Quality
from bridge.mapping.model import Family


class DriveChannel:
    """The command side of one drive.

    After any call the caller compares ``output`` and sends it. ``report`` gets the events. ``settled`` is
    called when what others may see has changed beyond the status word, before outcomes are told: so a client
    that reads after its outcome sees the new values. ``tripped`` gets the deadline whenever the watchdog
    trips. ``due`` is told of deadlines that may be earlier than before, ``NOW`` where they are not computed;
    whoever is told by ``settled`` has to ask for them, too.
    """

    def __init__(
        self,
        name: str,
        family: Family,
        settings: DriveTable,
        hold_ms: int,
        report: Callable[[Event], None],
        *,
        settled: Callable[[float], None],
        tripped: Callable[[float], None],
        due: Callable[[float], None] = lambda at: None,
    ) -> None:
        self.name = name
        self.family = family
        self.settings = settings
        slot = family.slot_named(settings.slot)
        self.meanings = Meanings(family, slot, settings.parameters)
        """What the words mean in each parameter set: from the mapping and the site file, and as read from
        the drive."""
        self.unserved: dict[str, str] = {}
        """Points that the node cannot serve, by their leaf, with the reason; known after boot-up."""
        self.link = Link(settings.telegram_downtime_s, hold_ms)
        self._report = report
        self._settled = settled
        self._tripped = tripped
        self.due = due
        self._status = DriveStatus(family)
        decode = TelegramDecoder(
            name, family, slot, self.meanings, self.unserved, lambda: self._reported_word
        ).decode
        self.leg_settings = leg_settings(family, settings, decode)
        self.words = self.leg_settings.words
        self.leg = initial(self.leg_settings)
        """The state of the leg."""
        self._followed = frozenset(source for _, source in self.leg_settings.follows)
        self._start_reply: Reply | None = None
        self.trips = 0
        self.refused_writes = 0
        self.telegrams = 0
        """Number of the last valid telegram, modulo 2¹⁶: a witness outside sees by it that one came."""

    # what others may see

    @property
    def output(self) -> Output:
        """The words that belong on the bus now."""
        return self.leg.sent

    @property
    def until(self) -> float | None:
        """Until when ``output`` may be on the bus if nothing more is heard of the owner; None where no time
        ends it."""
        return until(self.leg_settings, self.leg)

    def output_then(self) -> Output:
        """What belongs on the bus from ``until`` on."""
        return output_then(self.leg_settings, self.leg)

    @property
    def _reported_word(self) -> int | None:
        """The status word of a drive that is heard."""
        return self._status.word if self.leg.way.is_heard else None

    @property
    def control_word(self) -> int:
        """As if it were the owner's (``bridge.command.leg.turn``)."""
        return control_word(self.words, self.leg)

    @property
    def setpoints(self) -> tuple[int, ...]:
        return self.leg.setpoints

    @property
    def silence_stops(self) -> bool:
        """The drive is known to stop by itself when it gets no RPDO any more, or nobody has asked it yet."""
        return self.leg.silence_stops

    @property
    def restart_interlock(self) -> bool:
        return self.leg.stage in WANTS_STOP_WORD

    @property
    def owner(self) -> Identity | None:
        return self.leg.owner.identity

    @property
    def watchdog_state(self) -> WatchdogState:
        return watchdog_state(self.leg_settings, self.leg)

    @property
    def controller_is_overdue(self) -> bool:
        """No valid telegram for longer than the time-out, after there had been one."""
        return self.leg.timer.is_overdue

    @property
    def timeout_ms(self) -> int:
        return self.leg.timer.timeout_ms

    def left_ms(self, now: float) -> int:
        """Time until the trip; 0 when the timer does not run."""
        deadline = self.leg.timer.deadline
        if deadline is None or self.watchdog_state is not WatchdogState.RUNNING:
            return 0
        return max(0, round((deadline - now) * 1000))

    @property
    def is_tripped(self) -> bool:
        return self.leg.stage.is_tripped

    @property
    def drive_status_word(self) -> int:
        """The status word as the drive sent it."""
        return self._status.word

    @property
    def status_word(self) -> int:
        """The status word as served: *fault* while tripped, as a bus interface would show it."""
        status = self._status
        return status.words.as_fault(status.word) if self.is_tripped else status.word

    @property
    def state(self) -> DriveState:
        """The state as the drive reports it."""
        return self.leg.drive

    @property
    def served_state(self) -> DriveState:
        return DriveState.FAULT if self.is_tripped else self.leg.drive

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
        return self._status.fault_text(self._bridge_fault, self.state)

    @property
    def fault(self) -> Explained:
        """The present fault as its maker writes it, with cause and remedy."""
        return self._status.fault(self._bridge_fault, self.state)

    @property
    def last_fault_text(self) -> str:
        return self._status.last_fault_text

    def refusal(self, identity: Identity) -> str:
        """Why ``identity`` may not command the drive, whose owner is there; empty where it may."""
        return owners.refusal(self.settings.control, self.leg.owner, identity, is_replaceable=False)

    # from the drive

    def on_own_watch(self, why_not: str, now: float) -> None:
        """Whether the drive stops by itself when it gets no RPDO any more: ``why_not``, or an empty text."""
        stops = not why_not
        if stops is self.leg.silence_stops:
            return
        if why_not and self.settings.falls_silent:
            message = f"silence does not stop the drive, it gets disable voltage instead: {why_not}"
            self._tell(now, Kind.WATCHDOG, 700, message)
        self._happen(event.OwnWatch(stops), now)

    def on_status_word(self, word: int, now: float) -> None:
        """A TPDO brought this status word."""
        status, leg, handshake = self._status, self.leg, self.leg_settings.handshake
        state = status.words.state(word)
        is_taken = handshake is not None and bool(word & handshake.acknowledged)
        is_news = state is not leg.drive or (handshake is not None and word != status.word)
        status.word = word
        is_news = is_news or not leg.way.is_heard
        if is_news or leg.stage in AWAITS_REPORT or leg.trip.ramps_until is not None:
            text = status.fault_text(self._bridge_fault, state) if state in FAULTED else ""
            self._happen(event.Report(state, is_taken, text), now)

    def on_unchanged(self, now: float) -> None:
        """A TPDO arrived that says what the last one said."""
        self.on_pdo(now)
        if self.leg.stage in AWAITS_REPORT or not self.leg.way.is_heard:
            self.on_status_word(self._status.word, now)

    def on_actual_words(self, words: Sequence[int], now: float) -> None:
        """What TPDOs have brought, the status word first, in the order of ``process.tpdo``."""
        follows, rest = self.leg_settings.follows, self.leg.rest
        unknown = self.meanings.unknown_followed(words)
        words = [0 if place in unknown else word for place, word in enumerate(words)] if unknown else words
        if any(rest[place] != words[source] for place, source in follows):
            self._happen(event.ActualWords(tuple(words)), now)

    def on_pdo(self, now: float) -> None:
        """A TPDO arrived; what it says comes after this."""
        deadline_s = self.link.pdo_deadline_s
        if deadline_s is not None:
            self.due(now + deadline_s)
        if self.link.on_pdo(now):
            self._status.link_fault = 0.0
            self._happen(self._way(now), now)

    def on_emcy(self, told: Told, now: float) -> None:
        """An emergency message about this drive."""
        self._status.on_emcy(told)
        severity = 100 if told.is_gone else 700
        self._tell(now, Kind.EMERGENCY, severity, f"emergency {told.code:04X}h: {told.text}")
        self._settled(now)

    def on_drive_fault(self, current: float | None, last: float | None, now: float) -> None:
        """The drive has been asked for its present and its last fault; None for what it did not tell."""
        if self._status.on_drive_fault(current, last):
            self._settled(now)

    def on_node(self, state: NodeState, now: float) -> None:
        """The node behind the drive is in another state now."""
        before = self.link.node
        self.link.on_node(state, now)
        if state is not before:
            if state in (NodeState.OPERATIONAL, NodeState.DISABLED):
                self._status.link_fault = 0.0
            if state is NodeState.LOST:
                self._link_is_lost(self.family.faults.node_missing, "the node is lost", now)
            if state is NodeState.OPERATIONAL:
                self._happen(event.NodeBack(), now)
        self._happen(self._way(now), now)

    def _link_is_lost(self, fault: float, reason: str, now: float) -> None:
        self._status.link_fault = self._status.last_fault = fault
        self._tell(now, Kind.WATCHDOG, 700, f"{self.family.faults.prefix}{fault:.1f}: {reason}")

    def _way(self, now: float) -> Way:
        link = self.link
        why = ""
        if link.is_expired:
            why = link.reason(Quality.LOST)
        elif not link.may_enable:
            why = f"the drive's node is {link.node.value}"
        # It is heard when it has reported: until then what it said before would count.
        is_heard = link.is_heard and self.leg.way.is_heard
        return Way(link.may_enable, why, self._why_unplaced(now), is_heard)

    def _why_unplaced(self, now: float) -> str:
        if not self._followed:
            return ""
        quality = self.link.quality(now)
        why = self.link.reason(quality)
        if quality is Quality.GOOD:
            why = self.link.why_lacking(self._followed, now)
        return f"the drive's own position is not known: {why}" if why else ""

    # time

    def on_time(self, now: float) -> None:
        """Let everything happen that is due by ``now``. Call it when the bus has been drained."""
        is_lost = self.link.on_time(now)
        self._happen(event.Time(self._way(now)), now, is_lost=is_lost)

    def next_deadline(self, now: float) -> float | None:
        """When ``on_time`` is to be called; ``now`` where something is due already, None for never."""
        of_link, of_leg = self.link.next_deadline(), next_deadline(self.leg)
        if of_link is None:
            return None if of_leg is None else max(of_leg, now)
        return max(of_link if of_leg is None else min(of_link, of_leg), now)

    def on_bridge_gap(self, now: float) -> None:
        """The bridge itself was not there for longer than the dead-man time: start as if anew."""
        self._happen(event.BridgeGap(), now)

    def start_anew(self, now: float) -> None:
        """The bus was gone, or the node was stopped or has restarted: whatever the drive was told does not
        count any more, not even where communication errors are ignored."""
        self._happen(event.StartAnew(), now)

    # requests

    def handle(self, request: Request, now: float, reply: Reply) -> None:
        """Do what ``request`` asks; ``reply`` is called exactly once, now or later."""
        self._happen(request, now, reply)

    def on_connection(self, identity: Identity, now: float, *, is_there: bool) -> None:
        """``identity`` has its first connection, or none any more: no telegram, and no end of control."""
        self.leg, _ = step(self.leg_settings, self.leg, event.Connection(identity, is_there), now)

    def on_refused(self, now: float) -> None:
        """A request about this drive was refused elsewhere, and counts as one that is refused here."""
        self.refused_writes += 1
        self._settled(now)

    # what comes of it

    def _happen(
        self, what: event.Event, now: float, reply: Reply | None = None, *, is_lost: bool = False
    ) -> None:
        outcomes: list[tuple[Reply, Outcome]] = []
        brings_way = isinstance(what, event.Time | Way)
        if self._followed and not brings_way and self._why_unplaced(now) != self.leg.way.why_unplaced:
            outcomes = self._take_in(*step(self.leg_settings, self.leg, self._way(now), now), now, None)
        outcomes += self._take_in(*step(self.leg_settings, self.leg, what, now), now, reply)
        if is_lost:
            self._link_is_lost(self.family.faults.telegram_downtime, "no process data from the drive", now)
        self._settled(now)
        for answer, outcome in outcomes:
            answer(outcome)

    def _take_in(
        self, leg: LegState, effects: list[Effect], now: float, reply: Reply | None
    ) -> list[tuple[Reply, Outcome]]:
        """Be in this state; the outcomes that are to be told once everybody can see it."""
        self.leg = leg
        outcomes: list[tuple[Reply, Outcome]] = []
        for effect in effects:
            match effect:
                case Heard():
                    self.telegrams = (self.telegrams + 1) & 0xFFFF
                case Answer(outcome=outcome, is_refused=is_refused):
                    self.refused_writes += is_refused
                    if reply is not None:
                        outcomes.append((reply, outcome))
                case StartBegun():
                    self._start_reply = reply
                case StartEnded(outcome=outcome):
                    started, self._start_reply = self._start_reply, None
                    if started is not None:
                        outcomes.append((started, outcome))
                case Tripped():
                    self._on_tripped(effect, now)
                case Ignored():
                    self._status.last_fault = self.family.faults.controller_silent
                    why = "the controller is silent; ignored (telegram_downtime_s)"
                    self._tell(now, Kind.WATCHDOG, 500, why)
                case Tell(kind=kind, severity=severity, message=message):
                    self._tell(now, kind, severity, message)
        return outcomes

    def _on_tripped(self, tripped: Tripped, now: float) -> None:
        fault = self.family.faults.controller_silent
        self.trips += 1
        self._status.last_fault = fault
        reaction = self.settings.on_expiry
        if reaction == "silence" and not self.leg.silence_stops:
            reaction = "disable_voltage"
        silent = f"{tripped.who} was silent for {tripped.timeout_ms} ms"
        message = f"{silent}: {reaction}, {self._status.fault_text(fault, self.state)}"
        self._tell(now, Kind.WATCHDOG, 900, message)
        self._tripped(tripped.due)

    def _tell(self, now: float, kind: Kind, severity: int, message: str) -> None:
        self._report(Event(now, kind, self.name, severity, message))
