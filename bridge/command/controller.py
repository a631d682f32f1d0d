"""The controller leg of one drive: who commands it, what is asked, and whether the one who asks is there.

Brings authority, watchdog, gate and start together. Requests and time in, outcomes and words out;
``DriveChannel`` shows the result to others.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from bridge.command.acknowledge import AcknowledgeEdges
from bridge.command.authority import Authority
from bridge.command.event import Kind
from bridge.command.freshness import arrival_of, is_stale, limit_ms_of
from bridge.command.link import Link
from bridge.command.output import Gate, Output
from bridge.command.request import (
    DONE,
    STOP_ACTIONS,
    Action,
    Code,
    Do,
    Identity,
    Outcome,
    Reply,
    Request,
    Role,
    SetTimeout,
    Start,
    TakeControl,
    Write,
)
from bridge.command.setpoints import followers_of, handshake_of
from bridge.command.start import StartSequence
from bridge.command.status import DriveStatus
from bridge.command.telegram import Refusal, TelegramDecoder
from bridge.command.watchdog import Effect, Stimulus, Watchdog, WatchdogState
from bridge.config import DriveTable
from bridge.drive import FAULTED, ControlWords, LinearScale
from bridge.image import Quality, Value
from bridge.mapping.model import Family

_LEASE_MS: Final = (100, 600_000)
_TAKEN_STALE: Final = STOP_ACTIONS | {Action.WRITE, Action.RELEASE_CONTROL}
"""Nothing is too old to stop a drive; whether a write does so is seen when it has been decoded."""

Tell = Callable[[float, Kind, int, str], None]
"""Reports an event: time, kind, severity, sentence."""


class ControllerLeg:
    """``link`` and ``status`` are the drive's, read here; ``outcomes`` waits to be told by the channel."""

    def __init__(
        self,
        name: str,
        family: Family,
        settings: DriveTable,
        link: Link,
        status: DriveStatus,
        scales: dict[str, LinearScale],
        unserved: dict[str, str],
        tell: Tell,
    ) -> None:
        self._settings = settings
        self._link = link
        self._status = status
        self._tell = tell
        self.authority = Authority(settings.control)
        self.watchdog = Watchdog(settings.fieldbus_timeout_ms or 0, report_only=link.ignores_errors)
        self.words = ControlWords(family.control_word)
        slot = family.slot_named(settings.slot)
        self._handshake = handshake_of(family, slot)
        self.gate = Gate(
            self.words,
            len(family.process.rpdo) - 1,
            settings.on_expiry,
            settings.then_silence_ms,
            followers_of(family, slot),
            self._handshake,
        )
        self._edges = AcknowledgeEdges()
        self.outcomes: list[tuple[Reply, Outcome]] = []
        self.start = StartSequence(self.words, self.gate, self.outcomes)
        self._decoder = TelegramDecoder(name, family, slot, scales, unserved)
        self.why_lacking: Callable[[frozenset[int], float], str] = lambda places, now: ""
        """Why these actual words are not known at this time, empty where they are; set by the drive."""
        self.tripped: Callable[[float], None] = lambda due: None
        """Called with the deadline when the watchdog has tripped."""
        self.trips = 0
        self.refused_writes = 0

    @property
    def owner(self) -> Identity | None:
        return self.authority.owner

    @property
    def is_tripped(self) -> bool:
        return self.watchdog.state is WatchdogState.TRIPPED

    @property
    def control_word(self) -> int:
        """The owner's control word, or what was led or stopped with since; the acknowledge bit is always as
        the owner wrote it, so that whoever changes a bit beside it makes no edge of it."""
        return self.gate.control_word | (self.words.acknowledge_mask if self._edges.is_set else 0)

    # time

    def judge(self, now: float) -> None:
        """Is the controller still there?"""
        due = self.watchdog.trips_at
        effect = self.watchdog.on_time(now)
        if effect is Effect.REACT:
            self._trip(now)
            if due is not None:
                self.tripped(due)
        elif effect is not None and self._link.ignores_errors:
            self._status.last_fault = self._status.faults.controller_silent
            self._tell(now, Kind.WATCHDOG, 500, "the controller is silent; ignored (telegram_downtime_s)")
        if self.authority.lease_is_over(now):
            self._tell(now, Kind.OWNER, 300, f"the lease of {self.owner} ran out")
            self.leave(Stimulus.OWNER_CHANGED, now)

    def next_deadlines(self) -> tuple[float | None, ...]:
        return (
            self.watchdog.next_deadline(),
            self.authority.next_deadline(),
            self.gate.next_deadline(),
            self.start.next_deadline(),
        )

    @property
    def until(self) -> float | None:
        """Until when what enables the drive may be on the bus, unless its owner is heard; None where no time
        ends it, or where nothing enables it."""
        if not self.words.enables(self.gate.sent.words[0]):
            return None
        trip = None if self._settings.on_expiry == "hold" else self.watchdog.trips_at
        lease = self.authority.next_deadline()
        if trip is None or (lease is not None and lease < trip):
            return lease
        return trip

    def output_then(self) -> Output:
        """What is sent from ``until`` on."""
        trip = self.gate.if_tripped() if self.until == self.watchdog.trips_at else None
        return trip or self.gate.if_left()

    def _trip(self, now: float) -> None:
        fault = self._status.faults.controller_silent
        self.gate.trip(now)
        self.trips += 1
        self._status.last_fault = fault
        self.start.end(Outcome(Code.CANCELLED, "the watchdog tripped"))
        message = (
            f"{self.owner} was silent for {self.watchdog.timeout_ms} ms: {self.gate.reaction}, "
            f"{self._status.fault_text(fault)}"
        )
        self._tell(now, Kind.WATCHDOG, 900, message)

    # requests

    def handle(self, request: Request, now: float, reply: Reply) -> None:
        """Do what ``request`` asks; exactly one outcome goes to ``outcomes``, now or later."""
        self.judge(now)
        try:
            self._check_authority(request, now)
            if request.action not in _TAKEN_STALE and self._is_stale(request, now):
                raise self._stale(request)
            if isinstance(request.command, Start):
                self._begin_start(request, request.command.direction, now, reply)
            else:
                self.outcomes.append((reply, self._carry_out(request, now)))
        except Refusal as refusal:
            self.refused_writes += 1
            message = f"{request.action} by {request.identity} refused: {refusal.message}"
            self._tell(now, Kind.REFUSED, 300, message)
            self.outcomes.append((reply, Outcome(refusal.code, refusal.message, forwarded=False)))

    def _check_authority(self, request: Request, now: float) -> None:
        """Raises ``Refusal`` where somebody else controls the drive. Stopping it is every operator's, unless
        the site file forbids it, and then where the owner is gone."""
        identity = request.identity
        may_stop = self._settings.stop_by_anyone or self._owner_is_gone(now)
        if request.action in STOP_ACTIONS and may_stop and identity.role >= Role.OPERATOR:
            return
        takes = request.action is Action.TAKE_CONTROL
        judge = self.authority.take_refusal if takes else self.authority.refusal
        why = judge(identity, owner_is_silent=self._owner_is_silent(now))
        if why:
            raise Refusal(Code.NOT_ALLOWED, why)

    def _is_stale(self, request: Request, now: float) -> bool:
        return is_stale(request, now, self.watchdog.timeout_ms)

    def _stale(self, request: Request) -> Refusal:
        """Why it does not count that it can have waited for so long."""
        limit_ms = limit_ms_of(request, self.watchdog.timeout_ms)
        return Refusal(Code.STALE, f"may have waited on its way for longer than {limit_ms} ms")

    def _owner_is_silent(self, now: float) -> bool:
        """Without a lease, an owner that has sent no telegram yet holds nobody up either."""
        watchdog = self.watchdog
        is_idle = watchdog.state is WatchdogState.IDLE and self.authority.control != "lease"
        return watchdog.controller_is_silent or is_idle or self._owner_is_gone(now)

    def _owner_is_gone(self, now: float) -> bool:
        """Where no watchdog says so."""
        return self.watchdog.timeout_ms == 0 and self.authority.owner_is_gone(now)

    def _carry_out(self, request: Request, now: float) -> Outcome:
        """What is done at once. Raises ``Refusal`` before anything has changed."""
        match request.command:
            case Write(values=values):
                return self._write(request, values, now)
            case Do(action=Action.KEEP_ALIVE):
                self._hear(request, now)
            case Do(action=Action.RESET_FAULT):
                return self._reset_fault(request, now)
            case Do(action=Action.STOP | Action.QUICK_STOP | Action.DISABLE_VOLTAGE):
                self._stop(request, now)
            case TakeControl(ttl_ms=ttl_ms):
                self._take_control(request, ttl_ms, now)
            case Do(action=Action.RELEASE_CONTROL):
                return self._release(request, now)
            case SetTimeout(timeout_ms=timeout_ms):
                self._set_timeout(request, timeout_ms, now)
            case _:
                raise Refusal(Code.UNKNOWN_POINT, f"a drive knows no {request.action}")
        return DONE

    def _write(self, request: Request, values: Mapping[str, Value], now: float) -> Outcome:
        is_owner = request.identity.is_same(self.owner)
        # A new owner inherits no setpoints.
        kept = self.gate.setpoints if is_owner else self.gate.rest
        telegram = self._decoder.decode(values, kept, self.control_word)
        word = telegram.control_word
        if word is not None and not self.words.is_valid(word):
            self.watchdog.apply(Stimulus.INVALID, now)
            raise Refusal(Code.NOT_VALID, f"control word {word:04X}h: the bit 'control data valid' is 0")
        if self._is_stale(request, now):
            if word is None or not is_owner or self.words.enables(word):
                raise self._stale(request)
            return self._take_stale_stop(word)
        self._own(request, now)
        if word is not None:
            self.start.end(Outcome(Code.CANCELLED, "a control word was written meanwhile"))
            mask = self.words.acknowledge_mask
            is_edge = self._edges.on_bit(is_set=bool(word & mask))
            if self.is_tripped and is_edge:
                self._acknowledge(request, now, pulse=False)
                # The edge itself goes on to the drive; whatever else the word asks has to be asked anew.
                self.gate.control_word |= mask
                return Outcome(Code.OK, "acknowledged; the drive stays stopped", forwarded=False)
            if not is_edge and not self.gate.control_word & mask:
                word &= ~mask  # what was sent meanwhile would make an edge of a bit that never fell
        self.watchdog.apply(Stimulus.TELEGRAM, arrival_of(request, now))
        position = self._handshake is not None and self._handshake.value in values
        may_enable = self.may_enable(now)
        if self.gate.take(word, telegram.setpoints, may_enable=may_enable, position=position):
            return DONE
        return Outcome(Code.OK, self.why_blocked(now), forwarded=False)

    def _take_stale_stop(self, word: int) -> Outcome:
        """The owner's stop, however long it has waited. It is no sign of life, acknowledges nothing and
        brings no setpoints."""
        self.start.end(Outcome(Code.CANCELLED, "a control word was written meanwhile"))
        acknowledge = self.words.acknowledge_mask
        self.gate.stop(word & ~acknowledge | self.gate.control_word & acknowledge, is_asked=True)
        return Outcome(Code.OK, "came late, and counts as a stop only")

    def may_enable(self, now: float) -> bool:
        """Whether enabling commands may go to the drive, or go on: a drive that is enabled already needs
        nothing to follow."""
        return self._link.may_enable and not self._why_no_follow(now)

    def _why_no_follow(self, now: float) -> str:
        """A target that is to follow the drive until it is enabled must know where that is: without the
        actual value it would be 0 or an old one, and the drive would go there."""
        places = self.gate.awaits_actual
        if not places:
            return ""
        quality = self._link.quality(now)
        why = self.why_lacking(places, now) if quality is Quality.GOOD else self._link.reason(quality)
        return f"the drive's own position is not known: {why}" if why else ""

    def why_blocked(self, now: float) -> str:
        if self.is_tripped:
            return "tripped: acknowledge first"
        if self._link.is_expired:
            return self._link.reason(Quality.LOST)
        if not self._link.may_enable:
            return f"the drive's node is {self._link.node.value}"
        why = self._why_no_follow(now)
        if why:
            return why
        return "restart interlock: send a control word that does not enable first"

    def _own(self, request: Request, now: float) -> None:
        """A valid telegram: who sent it owns the drive from now on."""
        identity = request.identity
        if request.pressed is False:
            self._edges.on_register(identity, is_set=False)
        if not identity.is_same(self.owner):
            self._hand_over(identity, now)
        self.authority.renew(arrival_of(request, now))

    def _hear(self, request: Request, now: float) -> None:
        """A valid telegram that says no more than that its sender is there."""
        self._own(request, now)
        self.watchdog.apply(Stimulus.TELEGRAM, arrival_of(request, now))

    def _hand_over(self, identity: Identity, now: float, lease_s: float | None = None) -> None:
        """Another owner, or a lease taken anew; the drive is stopped where the owner changes."""
        changes = not identity.is_same(self.owner)
        if changes and self.owner is not None:
            self.leave(Stimulus.OWNER_CHANGED, now)
        self.authority.take(identity, now, lease_s)
        if changes:
            self._tell(now, Kind.OWNER, 200, f"controlled by {identity}")

    def _reset_fault(self, request: Request, now: float) -> Outcome:
        """A method is an order each time; a register acknowledges where the telegram before it did not."""
        if request.pressed and not self._edges.on_register(request.identity, is_set=True):
            self._hear(request, now)
            return Outcome(Code.OK, "no edge: the telegram before it acknowledged, too", forwarded=False)
        self._own(request, now)
        self._acknowledge(request, now, pulse=True)
        return DONE

    def _acknowledge(self, request: Request, now: float, *, pulse: bool) -> None:
        was_tripped = self.is_tripped
        self.watchdog.apply(Stimulus.ACKNOWLEDGED, arrival_of(request, now))
        self.gate.clear(now, self._status.state, pulse=pulse)
        if was_tripped:
            self._tell(now, Kind.WATCHDOG, 200, f"acknowledged by {self.owner}; the drive stays stopped")

    def _take_control(self, request: Request, ttl_ms: int, now: float) -> None:
        low, high = _LEASE_MS
        if self.authority.control == "lease" and not low <= ttl_ms <= high:
            raise Refusal(Code.OUT_OF_RANGE, f"ttl_ms takes {low}…{high}")
        owner, is_free = self.owner, self._owner_is_silent(now)
        if owner is not None and not is_free and not request.identity.is_same(owner):
            self._tell(now, Kind.OWNER, 500, f"{request.identity} takes control away from {owner}")
        self._hand_over(request.identity, now, ttl_ms / 1000)

    def _release(self, request: Request, now: float) -> Outcome:
        if not request.identity.is_same(self.owner):
            return Outcome(Code.OK, "not in control")
        self._tell(now, Kind.OWNER, 200, f"released by {self.owner}")
        self.leave(Stimulus.RELEASED, now)
        return DONE

    def leave(self, stimulus: Stimulus, now: float) -> None:
        """The owner goes; the drive is stopped first."""
        self.watchdog.apply(stimulus, now)
        self._restore_timeout(now)
        self.gate.stop(self.words.stop(self.gate.sent.words[0]))
        self.authority.release()
        self._edges.on_leave()
        self.start.end(Outcome(Code.CANCELLED, "control of the drive has changed"))

    def _set_timeout(self, request: Request, timeout_ms: int, now: float) -> None:
        """Another time for as long as the owner owns the drive."""
        if not self._settings.fieldbus_timeout_writable:
            raise Refusal(Code.NOT_ALLOWED, "the site file does not allow to change fieldbus_timeout_ms")
        if not request.identity.is_same(self.owner):
            raise Refusal(Code.NOT_ALLOWED, "only who controls the drive may change fieldbus_timeout_ms")
        low, high = self._settings.timeout_range_ms
        if not low <= timeout_ms <= high:
            raise Refusal(Code.OUT_OF_RANGE, f"fieldbus_timeout_ms takes {low}…{high} here")
        self.watchdog.set_timeout(timeout_ms)
        message = f"fieldbus_timeout_ms = {timeout_ms}, by {request.identity}"
        self._tell(now, Kind.CONFIGURATION, 400, message)

    def _restore_timeout(self, now: float) -> None:
        site_ms = self._settings.fieldbus_timeout_ms or 0
        if self.watchdog.timeout_ms != site_ms:
            self.watchdog.set_timeout(site_ms)
            message = f"fieldbus_timeout_ms = {site_ms} again, as in the site file"
            self._tell(now, Kind.CONFIGURATION, 400, message)

    def _stop(self, request: Request, now: float) -> None:
        """Stop, by whoever asks. The owner's telegrams go on counting, its old enable does not."""
        if request.identity.is_same(self.owner):
            if not self._is_stale(request, now):
                self._hear(request, now)
        else:
            self._tell(now, Kind.OWNER, 400, f"{request.action} by {request.identity}")
            if self.watchdog.timeout_ms == 0:
                self.authority.on_stop_by_another(now)
        change = {
            Action.STOP: self.words.stop,
            Action.QUICK_STOP: self.words.quick_stop,
            Action.DISABLE_VOLTAGE: self.words.disable_voltage,
        }[request.action]
        self.gate.stop_as_asked(change(self.gate.sent.words[0]))
        self.start.end(Outcome(Code.CANCELLED, f"{request.action} by {request.identity}"))

    def _begin_start(self, request: Request, direction: int, now: float, reply: Reply) -> None:
        bits = {0: 0, 1: self.words.forward, -1: self.words.reverse}.get(direction)
        if bits is None:
            raise Refusal(Code.OUT_OF_RANGE, f"direction takes 1, -1 or 0, not {direction}")
        if direction < 0 and not bits:
            # Forward is what such a drive does with a positive setpoint: that needs no bit.
            raise Refusal(Code.OUT_OF_RANGE, "direction -1: here the sign of the setpoint is the direction")
        if self.is_tripped or self._status.state in FAULTED:
            raise Refusal(Code.ACKNOWLEDGE_FIRST, "acknowledge first")
        if not self.may_enable(now):
            raise Refusal(Code.NOT_READY, self.why_blocked(now))
        self._hear(request, now)
        self.start.begin(bits, self._status.state, now, reply, is_known=self._link.is_heard)
