"""The leg as one machine does what the command channel does, on the same sequences."""

from __future__ import annotations

import random
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, Final
from unittest.mock import patch

import pytest

from bridge.command import (
    Action,
    Command,
    Do,
    Identity,
    Outcome,
    Request,
    SetTimeout,
    Source,
    Start,
    TakeControl,
    Write,
)
from bridge.command.link import NodeState
from bridge.command.request import STOP_ACTIONS
from bridge.mapping.model import pattern_bits
from tests.support import rig as rigs
from tests.support.leg_events import writes_of
from tests.support.leg_pair import LegPair
from tests.support.leg_words import ALL, HOMING, NORD_TU4, LegWords
from tests.support.rig import ENGINEER, OBSERVER, OPERATOR, OTHER_PLC, PLC, Rig

STEPS: Final = 4000
_WHO: Final = (PLC, PLC, PLC, PLC, OTHER_PLC, OPERATOR, ENGINEER, OBSERVER, Identity(Source.LOCAL, "eve"))
_PAUSES: Final = (0.0, 0.001, 0.001, 0.05, 0.05, 0.1, 0.1, 0.2, 0.2, 0.3, 0.3, 0.7, 1.0, 2.5, 12.0)
_REACTIONS: Final = ("disable_voltage", "quick_stop", "stop", "silence", "hold")

CYCLIC: Final = replace(
    HOMING, mapping="cia402/cyclic-position", begin=0, setpoint={"position": 70_000}, more={"position": 5}
)
"""Its setpoints follow the drive's own position."""


@dataclass
class Walk:
    """One drive under random events. ``done`` can be played again."""

    words: LegWords
    settings: dict[str, Any]
    chance: random.Random
    done: list[tuple[str, tuple[Any, ...]]] = field(default_factory=list)
    outcomes: list[Outcome] = field(default_factory=list)

    def __post_init__(self) -> None:
        with patch.object(rigs, "DriveChannel", LegPair):
            given = {"fieldbus_timeout_ms": 2000, **self.settings}
            self.rig = Rig(hold_ms=500, pdo_deadline_s=0.5, words=self.words, **given)
        family = self.rig.channel.family
        model = family.status_word
        self.status = [pattern_bits(state.pattern)[1] for state in model.state] + [0xFFFF]
        self.writes = list(writes_of(self.words).values())
        self.count = len(family.process.tpdo)
        self.lacking = ""
        self.rig.channel.look_up(lambda places, now: self.lacking)

    # events, each with arguments that say all about it

    def write(self, number: int, who: Identity, age: float | None, pressed: bool | None) -> None:
        self._ask(Write(self.writes[number % len(self.writes)][1]), who, age, pressed)

    def words_of(self, word: int, who: Identity) -> None:
        self._ask(Write({"control_word": word}), who, None, None)

    def ask(self, command: Command, who: Identity, age: float | None, pressed: bool | None) -> None:
        self._ask(command, who, age, pressed)

    def _ask(self, command: Command, who: Identity, age: float | None, pressed: bool | None) -> None:
        came = None if age is None else self.rig.now - age
        request = Request(who, "conveyor/fu1", command, came, pressed)
        self.rig.channel.handle(request, self.rig.now, self.outcomes.append)

    def says(self, number: int, bits: int) -> None:
        self.rig.drive_says(self.status[number % len(self.status)] | bits)

    def answers(self) -> None:
        """The drive follows."""
        self.rig.drive_says(self.words.enabled if self.rig.enables else self.words.ready)

    def repeats(self) -> None:
        self.rig.channel.on_unchanged(self.rig.now)

    def stands(self, position: int) -> None:
        words = (self.rig.channel.drive_status_word, *(position + place for place in range(self.count - 1)))
        self.rig.channel.on_actual_words(words, self.rig.now)

    def lacks(self, why: str) -> None:
        self.lacking = why
        self.time()

    def node(self, state: NodeState) -> None:
        self.rig.node(state)

    def starts_unheard(self, times: int) -> None:
        """Start of a drive whose node is back and has not reported; then its timers run ``times``."""
        self.node(NodeState.LOST)
        self.node(NodeState.OPERATIONAL)
        self.ask(Start(1), PLC, None, None)
        for _ in range(times):
            self.due()

    def passes(self, seconds: float) -> None:
        self.rig.now += seconds
        if self.words is CYCLIC:
            # Which of two causes is told that come due at once is nobody's concern.
            self.time()

    def time(self) -> None:
        self.rig.channel.on_time(self.rig.now)

    def due(self) -> None:
        deadline = self.rig.channel.next_deadline(self.rig.now)
        if deadline is not None:
            self.rig.now = deadline
            self.rig.channel.on_time(deadline)

    def gap(self) -> None:
        self.rig.channel.on_bridge_gap(self.rig.now)

    def anew(self) -> None:
        self.rig.channel.start_anew(self.rig.now)

    def own_watch(self, why: str) -> None:
        self.rig.channel.on_own_watch(why, self.rig.now)

    def connected(self, who: Identity, is_there: bool) -> None:
        self.rig.channel.authority.on_connection(who, self.rig.now, is_there=is_there)

    # by chance

    def any_event(self) -> tuple[str, tuple[Any, ...]]:
        pick = self.chance.choice
        who = pick(_WHO)
        age = pick((None, None, None, 0.0, 0.05, 0.3, 1.0))
        pressed = pick((None, None, False, True))
        commands: tuple[Command, ...] = (
            Do(Action.KEEP_ALIVE),
            Do(Action.RESET_FAULT),
            Do(Action.STOP),
            Do(Action.QUICK_STOP),
            Do(Action.DISABLE_VOLTAGE),
            Do(Action.RELEASE_CONTROL),
            Do(Action.SAVE_PARAMETERS),
            Start(pick((0, 1, -1, 2))),
            Start(1),
            Start(1),
            TakeControl(pick((0, 500, 5000))),
            SetTimeout(pick((0, 150, 300, 3000, 40_000))),
        )
        bits = pick((0, 0, self.words.taken, 0x1000))
        events: list[tuple[int, Callable[..., None], tuple[Any, ...]]] = [
            (8, self.write, (self.chance.randrange(20), who, age, pressed)),
            (3, self.words_of, (pick((self.words.enable, self.words.shut_down, 0x047F, 0, 0xFFFF)), who)),
            (8, self.ask, (pick(commands), who, age, pressed)),
            (6, self.ask, (Start(1), PLC, None, None)),
            (4, self.ask, (Do(Action.RESET_FAULT), PLC, None, None)),
            (3, self.ask, (Do(pick(tuple(STOP_ACTIONS))), OPERATOR, None, None)),
            (4, self.write, (self.chance.randrange(3), PLC, None, None)),
            (6, self.says, (self.chance.randrange(12), bits)),
            (6, self.answers, ()),
            (5, self.repeats, ()),
            (2, self.stands, (self.chance.randrange(3) * 100,)),
            (1, self.lacks, (pick(("", "no TPDO2 from the drive")),)),
            (1, self.node, (pick(tuple(NodeState)),)),
            (3, self.node, (NodeState.OPERATIONAL,)),
            (2, self.starts_unheard, (self.chance.randrange(6),)),
            (6, self.passes, (pick(_PAUSES),)),
            (6, self.due, ()),
            (4, self.time, ()),
            (1, self.gap, ()),
            (1, self.anew, ()),
            (1, self.own_watch, (pick(("", "it is off")),)),
            (1, self.connected, (who, pick((True, False)))),
        ]
        (chosen,) = self.chance.choices(events, [weight for weight, _, _ in events])
        return chosen[1].__name__, chosen[2]

    def play(self, event: tuple[str, tuple[Any, ...]]) -> None:
        self.done.append(event)
        getattr(self, event[0])(*event[1])


def shortest(words: LegWords, settings: dict[str, Any], done: list[Any]) -> list[Any]:
    """Without the events that are not needed to fail."""

    def fails(some: list[Any]) -> bool:
        walk = Walk(words, settings, random.Random(0))
        try:
            for event in some:
                walk.play(event)
        except AssertionError:
            return True
        return False

    size = len(done) // 2
    while size:
        at = 0
        while at < len(done):
            without = done[:at] + done[at + size :]
            if fails(without):
                done = without
            else:
                at += size
        size //= 2
    return done


def agree(words: LegWords, seed: int, steps: int = STEPS, **settings: Any) -> Walk:
    walk = Walk(words, settings, random.Random(seed))
    try:
        for _ in range(steps):
            walk.play(walk.any_event())
    except AssertionError as error:
        few = shortest(words, settings, walk.done)
        raise AssertionError(f"{error}\n" + "\n".join(map(repr, few))) from None
    return walk


@pytest.mark.parametrize("reaction", _REACTIONS)
@pytest.mark.parametrize("words", (*ALL, CYCLIC), ids=lambda words: words.mapping)
def test_in_the_words_of_every_family_with_every_reaction(words: LegWords, reaction: str) -> None:
    walk = agree(words, 1, on_expiry=reaction)
    assert {outcome.code for outcome in walk.outcomes} > {"ok", "not_allowed"}


@pytest.mark.parametrize(
    "settings",
    [
        {"control": "lease"},
        {"control": "none"},
        {"control": "lease", "fieldbus_timeout_ms": 0},
        {"fieldbus_timeout_ms": 0},
        {"telegram_downtime_s": -0.1},
        {"telegram_downtime_s": 0.3},
        {"on_expiry": "stop", "then_silence_ms": 300},
        {"on_expiry": "quick_stop", "then_silence_ms": 300},
        {"fieldbus_timeout_writable": True, "fieldbus_timeout_range_ms": [0, 400]},
        {"stop_by_anyone": False},
    ],
    ids=str,
)
def test_with_other_settings(settings: dict[str, Any]) -> None:
    agree(NORD_TU4, 2, **settings)
