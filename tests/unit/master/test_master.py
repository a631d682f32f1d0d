"""Random frames, losses, boot-ups, commands and times against the master: it survives, stays small and
forgets no node that it supervises."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from typing import ClassVar

import pytest
from hypothesis import HealthCheck, Phase, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule, run_state_machine_as_test

from bridge.canopen.frame import Frame
from bridge.command import Action
from bridge.command.drive_link import NodeState
from bridge.command.messages.request import NODE_ACTIONS
from tests.support.nightly import examples
from tests.support.quick import Quick, quick_site

STEPS = examples(20_000, 1_000)
LONGEST_BACK_OFF_S = 301.0
MOST_EVENTS_A_SECOND = 100
NODES = (
    'mandatory = true\nstart_order = 1\non_loss = "restart"',
    'on_loss = "stop_all"\nstart_order = 2',
    'on_loss = "nothing"\nsupervision = "guarding"',
    'on_loss = "stop_node"\n[[bus.node.configure]]\nobject = "2097:01"\ntype = "uint16"\nvalue = 500',
    'supervision = "none"',
)
BUSES = ("", 'mandatory_missing = "hold_all"', 'mandatory_missing = "stop_all"\nreset_at_start = "node"')
ACTIONS = tuple(sorted(NODE_ACTIONS))
BASES = (0x000, 0x080, 0x180, 0x280, 0x580, 0x700)
HEADS = (
    b"",
    b"\0",
    b"\x05",
    b"\x7f",
    b"\x04",
    b"\x85",
    b"\x80",
    b"\x60",
    b"\x43",
    b"\x4f",
    b"\x41",
    b"\x01\x00",
)

ids = st.integers(1, len(NODES))
scripts = st.binary(min_size=400, max_size=480)


class MasterMachine(RuleBasedStateMachine):
    """``script`` is read in fours: what, which node, and two octets of detail."""

    steps: ClassVar[int] = 0
    rounds: ClassVar[int] = 0

    def __init__(self) -> None:
        super().__init__()
        with tempfile.TemporaryDirectory() as folder:
            bus = BUSES[MasterMachine.rounds % len(BUSES)]
            self.quick = Quick(quick_site(Path(folder), NODES, bus=bus))
        MasterMachine.rounds += 1
        self.loss = 0
        self.lost = 0
        self.quick.lose = self.is_lost
        self.quick.run(1.0)
        self.began = self.quick.now
        self.quick.events.clear()

    def is_lost(self, frame: Frame) -> bool:
        """Every n-th frame does not arrive."""
        self.lost += 1
        return self.loss > 0 and self.lost % self.loss == 0

    @rule(script=scripts)
    def play(self, script: bytes) -> None:
        for place in range(0, len(script) - 3, 4):
            self.move(*script[place : place + 4])

    @rule(node=ids, action=st.sampled_from(ACTIONS))
    def command(self, node: int, action: Action) -> None:
        MasterMachine.steps += 1
        self.quick.ask(action, f"n{node}")
        self.quick.run(0.01)

    @rule(action=st.sampled_from(ACTIONS))
    def command_all(self, action: Action) -> None:
        MasterMachine.steps += 1
        self.quick.ask(action, "bus/can0")
        self.quick.run(0.01)

    @rule(loss=st.integers(0, 9))
    def lose_frames(self, loss: int) -> None:
        self.loss = loss

    @rule(seconds=st.floats(0.0, 5.0))
    def wait(self, seconds: float) -> None:
        MasterMachine.steps += 1
        self.quick.run(seconds)

    def move(self, what: int, which: int, low: int, high: int) -> None:
        MasterMachine.steps += 1
        quick = self.quick
        node = quick.nodes[1 + which % len(NODES)]
        match what % 8:
            case 0 | 1:
                data = HEADS[low % len(HEADS)] + bytes((low, high, what, which))[: high % 9]
                quick.receive(Frame((BASES[high % len(BASES)] + which % 128) & 0x7FF, data[:8]))
                quick.round()
            case 2:
                node.present = not node.present
            case 3:
                if node.present:
                    node.start(quick.now)
                quick.round()
            case 4:
                quick.receive(Frame(0x700 + node.node_id, bytes((low,))))
            case 5:
                node.outbox.append(Frame(0x580 + node.node_id, bytes((0x43, low, 0x10, high)) + bytes(4)))
                quick.run(low / 5000)
            case 6 if low < 8:
                quick.network.bus_is_gone(quick.now)
                quick.run(0.05)
            case _:
                quick.run(low / 2000)

    @invariant()
    def every_supervised_node_has_a_deadline(self) -> None:
        quick = self.quick
        next_at = quick.network.next_deadline()
        for core in quick.network.nodes:
            if core.state is NodeState.OPERATIONAL and core.table.supervision != "none":
                deadline = core.error_control.next_deadline()
                assert deadline is not None, f"{core.node.name} is operational and nobody watches it"
                life_s = core.table.supervision_ms * core.table.life_time_factor / 1000
                assert deadline <= quick.now + life_s + 0.1
                assert next_at is not None and next_at <= deadline, "the timer comes too late for it"

    @invariant()
    def every_node_that_is_wanted_is_asked_again(self) -> None:
        for core in self.quick.network.nodes:
            gave_up = core.table.on_loss in ("stop_node", "nothing") and core.state is NodeState.LOST
            if core.is_out_of_service or core.state is NodeState.OPERATIONAL or gave_up:
                continue
            assert core.booting.is_running or core.boot_at is not None, f"{core.node.name} is forgotten"
            assert core.boot_at is None or core.boot_at <= self.quick.now + LONGEST_BACK_OFF_S

    @invariant()
    def nothing_grows(self) -> None:
        network = self.quick.network
        for core in network.nodes:
            assert all(channel.waiting <= 64 for channel in core.wire.sdo)
            assert len(core.wire.routes) + len(core.wire.services) <= 16
        assert network.waiting <= 100, "plans and frames that wait"
        self.quick.log.clear()

    def wait_for_all(self) -> None:
        """Nobody resets a node: only who was taken out of service, or was given up as its ``on_loss`` asks,
        is started; and who is not supervised, whose restart may have gone unseen, is reset, as is who says
        that it waits for that: a random frame was the answer to what was written into it."""
        quick = self.quick
        for core in quick.network.nodes:
            gave_up = core.table.on_loss in ("stop_node", "nothing") and core.state is NodeState.LOST
            if core.is_out_of_service or gave_up:
                quick.ask(Action.START_NODE, core.node.name)
            elif core.table.supervision == "none":
                quick.ask(Action.RESET, core.node.name)
        until = quick.now + LONGEST_BACK_OFF_S + 15.0
        while quick.states() != "ooooo" and quick.now < until:
            for number in quick.nodes:
                if "until the node restarts or is reset" in quick.status(number):
                    quick.ask(Action.RESET, f"n{number}")
            quick.run(5.0)

    def teardown(self) -> None:
        """Whatever was: with every node there and no operator's stop, all come into operation."""
        quick = self.quick
        self.loss = 0
        for number, node in quick.nodes.items():
            quick.ask(Action.ENABLE, f"n{number}")
            node.present = True
        if MasterMachine.rounds % 2:
            # An operator's reset waits for no back-off.
            for number in quick.nodes:
                quick.ask(Action.RESET, f"n{number}")
            quick.run(15.0)
        else:
            self.wait_for_all()
        assert quick.states() == "ooooo", {n: quick.status(n) for n in quick.nodes}
        elapsed_s = quick.now - self.began
        assert len(quick.events) <= MOST_EVENTS_A_SECOND * max(1.0, elapsed_s) + 20 * MasterMachine.steps


@pytest.mark.landing
def test_random_frames_losses_and_times() -> None:
    MasterMachine.steps = 0
    run_state_machine_as_test(
        MasterMachine,
        settings=settings(
            max_examples=examples(120),
            stateful_step_count=16,
            deadline=None,
            derandomize=True,
            # Shrinking a failure takes minutes: add Phase.shrink to look for a short one.
            phases=(Phase.generate,),
            suppress_health_check=list(HealthCheck),
        ),
    )
    assert MasterMachine.steps >= STEPS, f"only {MasterMachine.steps} steps"
    print(f"{MasterMachine.steps} steps", file=sys.stderr)
