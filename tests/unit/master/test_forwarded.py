"""An answer says *forwarded* if and only if the bus says what was asked (shared design, watchdog): judged by
the frames on the wire, in every state of the node, of its bus and of this bridge."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import pytest

from bridge.can.interface import ControllerState
from bridge.canopen.frame import Frame
from bridge.command import Action, Code, Identity, Outcome, Request, Role, Source, command_of
from bridge.command.drive_link import NodeState
from bridge.command.messages.request import STOP_ACTIONS
from bridge.image import Value
from bridge.master.standby import Standby
from bridge.sim.stoeber.stoeber_5000 import Stoeber5000
from bridge.text import as_json
from tests.support.bench import Bench, write_site
from tests.support.devices import IO_BLOCK, OUTPUTS, device_bench, io_block
from tests.support.nightly import by_night
from tests.unit.node.test_stoeber_posi import DRIVE as LIFT
from tests.unit.node.test_stoeber_posi import bench_with

OTHER: Final = Identity(Source.OPCUA, "ann", Role.ENGINEER)
TWIN: Final = Frame(0x77F, b"\x05")
"""A second bridge with the same site file says that it is operational."""
LISTENS_S: Final = 0.2
RPDO: Final = {"conveyor/fu1": 0x205, "shaft": 0x214}
"""NORD: BU 2500 §6.5; the block: its first RPDO, CiA 301 §7.5.2.35."""
WINDOW_S: Final = 0.06
"""Several RPDO periods."""
STOPPED, RUN, ACKNOWLEDGE_BIT = 0x047E, 0x047F, 0x80


@dataclass(frozen=True)
class Asked:
    """A request, and whether words of an RPDO say what it asks."""

    name: str
    ask: Callable[[Bench], Outcome]
    is_said: Callable[[bytes], bool]


def word_of(data: bytes) -> int:
    return int.from_bytes(data[:2], "little")


def _write(target: str, **values: Value) -> Callable[[Bench], Outcome]:
    return lambda bench: bench.ask(Action.WRITE, target, values=values)


def _stop(target: str, action: Action) -> Callable[[Bench], Outcome]:
    return lambda bench: bench.ask(action, target, OTHER)


def _of_a_drive(target: str) -> Iterator[Asked]:
    for action in sorted(STOP_ACTIONS):
        yield Asked(action, _stop(target, action), lambda data: word_of(data) & 7 < 7)
    stopped, run = (_write(target, control_word=word) for word in (STOPPED, RUN))
    yield Asked("a word that stops", stopped, lambda data: word_of(data) == STOPPED)
    yield Asked("a setpoint", _write(target, setpoint_1=0x1234), lambda data: data[2:4] == b"\x34\x12")
    yield Asked("a word that enables", run, lambda data: word_of(data) == RUN)
    yield Asked(
        "reset_fault",
        lambda bench: bench.ask(Action.RESET_FAULT, target),
        lambda data: bool(word_of(data) & ACKNOWLEDGE_BIT),
    )


def _of_outputs(target: str) -> Iterator[Asked]:
    for action in sorted(STOP_ACTIONS):
        yield Asked(action, _stop(target, action), lambda data: data == b"\0")
    yield Asked("safe values", _write(target, valves=0), lambda data: data == b"\0")
    yield Asked("active values", _write(target, valves=0x81), lambda data: data == b"\x81")


ASKED: Final = {"conveyor/fu1": [*_of_a_drive("conveyor/fu1")], "shaft": [*_of_outputs("shaft")]}
WRONG: Final = "identity = { vendor_id = 4711 }"


def bench_of(folder: Path, target: str, node: str = "", *, present: bool = True) -> Bench:
    """A NORD interface, or a block of outputs; ``node`` goes into its table."""
    if target == "shaft":
        bench = device_bench(folder, io_block(), IO_BLOCK, f"{node}\n{OUTPUTS}")
        bench.powered = present
        return bench
    return Bench(write_site(folder, node=node), present=present)


# states of the node


def operational(folder: Path, target: str) -> Bench:
    bench = bench_of(folder, target)
    bench.run(2.0)
    return bench


def not_seen(folder: Path, target: str) -> Bench:
    bench = bench_of(folder, target, present=False)
    bench.run(2.0)
    return bench


def booting(folder: Path, target: str) -> Bench:
    """It answers so slowly that its boot-up never ends."""
    bench = bench_of(folder, target)
    while bench.network.nodes[0].state is not NodeState.BOOTING:
        bench.run(0.001)
    bench.cut = True
    return bench


def lost(folder: Path, target: str) -> Bench:
    bench = operational(folder, target)
    bench.cut = True
    bench.run(1.5)
    return bench


def lost_before_its_boot_up_ended(folder: Path, target: str) -> Bench:
    bench = booting(folder, target)
    while bench.network.nodes[0].state is NodeState.BOOTING:
        bench.run(0.1)
    return bench


def told(action: Action) -> Callable[[Path, str], Bench]:
    def bench(folder: Path, target: str) -> Bench:
        bench = operational(folder, target)
        assert bench.ask(action, target.partition("/")[0], OTHER).ok
        return bench

    return bench


def off_by_the_site(folder: Path, target: str) -> Bench:
    bench = bench_of(folder, target, "enabled = false")
    bench.run(1.0)
    return bench


def another_device(folder: Path, target: str) -> Bench:
    bench = bench_of(folder, target, WRONG)
    bench.run(2.0)
    return bench


NODES: Final[dict[str, tuple[NodeState, Callable[[Path, str], Bench]]]] = {
    "operational": (NodeState.OPERATIONAL, operational),
    "not seen": (NodeState.ABSENT, not_seen),
    "booting": (NodeState.BOOTING, booting),
    "lost": (NodeState.LOST, lost),
    "lost before its boot-up ended": (NodeState.LOST, lost_before_its_boot_up_ended),
    "stopped": (NodeState.STOPPED, told(Action.STOP_NODE)),
    "pre-operational": (NodeState.STOPPED, told(Action.ENTER_PRE_OPERATIONAL)),
    "reset": (NodeState.LOST, told(Action.RESET)),
    "switched off": (NodeState.DISABLED, told(Action.DISABLE)),
    "off by the site": (NodeState.DISABLED, off_by_the_site),
    "another device": (NodeState.CONFIG_ERROR, another_device),
}


# states of the bus, and of this bridge on it


def in_order(bench: Bench) -> None: ...


def _goes(state: ControllerState) -> Callable[[Bench], None]:
    def goes(bench: Bench) -> None:
        bench.bus.status.state = state
        bench.bus.clear()
        bench.run(0.0)

    return goes


def back(bench: Bench) -> None:
    _goes(ControllerState.DOWN)(bench)
    bench.run(0.05)
    bench.bus.status.state = ControllerState.OK
    bench.run(0.04)


def another_bridge_is_in_charge(bench: Bench) -> None:
    bench.network.mastership._listening.listen_s = LISTENS_S
    bench.hang(0.15)
    bench.receive(TWIN)
    bench.run(0.02)
    assert bench.network.mastership.is_passive


def it_comes_back_to_the_bus(bench: Bench) -> None:
    """The other bridge has fallen silent."""
    another_bridge_is_in_charge(bench)
    while bench.network.mastership.is_passive:
        bench.run(0.01)


BUSES: Final[dict[str, Callable[[Bench], None]]] = {
    "in order": in_order,
    "down": _goes(ControllerState.DOWN),
    "bus-off": _goes(ControllerState.BUS_OFF),
    "back": back,
    "another bridge is in charge": another_bridge_is_in_charge,
    "it comes back to the bus": it_comes_back_to_the_bus,
}


def ask(bench: Bench, target: str, asked: Asked) -> tuple[Outcome, bool]:
    """Its outcome, and whether the bus repeats what it asks, while the node's state is one and the same."""
    core, begin = bench.network.nodes[0], len(bench.log)
    state = core.state
    if bench.network.mastership.is_passive:
        bench.receive(TWIN)
    outcome = asked.ask(bench)
    bench.run(WINDOW_S)
    if core.state is not state:
        return ask(bench, target, asked)
    sent = [frame for frame in bench.log[begin:] if frame.can_id == RPDO[target]]
    # One frame may be the stopped words of a boot-up.
    return outcome, sum(asked.is_said(frame.data) for frame in sent) >= 2


@pytest.mark.landing(14)
@pytest.mark.parametrize(("target", "node", "bus"), by_night(itertools.product(RPDO, NODES, BUSES), 4))
def test_an_answer_says_forwarded_where_the_bus_says_what_was_asked(
    tmp_path: Path, target: str, node: str, bus: str
) -> None:
    state, make = NODES[node]
    bench = make(tmp_path, target)
    assert bench.network.nodes[0].state is state
    BUSES[bus](bench)
    for asked in ASKED[target]:
        outcome, is_said = ask(bench, target, asked)
        assert outcome.code is Code.OK, asked.name
        assert outcome.forwarded is is_said, (asked.name, outcome.message)
        assert outcome.forwarded or outcome.message, asked.name
        assert not outcome.message or as_json(outcome.said), outcome.message


@pytest.mark.parametrize("target", RPDO)
def test_while_the_bridge_listens_at_its_start_nothing_is_forwarded(tmp_path: Path, target: str) -> None:
    bench = bench_of(tmp_path, target)
    bench.network.mastership._listening = Standby(LISTENS_S)
    bench.run(0.01)
    for asked in ASKED[target]:
        outcome = asked.ask(bench)
        assert not outcome.forwarded, asked.name
        if asked.name in STOP_ACTIONS:
            assert outcome.message == "on can0 the bridge listens before it begins"
    bench.run(3.0)
    assert ASKED[target][0].ask(bench) == Outcome(Code.OK)


def test_a_drive_whose_pdos_cannot_be_used_gets_no_stop_and_the_answer_says_why(tmp_path: Path) -> None:
    """STÖBER with another application: an RPDO without a part of the control word."""
    bench = bench_with(tmp_path, Stoeber5000(1))
    for action in STOP_ACTIONS:
        outcome = bench.ask(action, LIFT, OTHER)
        assert not outcome.forwarded
        assert outcome.message.startswith("no PDOs of the drive can be used: ")
    bench.log.clear()
    bench.run(WINDOW_S)
    plans = bench.network.nodes[0].wire.stop_words.plans(bench.plant.drives[LIFT])
    assert not [frame for frame in bench.log if frame.can_id in plans]


def test_an_answer_is_right_at_once_when_a_command_has_ended_the_words(tmp_path: Path) -> None:
    """Two requests of one telegram: no round comes between them."""
    bench = operational(tmp_path, "conveyor/fu1")
    replies: list[Outcome] = []
    for target, action in (("conveyor", Action.STOP_NODE), ("conveyor/fu1", Action.STOP)):
        request = Request(OTHER, target, command_of(action))
        bench.plant.submit(request, bench.now, replies.append, bench.master.carry_out)
    assert [outcome.forwarded for outcome in replies] == [True, False]
    assert "NMT stop was sent to it" in replies[1].message
