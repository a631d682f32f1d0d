"""One drive's command channel: requests in, RPDO words and outcomes out.

Brings authority, watchdog, link and gate together for one drive. Sans-IO: every entry takes ``now``
(monotonic seconds) and lets the timers run first, so a telegram that waited in a buffer while the
process hung cannot save a drive whose time was up.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from bridge.command.authority import Authority
from bridge.command.event import Event, Kind
from bridge.command.link import Link, NodeState
from bridge.command.output import Gate, Output
from bridge.command.request import DONE, STOP_ACTIONS, Action, Code, Identity, Outcome, Reply, Request
from bridge.command.watchdog import Effect, Stimulus, Watchdog, WatchdogState
from bridge.config import DriveTable
from bridge.drive import FAULTED, ControlWords, DriveState, LinearScale, StatusWords
from bridge.image import Value
from bridge.mapping.model import Family, ScaledValue

_START_LIMIT_S = 3.0
_LEASE_MS = (100, 600_000)


@dataclass(slots=True)
class _Start:
    """A ``Start`` on its way through the drive's states."""

    control_word: int
    reply: Reply
    deadline: float


class DriveChannel:
    """The command side of one drive.

    ``report`` gets the events. After any call the caller compares ``output.words`` and sends them.
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
        self.authority = Authority(settings.control)
        self.link = Link(settings.telegram_downtime_s, hold_ms)
        self.watchdog = Watchdog(settings.fieldbus_timeout_ms or 0, report_only=self.link.ignores_errors)
        self.words = ControlWords(family.control_word)
        self.status_words = StatusWords(family.status_word)
        self.scales: dict[str, LinearScale] = {}
        """Known scales by parameter name; filled from the site file and at boot-up."""
        self.drive_status_word = 0
        self.state = DriveState.UNKNOWN
        self.current_fault = 0.0
        self.last_fault = 0.0
        self.trips = 0
        self.refused_writes = 0
        self.emcy_code = 0
        self._report = report
        self._start: _Start | None = None
        self._setpoint_names = tuple(family.process.rpdo[1:])
        self._gate = Gate(self.words, len(self._setpoint_names), settings.on_expiry, settings.then_silence_ms)
        self._scaled = {value.name: value for value in family.value if value.group == "command"}

    # what others may see

    @property
    def output(self) -> Output:
        """The words that belong on the bus now."""
        return self._gate.sent

    @property
    def control_word(self) -> int:
        return self._gate.control_word

    @property
    def setpoints(self) -> tuple[int, ...]:
        return self._gate.setpoints

    @property
    def restart_interlock(self) -> bool:
        return self._gate.interlocked

    @property
    def owner(self) -> Identity | None:
        return self.authority.owner

    @property
    def is_tripped(self) -> bool:
        return self.watchdog.state is WatchdogState.TRIPPED

    @property
    def status_word(self) -> int:
        """The status word as served: *fault* while tripped, as a bus interface would show it."""
        if self.is_tripped:
            return self.status_words.as_fault(self.drive_status_word)
        return self.drive_status_word

    @property
    def served_state(self) -> DriveState:
        return DriveState.FAULT if self.is_tripped else self.state

    @property
    def fault_text(self) -> str:
        faults = self.family.faults
        if self.current_fault:
            number = f"{self.current_fault:.1f}"
            return f"{faults.prefix}{number} {faults.texts.get(number, '')}".strip()
        if self.state in FAULTED:
            return emcy_text(self.family, self.emcy_code) if self.emcy_code else "fault"
        return ""

    # from the drive

    def on_status_word(self, word: int, now: float) -> None:
        """A TPDO brought this status word."""
        self.drive_status_word = word
        self.state = self.status_words.state(word)
        self._gate.on_state(self.state)
        if self._start:
            self._go_on_starting(now)
        self._update(now)

    def on_pdo(self, now: float) -> None:
        """A TPDO arrived, changed or not."""
        was_expired = self.link.is_expired
        self.link.on_pdo(now)
        if was_expired:
            self._link_is_back()

    def on_emcy(self, code: int, now: float) -> None:
        self.emcy_code = code
        text = emcy_text(self.family, code)
        severity = 100 if code == 0 else 700
        self._tell(now, Kind.EMERGENCY, severity, f"emergency {code:04X}h: {text}")

    def on_node(self, state: NodeState, now: float) -> None:
        """The node behind the drive is in another state now."""
        before = self.link.node
        self.link.on_node(state, now)
        if state is NodeState.OPERATIONAL and before is not state:
            # It may have been switched off and on: whatever it was told before does not count.
            self._gate.interlocked = True
            self._link_is_back()
        elif state is NodeState.LOST and before is not state:
            self._link_is_lost(self.family.faults.node_missing, "the node is lost", now)
        self._update(now)

    def _link_is_lost(self, fault: float, reason: str, now: float) -> None:
        self.last_fault = fault
        if not self.is_tripped:
            self.current_fault = fault
        if not self.link.ignores_errors:
            self._gate.interlocked = True
            self._fail_start(Outcome(Code.NOT_READY, reason))
        self._tell(now, Kind.WATCHDOG, 700, f"{self.family.faults.prefix}{fault:.1f}: {reason}")

    def _link_is_back(self) -> None:
        faults = self.family.faults
        if self.current_fault in (faults.telegram_downtime, faults.node_missing):
            self.current_fault = faults.controller_silent if self.is_tripped else 0.0

    # time

    def on_time(self, now: float) -> None:
        """Let everything happen that is due by ``now``."""
        effect = self.watchdog.on_time(now)
        if effect is Effect.REACT:
            self._trip(now)
        elif effect is not None and self.link.ignores_errors:
            self._tell(now, Kind.WATCHDOG, 500, "the controller is silent; ignored (telegram_downtime_s)")
        if self.authority.lease_is_over(now):
            self._tell(now, Kind.OWNER, 300, f"the lease of {self.owner} ran out")
            self._leave(Stimulus.OWNER_CHANGED, now)
        if self.link.on_time(now):
            self._link_is_lost(self.family.faults.telegram_downtime, "no process data from the drive", now)
        if self._start and now >= self._start.deadline:
            state = self.state.label.replace("_", " ")
            self._gate.stop(self.words.ready)
            self._fail_start(Outcome(Code.TIMED_OUT, f"the drive did not start, it is {state}"))
        self._update(now)

    def next_deadline(self, now: float) -> float | None:
        times = (
            self.watchdog.next_deadline(),
            self.authority.next_deadline(),
            self.link.next_deadline(now),
            self._gate.next_deadline(now),
            self._start.deadline if self._start else None,
        )
        known = [time for time in times if time is not None]
        return min(known) if known else None

    def on_bridge_gap(self, now: float) -> None:
        """The bridge itself was not there for longer than the dead-man time: start as if anew."""
        self.on_time(now)
        if not self.is_tripped:
            self._leave(Stimulus.STARTED, now)
        self._update(now)

    def _trip(self, now: float) -> None:
        self._gate.trip(now)
        self.trips += 1
        self.current_fault = self.last_fault = self.family.faults.controller_silent
        self._fail_start(Outcome(Code.CANCELLED, "the watchdog tripped"))
        message = (
            f"{self.owner} was silent for {self.watchdog.timeout_ms} ms: {self.settings.on_expiry}, "
            f"{self.fault_text}"
        )
        self._tell(now, Kind.WATCHDOG, 900, message)

    # requests

    def handle(self, request: Request, now: float, reply: Reply) -> None:
        """Do what ``request`` asks; ``reply`` is called exactly once, now or later."""
        self.on_time(now)
        action = request.action
        if action in STOP_ACTIONS and request.identity.role >= 1:
            self._stop(request, now)
            reply(DONE)
        elif action is Action.TAKE_CONTROL:
            reply(self._take_control(request, now))
        else:
            why = self.authority.refusal(request.identity, owner_is_silent=self.watchdog.controller_is_silent)
            if why:
                reply(self._refuse(request, Code.NOT_ALLOWED, why, now))
            else:
                self._handle_owned(request, now, reply)
        self._update(now)

    def _handle_owned(self, request: Request, now: float, reply: Reply) -> None:
        """A request of an identity that may command the drive."""
        match request.action:
            case Action.WRITE:
                reply(self._write(request, now))
            case Action.KEEP_ALIVE:
                self._own(request.identity, now)
                self.watchdog.apply(Stimulus.TELEGRAM, now)
                reply(DONE)
            case Action.RESET_FAULT:
                self._own(request.identity, now)
                self._acknowledge(now, pulse=True)
                reply(DONE)
            case Action.START:
                self._begin_start(request, now, reply)
            case Action.RELEASE_CONTROL:
                reply(self._release(request, now))
            case Action.SET_TIMEOUT:
                reply(self._set_timeout(request, now))
            case _:
                reply(Outcome(Code.UNKNOWN_POINT, f"a drive knows no {request.action}"))

    def _write(self, request: Request, now: float) -> Outcome:
        try:
            control_word, setpoints = self._decode(request)
        except LookupError as error:
            return self._refuse(request, Code.UNKNOWN_POINT, str(error.args[0]), now)
        except NotImplementedError as error:
            return self._refuse(request, Code.NOT_CONFIGURED, str(error), now)
        except ValueError as error:
            return self._refuse(request, Code.OUT_OF_RANGE, str(error), now)
        before = self._gate.control_word
        word = before if control_word is None else control_word
        if not self.words.is_valid(word):
            self.watchdog.apply(Stimulus.INVALID, now)
            message = f"control word {word:04X}h: the bit 'control data valid' is 0"
            return self._refuse(request, Code.NOT_VALID, message, now)
        self._own(request.identity, now)
        if control_word is not None:
            self._fail_start(Outcome(Code.CANCELLED, "a control word was written meanwhile"))
        if self.is_tripped and self.words.acknowledges(before, word):
            self._acknowledge(now, pulse=False)
            # The edge itself goes on to the drive; whatever else the word asks has to be asked anew.
            self._gate.control_word |= self.words.acknowledge_mask
            return Outcome(Code.OK, "acknowledged; the drive stays stopped", forwarded=False)
        effect = self.watchdog.apply(Stimulus.TELEGRAM, now)
        self._gate.take(control_word, setpoints, may_enable=self.link.may_enable)
        if effect is Effect.TAKE:
            return Outcome(Code.OK, "tripped: acknowledge first", forwarded=False)
        if self.words.enables(word) and (self._gate.interlocked or not self.link.may_enable):
            return Outcome(Code.OK, self._why_blocked(), forwarded=False)
        return DONE

    def _why_blocked(self) -> str:
        if not self.link.may_enable:
            return f"the drive's node is {self.link.node.value}"
        return "restart interlock: send a control word that does not enable first"

    def _decode(self, request: Request) -> tuple[int | None, tuple[int, ...]]:
        """Control word and setpoint words of a WRITE; nothing is applied before all of it is right."""
        control_word: int | None = None
        setpoints = list(self._gate.setpoints)
        for leaf, value in request.values.items():
            if leaf == "control_word":
                control_word = _as_word(leaf, value)
            elif leaf in self._setpoint_names:
                setpoints[self._setpoint_names.index(leaf)] = _as_word(leaf, value)
            elif leaf in self._scaled:
                scaled = self._scaled[leaf]
                setpoints[self._setpoint_names.index(scaled.word)] = self._to_word(scaled, value)
            else:
                known = ", ".join(["control_word", *self._setpoint_names, *self._scaled])
                raise KeyError(f"{self.name}/command has no {leaf!r}; it has {known}")
        return control_word, tuple(setpoints)

    def _to_word(self, scaled: ScaledValue, value: Value) -> int:
        scale = self.scales.get(scaled.scale.full)
        if scale is None:
            raise NotImplementedError(f"{scaled.name}: {scaled.scale.full} is not known; see boot_status")
        if isinstance(value, bool | str):
            raise ValueError(f"{scaled.name} takes a number")
        try:
            return scale.to_word(float(value))
        except ValueError as error:
            raise ValueError(f"{scaled.name} {error} {scaled.unit}") from None

    def _own(self, identity: Identity, now: float) -> None:
        """A valid telegram of ``identity``: it owns the drive from now on."""
        if not identity.is_same(self.authority.owner):
            if self.authority.owner is not None:
                self._leave(Stimulus.OWNER_CHANGED, now)
            self._tell(now, Kind.OWNER, 200, f"controlled by {identity}")
            self.authority.take(identity, now)
        self.authority.renew(now)

    def _acknowledge(self, now: float, *, pulse: bool) -> None:
        was_tripped = self.is_tripped
        self.watchdog.apply(Stimulus.ACKNOWLEDGED, now)
        self._gate.clear(now, pulse=pulse)
        if was_tripped:
            self.current_fault = 0.0
            self._tell(now, Kind.WATCHDOG, 200, f"acknowledged by {self.owner}; the drive stays stopped")

    def _take_control(self, request: Request, now: float) -> Outcome:
        silent = self.watchdog.controller_is_silent
        why = self.authority.take_refusal(request.identity, owner_is_silent=silent)
        if why:
            return self._refuse(request, Code.NOT_ALLOWED, why, now)
        low, high = _LEASE_MS
        if self.authority.control == "lease" and not low <= request.ttl_ms <= high:
            return self._refuse(request, Code.OUT_OF_RANGE, f"ttl_ms takes {low}…{high}", now)
        if self.owner is not None and not request.identity.is_same(self.owner):
            self._leave(Stimulus.OWNER_CHANGED, now)
        if self.authority.take(request.identity, now, request.ttl_ms / 1000):
            self._tell(now, Kind.OWNER, 200, f"controlled by {request.identity}")
        return DONE

    def _release(self, request: Request, now: float) -> Outcome:
        if not request.identity.is_same(self.owner):
            return Outcome(Code.OK, "not in control")
        self._tell(now, Kind.OWNER, 200, f"released by {self.owner}")
        self._leave(Stimulus.RELEASED, now)
        return DONE

    def _leave(self, stimulus: Stimulus, now: float) -> None:
        """The owner goes; the drive is stopped first."""
        if self.watchdog.apply(stimulus, now) is Effect.STOP:
            self._gate.stop(self.words.stop(self._gate.sent.words[0]))
        self.authority.release()
        self._fail_start(Outcome(Code.CANCELLED, "control of the drive has changed"))

    def _set_timeout(self, request: Request, now: float) -> Outcome:
        if not self.settings.fieldbus_timeout_writable:
            message = "the site file does not allow to change fieldbus_timeout_ms"
            return self._refuse(request, Code.NOT_ALLOWED, message, now)
        if not 0 <= request.timeout_ms <= 32767:
            return self._refuse(request, Code.OUT_OF_RANGE, "fieldbus_timeout_ms takes 0…32767", now)
        self._own(request.identity, now)
        self.watchdog.set_timeout(request.timeout_ms, now)
        message = f"fieldbus_timeout_ms = {request.timeout_ms}, by {request.identity}"
        self._tell(now, Kind.CONFIGURATION, 400, message)
        return DONE

    def _stop(self, request: Request, now: float) -> None:
        """Stop, by whoever asks. The owner's telegrams go on counting, its old enable does not."""
        if request.identity.is_same(self.owner):
            self._own(request.identity, now)
            self.watchdog.apply(Stimulus.TELEGRAM, now)
        else:
            self._tell(now, Kind.OWNER, 400, f"{request.action} by {request.identity}")
        sent = self._gate.sent.words[0]
        change = {
            Action.STOP: self.words.stop,
            Action.QUICK_STOP: self.words.quick_stop,
            Action.DISABLE_VOLTAGE: self.words.disable_voltage,
        }[request.action]
        self._gate.stop(change(sent))
        self._fail_start(Outcome(Code.CANCELLED, f"{request.action} by {request.identity}"))

    # start: through the drive's states, with one outcome

    def _begin_start(self, request: Request, now: float, reply: Reply) -> None:
        if self.is_tripped or self.state in FAULTED:
            reply(self._refuse(request, Code.ACKNOWLEDGE_FIRST, "acknowledge first", now))
            return
        if not self.link.may_enable:
            reply(self._refuse(request, Code.NOT_READY, self._why_blocked(), now))
            return
        self._own(request.identity, now)
        self.watchdog.apply(Stimulus.TELEGRAM, now)
        self._fail_start(Outcome(Code.CANCELLED, "started anew"))
        bits = {1: self.words.forward, -1: self.words.reverse}.get(request.direction, 0)
        self._start = _Start(self.words.run | bits, reply, now + _START_LIMIT_S)
        if self.state is not DriveState.OPERATION_ENABLED:
            self._gate.take(self.words.ready, self._gate.setpoints, may_enable=True)
        self._go_on_starting(now)

    def _go_on_starting(self, now: float) -> None:
        start = self._start
        if start is None:
            return
        if self.state in FAULTED:
            self._gate.stop(self.words.ready)
            self._fail_start(Outcome(Code.NOT_READY, f"the drive went into fault: {self.fault_text}"))
            return
        ready = (DriveState.READY, DriveState.SWITCHED_ON, DriveState.OPERATION_ENABLED)
        if self.state in ready:
            self._gate.interlocked = False
            self._gate.take(start.control_word, self._gate.setpoints, may_enable=self.link.may_enable)
        if self.state is DriveState.OPERATION_ENABLED:
            self._start = None
            start.reply(DONE)

    def _fail_start(self, outcome: Outcome) -> None:
        start, self._start = self._start, None
        if start:
            start.reply(outcome)

    # bookkeeping

    def _update(self, now: float) -> None:
        if not self.link.may_enable:
            self._gate.interlocked = True
        self._gate.compute(now, may_enable=self.link.may_enable)

    def _refuse(self, request: Request, code: Code, message: str, now: float) -> Outcome:
        self.refused_writes += 1
        self._tell(now, Kind.REFUSED, 300, f"{request.action} by {request.identity} refused: {message}")
        return Outcome(code, message, forwarded=False)

    def _tell(self, now: float, kind: Kind, severity: int, message: str) -> None:
        self._report(Event(now, kind, self.name, severity, message))


def _as_word(leaf: str, value: Value) -> int:
    """``value`` as a 16-bit word; a signed number stands for its two's complement."""
    if isinstance(value, bool | str) or (isinstance(value, float) and not value.is_integer()):
        raise ValueError(f"{leaf} takes a whole number")
    number = int(value)
    if not -0x8000 <= number <= 0xFFFF:
        raise ValueError(f"{leaf} takes 0…65535, not {number}")
    return number & 0xFFFF


def emcy_text(family: Family, code: int) -> str:
    """The family's text for an EMCY code, or for its group."""
    codes = family.emcy.codes
    name = f"{code:04X}"
    return codes.get(name) or codes.get(f"{name[:2]}xx") or "unknown code"
