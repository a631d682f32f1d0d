"""The leg of one drive by itself: its state, its clock, and what has come of what happened."""

from __future__ import annotations

from typing import Any

from bridge.command import Action, Command, Do, Identity, Outcome, Request, Source, Write
from bridge.command.leg.draft import Draft
from bridge.command.leg.effect import Answer, Effect, Tell
from bridge.command.leg.event import Event, NodeBack, StatusReport, Time
from bridge.command.leg.outlook import next_deadline
from bridge.command.leg.settings import LegSettings, leg_settings
from bridge.command.leg.state import WANTS_STOP_WORD, Way
from bridge.command.leg.step import initial, step
from bridge.command.messages.life_sign import LifeSign
from bridge.command.messages.telegram import TelegramDecoder
from bridge.command.status import DriveStatus
from bridge.config import DriveTable
from bridge.drive import DriveState, Meanings
from bridge.image import Value
from bridge.mapping import load_family
from bridge.text import render

PLC = Identity(Source.MODBUS, "192.168.1.10")
TOKENS = LifeSign(start=4711, step=20_002)
OPEN = Way(is_open=True, why="", is_heard=True)
SHUT_DOWN, RUN, DISABLE, ACKNOWLEDGE = 0x047E, 0x047F, 0x0000, 0x0080
"""NORD's (BU 2500 §6.5.1, §6.8)."""
SHUT = Way(is_open=False, why="the drive's node is lost", is_heard=True)


def settings_of(mapping: str, **given: object) -> LegSettings:
    """A drive of this family that is commanded by Modbus; nobody watches its controller."""
    family = load_family(mapping)
    keys = {"slot": family.slot[0].name, "control": "modbus", "fieldbus_timeout_ms": 0, **given}
    table = DriveTable.model_validate(keys)
    meanings = Meanings(family, family.slot[0], {})
    meanings.take_defaults()
    decode = TelegramDecoder("n/d", family, family.slot[0], meanings, {}, DriveStatus(family)).decode
    return leg_settings(family, table, decode, TOKENS)


class Leg:
    """Leg of a drive that has been heard, on an operational node."""

    def __init__(self, settings: LegSettings) -> None:
        self.settings = settings
        self.state = initial(settings)
        self.now = 100.0
        self.effects: list[Effect] = []
        self.happens(OPEN)

    def happens(self, event: Event) -> int:
        """The control word that is sent after it."""
        self.state, self.effects = step(self.settings, self.state, event, self.now)
        return self.sent

    # the drive and its node

    def says(self, state: DriveState, after_s: float = 0.0, *, is_acknowledged: bool = False) -> int:
        self.now += after_s
        return self.happens(StatusReport(state, is_acknowledged, "it says so"))

    def restarts(self) -> int:
        """The node has restarted: what the owner wants stays, behind the interlock."""
        self.happens(NodeBack())
        return self.happens(self.state.way._replace(is_heard=False))

    # who commands it

    def asks(
        self,
        command: Command | Action,
        who: Identity = PLC,
        *,
        received_at: float | None = None,
        pressed: bool | None = None,
    ) -> int:
        asked = Do(command) if isinstance(command, Action) else command
        return self.happens(Request(who, "n/d", asked, received_at, pressed))

    def writes(self, control_word: int | None = None, **values: Value) -> int:
        words: dict[str, Value] = {} if control_word is None else {"control_word": control_word}
        return self.asks(Write({**words, **values}))

    @property
    def outcome(self) -> Outcome:
        """Outcome of the last request."""
        (outcome,) = (effect.outcome for effect in self.effects if isinstance(effect, Answer))
        return outcome

    # time

    def at(self, now: float) -> None:
        """Set the time: what is due happens."""
        self.now = now
        self.happens(Time(self.state.way))

    def waits(self, seconds: float) -> list[Effect]:
        """Let the time pass, asked for as the master does; what has come of it."""
        end = self.now + seconds
        effects: list[Effect] = []
        while (due := next_deadline(self.state)) is not None and due <= end:
            self.at(due)
            effects += self.effects
        self.at(end)
        return effects + self.effects

    def trips(self) -> int:
        """The owner is silent until its time is up."""
        deadline = self.state.timer.deadline
        assert deadline is not None
        self.at(deadline)
        assert self.state.stage.is_tripped
        return self.sent

    # what came of it

    @property
    def sent(self) -> int:
        return self.state.sent.words[0]

    @property
    def setpoints(self) -> tuple[int, ...]:
        """Setpoints as they are sent."""
        return self.state.sent.words[1:]

    @property
    def enables(self) -> bool:
        return self.settings.words.enables(self.sent)

    @property
    def is_interlocked(self) -> bool:
        return self.state.stage in WANTS_STOP_WORD


def running_nord(**given: object) -> Leg:
    """A NORD that runs at half its speed, watched with 200 ms."""
    leg = Leg(settings_of("nord/sk-tu4-cao", **{"fieldbus_timeout_ms": 200, **given}))
    leg.writes(SHUT_DOWN)
    leg.writes(RUN, setpoint_1=0x2000)
    leg.says(DriveState.OPERATION_ENABLED)
    assert leg.enables
    return leg


def draft_of(leg: Leg, at: float | None = None) -> Draft:
    return Draft(leg.settings, leg.state, leg.now if at is None else at)


def told(effects: list[Effect]) -> list[Any]:
    """The sentences among them."""
    return [render(effect.said) for effect in effects if isinstance(effect, Tell)]
