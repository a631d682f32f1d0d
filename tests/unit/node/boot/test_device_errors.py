"""A slave that keeps an error and refuses to start: it is shown, and its communication is reset once, never
while one of its drives may be running."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.canopen.frame import Frame
from bridge.command import Action, EventKind, Identity, Outcome, Request, Role, Source, Start
from bridge.command.drive_link import NodeState
from bridge.mapping import load_family
from bridge.node.boot import BootMemory
from bridge.sim.catalogue import simulate_node
from tests.support.bench import PLC, Bench
from tests.support.latching_slave import LatchingSlave
from tests.unit.node.test_booting import SOME, is_running, site

FAN = "cia402/profile-velocity"
RESET_NODE, RESET_COMMUNICATION, STOP = 0x81, 0x82, 0x02
LONG_SYNC = Frame(0x80, b"\0\0")
ENGINEER = Identity(Source.LOCAL, "test", Role.ENGINEER)
ERRORS = "n/node/device_errors"
SAID = "1001h is 11h (generic error, communication), 1003h: 8240h unexpected length of SYNC"


BUS = "sync_period_ms = 50\ndeadman_ms = 500"
"""Few frames: a second of the bench costs less."""


class LatchingBench(Bench):
    """Notes whether a drive was running when the node's communication was reset."""

    def __init__(self, folder: Path, mapping: str, *codes: int, node: str = "", **more: Any) -> None:
        self.running_at_reset: list[bool] = []
        self.slave = LatchingSlave(simulate_node(mapping, 5, {}), *codes)
        whole = site(folder, mapping, node=node, bus=BUS)
        super().__init__(whole, family=load_family(mapping), mapping=mapping, node=self.slave, **more)

    def _from_master(self, frame: Frame) -> None:
        if frame.can_id == 0 and frame.data[0] == RESET_COMMUNICATION:
            self.running_at_reset.append(is_running(self.slave.node))
        super()._from_master(frame)

    def disturb(self) -> None:
        """Somebody else sends one SYNC of two bytes."""
        self.slave.on_frame(LONG_SYNC, self.now)

    @property
    def state(self) -> NodeState:
        return self.network.nodes[0].state

    def nmt(self, *commands: int) -> list[int]:
        return [frame.data[0] for frame in self.sent(0) if frame.data[0] in commands]

    def told(self, text: str) -> list[str]:
        return [event.message for event in self.events if text in event.message]


def begin(bench: LatchingBench) -> None:
    """The first drive runs."""
    bench.run(2.5)
    (name, *_) = bench.plant.drives
    outcomes: list[Outcome] = []
    bench.view.submit(Request(PLC, name, Start()), outcomes.append)
    bench.run(1.0)
    assert [outcome.ok for outcome in outcomes] == [True], outcomes
    assert is_running(bench.slave.node)
    bench.log.clear()


def test_it_is_back_by_itself_after_one_reset(tmp_path: Path) -> None:
    bench = LatchingBench(tmp_path, FAN)
    begin(bench)
    bench.disturb()
    bench.run(3.0)
    assert bench.state is NodeState.CONFIG_ERROR
    assert SAID in str(bench.value("n/node/boot_status")), "why it did not start"
    assert bench.value(ERRORS) == SAID
    bench.run(10.0)
    assert bench.state is NodeState.OPERATIONAL
    assert bench.nmt(STOP, RESET_COMMUNICATION, RESET_NODE) == [STOP, RESET_COMMUNICATION], "stopped first"
    assert bench.running_at_reset == [False]
    assert bench.value(ERRORS) == ""
    assert len(bench.told(f"the node says: {SAID}")) == 1
    assert len(bench.told("reset communication by the bridge, once")) == 1
    [kind] = [event.kind for event in bench.events if "reset communication by the bridge" in event.message]
    assert kind is EventKind.CONFIGURATION, "nobody has taken the drive"


def test_one_that_goes_on_refusing_is_reset_once(tmp_path: Path) -> None:
    bench = LatchingBench(tmp_path, FAN, 0x8240, 0x8240, 0x8240)
    begin(bench)
    bench.disturb()
    bench.run(40.0)
    assert bench.state is NodeState.CONFIG_ERROR
    assert bench.nmt(RESET_COMMUNICATION, RESET_NODE) == [RESET_COMMUNICATION]
    assert len(bench.told("reset communication by the bridge, once")) == 1
    assert SAID in str(bench.value("n/node/boot_status"))


def test_each_error_in_a_row_is_tried_once_and_not_for_ever(tmp_path: Path) -> None:
    bench = LatchingBench(tmp_path, FAN, 0x8110, 0x8240, 0x8120, *range(0x8130, 0x8140))
    begin(bench)
    bench.disturb()
    bench.run(40.0)
    assert bench.nmt(RESET_COMMUNICATION) == [RESET_COMMUNICATION] * 2, "8240h had its turn"


def test_ever_new_errors_are_no_reason_for_ever_new_resets(tmp_path: Path) -> None:
    bench = LatchingBench(tmp_path, FAN, *range(0x8100, 0x8180))
    begin(bench)
    bench.disturb()
    bench.run(40.0)
    assert bench.nmt(RESET_COMMUNICATION) == [RESET_COMMUNICATION] * 3


def test_an_error_that_comes_again_after_the_node_was_in_operation_is_another_one(tmp_path: Path) -> None:
    bench = LatchingBench(tmp_path, FAN)
    begin(bench)
    for times in (1, 2):
        bench.disturb()
        bench.run(15.0)
        assert bench.state is NodeState.OPERATIONAL
        assert bench.nmt(RESET_COMMUNICATION) == [RESET_COMMUNICATION] * times


@pytest.mark.landing
def test_an_operators_reset_begins_anew(tmp_path: Path) -> None:
    bench = LatchingBench(tmp_path, FAN, 0x8240, 0x8240, 0x8240)
    begin(bench)
    bench.disturb()
    bench.run(30.0)
    assert bench.nmt(RESET_COMMUNICATION) == [RESET_COMMUNICATION]
    assert bench.ask(Action.RESET_COMMUNICATION, "n", ENGINEER).ok
    bench.run(30.0)
    assert bench.nmt(RESET_COMMUNICATION) == [RESET_COMMUNICATION] * 3, "the operator's, and one more"


def test_the_site_file_may_have_it_reported_only(tmp_path: Path) -> None:
    bench = LatchingBench(tmp_path, FAN, node='on_failed_start = "report"')
    begin(bench)
    bench.disturb()
    bench.run(25.0)
    assert bench.state is NodeState.CONFIG_ERROR
    assert not bench.nmt(RESET_COMMUNICATION, RESET_NODE)
    assert bench.value(ERRORS) == SAID


def test_a_node_of_which_nobody_knows_whether_it_stands_is_not_reset(tmp_path: Path) -> None:
    """No boot-up message, and no word of being in Stopped: its heartbeat is not heard."""
    bench = LatchingBench(tmp_path, FAN)
    begin(bench)
    bench.disturb()
    bench.run(1.0)
    bench.network.nodes[0].leaving.on_state = lambda state, now: None  # type: ignore[method-assign]
    bench.run(25.0)
    assert not bench.nmt(RESET_COMMUNICATION)


def test_a_start_that_the_node_follows_is_no_reason_whatever_it_says_of_errors(tmp_path: Path) -> None:
    """A drive in fault has an error in 1001h, and is started."""
    bench = LatchingBench(tmp_path, FAN)
    bench.slave.latched = 0x2310
    bench.slave.history = [0x2310]
    bench.slave.register = 0x03
    refuses = bench.slave.on_frame

    def follows(frame: Frame, now: float) -> None:
        is_start = frame.can_id == 0 and frame.data[0] == 0x01
        (bench.slave.node.on_frame if is_start else refuses)(frame, now)

    bench.slave.on_frame = follows
    bench.run(5.0)
    assert bench.state is NodeState.OPERATIONAL
    errors = "1001h is 03h (generic error, current), 1003h: 2310h continuous overcurrent, output"
    assert bench.value(ERRORS) == errors
    assert not bench.nmt(RESET_COMMUNICATION, RESET_NODE)


@pytest.mark.landing(4)
@pytest.mark.parametrize("codes", [(), (0x8240,) * 9], ids=["once", "for good"])
@pytest.mark.parametrize("mapping", SOME)
def test_no_family_is_reset_while_a_drive_is_running(
    tmp_path: Path, mapping: str, codes: tuple[int, ...]
) -> None:
    bench = LatchingBench(tmp_path, mapping, *codes)
    begin(bench)
    begun = bench.now
    bench.disturb()
    bench.run(25.0)
    assert not any(bench.running_at_reset)
    assert len(bench.running_at_reset) <= 1
    assert (bench.state is NodeState.OPERATIONAL) is not bool(codes)
    stops = [frame.time for frame in bench.sent(0) if frame.data[0] in (STOP, RESET_NODE)]
    first = next(at for at in stops if at > begun)
    resets = [frame.time for frame in bench.sent(0) if frame.data[0] == RESET_COMMUNICATION]
    assert all(at > first for at in resets), "it was told to stop before"


def test_a_bridge_that_is_started_anew_stops_the_drive_first(tmp_path: Path) -> None:
    """The bridge is killed while the drive runs; the node latches its error, and a new bridge comes."""
    old = LatchingBench(tmp_path, FAN)
    begin(old)
    new = LatchingBench(tmp_path, FAN, present=False, begin_s=old.now)
    new.slave, new.node, new.powered = old.slave, old.node, True
    new.disturb()
    new.run(20.0)
    assert new.running_at_reset == [False]
    assert new.state is NodeState.OPERATIONAL


def test_of_a_node_that_was_stopped_meanwhile_one_start_is_enough(tmp_path: Path) -> None:
    """By an operator, or because somebody else has sent SYNC (``on_intruder``): nothing is tried before."""
    bench = LatchingBench(tmp_path, FAN)
    begin(bench)
    bench.disturb()
    assert bench.ask(Action.STOP_NODE, "n", ENGINEER).ok
    bench.run(30.0)
    assert bench.state is NodeState.STOPPED
    assert not bench.nmt(RESET_COMMUNICATION, RESET_NODE)
    assert bench.ask(Action.START_NODE, "n", ENGINEER).ok
    bench.run(15.0)
    assert bench.state is NodeState.OPERATIONAL
    assert bench.running_at_reset == [False]


EVENTS = ("disturb", "start the drive", "unplug", "plug", "power cycle", "stop the node", "start the node")


happenings = st.tuples(st.sampled_from(EVENTS), st.sampled_from((0.2, 2.5, 6.0)))


@pytest.mark.landing
@given(st.lists(happenings, max_size=6), st.booleans())
@settings(max_examples=8)
def test_whatever_happens_no_running_drive_is_reset_and_none_twice_for_one_error(
    tmp_path_factory: pytest.TempPathFactory, events: list[tuple[str, float]], goes_on: bool
) -> None:
    folder = tmp_path_factory.mktemp("site")
    bench = LatchingBench(folder, FAN, *((0x8240,) * 20 if goes_on else ()))
    bench.run(2.5)
    seen: list[str] = []
    was = bench.state
    for event, seconds in [*events, ("disturb", 12.0)]:
        happen(bench, event)
        if event == "power cycle":
            seen.append(event)
        until = bench.now + seconds
        while bench.now < until:
            bench.run(0.2)
            seen += ["reset"] * (len(bench.running_at_reset) - seen.count("reset"))
            if bench.state is NodeState.OPERATIONAL and was is not NodeState.OPERATIONAL:
                seen.append("operational")
            was = bench.state
    assert not any(bench.running_at_reset)
    assert all(pair != ("reset", "reset") for pair in itertools.pairwise(seen)), seen


def happen(bench: LatchingBench, event: str) -> None:
    match event:
        case "disturb":
            bench.disturb()
        case "start the drive":
            bench.view.submit(Request(PLC, "n/drive", Start()), lambda outcome: None)
        case "unplug" | "plug":
            bench.cut = event == "unplug"
        case "power cycle":
            bench.slave.latched = 0
            bench.slave.power_cycle()
        case _:
            action = Action.STOP_NODE if event == "stop the node" else Action.START_NODE
            bench.ask(action, "n", ENGINEER)


@pytest.mark.parametrize("may_run", [False, True])
@pytest.mark.parametrize("is_at_rest", [False, True])
@pytest.mark.parametrize("did_not_start", [False, True])
def test_the_rule(may_run: bool, is_at_rest: bool, did_not_start: bool) -> None:
    memory = BootMemory(may_run=may_run, is_at_rest=is_at_rest, did_not_start=did_not_start)
    allowed = did_not_start and (is_at_rest or not may_run)
    assert memory.may_reset_for((0x11, 0x8240)) is allowed
    memory.note_reset((0x11, 0x8240))
    memory.did_not_start = did_not_start
    assert not memory.may_reset_for((0x11, 0x8240))
    assert memory.may_reset_for((0x11, 0x8130)) is allowed
