"""One drive's command channel on a bench: a virtual clock, a controller, and what came of it."""

from __future__ import annotations

from typing import Any

from bridge.command import (
    Action,
    Code,
    Event,
    EventKind,
    EventQueue,
    Identity,
    Outcome,
    Request,
    Role,
    Source,
    command_of,
)
from bridge.command.drive_channel import DriveChannel
from bridge.command.drive_link import NodeState
from bridge.command.effects import Effects
from bridge.config import DriveTable
from bridge.drive import EmergencyMeaning, EmergencyReader, LinearScale
from bridge.image import Value
from bridge.mapping import Family, load_family
from tests.support.leg_words import HALF_SPEED, NORD_TU4, LegWords

NORD: Family = load_family(NORD_TU4.mapping)

PLC = Identity(Source.MODBUS, "192.168.1.10")
OTHER_PLC = Identity(Source.MODBUS, "192.168.1.11")
OPERATOR = Identity(Source.OPCUA, "ann")
OBSERVER = Identity(Source.OPCUA, "guest", Role.OBSERVER)
ENGINEER = Identity(Source.OPCUA, "eve", Role.ENGINEER)

# BU 2500 §6.8: control words and the drive's answers to them.
SHUT_DOWN, ENABLE = NORD_TU4.shut_down, NORD_TU4.enable
ACKNOWLEDGE = SHUT_DOWN | NORD_TU4.acknowledge
INHIBITED, READY, SWITCHED_ON, ENABLED = 0x0B40, NORD_TU4.ready, 0x0B33, NORD_TU4.enabled
QUICK_STOPPING, FAULT, FAULT_REACTION = 0x0B17, NORD_TU4.fault, 0x0B0F

_ROUNDING_S = 1e-9
"""0.15 + 0.05 may come out a little less than 0.2."""


def emergency(code: int, vendor: bytes = bytes(5)) -> EmergencyMeaning:
    """An emergency message of a NORD drive, read."""
    return EmergencyReader(NORD).read(code, vendor)


class Rig:
    """A channel with the controller that owns it. ``settings`` are those of the site file's drive, ``words``
    those of its family.

    Times are seconds from the start of the rig; ``now`` is on the channel's own clock.
    """

    def __init__(
        self,
        *,
        hold_ms: int = 2000,
        pdo_deadline_s: float | None = None,
        words: LegWords = NORD_TU4,
        **settings: object,
    ) -> None:
        self.words = words
        family = NORD if words is NORD_TU4 else load_family(words.mapping)
        slot = family.slot[0].name
        given = {"slot": slot, "control": "modbus", "fieldbus_timeout_ms": 200, **settings}
        self.effects = Effects(EventQueue())
        self.events: list[Event] = self.effects.events.waiting
        table = DriveTable.model_validate(given)
        self.channel = DriveChannel(
            f"conveyor/{slot}", family, table, hold_ms, self.effects, lambda now: None
        )
        meanings = self.channel.meanings
        meanings.scales.setdefault("command/frequency", LinearScale(50.0, 16384, 2.0))
        meanings.scales.setdefault("command/velocity", LinearScale(3000.0, 1000, 2.0))
        meanings.take_defaults()
        self.channel.link.pdo_deadline_s = pdo_deadline_s
        self.now = 1000.0

    # the drive

    def node(self, state: NodeState) -> None:
        self.channel.on_node(state, self.now)

    def drive_says(self, status_word: int) -> None:
        self.channel.on_pdo(self.now)
        self.channel.on_status_word(status_word, self.now)

    # the controller

    def submit(
        self,
        action: Action,
        identity: Identity = PLC,
        *,
        pressed: bool | None = None,
        **fields: Any,
    ) -> list[Outcome]:
        """The outcomes so far, which grow when a later one comes."""
        outcomes: list[Outcome] = []
        request = Request(identity, "conveyor/fu1", command_of(action, **fields), pressed=pressed)
        self.channel.handle(request, self.now, outcomes.append)
        return outcomes

    def ask(self, action: Action, identity: Identity = PLC, **more: int) -> Outcome:
        """An action with an outcome at once."""
        (outcome,) = self.submit(action, identity, **more)
        return outcome

    def write(
        self, control_word: int | None = None, *setpoints: int, identity: Identity = PLC, **values: Value
    ) -> Outcome:
        """One telegram of process data."""
        words = {} if control_word is None else {"control_word": control_word}
        words |= {f"setpoint_{place}": word for place, word in enumerate(setpoints, 1)}
        (outcome,) = self.submit(Action.WRITE, identity, values={**words, **values})
        return outcome

    def run(self, setpoint: int = HALF_SPEED) -> None:
        """Boot the node and lead NORD's drive to operation enabled, as the manual's example does."""
        self.node(NodeState.OPERATIONAL)
        self.drive_says(INHIBITED)
        assert self.write(SHUT_DOWN).code is Code.OK
        self.drive_says(READY)
        assert self.write(ENABLE, setpoint).forwarded
        self.drive_says(ENABLED)
        assert self.enables

    # time

    def wait(self, seconds: float) -> None:
        """Let the time pass; the channel is called whenever it asked for it, as the master does."""
        end = self.now + seconds + _ROUNDING_S
        while (deadline := self.channel.next_deadline(self.now)) is not None and deadline <= end:
            self.now = max(self.now, deadline)
            self.channel.on_time(self.now)
            again = self.channel.next_deadline(self.now)
            assert again is None or again > self.now, "the channel asks for the same time again and again"
        self.now = end

    # what came of it

    @property
    def sent(self) -> int:
        """The control word on the bus."""
        return self.channel.output.words[0]

    @property
    def sent_setpoints(self) -> tuple[int, ...]:
        return self.channel.output.words[1:]

    @property
    def silent(self) -> bool:
        return self.channel.output.silent

    @property
    def enables(self) -> bool:
        """Whether what is on the bus makes the drive move."""
        return not self.silent and self.words.enabling.fit(self.sent)

    @property
    def watchdog(self) -> str:
        return self.channel.watchdog_state.label

    def told(self, kind: EventKind) -> list[str]:
        return [event.message for event in self.events if event.kind is kind]
