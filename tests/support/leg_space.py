"""Everything that can happen to the leg of one drive, breadth first, each state visited once.

A state is the leg's own with what the oracle remembers: two sequences that lead to the same one have the same
future, so only the first goes on.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from typing import Final
from unittest.mock import patch

from bridge.command import (
    Action,
    Code,
    Do,
    Identity,
    Request,
    SetTimeout,
    Start,
    TakeControl,
    Write,
)
from bridge.command.leg import deeds
from bridge.command.leg.effect import Answer, Effect, StartBegun, StartEnded, Tripped
from bridge.command.leg.event import (
    ActualWords,
    BridgeGap,
    Connection,
    Event,
    NodeBack,
    StartAnew,
    StatusReport,
    StopsOnSilence,
    Time,
)
from bridge.command.leg.outlook import next_deadline, output_then, until
from bridge.command.leg.settings import LegSettings
from bridge.command.leg.state import LegState, Stage, Way
from bridge.command.leg.step import step
from bridge.command.leg.table import Cell, Stimulus
from bridge.command.messages.request import STOP_ACTIONS
from bridge.drive import DriveState
from tests.support.leg_deeds import HOLDS, Done
from tests.support.leg_forget import Forgetting
from tests.support.leg_oracle import Oracle
from tests.support.leg_recorded import RecordedTable, Walked
from tests.support.leg_requests import PLC, TWIN, requests_of
from tests.support.leg_rules import FAULTED
from tests.support.leg_seen import Rules, Seen, first
from tests.support.leg_time import NOW, State, ahead, come, timeless

_OPEN: Final = Way(True, "", "", True)
_UNHEARD: Final = Way(True, "", "", False)
_SHUT: Final = Way(False, "the node is lost", "", False)
_UNPLACED: Final = Way(True, "", "nobody knows where it is", True)
_SAYS: Final = {
    "ready": DriveState.READY,
    "enabled": DriveState.OPERATION_ENABLED,
    "braking": DriveState.QUICK_STOP_ACTIVE,
    "inhibited": DriveState.SWITCH_ON_INHIBITED,
    "fault": DriveState.FAULT,
    "fault reaction": DriveState.FAULT_REACTION_ACTIVE,
    "switched on": DriveState.SWITCHED_ON,
    "not ready": DriveState.NOT_READY,
    "unknown": DriveState.UNKNOWN,
}


class Space:
    """``events`` are all that may happen to a state; each gives the next one, having checked what must hold.
    ``names``: those of the profile. ``after_hang``: requests that are read after everything has come due."""

    def __init__(
        self,
        settings: LegSettings,
        rules: Rules,
        leg: LegState,
        names: Collection[str],
        after_hang: Collection[str] = (),
        ttl_ms: int = 5000,
    ) -> None:
        self.settings, self.rules = settings, rules
        self.forgets: Callable[[LegState, Seen], State] = Forgetting(settings.words, {*names, *after_hang})
        self.first = timeless(*self.forgets(leg, first(rules)))
        self.walked = Walked()
        self._table = RecordedTable(deeds.TABLE)
        self.states = [self.first]
        every = self._every(requests_of(rules, ttl_ms))
        unknown = {*names, *after_hang} - every.keys()
        assert not unknown, unknown
        self.events = {name: happen for name, happen in every.items() if name in names}
        for name in after_hang:
            self.events[f"{name}, after a hang"] = self._late(every[name])

    def _every(self, requests: dict[str, Request]) -> dict[str, Callable[[State], State]]:
        every: dict[str, Callable[[State], State]] = {
            name: lambda state, request=request: self._request(state, request)
            for name, request in requests.items()
        }
        for says in _SAYS:
            every[f"drive says: {says}"] = lambda state, says=says: self._says(state, says)
        return every | {
            "drive follows": self._follows,
            "drive repeats": self._repeats,
            "drive is moved": self._moved,
            "drive takes the setpoint": lambda state: self._follows(state, is_acknowledged=True),
            "drive's own watch is off": lambda state: self._watches(state, watches=False),
            "drive's own watch is on": lambda state: self._watches(state, watches=True),
            "node lost": lambda state: self._way(state, _SHUT),
            "node operational": lambda state: self._node_back(state, _OPEN),
            "node operational, not heard": lambda state: self._node_back(state, _UNHEARD),
            "process data overdue": lambda state: self._way(state, _SHUT),
            "process data back": lambda state: self._way(state, _OPEN, comes_back=True),
            "position not known": lambda state: self._way(state, _UNPLACED),
            "position known": lambda state: self._way(state, _OPEN),
            "words do not reach the bus": lambda state: self._sends(state, "the kernel refuses them"),
            "words reach the bus": lambda state: self._sends(state, ""),
            "bus back": self._bus_back,
            "bridge gap": self._gap,
            "everything is due": lambda state: self._round(come(state, ahead(state))),
            "nothing is due": self._round,
            "owner's connection ends": lambda state: self._connection(state, PLC, is_there=False),
            "owner is connected": lambda state: self._connection(state, PLC, is_there=True),
            "owner's connection ends, not its twin": lambda state: self._connection(
                state, PLC, is_there=False, has_others=True
            ),
            "twin's connection ends": lambda state: self._connection(
                state, TWIN, is_there=False, has_others=True
            ),
        }

    def _late(self, happen: Callable[[State], State]) -> Callable[[State], State]:
        return lambda state: happen(come(state, ahead(state)))

    def _step(self, leg: LegState, event: Event) -> tuple[LegState, list[Effect]]:
        """A step that does what the table says."""
        table = self._table
        table.last = None
        after, effects = step(self.settings, leg, event, NOW)
        if table.last is not None:
            stage, deed = table.last
            enables = self.rules.words.enabling.fit(after.sent.words[0]) and not after.sent.silent
            done = Done(event, stage, after, effects, enables)
            assert HOLDS[deed](done), f"{stage}: {deed} is not what was done"
        return after, effects

    # requests, between two rounds of the service: the leg has to see to its timers by itself

    def _request(self, state: State, request: Request) -> State:
        leg, seen = state
        after, effects = self._step(leg, request)
        oracle = Oracle(self.rules, seen, NOW)
        oracle.judge()
        answers = [effect for effect in effects if isinstance(effect, Answer)]
        begun = sum(isinstance(effect, StartBegun) for effect in effects)
        assert len(answers) + begun == 1, "a request is answered, once"
        answer = answers[0] if answers else None
        may = self._may(oracle, request)
        if answer is not None and answer.is_refused:
            assert not answer.outcome.forwarded
            assert not may, f"refused: {answer.outcome.message}"
            self.walked.refused += 1
            if after is leg:
                return state
            alone, _ = self._step(leg, Time())
            both, _ = self._step(after, Time())
            assert both == alone, "a refused telegram changes nothing"
        else:
            assert may, f"{request.action} was taken"
            is_edge = not (request.pressed and oracle.pressed(request.identity))
            self._tell(oracle, request)
            sent, command = after.sent, request.command
            if answer is not None:
                oracle.check_told(
                    request.action,
                    command.values if isinstance(command, Write) else {},
                    sent.words,
                    is_edge=is_edge,
                    silent=sent.silent,
                    forwarded=answer.outcome.forwarded,
                )
            if request.action in STOP_ACTIONS:
                oracle.check_stop(sent.words[0], request.action)
        return self._end(leg, after, oracle, effects)

    def _may(self, oracle: Oracle, request: Request) -> bool:
        """Whether it is to be taken."""
        who, command, action = request.identity, request.command, request.action
        is_late = request.received_at is not None
        if action in STOP_ACTIONS:
            return oracle.may_stop(who)
        if not oracle.may(who, take=action is Action.TAKE_CONTROL):
            return False
        words = self.rules.words
        match command:
            case Write(values=values):
                word = values.get("control_word", words.valid)
                assert isinstance(word, int)
                is_stop = "control_word" in values and not words.enabling.fit(word)
                is_late = is_late or not oracle.lives(who, values.get("life_sign"))
                is_valid = word & words.valid == words.valid and values is not words.too_large
                return is_valid and (not is_late or (is_stop and oracle.owns(who)))
            case Start():
                is_late = is_late or not oracle.lives(who)
                is_refused = is_late or oracle.is_tripped or oracle.says in FAULTED or oracle.is_unsent
                return not is_refused and oracle.is_open
            case SetTimeout():
                return self.rules.is_writable and oracle.owns(who)
            case Do(action=Action.KEEP_ALIVE | Action.RESET_FAULT):
                return not is_late and oracle.lives(who)
            case _:
                return not is_late

    def _tell(self, oracle: Oracle, request: Request) -> None:
        who, command, action = request.identity, request.command, request.action
        is_late = request.received_at is not None
        if request.pressed is False and oracle.pressed(who):
            oracle.press(None)
        match command:
            case Write(values=values) if is_late or not oracle.lives(who, values.get("life_sign")):
                oracle.late_stop()
            case Write(values=values):
                word = values.get("control_word")
                if isinstance(word, int):
                    oracle.word(who, word, values.get("life_sign"))
                else:
                    oracle.telegram(who, values.get("life_sign"))
                oracle.has_set |= bool(values.keys() - {"control_word", "life_sign"})
                if "position" in values:
                    oracle.order(values["position"])
            case Start():
                oracle.start(who)
            case TakeControl(ttl_ms=ttl_ms):
                oracle.take_control(who, ttl_ms / 1000)
            case SetTimeout(timeout_ms=timeout_ms):
                oracle.set_timeout(timeout_ms / 1000)
            case _ if action in STOP_ACTIONS:
                oracle.asked_to_stop(who, action, is_late=is_late)
            case _ if action is Action.KEEP_ALIVE or (request.pressed and oracle.pressed(who)):
                if request.pressed:
                    oracle.press(who)
                oracle.telegram(who)
            case _ if action is Action.RESET_FAULT:
                if request.pressed:
                    oracle.press(who)
                oracle.acknowledge(who, is_reset=True)
            case _:
                if oracle.owns(who):
                    oracle.leave()

    # rounds of the service

    def _round(self, state: State) -> State:
        leg, seen = state
        oracle = Oracle(self.rules, seen, NOW)
        return self._time(leg, leg, oracle, [])

    def _time(self, before: LegState, leg: LegState, oracle: Oracle, effects: list[Effect]) -> State:
        oracle.round()
        after, more = self._step(leg, Time())
        return self._end(before, after, oracle, [*effects, *more])

    # the drive

    def _follows(self, state: State, *, is_acknowledged: bool = False) -> State:
        sent = state[0].sent
        enables = self.rules.words.enabling.fit(sent.words[0]) and not sent.silent
        return self._hear(state, "enabled" if enables else "ready", is_acknowledged=is_acknowledged)

    def _repeats(self, state: State) -> State:
        return self._hear(state, state[1].says, is_acknowledged=state[1].is_acknowledged)

    def _says(self, state: State, says: str) -> State:
        _, seen = state
        if says == "enabled" and seen.followed and seen.says != "enabled":
            return state  # nothing that was sent would have brought it there
        return self._hear(state, says)

    def _hear(self, state: State, says: str, *, is_acknowledged: bool = False) -> State:
        leg, seen = state
        oracle = Oracle(self.rules, seen, NOW)
        if not seen.is_there:
            return state
        after, effects = self._step(leg, StatusReport(_SAYS[says], is_acknowledged, "a fault"))
        oracle.hear(says, is_acknowledged=is_acknowledged)
        self._check(after, oracle, leg, effects)
        return self._time(after, after, oracle, [])

    def _moved(self, state: State) -> State:
        """There and back."""
        leg, seen = state
        if not seen.is_there:
            return state
        place = self.rules.words.place
        oracle = Oracle(self.rules, seen, NOW)
        oracle.at = () if seen.at else place
        actual = oracle.at or (0,) * len(place)
        after, effects = self._step(leg, ActualWords((self.rules.words.ready, *actual)))
        return self._time(leg, after, oracle, effects)

    def _watches(self, state: State, *, watches: bool) -> State:
        leg, seen = state
        oracle = Oracle(self.rules, seen, NOW)
        after, effects = self._step(leg, StopsOnSilence(watches))
        oracle.watches = watches
        return self._time(leg, after, oracle, effects)

    # the way to it

    def _way(self, state: State, way: Way, *, comes_back: bool = False) -> State:
        leg, seen = state
        way = way._replace(is_heard=leg.way.is_heard, why_unsent=leg.way.why_unsent)
        if leg.way == way or (way.is_open and not leg.way.is_open and not comes_back):
            return state
        oracle = Oracle(self.rules, seen, NOW)
        after, effects = self._step(leg, way)
        oracle.way(is_there=way.is_open, is_placed=not way.why_unplaced, is_heard=way.is_heard)
        return self._time(leg, after, oracle, effects)

    def _sends(self, state: State, why_not: str) -> State:
        leg, seen = state
        oracle = Oracle(self.rules, seen, NOW)
        after, effects = self._step(leg, leg.way._replace(why_unsent=why_not))
        oracle.is_unsent = bool(why_not)
        return self._time(leg, after, oracle, effects)

    def _node_back(self, state: State, way: Way) -> State:
        leg, seen = state
        if leg.way.is_open and not self.rules.ignores:
            return state
        oracle = Oracle(self.rules, seen, NOW)
        back, effects = self._step(leg, NodeBack())
        after, more = self._step(back, way._replace(why_unsent=leg.way.why_unsent))
        oracle.stop()
        oracle.way(is_there=True, is_heard=way.is_heard)
        return self._time(leg, after, oracle, [*effects, *more])

    def _bus_back(self, state: State) -> State:
        leg, seen = state
        oracle = Oracle(self.rules, seen, NOW)
        after, effects = self._step(leg, StartAnew())
        oracle.drop()
        oracle.stop()
        oracle.followed = True
        oracle.said = None
        return self._time(leg, after, oracle, effects)

    def _gap(self, state: State) -> State:
        leg, seen = state
        oracle = Oracle(self.rules, seen, NOW)
        after, effects = self._step(leg, BridgeGap())
        oracle.judge()
        if oracle.is_tripped:
            oracle.drop()
            oracle.stop()
        else:
            oracle.leave()
        return self._time(leg, after, oracle, effects)

    def _connection(self, state: State, who: Identity, *, is_there: bool, has_others: bool = False) -> State:
        leg, seen = state
        oracle = Oracle(self.rules, seen, NOW)
        after, effects = self._step(leg, Connection(who, is_there, has_others))
        oracle.connection(who, is_there=is_there, has_others=has_others)
        return self._end(leg, after, oracle, effects)

    # what must hold

    def _end(self, before: LegState, leg: LegState, oracle: Oracle, effects: list[Effect]) -> State:
        self._check(leg, oracle, before, effects)
        return timeless(*self.forgets(leg, oracle.end()))

    def _check(self, leg: LegState, oracle: Oracle, before: LegState, effects: list[Effect]) -> None:
        ended = [effect.outcome for effect in effects if isinstance(effect, StartEnded)]
        begun = sum(isinstance(effect, StartBegun) for effect in effects)
        trips = sum(isinstance(effect, Tripped) for effect in effects)
        assert trips <= 1, "a trip is told once"
        assert trips or before.stage.is_tripped or not leg.stage.is_tripped, "a trip is told"
        was, is_going_on = before.start is not None, leg.start is not None
        assert was + begun == is_going_on + len(ended), "a start has one outcome"
        for number, outcome in enumerate(ended):
            if number >= was + begun - 1:
                is_done = outcome.code is Code.OK
                enables = self.rules.words.enabling.fit(leg.sent.words[0]) and not leg.sent.silent
                assert enables or not is_done, "a start is told as done when the drive gets what enables it"
                oracle.start_has_ended(is_done=is_done)
        oracle.look_at_way()
        assert oracle.is_starting is is_going_on, "a start goes on until something ends it"
        assert leg.stage.is_tripped is oracle.is_tripped, "tripped exactly if the owner's time was up"
        owner = oracle.owner
        assert leg.owner.identity is (owner.without_connection() if oracle.is_cut else owner)
        sent = leg.sent
        oracle.check(sent.words, silent=sent.silent)
        if oracle.sends:
            self.walked.enabled += 1
            then = output_then(self.settings, leg)
            oracle.check_kernel(until(self.settings, leg), then.words, silent=then.silent)

    # the walk

    def explore(self, most: int, table: dict[tuple[Stage, Stimulus], Cell] | None = None) -> Walked:
        """Every state there is; fails with the shortest sequence that breaks a rule."""
        self._table = RecordedTable(deeds.TABLE if table is None else table)
        with patch.object(deeds, "TABLE", self._table):
            self._explore(most)
        self.walked.cells = self._table.seen
        return self.walked

    def _explore(self, most: int) -> None:
        states = self.states
        numbers: dict[State, int] = {self.first: 0}
        ways: list[tuple[int, str]] = [(-1, "")]
        events = tuple(self.events.items())
        for number, state in enumerate(states):
            assert len(states) <= most, f"more than {most} states"
            instants = ahead(state)
            due = tuple((f"due {at}", lambda state, at=at: self._round(come(state, [at]))) for at in instants)
            for name, happen in events + due:
                try:
                    after = happen(state)
                except AssertionError as error:
                    raise AssertionError(f"{error}\nafter {_told(ways, number)}{name}") from error
                self.walked.steps += 1
                if after is not state and after not in numbers:
                    numbers[after] = len(states)
                    states.append(after)
                    ways.append((number, name))
            if not self._is_woken(state):
                raise AssertionError(f"nobody wakes the leg in time\nafter {_told(ways, number)}")
            if not self._knows_what_comes(state[0]):
                raise AssertionError(f"the kernel does not know what comes\nafter {_told(ways, number)}")
        self.walked.states = len(states)

    def _is_woken(self, state: State) -> bool:
        wakes, times = next_deadline(state[0]), state[1].times
        due = [it for it in (times.deadline, times.lease_until, times.mute_at) if it is not None and it > NOW]
        return not due or (wakes is not None and wakes <= min(due))

    def _knows_what_comes(self, leg: LegState) -> bool:
        """The kernel is told what the leg will send by itself."""
        at = until(self.settings, leg)
        return at is None or output_then(self.settings, leg) == step(self.settings, leg, Time(), at)[0].sent


def _told(ways: list[tuple[int, str]], number: int) -> str:
    events = ""
    while number:
        number, name = ways[number]
        events = f"{name}, {events}"
    return events
