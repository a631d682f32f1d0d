"""Everything that can happen to the outputs of one node, breadth first, against the shared design.

The wire is what their RPDOs carry."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

from bridge.command import Action, Do, EventQueue, Outcome, Request, Write
from bridge.command.drive_link import NodeState
from bridge.command.effects import Effects
from bridge.command.leg.event import BridgeGap, Event, StartAnew, Time
from bridge.command.leg.state import LegState
from bridge.command.messages.request import STOP_ACTIONS
from bridge.command.output_words import OutputWords
from bridge.command.outputs import OutputChannel
from bridge.config import OutputsTable, SafeValue
from bridge.image import Value
from bridge.mapping.device_signals import Output
from tests.support.leg_requests import OPERATOR, OTHER_PLC, PLC
from tests.support.leg_seen import Seen, Times
from tests.support.leg_time import NOW, ahead, come, timeless

ON: Final = 0xFE
_NAMES: Final[tuple[str, ...]] = ("valves", "lamp")


class _State(NamedTuple):
    leg: LegState
    held: tuple[int, ...]
    is_stopped: bool = False
    """True if somebody else has stopped them, and the owner has sent no safe values since."""


class OutputSpace:
    """``on_expiry``: of two outputs what they get when nobody commands them."""

    def __init__(self, on_expiry: tuple[SafeValue, SafeValue]) -> None:
        outputs = [
            Output.model_validate({"name": name, "object": f"6200:0{place}", "data_type": "uint8"})
            for place, name in enumerate(_NAMES, 1)
        ]
        self.words = OutputWords("io", outputs, dict(zip(_NAMES, on_expiry, strict=True)))
        table = OutputsTable.model_validate({"control": "modbus", "fieldbus_timeout_ms": 2000})
        self.channel = OutputChannel(
            "io",
            self.words,
            table,
            2000,
            Effects(EventQueue()),
            lambda now: self._settled(),
        )
        self.channel.on_node(NodeState.OPERATIONAL, NOW)
        self.safe = tuple(0 if value == "hold" else int(value) for value in on_expiry)
        """Values of the outputs after somebody's Stop."""
        self.expiry = on_expiry
        stop: dict[str, Value] = dict(zip(_NAMES, self.safe, strict=True))
        active: dict[str, Value] = dict.fromkeys(_NAMES, ON)
        self.events: dict[str, Callable[[], object]] = {
            "owner writes what is safe": lambda: self._write(PLC, stop),
            "owner writes": lambda: self._write(PLC, active),
            "rival writes": lambda: self._write(OTHER_PLC, active),
            "owner acknowledges": lambda: self._ask(Request(PLC, "io", Do(Action.RESET_FAULT))),
            "owner keeps alive": lambda: self._ask(Request(PLC, "io", Do(Action.KEEP_ALIVE), None, False)),
            "owner acknowledges by a register": lambda: self._ask(
                Request(PLC, "io", Do(Action.RESET_FAULT), None, True)
            ),
            "owner releases": lambda: self._ask(Request(PLC, "io", Do(Action.RELEASE_CONTROL))),
            "owner stops": lambda: self._stop(Request(PLC, "io", Do(Action.STOP))),
            **{
                f"stranger: {action}": lambda action=action: self._stop(Request(OPERATOR, "io", Do(action)))
                for action in sorted(STOP_ACTIONS)
            },
            "bridge gap": lambda: self._happen(BridgeGap()),
            "bus back": lambda: self._happen(StartAnew()),
            "nothing is due": lambda: self._happen(Time()),
        }
        self.is_stopped = False
        self.steps = 0

    def _settled(self) -> None:
        """Settle as ``Outputs`` does it."""
        if self.channel.output.words[0] & 1:
            self.words.held = self.channel.output.words[1:]

    # what happens

    def _ask(self, request: Request) -> Outcome:
        (outcome,) = self._outcomes(request)
        return outcome

    def _outcomes(self, request: Request) -> list[Outcome]:
        outcomes: list[Outcome] = []
        self.channel.handle(request, NOW, outcomes.append)
        return outcomes

    def _happen(self, event: Event) -> None:
        self.channel._happen(event, NOW)  # pyright: ignore[reportPrivateUsage]

    def _write(self, who: object, values: Mapping[str, Value]) -> None:
        outcome = self._ask(Request(who, "io", Write(values)))  # pyright: ignore[reportArgumentType]
        if not outcome.ok:
            assert not outcome.forwarded
            return
        says = self.channel.wired == tuple(values.values())
        is_tripped = self.channel.is_tripped
        assert says if outcome.forwarded else is_tripped or not says, "told as what the outputs get"
        if not is_tripped and tuple(values.values()) == self.safe:
            self.is_stopped = False

    def _stop(self, request: Request) -> None:
        outcome = self._ask(request)
        assert outcome == Outcome(outcome.code)
        assert outcome.forwarded is (self.channel.wired == self.safe), (
            "a stop is told as what the outputs get"
        )
        assert outcome.forwarded, "hold speaks of silence, never of somebody's stop"
        self.is_stopped |= request.identity is not PLC

    # the walk

    def explore(self) -> int:
        """Number of states; fails with the shortest sequence that breaks a rule."""
        first = self._state(False)
        states, ways = [first], {first: ""}
        for state in states:
            for name, happen in self.events.items():
                for is_due in (False, True):
                    self._enter(state, is_due=is_due)
                    way = f"{ways[state]}{'time, ' if is_due else ''}{name}, "
                    try:
                        happen()
                        self._check()
                    except AssertionError as error:
                        raise AssertionError(f"{error}\nafter {way}") from error
                    self.steps += 1
                    after = self._state(self.is_stopped)
                    if after not in ways:
                        ways[after] = way
                        states.append(after)
        return len(states)

    def _check(self) -> None:
        wired = self.channel.wired
        if self.is_stopped:
            assert wired == self.safe, "a stop by somebody else asks for an edge of the owner's own"
        if self.channel.is_tripped:
            for value, safe in zip(wired, self.expiry, strict=True):
                assert safe == "hold" or value == safe, "tripped, they are safe"

    def _state(self, is_stopped: bool) -> _State:
        leg, _ = timeless(self.channel.leg, _NOTHING)
        return _State(leg, self.words.held, is_stopped)

    def _enter(self, state: _State, *, is_due: bool) -> None:
        leg = state.leg
        if is_due:
            leg, _ = come((leg, _NOTHING), ahead((leg, _NOTHING)))
        self.channel.leg, self.words.held, self.is_stopped = leg, state.held, state.is_stopped


_NOTHING: Final = Seen(Times(), 0.0)
