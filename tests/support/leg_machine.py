"""The controller leg of a drive as something to be explored: its events, and what must hold after each."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Final

from bridge.command import Action, Code, Identity, Outcome, Request, Role, watchdog
from bridge.command.channel import DriveChannel
from bridge.command.link import NodeState
from bridge.command.request import STOP_ACTIONS
from bridge.command.watchdog import Stimulus, WatchdogState
from bridge.drive import DriveState
from bridge.image import Value
from tests.support.explorer import Parts, State
from tests.support.leg_events import (
    ACTIONS,
    ANSWERS,
    PULSES,
    REST,
    RIVALS,
    STARTS,
    STOPS,
    TIMES,
    WRITES,
)
from tests.support.leg_model import LegModel, Stage
from tests.support.rig import ENABLED, FAULT, READY, Rig

TIMEOUT_MS: Final = 2000
"""Shorter than a start may take, so that both ends of a start are on the way."""
_EPOCH: Final = 1000.0
_NOW: Final = 2000.0
_HUNG_S: Final = 20.0
_A_MOMENT_S: Final = 0.001
_FAULT_BITS, _FAULT = 0b1001111, 0b0001000

Transition = tuple[WatchdogState, Stimulus, str]
"""Where the watchdog was, what happened, and in which of ``GATES`` the way to the bus was."""
GATES: Final = ("open", "interlocked", "node gone")

_CAN_BE_ENABLED: Final = (DriveState.READY, DriveState.SWITCHED_ON, DriveState.OPERATION_ENABLED)


class _Recorder(dict[tuple[WatchdogState, Stimulus], Any]):
    """The watchdog's table, which notes what is looked up in it."""

    def __init__(self, *args: Any) -> None:
        super().__init__(*args)
        self.seen: list[tuple[WatchdogState, Stimulus]] = []

    def __getitem__(self, key: tuple[WatchdogState, Stimulus]) -> Any:
        self.seen.append(key)
        return super().__getitem__(key)


@contextmanager
def recorded_table() -> Iterator[_Recorder]:
    table = watchdog.TABLE
    recorder = _Recorder(table)
    watchdog.TABLE = recorder  # pyright: ignore[reportConstantRedefinition]
    try:
        yield recorder
    finally:
        watchdog.TABLE = table  # pyright: ignore[reportConstantRedefinition]


class LegMachine:
    """``starts``: explore starts, else pulses of the acknowledge bit. ``answers``: explore what the drive
    says, as starts need it. ``stops``: every kind of stop. ``ttl_ms`` is how long everybody takes control
    for. The rest are the drive's keys of the site file."""

    def __init__(
        self,
        recorder: _Recorder,
        *,
        starts: bool = False,
        answers: bool = False,
        stops: bool = False,
        ttl_ms: int = 5000,
        **settings: object,
    ) -> None:
        self._ttl_ms = ttl_ms
        given = {"control": "modbus", "fieldbus_timeout_ms": TIMEOUT_MS, "on_expiry": "disable_voltage"}
        given |= settings
        self._recorder = recorder
        self._rig = Rig(hold_ms=0, **given)
        self._channel: DriveChannel = self._rig.channel
        self._is_hold = given["on_expiry"] == "hold"
        self._timeout_ms = given["fieldbus_timeout_ms"]
        self._ignores = given.get("telegram_downtime_s") == -0.1
        memory_ms = given.get("then_silence_ms", 0)
        assert isinstance(memory_ms, int)
        self._parts = Parts(
            self._channel,
            epoch=_EPOCH,
            at=_NOW,
            memory_s={"_tripped_at": memory_ms / 1000},
            only_shown=("trips", "refused_writes", "last_fault", "telegrams"),
            spent=("_acknowledge_until",),
        )
        assert isinstance(self._timeout_ms, int)
        self._model = LegModel(
            str(given["control"]), self._timeout_ms / 1000, self._ignores, self._is_hold, _NOW, is_there=True
        )
        self._model_parts = Parts(self._model, epoch=_EPOCH, at=_NOW)
        self._rig.now = _NOW
        self._channel.on_node(NodeState.OPERATIONAL, _NOW)
        self._rig.drive_says(READY)
        self._channel.on_time(_NOW)
        self._hung = False
        self._outcomes: list[Outcome] = []
        self._before: tuple[State, State] = ((), ())
        left_out = (
            *(PULSES if starts else STARTS),
            *(() if starts or answers else ANSWERS),
            *(() if stops else STOPS),
            *(RIVALS if starts or answers else ()),
        )
        self.events = tuple(n for n in (*WRITES, *ACTIONS, *TIMES, *REST) if n not in left_out)
        self.trips = self.refusals = self.enabled = 0

    # the state

    def take(self) -> Hashable:
        now = self._rig.now
        return self._parts.take(now), self._model_parts.take(now), self._hung

    def put(self, state: tuple[State, State, bool]) -> None:
        parts, model, self._hung = state
        self._before = parts, model
        self._rig.now = _NOW
        self._parts.put(parts)
        self._model_parts.put(model)

    # what happens

    def happen(self, event: str) -> tuple[Transition, ...]:
        self._recorder.seen.clear()
        gate = self._gate_state()
        trips = self._channel.trips
        if event in WRITES:
            who, values = WRITES[event]
            self._request(Request(who, "", Action.WRITE, values))
        elif event in ACTIONS:
            who, action = ACTIONS[event]
            self._request(Request(who, "", action, ttl_ms=self._ttl_ms, direction=1))
        elif event in TIMES:
            self._pass_time(event)
        else:
            self._southbound(event)
        seen = tuple((state, stimulus, gate) for state, stimulus in self._recorder.seen)
        self.trips += self._channel.trips - trips
        self._rig.events.clear()
        start = self._channel._leg.start
        if not start.is_going_on:
            start._deadline = 0.0  # that of one that is over
        self._see()
        if not self._hung:
            self._check()
        return seen

    def _gate_state(self) -> str:
        channel = self._channel
        if not channel.link.may_enable:
            return "node gone"
        return "interlocked" if channel.restart_interlock else "open"

    # requests, between two rounds of the service: the channel has to see to its timers by itself

    def _request(self, request: Request) -> None:
        before, model_before = self._before
        was_hung = self._hung
        self._model.judge()
        is_taken = self._expect(request)
        outcomes = self._outcomes
        outcomes.clear()
        # The same reply each time: equal states are those that will tell the same one.
        self._channel.handle(request, self._rig.now, self._told)
        made = len(self._recorder.seen)
        self._hung = False
        if is_taken and request.action is Action.START:  # its own outcome may come later
            assert all(outcome.ok or outcome.code is Code.CANCELLED for outcome in outcomes)
        else:
            assert outcomes[-1].ok is is_taken, f"{request.action}: {outcomes[-1]}"
        if is_taken:
            return
        self.refusals += 1
        assert not outcomes[-1].forwarded
        if was_hung:
            # Nothing has changed but what the timers changed.
            self._round()
            after = self._parts.take(self._rig.now)
            self._parts.put(before)
            self._model_parts.put(model_before)
            self._round()
            before = self._parts.take(self._rig.now)
            del self._recorder.seen[made:]
        else:
            after = self._parts.take(self._rig.now)
        assert after == before, "a refused telegram changes nothing"

    def _told(self, outcome: Outcome) -> None:
        self._outcomes.append(outcome)

    def _expect(self, request: Request) -> bool:
        """Let the model do what is asked; whether it is to be taken."""
        model, who, action = self._model, request.identity, request.action
        if action in STOP_ACTIONS and who.role >= Role.OPERATOR:
            if who.is_same(model.owner):
                model.telegram(who)
            else:
                model.stopped_by_another()
            model.stop()
            return True
        if not model.may(who, take=action is Action.TAKE_CONTROL):
            return False
        match action:
            case Action.WRITE:
                return self._expect_write(who, request.values)
            case Action.KEEP_ALIVE:
                model.telegram(who)
            case Action.RESET_FAULT:
                model.acknowledge(who, fault=self._channel.state is DriveState.FAULT)
            case Action.START:
                state = self._channel.state
                if model.tripped or state is DriveState.FAULT or not model.is_there:
                    return False
                model.start(
                    who, ready=state in _CAN_BE_ENABLED, enabled=state is DriveState.OPERATION_ENABLED
                )
            case Action.TAKE_CONTROL:
                model.take(who, request.ttl_ms / 1000)
            case Action.RELEASE_CONTROL:
                if who.is_same(model.owner):
                    model.leave()
            case unknown:
                raise AssertionError(unknown)
        return True

    def _expect_write(self, who: Identity, values: Mapping[str, Value]) -> bool:
        word = values.get("control_word")
        if "frequency" in values:
            return False
        if word is None:
            self._model.telegram(who)
            return True
        assert isinstance(word, int)
        if not word & 0x0400:
            return False
        self._model.word(who, enables=word & 0xF == 0xF, acknowledges=bool(word & 0x80))
        return True

    # rounds of the service

    def _round(self) -> None:
        self._model.now = self._rig.now
        self._model.pump()
        self._channel.on_time(self._rig.now)
        self._hung = False

    def _pass_time(self, event: str) -> None:
        deadline = self._channel.next_deadline(self._rig.now)
        if deadline is None:
            return
        match event:
            case "a moment before the deadline":
                self._rig.now = max(self._rig.now, deadline - _A_MOMENT_S)
                self._round()
            case "at the deadline":
                self._rig.now = deadline
                self._round()
            case _:
                self._rig.now += _HUNG_S
                self._model.now = self._rig.now
                self._hung = True

    def _southbound(self, event: str) -> None:
        """What is read from the bus; the timers run after it has been drained."""
        channel, model, now = self._channel, self._model, self._rig.now
        match event:
            case "everything is read":
                self._read()
                return
            case "node operational" | "node lost":
                state = NodeState.OPERATIONAL if event == "node operational" else NodeState.LOST
                if channel.link.node is not state:
                    model.node(is_there=state is NodeState.OPERATIONAL)
                channel.on_node(state, now)
            case "bus down":
                model.stop()
                model.followed = True
                channel.start_anew(now)
            case "bridge gap":
                model.gap()
                channel.on_bridge_gap(now)
            case _:
                word = FAULT if event == "drive in fault" else ENABLED if self._rig.enables else READY
                state = channel.state
                channel.on_pdo(now)
                channel.on_status_word(word, now)
                if channel.state is not state:
                    model.drive_is(fault=word == FAULT, ready=word != FAULT, enabled=word == ENABLED)
                else:
                    model.drive_is_still(ready=word != FAULT)
                self._see()
        self._round()

    def _see(self) -> None:
        self._model.see(sent=self._rig.enables, enabled=self._channel.state is DriveState.OPERATION_ENABLED)

    def _read(self) -> None:
        """Everything that others may see is looked at, which must change nothing."""
        now = self._rig.now
        before = self._parts.take(now)
        for name, attribute in vars(DriveChannel).items():
            if isinstance(attribute, property):
                getattr(self._channel, name)
        self._channel.watchdog.left_ms(now)
        self._channel.link.quality(now)
        self._channel.link.age_ms(now)
        self._channel.next_deadline(now)
        assert self._parts.take(now) == before, "reading changes nothing"

    # what must hold

    def _check(self) -> None:
        channel, model, rig = self._channel, self._model, self._rig
        assert channel.is_tripped is model.tripped, "the watchdog has tripped exactly if its time was up"
        assert channel.owner == model.owner
        if rig.enables:
            self.enabled += 1
            assert model.is_there, "nothing enables a drive whose node is not there"
            if not (self._ignores or self._is_hold or not model.timeout_s):
                assert model.deadline is not None, "nothing enables without a telegram of the owner"
                assert rig.now < model.deadline, "nothing enables after the deadline"
            assert model.held or model.stage is Stage.ENABLED, f"still missing: {model.stage.name}"
        else:
            assert not model.enables or rig.silent, "what may be enabled is enabled"
            assert rig.silent or rig.sent & 0xF != 0xF
        drives = channel.drive_status_word
        if model.tripped:
            assert channel.status_word & _FAULT_BITS == _FAULT, "while tripped, the status word says fault"
            assert channel.status_word & ~_FAULT_BITS == drives & ~_FAULT_BITS
            assert self._is_hold or not any(rig.sent_setpoints)
        else:
            assert channel.status_word == drives
        assert channel.owner or model.deadline is None, "a timer without an owner"
