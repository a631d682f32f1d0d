"""A node that is no drive: its inputs, and how good they are."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.canopen.frame import Frame
from bridge.command import (
    Action,
    Code,
    Command,
    Do,
    Identity,
    Outcome,
    ReadParameter,
    Request,
    Role,
    Source,
    Write,
    WriteParameter,
)
from bridge.command.device import InputPdo
from bridge.command.drive_link import REASONS, NodeState
from bridge.image import Quality, Reading
from bridge.mapping.entry_types import ObjectRef
from tests.support.bench import Bench
from tests.support.devices import ENCODER, IO_BLOCK, OUTPUTS, device_bench, encoder
from tests.support.node_states import node_goes
from tests.support.nodes import device_plant
from tests.support.rig import PLC
from tests.support.views import view_of

ENGINEER = Identity(Source.OPCUA, "eve", Role.ENGINEER)


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    bench = device_bench(tmp_path, encoder())
    bench.run(1.0)
    return bench


def point(bench: Bench, leaf: str) -> Reading:
    return bench.plant.image.read(f"shaft/{leaf}")


def test_what_its_tpdos_carry_is_shown(bench: Bench) -> None:
    assert str(bench.value("shaft/node/boot_status")).endswith("; no TPDO of the node carries 6030:01")
    assert bench.value("shaft/node/state") == 2
    assert point(bench, "input/position")[:2] == (-1.5, Quality.GOOD)
    assert point(bench, "input/alarms")[:2] == (0, Quality.GOOD)
    bench.node.put("6004:00", 4, 2500)
    bench.run(0.1)
    assert point(bench, "input/position").value == 2.5


def test_what_none_carries_is_not_good(bench: Bench) -> None:
    speed = point(bench, "input/speed")
    assert (speed.quality, speed.reason) == (Quality.CONFIG_ERROR, "no TPDO of the node carries 6030:01")


def test_a_tpdo_that_stays_away_makes_its_own_inputs_stale(bench: Bench) -> None:
    bench.deaf_to = frozenset({0x180 + 20})
    bench.run(1.0)
    position = point(bench, "input/position")
    assert (position.value, position.quality) == (-1.5, Quality.STALE)
    assert position.reason == "no TPDO1 from the node"
    assert point(bench, "input/alarms").quality is Quality.GOOD
    bench.deaf_to = frozenset()
    bench.run(0.3)
    assert point(bench, "input/position").quality is Quality.GOOD


def test_a_node_that_is_gone_is_lost_and_then_dead(bench: Bench) -> None:
    bench.cut = True
    bench.run(1.0)
    assert point(bench, "input/position").quality is Quality.LOST
    assert bench.value("shaft/node/state") == 3
    bench.run(2.0)
    assert point(bench, "input/position").quality is Quality.DEAD
    bench.cut = False
    bench.run(5.0)
    assert point(bench, "input/position").quality is Quality.GOOD


def test_its_inputs_are_lost_with_their_node_at_once(tmp_path: Path) -> None:
    """Before anybody looks, and before a TPDO is late."""
    plant = device_plant(tmp_path, ENCODER)
    node = plant.nodes["shaft"]
    (device,) = node.devices
    node_goes(plant, node, NodeState.OPERATIONAL, 10.0)
    device.on_pdos([InputPdo("TPDO1", (ObjectRef(0x6004, 0),), 0.25)], {}, 10.0)
    device.on_data(0, [2500], 10.125)
    node_goes(plant, node, NodeState.LOST, 10.25)
    position = plant.image.read("shaft/input/position")
    assert position == Reading(2.5, Quality.LOST, 10.25, REASONS[NodeState.LOST])


def test_who_looks_sees_the_times_of_its_outputs_at_that_moment(tmp_path: Path) -> None:
    plant = device_plant(tmp_path, IO_BLOCK, OUTPUTS)
    now = 10.0
    view = view_of(plant, lambda: now)
    node_goes(plant, plant.nodes["shaft"], NodeState.OPERATIONAL, now)
    for command in (Write({"valves": 0}), Write({"valves": 1}), Do(Action.KEEP_ALIVE)):
        view.submit(Request(PLC, "shaft", command), lambda outcome: None)
    now += 0.125
    view.look("shaft")
    leaves = ("telegrams", "watchdog_left_ms")
    assert [plant.image.read(f"shaft/supervision/{leaf}").value for leaf in leaves] == [3, 75]


def test_before_anything_was_heard_it_waits(tmp_path: Path) -> None:
    bench = device_bench(tmp_path, encoder())
    for leaf in ("position", "speed", "alarms"):
        assert point(bench, f"input/{leaf}").quality is Quality.WAITING


def test_a_switched_off_tpdo_is_named(tmp_path: Path) -> None:
    node = encoder()
    node.pdo("tpdo", 1, 0x180, ["6004:00/32"], on=False)
    bench = device_bench(tmp_path, node)
    bench.run(1.0)
    position = point(bench, "input/position")
    assert (position.quality, position.reason) == (
        Quality.CONFIG_ERROR,
        "TPDO1 is switched off in the node",
    )


@pytest.mark.parametrize("data", [b"", b"\1\2\3", b"\1\2\3\4\5"])
def test_a_frame_that_does_not_fit_is_counted(bench: Bench, data: bytes) -> None:
    before = bench.number("shaft/node/rejected_frames")
    bench.receive(Frame(0x180 + 20, data))
    bench.run(0.2)
    assert bench.number("shaft/node/rejected_frames") == before + 1
    assert point(bench, "input/position").quality is Quality.GOOD


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('name = "speed"', 'name = "position"', "input 'position' is there twice"),
        ('"6030:01"', '"6004:00"', "object of an input, '6004:00' is there twice"),
        ("factor = 0.001", "factor = 0.0", "must not be 0"),
        ('"commissioning"]', '"position_error"]', "bit 'position_error' is there twice"),
        (
            "[[parameter]]",
            "[process]\nrpdo = ['a']\ntpdo = ['b']\n[[parameter]]",
            "no effect without a [[slot]]",
        ),
    ],
)
def test_a_mapping_that_contradicts_itself_is_refused(tmp_path: Path, old: str, new: str, said: str) -> None:
    with pytest.raises(FileFaults) as told:
        device_bench(tmp_path, encoder(), ENCODER.replace(old, new, 1))
    assert said in str(told.value)


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ('[[bus.node.drive]]\nslot = "a"', "Encoder is no drive and has none"),
        ("own_timeout_ms = 100", "Encoder has no outputs: has no effect"),
    ],
)
def test_a_site_that_takes_it_for_a_drive_is_refused(tmp_path: Path, more: str, said: str) -> None:
    with pytest.raises(FileFaults) as told:
        device_bench(tmp_path, encoder(), more=more)
    assert said in str(told.value)


def asked(bench: Bench, command: Command, identity: Identity = ENGINEER) -> Outcome:
    outcomes: list[Outcome] = []
    request = Request(identity, "shaft", command)
    bench.view.submit(request, outcomes.append)
    bench.run(0.1)
    assert len(outcomes) == 1
    return outcomes[0]


def test_its_parameters_are_read_and_written(bench: Bench) -> None:
    assert point(bench, "parameter/6000")[:2] == (4, Quality.GOOD)
    assert asked(bench, ReadParameter("6000")).value == 4
    written = asked(bench, WriteParameter("6000", 5))
    assert (written.code, written.value) == (Code.OK, 5)
    assert point(bench, "parameter/6000")[:2] == (5, Quality.GOOD)


def test_who_may_only_read_sets_no_parameters(bench: Bench) -> None:
    refused = asked(bench, WriteParameter("6000", 5), Identity(Source.OPCUA, "otto"))
    assert refused.code is Code.NOT_ALLOWED
    assert bench.value("shaft/supervision/refused_writes") == 1


def test_it_takes_no_command(bench: Bench) -> None:
    assert asked(bench, Write({"position": 1})).code is Code.READ_ONLY
