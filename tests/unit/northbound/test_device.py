"""A node that is no drive, as OPC UA and zenoh show it."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.command import Action, Identity, Outcome, Role, Source
from bridge.northbound.opcua.space.nodes import layout
from bridge.northbound.zenoh.commands import Commands
from bridge.northbound.zenoh.keys import KeySpace
from tests.support.bench import Bench
from tests.support.devices import ENCODER, device_bench, encoder

SWITCH = """
[[input]]
name = "switch"
object = "6100:01"
data_type = "bool"
[[input]]
name = "turns"
object = "6200:01"
data_type = "int32"
"""


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    node = encoder()
    node.pdo("tpdo", 3, 0x380, ["6100:01/8", "6200:01/32"], event_ms=100)
    node.put("6100:01", 1, 1)
    node.put("6200:01", 4, -2)
    bench = device_bench(tmp_path, node, ENCODER.replace("[[parameter]]", SWITCH + "[[parameter]]"))
    bench.run(1.0)
    return bench


def test_opcua_has_its_folders(bench: Bench) -> None:
    drives, _, _ = layout(bench.plant.image.points)
    (shaft,) = drives.objects
    assert [folder.id for folder in shaft.objects] == [
        f"shaft/{group}" for group in ("node", "supervision", "input", "parameter")
    ]
    names = [variable.browse_name for variable in shaft.objects[2].variables]
    assert names == ["Position", "Speed", "Alarms", "Switch", "Turns"]
    methods = {method.browse_name: method.target for method in shaft.methods}
    assert methods.keys() >= {"Reset", "ReadParameter", "WriteParameter", "SaveParameters"}
    assert set(methods.values()) == {"shaft"}


def test_zenoh_has_its_keys(bench: Bench) -> None:
    keys = KeySpace("drives", "hall", bench.plant.image.points)
    assert "drives/hall/shaft/input/position" in keys.keys


def test_zenoh_reads_and_writes_its_parameters_by_any_name(bench: Bench) -> None:
    commands = Commands(bench.plant.image.points)
    engineer = Identity(Source.ZENOH, "desk", Role.ENGINEER)
    outcomes: list[Outcome] = []
    bench.view.submit(commands.request("shaft/parameter/6000", b"5", engineer), outcomes.append)
    bench.run(0.5)
    bench.view.submit(commands.reading("shaft", "6000:00", engineer, cached=False), outcomes.append)
    bench.run(0.5)
    assert [(one.ok, one.value) for one in outcomes] == [(True, 5), (True, 5)]
    assert commands.addressee_of("shaft/parameter/6000") == ("shaft", Action.WRITE_PARAMETER)
