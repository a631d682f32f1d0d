"""What the points say at the moment at which a command is answered with ok: what the command has done.

Each method and each writable point of a drive, a node, its outputs and a bus is in one of the tables. What a
front shows then is what the bus process shows (``tests/unit/mirror/test_client.py``).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path

import pytest

from bridge.command import Action, Command, Identity, Outcome, Request, Role, Source, Start, command_of
from bridge.command.messages.request import SetTimeout, TakeControl, Write, WriteParameter
from bridge.config import load_site
from bridge.image import Quality, Reading, Value
from bridge.northbound.opcua.space.nodes import MethodNode, ObjectNode, layout
from tests.support import sites
from tests.support.bench import Bench
from tests.support.devices import IO_BLOCK, OUTPUTS, device_bench, io_block
from tests.support.rig import ENABLE, SHUT_DOWN

EVE = Identity(Source.OPCUA, "eve", Role.ENGINEER)
FU1, NODE, BUS, BLOCK = "conveyor/fu1", "conveyor", "bus/can0", "shaft"
LONGEST_S = 5.0
HALF = 0x2000


@dataclass
class Shown:
    """All points at the moment of an outcome, and the outcome."""

    outcome: Outcome
    readings: Mapping[str, Reading]
    states: Mapping[str, Mapping[Value, str]]

    def __getitem__(self, name: str) -> Value:
        """The value, of an enumeration its text."""
        value = self.readings[name].value
        return self.states[name].get(value, value)


class Hall:
    """A bench with a client; ``done`` is what it has commanded."""

    def __init__(self, bench: Bench) -> None:
        self.bench = bench
        self.points = bench.plant.image.points
        self._states = {point.name: dict(point.states) for point in self.points}

    def _readings(self, target: str) -> Mapping[str, Reading]:
        # As a server does before it reads, and the mirror before it answers.
        if f"{target}/supervision/telegrams" in self.bench.plant.image.index:
            self.bench.view.look(target)
        return {point.name: self.bench.plant.image.read(point.name) for point in self.points}

    def now(self, name: str) -> Value:
        return self.bench.plant.image.read(name).value

    def quality(self, name: str) -> Quality:
        return self.bench.plant.image.read(name).quality

    def do(self, command: Command, target: str = FU1) -> Shown:
        found: list[Shown] = []

        def reply(outcome: Outcome) -> None:
            found.append(Shown(outcome, self._readings(target), self._states))

        self.bench.view.submit(Request(EVE, target, command), reply)
        until = self.bench.now + LONGEST_S
        while not found and self.bench.now < until:
            self.bench.run(0.01)
        (shown,) = found
        assert shown.outcome.ok, shown.outcome
        return shown

    def act(self, action: Action, target: str = FU1) -> Shown:
        return self.do(command_of(action), target)

    def write(self, target: str = FU1, **values: Value) -> Shown:
        return self.do(Write(values), target)

    def run(self) -> None:
        """Lead the drive to operation enabled."""
        self.write(control_word=SHUT_DOWN)
        self.bench.run(0.1)
        assert self.do(Start())[f"{FU1}/status/state"] == "operation_enabled"

    def trip(self, target: str) -> None:
        self.bench.run(2.0)
        assert self._readings(target)[f"{target}/supervision/trips"].value == 1


@pytest.fixture
def hall(tmp_path: Path) -> Hall:
    drive = sites.drive("fu1", "lease", 300, f"fieldbus_timeout_writable = true\n{sites.SCALED}")
    site = load_site(sites.write(tmp_path, sites.bus(sites.node(drive)), sites.modbus()))
    bench = Bench(site)
    bench.run(3.0)
    hall = Hall(bench)
    hall.do(TakeControl(ttl_ms=600_000))
    return hall


@pytest.fixture
def block(tmp_path: Path) -> Hall:
    bench = device_bench(tmp_path, io_block(), IO_BLOCK, OUTPUTS.replace('"modbus"', '"lease"'))
    bench.run(2.0)
    return Hall(bench)


# a drive


def taken(hall: Hall) -> None:
    hall.act(Action.RELEASE_CONTROL)
    shown = hall.do(TakeControl(ttl_ms=5000))
    assert shown[f"{FU1}/supervision/owner"] == "opcua:eve"


def released(hall: Hall) -> None:
    hall.run()
    shown = hall.act(Action.RELEASE_CONTROL)
    assert shown[f"{FU1}/supervision/owner"] == ""
    is_stopped(shown)


def started(hall: Hall) -> None:
    hall.run()
    assert enables(hall.now(f"{FU1}/supervision/sent_control_word"))


def stopped_by(action: Action) -> Callable[[Hall], None]:
    def stopped(hall: Hall) -> None:
        hall.run()
        is_stopped(hall.act(action))

    return stopped


def kept_alive(hall: Hall) -> None:
    before = hall.act(Action.KEEP_ALIVE)[f"{FU1}/supervision/telegrams"]
    hall.bench.run(0.1)
    shown = hall.act(Action.KEEP_ALIVE)
    assert isinstance(before, int)
    assert shown[f"{FU1}/supervision/telegrams"] == before + 1
    assert shown[f"{FU1}/supervision/watchdog_left_ms"] == hall.now(f"{FU1}/supervision/fieldbus_timeout_ms")


def acknowledged(hall: Hall) -> None:
    hall.run()
    hall.trip(FU1)
    shown = hall.act(Action.RESET_FAULT)
    assert shown[f"{FU1}/supervision/watchdog_state"] != "tripped"
    assert shown[f"{FU1}/status/state"] != "fault"


def parameter_read(hall: Hall) -> None:
    for name in writable(hall, FU1, "parameter"):
        shown = hall.do(command_of(Action.READ_PARAMETER, name.removeprefix(f"{FU1}/parameter/")))
        reading = shown.readings[name]
        assert (reading.value, reading.quality) == (shown.outcome.value, Quality.GOOD), name


def parameter_written(hall: Hall) -> None:
    for name in writable(hall, FU1, "parameter"):
        leaf, value = name.removeprefix(f"{FU1}/parameter/"), another(hall, name)
        shown = hall.do(WriteParameter(leaf, value))
        assert shown.outcome.value == pytest.approx(value, rel=0.01), name
        assert shown.readings[name].value == shown.outcome.value, name


def saved(hall: Hall) -> None:
    """Nothing but that the drive has not refused it."""
    assert hall.act(Action.SAVE_PARAMETERS)[f"{FU1}/supervision/sdo_abort_code"] == 0


METHODS: Mapping[Action, Callable[[Hall], None]] = {
    Action.TAKE_CONTROL: taken,
    Action.RELEASE_CONTROL: released,
    Action.START: started,
    Action.STOP: stopped_by(Action.STOP),
    Action.QUICK_STOP: stopped_by(Action.QUICK_STOP),
    Action.DISABLE_VOLTAGE: stopped_by(Action.DISABLE_VOLTAGE),
    Action.KEEP_ALIVE: kept_alive,
    Action.RESET_FAULT: acknowledged,
    Action.READ_PARAMETER: parameter_read,
    Action.WRITE_PARAMETER: parameter_written,
    Action.SAVE_PARAMETERS: saved,
}


@pytest.mark.landing(11)
@pytest.mark.parametrize("method", METHODS)
def test_a_method_of_a_drive(hall: Hall, method: Action) -> None:
    METHODS[method](hall)


def test_each_writable_point_of_the_command_group(hall: Hall) -> None:
    hall.write(control_word=SHUT_DOWN)
    assert hall.write(control_word=ENABLE, setpoint_1=HALF)[f"{FU1}/supervision/sent_control_word"] == ENABLE
    served = [one for one in writable(hall, FU1, "command") if hall.quality(one) is Quality.GOOD]
    assert len(served) > 3
    for name in served:
        leaf, value = name.removeprefix(f"{FU1}/command/"), another(hall, name)
        value = SHUT_DOWN if leaf == "control_word" else value
        shown = hall.write(**{"control_word": ENABLE, leaf: value})
        assert shown[name] == pytest.approx(value, rel=1e-3), name
        assert shown.readings[name].quality is Quality.GOOD


def test_the_time_out_of_a_drive(hall: Hall) -> None:
    (name,) = writable(hall, FU1, "supervision")
    assert hall.do(SetTimeout(450))[name] == 450


# a node and a bus

AFTERWARDS: Mapping[Action, str] = {
    Action.RESET: "lost",
    Action.RESET_COMMUNICATION: "lost",
    Action.STOP_NODE: "stopped",
    Action.ENTER_PRE_OPERATIONAL: "stopped",
    Action.DISABLE: "disabled",
}
OF_BUSES = tuple(action for action in AFTERWARDS if action is not Action.DISABLE)
PLACES = [*((NODE, action) for action in AFTERWARDS), *((BUS, action) for action in OF_BUSES)]


@pytest.mark.landing(9)
@pytest.mark.parametrize(("target", "action"), PLACES)
def test_a_command_to_a_node_in_operation(hall: Hall, target: str, action: Action) -> None:
    hall.run()
    shown = hall.act(action, target)
    assert shown[f"{NODE}/node/state"] == AFTERWARDS[action]
    assert shown.readings[f"{FU1}/status/state"].quality is not Quality.GOOD
    assert not enables(shown[f"{FU1}/supervision/sent_control_word"])


@pytest.mark.landing(2)
@pytest.mark.parametrize("target", [NODE, BUS])
def test_a_node_that_is_started_is_booted(hall: Hall, target: str) -> None:
    hall.act(Action.STOP_NODE, NODE)
    assert hall.act(Action.START_NODE, target)[f"{NODE}/node/state"] == "booting"
    hall.bench.run(3.0)
    assert hall.act(Action.START_NODE, target)[f"{NODE}/node/state"] == "operational"


def test_a_node_that_is_put_in_service_is_not_disabled_any_more(hall: Hall) -> None:
    hall.act(Action.DISABLE, NODE)
    assert hall.act(Action.ENABLE, NODE)[f"{NODE}/node/state"] == "absent"


# outputs


def test_the_methods_of_outputs(block: Hall) -> None:
    for action in OF_OUTPUTS:
        OF_OUTPUTS[action](block)


def outputs_taken(block: Hall) -> None:
    assert block.do(TakeControl(ttl_ms=600_000), BLOCK)[f"{BLOCK}/supervision/owner"] == "opcua:eve"


def outputs_written(block: Hall) -> None:
    block.write(BLOCK, valves=0)
    for name in writable(block, BLOCK, "output"):
        leaf, value = name.removeprefix(f"{BLOCK}/output/"), another(block, name)
        shown = block.write(BLOCK, **{leaf: value})
        assert shown.outcome.forwarded
        assert shown[name] == pytest.approx(value), name


def outputs_kept_alive(block: Hall) -> None:
    before = block.act(Action.KEEP_ALIVE, BLOCK)[f"{BLOCK}/supervision/telegrams"]
    assert isinstance(before, int)
    assert block.act(Action.KEEP_ALIVE, BLOCK)[f"{BLOCK}/supervision/telegrams"] == before + 1


def outputs_stopped(block: Hall) -> None:
    outputs_written(block)
    is_safe(block.act(Action.STOP, BLOCK))


def outputs_acknowledged(block: Hall) -> None:
    block.trip(BLOCK)
    assert block.act(Action.RESET_FAULT, BLOCK)[f"{BLOCK}/supervision/watchdog_state"] != "tripped"


def outputs_released(block: Hall) -> None:
    outputs_written(block)
    shown = block.act(Action.RELEASE_CONTROL, BLOCK)
    assert shown[f"{BLOCK}/supervision/owner"] == ""
    is_safe(shown)


OF_OUTPUTS: Mapping[Action, Callable[[Hall], None]] = {
    Action.TAKE_CONTROL: outputs_taken,
    Action.KEEP_ALIVE: outputs_kept_alive,
    Action.STOP: outputs_stopped,
    Action.RESET_FAULT: outputs_acknowledged,
    Action.RELEASE_CONTROL: outputs_released,
}


# nothing is left out


def methods(above: ObjectNode) -> Iterable[MethodNode]:
    yield from above.methods
    for below in above.objects:
        yield from methods(below)


def test_no_method_and_no_writable_point_is_left_out(hall: Hall, block: Hall) -> None:
    of_nodes = {*AFTERWARDS, Action.START_NODE, Action.ENABLE}
    of_a_device = {*OF_OUTPUTS, *of_nodes, *(action for action in METHODS if "parameter" in action)}
    tried = {
        FU1: set(METHODS),
        NODE: of_nodes,
        BUS: {*OF_BUSES, Action.START_NODE},
        BLOCK: of_a_device,
    }
    for one in (hall, block):
        for tree in layout(one.points):
            for method in methods(tree):
                assert method.action in tried[method.target], method.id
        groups = {tuple(point.name.split("/")[:-1]) for point in one.points if point.writable}
        known = {(*FU1.split("/"), group) for group in ("command", "parameter", "supervision")}
        assert groups <= known | {(BLOCK, "output")}, groups


# what is written and what is seen


def enables(word: Value) -> bool:
    """Bits 0 … 3 of CiA 402's and NORD's control word (BU 2500 §6.8)."""
    assert isinstance(word, int)
    return word & 0xF == 0xF


def is_stopped(shown: Shown) -> None:
    word = shown[f"{FU1}/supervision/sent_control_word"]
    assert not enables(word)
    assert shown[f"{FU1}/command/control_word"] == word


def is_safe(shown: Shown) -> None:
    """``IO_BLOCK``: the lamp holds what it has."""
    assert (shown[f"{BLOCK}/output/valves"], shown[f"{BLOCK}/output/speed"]) == (0, 5.0)


def writable(hall: Hall, target: str, group: str) -> list[str]:
    return [one.name for one in hall.points if one.writable and one.name.startswith(f"{target}/{group}/")]


def another(hall: Hall, name: str) -> Value:
    """A value that the point may have and has not."""
    (point,) = (one for one in hall.points if one.name == name)
    before = hall.now(name)
    if point.states:
        return next(code for code, _ in point.states if code != before)
    if isinstance(before, bool):
        return not before
    assert isinstance(before, int | float)
    low = point.low if point.low is not None else 0
    high = point.high if point.high is not None else 100
    step = 1 if isinstance(before, int) else (high - low) / 100
    return before + step if before + step <= high else before - step
