"""The controller leg of a drive as something to be explored: its events, and what must hold after each."""

from __future__ import annotations

from collections.abc import Collection, Hashable, Mapping
from typing import Any, Final

from bridge.command import (
    Action,
    Code,
    Command,
    Do,
    Identity,
    Outcome,
    Request,
    Role,
    Start,
    TakeControl,
    Write,
)
from bridge.command.channel import DriveChannel
from bridge.command.leg.state import Stage as LegStage
from bridge.command.leg.table import Stimulus
from bridge.command.link import NodeState
from bridge.command.request import STOP_ACTIONS
from bridge.drive import DriveState
from bridge.image import Value
from tests.support.explorer import Parts, State
from tests.support.leg_events import (
    ACTIONS,
    ANSWERS,
    PULSES,
    REST,
    STARTS,
    STOPS,
    TAKEN,
    TIMES,
    writes_of,
)
from tests.support.leg_model import LegModel, Says, Stage
from tests.support.leg_words import NORD_TU4, LegWords
from tests.support.recorded_table import RecordedTable
from tests.support.rig import Rig

TIMEOUT_MS: Final = 2000
"""Shorter than a start may take, so that both ends of a start are on the way."""
_EPOCH: Final = 1000.0
_NOW: Final = 2000.0
_HUNG_S: Final = 20.0
_A_MOMENT_S: Final = 0.001

Transition = tuple[LegStage, Stimulus, str]
"""Where the watchdog was, what happened, and in which of ``GATES`` the way to the bus was."""
GATES: Final = ("open", "interlocked", "node gone")

_STATES: Final = {
    Says.READY: DriveState.READY,
    Says.ENABLED: DriveState.OPERATION_ENABLED,
    Says.FAULT: DriveState.FAULT,
}


def _command(action: Action, ttl_ms: int) -> Command:
    match action:
        case Action.TAKE_CONTROL:
            return TakeControl(ttl_ms)
        case Action.START:
            return Start(direction=1)
        case _:
            return Do(action)


class LegMachine:
    """``words``: of which family. ``starts``: explore starts, else pulses of the acknowledge bit.
    ``answers``: explore what the drive says, as starts need it. ``stops``: every kind of stop. ``without``:
    events that are left out, too. ``ttl_ms`` is how long everybody takes control for. The rest are the
    drive's keys of the site file."""

    def __init__(
        self,
        recorder: RecordedTable,
        *,
        words: LegWords = NORD_TU4,
        starts: bool = False,
        answers: bool = False,
        stops: bool = False,
        without: Collection[str] = (),
        ttl_ms: int = 5000,
        **settings: object,
    ) -> None:
        given = {"control": "modbus", "fieldbus_timeout_ms": TIMEOUT_MS, "on_expiry": "disable_voltage"}
        given |= settings
        self._recorder = recorder
        self._words = words
        self._rig = Rig(hold_ms=0, words=words, **given)
        self._channel: DriveChannel = self._rig.channel
        self._parts, self._model, self._model_parts = self._observed(given)
        self._is_hold = self._model.reaction == "hold"
        self._rig.now = _NOW
        self._channel.on_node(NodeState.OPERATIONAL, _NOW)
        self._rig.drive_says(words.ready)
        self._channel.on_time(_NOW)
        self._hung = False
        self._outcomes: list[Outcome] = []
        self._before: tuple[State, State] = ((), ())
        self._requests = {
            **{name: Request(who, "", Write(values)) for name, (who, values) in writes_of(words).items()},
            **{name: Request(who, "", _command(action, ttl_ms)) for name, (who, action) in ACTIONS.items()},
        }
        names = (*self._requests, *TIMES, *REST, *((TAKEN,) if words.taken else ()))
        left_out = (
            *without,
            *(PULSES if starts else STARTS),
            *(() if starts or answers else ANSWERS),
            *(() if stops else STOPS),
            *(name for name in names if name.startswith("rival") and (starts or answers)),
        )
        self.events = tuple(name for name in names if name not in left_out)
        self.trips = self.refusals = self.enabled = 0

    def _observed(self, given: dict[str, Any]) -> tuple[Parts, LegModel, Parts]:
        """The channel's state, the model of it, and its."""
        silence_ms, reaction = given.get("then_silence_ms", 0), given["on_expiry"]
        parts = Parts(
            self._channel,
            epoch=_EPOCH,
            at=_NOW,
            only_shown=("trips", "refused_writes", "last_fault", "telegrams"),
            spent=("pulse_until",),
        )
        model = LegModel(
            control=given["control"],
            timeout_s=given["fieldbus_timeout_ms"] / 1000,
            ignores=given.get("telegram_downtime_s") == -0.1,
            reaction=reaction,
            mutes_after_s=0.0 if reaction == "silence" else silence_ms / 1000 or None,
            now=_NOW,
            is_there=True,
        )
        return parts, model, Parts(model, epoch=_EPOCH, at=_NOW)

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
        request = self._requests.get(event)
        if request is not None:
            self._request(request)
        elif event in TIMES:
            self._pass_time(event)
        else:
            self._canopen(event)
        seen = tuple((state, stimulus, gate) for state, stimulus in self._recorder.seen)
        self.trips += self._channel.trips - trips
        self._rig.events.clear()
        if not self._hung:
            self._see()
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
        self._see()
        if is_taken and request.action in STOP_ACTIONS:
            self._check_stop(request.action)
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
            model.asked_to_stop(action)
            return True
        if not model.may(who, take=action is Action.TAKE_CONTROL):
            return False
        match request.command:
            case Write(values=values):
                return self._expect_write(who, values)
            case Do(action=Action.KEEP_ALIVE):
                model.telegram(who)
            case Do(action=Action.RESET_FAULT):
                model.acknowledge(who, fault=model.says is Says.FAULT)
            case Start():
                if model.tripped or model.says is Says.FAULT or not model.is_there:
                    return False
                model.start(who)
            case TakeControl(ttl_ms=ttl_ms):
                model.take(who, ttl_ms / 1000)
            case Do(action=Action.RELEASE_CONTROL):
                if who.is_same(model.owner):
                    model.leave()
            case unknown:
                raise AssertionError(unknown)
        return True

    def _expect_write(self, who: Identity, values: Mapping[str, Value]) -> bool:
        model, words, word = self._model, self._words, values.get("control_word")
        if values is words.too_large:
            return False
        if word is None:
            model.telegram(who)
        else:
            assert isinstance(word, int)
            if word & words.valid != words.valid:
                return False
            model.word(who, enables=words.enabling.fit(word), acknowledges=bool(word & words.acknowledge))
        if "position" in values:
            model.handshake.order(values["position"])
        return True

    # rounds of the service

    def _round(self) -> None:
        self._model.now = self._rig.now
        self._model.pump()
        self._channel.on_time(self._rig.now)
        self._see()
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

    def _canopen(self, event: str) -> None:
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
                self._drive_says(event)
                return
        self._see()
        self._round()

    def _drive_says(self, event: str) -> None:
        words = self._words
        if event == "drive in fault":
            says, word = Says.FAULT, words.fault
        elif self._rig.enables:
            says, word = Says.ENABLED, words.enabled | (words.taken if event == TAKEN else 0)
        else:
            says, word = Says.READY, words.ready
        is_news = word != self._channel.drive_status_word
        self._channel.on_pdo(self._rig.now)
        self._channel.on_status_word(word, self._rig.now)
        self._model.drive_says(says)
        if is_news:
            self._see()
        self._round()

    def _see(self) -> None:
        model, sends = self._model, self._rig.enables
        model.see(sent=sends)
        if self._words.handshake:
            if not model.is_there:
                model.handshake.forget()
            taken = bool(self._channel.drive_status_word & self._words.taken)
            model.handshake.go_on(self._rig.now, commanded=sends and model.is_enabled, taken=taken)

    def _read(self) -> None:
        """Everything that others may see is looked at, which must change nothing."""
        now = self._rig.now
        before = self._parts.take(now)
        for name, attribute in vars(DriveChannel).items():
            if isinstance(attribute, property):
                getattr(self._channel, name)
        self._channel.left_ms(now)
        self._channel.link.quality(now)
        self._channel.link.age_ms(now)
        self._channel.next_deadline(now)
        assert self._parts.take(now) == before, "reading changes nothing"

    # what must hold

    def _check(self) -> None:
        channel, model, rig, words = self._channel, self._model, self._rig, self._words
        assert channel.is_tripped is model.tripped, "the watchdog has tripped exactly if its time was up"
        assert channel.owner == model.owner
        assert channel.state is _STATES[model.says], "what the drive says is understood"
        is_mute = model.mute_at is not None and rig.now >= model.mute_at
        assert rig.silent is is_mute, "nothing is sent where the site file says so, and only there"
        assert rig.sent & words.valid == words.valid, "the drive takes what is sent"
        if rig.enables:
            self.enabled += 1
            assert model.is_there, "nothing enables a drive whose node is not there"
            if not (model.ignores or self._is_hold or not model.timeout_s):
                assert model.deadline is not None, "nothing enables without a telegram of the owner"
                assert rig.now < model.deadline, "nothing enables after the deadline"
            assert model.held or model.stage is Stage.ENABLED, f"still missing: {model.stage.name}"
            if words.begin:
                assert bool(rig.sent & words.begin) is model.has_begun, "it begins when the drive is enabled"
            if words.handshake:
                is_up = bool(rig.sent & words.handshake)
                assert is_up is model.handshake.is_up, (
                    "a position is handed over once, and only when it may be"
                )
        else:
            assert not model.enables or rig.silent, "what may be enabled is enabled"
            assert rig.silent or not words.enabling.fit(rig.sent)
        drives = channel.drive_status_word
        if model.tripped:
            assert words.in_fault.fit(channel.status_word), "while tripped, the status word says fault"
            assert (channel.status_word ^ drives) & ~words.in_fault.mask == 0, (
                "its other bits are the drive's"
            )
            if not self._is_hold:
                assert not any(rig.sent_setpoints), "setpoints go to zero"
                self._check_reaction()
        else:
            assert channel.status_word == drives
        assert channel.owner or model.deadline is None, "a timer without an owner"

    def _check_reaction(self) -> None:
        """Tripped: the drive is stopped as the site file says, or more strongly, unless it stands."""
        model, word = self._model, self._rig.sent
        if model.coasts_at is not None and self._rig.now >= model.coasts_at:
            assert self._words.disable_voltage.fit(word), "a quick stop ends with disable voltage"
        elif model.stop_kind and model.is_enabled:
            is_stop = any(stop.fit(word) for stop in self._words.stops(model.stop_kind))
            assert is_stop, f"{word:04X}h is no {model.stop_kind}"

    def _check_stop(self, action: str) -> None:
        """Somebody has just stopped the drive."""
        word = self._rig.sent
        stops = any(stop.fit(word) for stop in self._words.stops(action))
        assert stops or self._rig.silent, f"{word:04X}h is no {action}"
