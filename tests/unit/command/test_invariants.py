"""What holds whatever happens: a drive is led by chance, and a model of our own says what may be sent.

The rules are those of the shared design (watchdog). Time passes as it does in the service: the channel
is called at the times it asks for, or late, after the process has hung.
"""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import HealthCheck, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule, run_state_machine_as_test

from bridge.command import Action, Identity, Outcome
from bridge.command.drive_channel import DriveChannel
from bridge.command.drive_link import NodeState
from bridge.drive import DriveState
from bridge.image import Value
from tests.support.nightly import examples
from tests.support.rig import (
    ACKNOWLEDGE,
    ENABLE,
    ENABLED,
    ENGINEER,
    FAULT,
    FAULT_REACTION,
    HALF_SPEED,
    INHIBITED,
    OBSERVER,
    OPERATOR,
    OTHER_PLC,
    PLC,
    QUICK_STOPPING,
    READY,
    SHUT_DOWN,
    SWITCHED_ON,
    Rig,
)

_CONTROL_WORDS = (SHUT_DOWN, ENABLE, ACKNOWLEDGE, 0x04FF, 0x0C7F, 0x0474, 0x047B, 0x0400)
_STATUS_WORDS = (INHIBITED, READY, SWITCHED_ON, ENABLED, QUICK_STOPPING, FAULT, FAULT_REACTION, 0xFFFF)
_IDENTITIES = (PLC, PLC, PLC, ENGINEER, OTHER_PLC, OPERATOR, OBSERVER)
"""The owner more often than others: who is refused at the door finds nothing out."""
_TELEGRAMS = (Action.KEEP_ALIVE, Action.RESET_FAULT)
_STOPS = (Action.STOP, Action.QUICK_STOP, Action.DISABLE_VOLTAGE)
_HUNG_S = 1e-9


def enables(word: int) -> bool:
    return word & 0x000F == 0x000F


class DriveByChance(RuleBasedStateMachine):
    """``reaction`` and ``control`` are set by the profiles below."""

    reaction = "disable_voltage"
    control = "modbus"
    timeout_ms = 200

    def __init__(self) -> None:
        super().__init__()
        self.rig = Rig(
            control=self.control,
            fieldbus_timeout_ms=self.timeout_ms,
            fieldbus_timeout_writable=True,
            on_expiry=self.reaction,
            pdo_deadline_s=0.4,
        )
        self.channel: DriveChannel = self.rig.channel
        self.pending: list[list[Outcome]] = []
        self.deadline: float | None = None
        self.trips = 0
        self.needs_acknowledge = False
        self.needs_stop = True
        self.owner: Identity | None = None
        self.written = 0xFFFF
        """The owner's last control word; a first one is no edge."""

    # the model

    def _telegram(self, outcome: Outcome, identity: Identity) -> None:
        if outcome.ok and identity.is_same(self.channel.owner):
            self.deadline = self.rig.now + self.channel.timeout_ms / 1000

    def _look(self) -> None:
        """Trips, losses and gaps close the way; what opens it is noted where it is done."""
        if self.channel.trips != self.trips:
            self.trips = self.channel.trips
            self.needs_acknowledge = self.needs_stop = True
        if not self.channel.link.may_enable or self.channel.owner is None:
            self.needs_stop = True
        if self.channel.owner != self.owner:
            self.owner = self.channel.owner
            self.written = 0xFFFF

    # what may happen

    @initialize(operational=st.booleans())
    def boot(self, operational: bool) -> None:
        if operational:
            self.rig.node(NodeState.OPERATIONAL)
            self.rig.drive_says(READY)

    @rule(
        word=st.sampled_from(_CONTROL_WORDS),
        setpoint=st.sampled_from((0, HALF_SPEED, 0xC000)),
        identity=st.sampled_from((PLC, PLC, OTHER_PLC)),
    )
    def write(self, word: int, setpoint: int, identity: Identity) -> None:
        self._write({"control_word": word, "setpoint_1": setpoint}, identity)

    @rule(setpoint=st.integers(0, 0xFFFF))
    def write_setpoint(self, setpoint: int) -> None:
        self._write({"setpoint_1": setpoint}, PLC)

    @rule(
        values=st.sampled_from(
            (
                {"control_word": 0x007F},
                {"control_word": 0x007E},
                {"control_word": 0x1_0000},
                {"control_word": ENABLE, "setpoint_1": 1.5},
                {"frequency": 1e9},
                {"nothing": 1},
            )
        ),
        identity=st.sampled_from(_IDENTITIES),
    )
    def write_nonsense(self, values: dict[str, Value], identity: Identity) -> None:
        self.channel.on_time(self.rig.now)
        self._look()
        before = self._everything()
        (outcome,) = self.rig.submit(Action.WRITE, identity, values=values)
        assert not outcome.ok
        assert not outcome.forwarded
        assert self._everything() == before, "a refused telegram changes nothing"

    def _everything(self) -> tuple[object, ...]:
        channel = self.channel
        return (
            channel.output,
            channel.control_word,
            channel.setpoints,
            channel.owner,
            channel.restart_interlock,
            channel.watchdog_state,
            channel.leg.timer.deadline,
            channel.leg.owner.lease_until,
            channel.status_word,
        )

    def _write(self, values: dict[str, Value], identity: Identity) -> None:
        channel = self.channel
        owner = channel.owner
        before = self.written
        was_tripped = self._judged_tripped()
        (outcome,) = self.rig.submit(Action.WRITE, identity, values=values)
        self._look()
        if not outcome.ok:
            return
        self._telegram(outcome, identity)
        if not identity.is_same(owner):
            self.needs_stop = True
            before = 0xFFFF
        word = values.get("control_word")
        if not isinstance(word, int):
            return
        self.written = word
        if was_tripped and word & ~before & 0x0080:
            self.needs_acknowledge = False
            self.needs_stop = True
        elif not enables(word) and channel.link.may_enable and not was_tripped:
            self.needs_stop = False

    def _judged_tripped(self) -> bool:
        deadline = self.channel.leg.timer.deadline
        expired = deadline is not None and self.rig.now >= deadline
        return self.channel.is_tripped or (expired and self.channel.watchdog_state.label == "running")

    @rule(action=st.sampled_from(_TELEGRAMS), identity=st.sampled_from(_IDENTITIES))
    def keep_alive_or_reset(self, action: Action, identity: Identity) -> None:
        was_tripped = self._judged_tripped()
        (outcome,) = self.rig.submit(action, identity)
        self._look()
        self._telegram(outcome, identity)
        if outcome.ok and action is Action.RESET_FAULT and was_tripped:
            self.needs_acknowledge = False
            self.needs_stop = True

    @rule(action=st.sampled_from(_STOPS), identity=st.sampled_from(_IDENTITIES))
    def stop(self, action: Action, identity: Identity) -> None:
        (outcome,) = self.rig.submit(action, identity)
        assert outcome.ok is (identity is not OBSERVER)
        self._look()
        if outcome.ok:
            self._telegram(outcome, identity)
            self.needs_stop = True
            assert not enables(self.rig.sent), "a stop is a stop"

    @rule(identity=st.sampled_from(_IDENTITIES), direction=st.sampled_from((0, 1, -1, 5)))
    def start(self, identity: Identity, direction: int) -> None:
        outcomes = self.rig.submit(Action.START, identity, direction=direction)
        self.pending.append(outcomes)
        self._look()
        if not outcomes or outcomes[0].ok:
            self.deadline = self.rig.now + self.channel.timeout_ms / 1000
            self.needs_stop = False  # Start is both: a word that does not enable, and a fresh enable

    @rule(identity=st.sampled_from(_IDENTITIES), ttl_ms=st.sampled_from((1000, 100, 0)))
    def take_control(self, identity: Identity, ttl_ms: int) -> None:
        owner = self.channel.owner
        (outcome,) = self.rig.submit(Action.TAKE_CONTROL, identity, ttl_ms=ttl_ms)
        self._look()
        if outcome.ok and not identity.is_same(owner):
            self.needs_stop = True

    @rule(identity=st.sampled_from(_IDENTITIES))
    def release_control(self, identity: Identity) -> None:
        self.rig.ask(Action.RELEASE_CONTROL, identity)
        self._look()

    @rule(timeout_ms=st.sampled_from((200, 300, 250)), identity=st.sampled_from(_IDENTITIES))
    def set_timeout(self, timeout_ms: int, identity: Identity) -> None:
        before = self.channel.timeout_ms
        outcome = self.rig.ask(Action.SET_TIMEOUT, identity, timeout_ms=timeout_ms)
        self._look()
        if outcome.ok and self.deadline is not None:
            self.deadline += (timeout_ms - before) / 1000

    @rule(word=st.sampled_from(_STATUS_WORDS))
    def drive_says(self, word: int) -> None:
        self.rig.drive_says(word)
        self._look()

    @rule(state=st.sampled_from(list(NodeState)))
    def node(self, state: NodeState) -> None:
        before = self.channel.link.node
        self.rig.node(state)
        self._look()
        if state is not before:
            self.needs_stop = True

    @rule(ms=st.sampled_from((1, 10, 50, 100, 150, 200, 500, 3000)))
    def wait(self, ms: int) -> None:
        end = self.rig.now + ms / 1000
        while self.rig.now < end:
            # Step by step, so that no short enabling word between two looks goes unseen.
            self.rig.wait(min(0.05, end - self.rig.now))
            self._look()
            self.nothing_enables_without_a_controller()

    @rule(ms=st.sampled_from((10, 150, 400)), word=st.sampled_from(_CONTROL_WORDS))
    def hang_and_find_a_telegram(self, ms: int, word: int) -> None:
        """The process hung; a telegram waited meanwhile and is read before any timer is judged."""
        self.rig.now += ms / 1000
        is_late = self.rig.watchdog == "running" and self._judged_tripped()
        trips = self.channel.trips
        self._write({"control_word": word, "setpoint_1": HALF_SPEED}, PLC)
        assert self.channel.trips == trips + is_late, "a telegram that waited does not save the drive"

    @rule(reverse=st.booleans(), ms=st.sampled_from((1, 100, 199)))
    def lead_to_operation(self, reverse: bool, ms: int) -> None:
        """What chance alone seldom finds: a drive that moves, and a while after the last telegram."""
        self.rig.node(NodeState.OPERATIONAL)
        if self.control == "lease":
            self.take_control(PLC, 1000)
        self._write({"control_word": SHUT_DOWN}, PLC)
        self._write({"control_word": ACKNOWLEDGE}, PLC)
        self._write({"control_word": SHUT_DOWN}, PLC)
        self.rig.drive_says(READY)
        self._write({"control_word": 0x147F if reverse else ENABLE, "setpoint_1": HALF_SPEED}, PLC)
        self.rig.drive_says(ENABLED)
        self.wait(ms)

    @rule()
    def bridge_gap(self) -> None:
        self.channel.on_bridge_gap(self.rig.now)
        self._look()
        self.needs_stop = True

    # what always holds

    @invariant()
    def nothing_enables_without_a_controller(self) -> None:
        """Called at the time it asked for, the channel sends no enabling word after the deadline."""
        self.channel.on_time(self.rig.now)
        self._look()
        if not self.rig.enables:
            return
        assert self.deadline is not None
        assert self.rig.now < self.deadline + _HUNG_S or self.reaction == "hold"
        assert self.channel.link.may_enable
        if self.reaction != "hold":
            assert not self.needs_acknowledge, "after a trip nothing moves before an acknowledge"
            assert not self.needs_stop, "and nothing before a word that does not enable"

    @invariant()
    def a_trip_is_shown_as_a_fault_beside_the_drives_own_word(self) -> None:
        channel = self.channel
        if channel.is_tripped:
            assert channel.status_word & 0b1001111 == 0b0001000
            assert channel.status_word & ~0b1001111 == channel.drive_status_word & ~0b1001111
            assert channel.served_state is DriveState.FAULT
            assert channel.current_fault == 10.3
        else:
            assert channel.status_word == channel.drive_status_word

    @invariant()
    def setpoints_go_with_an_enable_alone(self) -> None:
        if self.channel.is_tripped and self.reaction != "hold":
            assert self.rig.sent_setpoints == (0, 0, 0, 0)

    @invariant()
    def a_start_has_one_outcome(self) -> None:
        assert all(len(outcomes) <= 1 for outcomes in self.pending)

    @invariant()
    def the_channel_asks_for_later_times_only(self) -> None:
        deadline = self.channel.next_deadline(self.rig.now)
        assert deadline is None or deadline > self.rig.now

    def teardown(self) -> None:
        self.rig.wait(5)
        assert all(len(outcomes) == 1 for outcomes in self.pending), "every request has an outcome in the end"
        times = [event.time for event in self.rig.events]
        assert all(earlier <= later for earlier, later in pairwise(times))


@pytest.mark.landing(6)
@pytest.mark.parametrize(
    ("reaction", "control"),
    [
        ("disable_voltage", "modbus"),
        ("quick_stop", "modbus"),
        ("stop", "lease"),
        ("silence", "modbus"),
        ("hold", "modbus"),
        ("disable_voltage", "lease"),
    ],
)
def test_whatever_happens(reaction: str, control: str):
    class Profile(DriveByChance):
        pass

    Profile.reaction = reaction
    Profile.control = control
    Profile.__name__ = f"Drive_{reaction}_{control}"
    profile = settings(
        max_examples=examples(100),
        stateful_step_count=50,
        deadline=None,
        derandomize=True,
        database=None,
        suppress_health_check=list(HealthCheck),
    )
    run_state_machine_as_test(Profile, settings=profile)
