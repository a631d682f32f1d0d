"""Values of every kind on all three protocols: a family of an invented maker."""

from __future__ import annotations

import json
import struct
from pathlib import Path

import pytest

from bridge.bustools.decode import Decoder
from bridge.canopen.frame import Frame
from bridge.northbound.modbus.registers import DriveMap, RegisterTable
from bridge.northbound.opcua.space.nodes import ObjectNode, VariableKind, VariableNode, layout
from bridge.northbound.zenoh.keys import KeySpace
from tests.support.bench import PLC, Bench
from tests.support.invented import NAME, command, spin_bench, spindle
from tests.support.views import dispatcher_of

DRIVE = "spindle/drive"


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    bench = spin_bench(tmp_path, spindle())
    bench.run(1.0)
    return bench


def variables(node: ObjectNode) -> dict[str, VariableNode]:
    found = {variable.id: variable for variable in node.variables}
    for child in node.objects:
        found |= variables(child)
    return found


def test_opc_ua_has_a_node_of_the_right_kind_for_each(bench: Bench) -> None:
    found: dict[str, VariableNode] = {}
    for tree in layout(bench.plant.image.points):
        found |= variables(tree)
    kinds = {
        leaf: found[f"{DRIVE}/{leaf}"].kind for leaf in ("command/target", "command/mode", "actual/probes")
    }
    assert kinds == {
        "command/target": VariableKind.ANALOG,
        "command/mode": VariableKind.MULTI_STATE,
        "actual/probes": VariableKind.PLAIN,
    }
    assert [bit.id for bit in found[f"{DRIVE}/actual/probes"].bits] == [
        f"{DRIVE}/actual/probes/left",
        f"{DRIVE}/actual/probes/right",
    ]


def test_modbus_has_two_registers_of_the_right_type_for_each(bench: Bench) -> None:
    rows = {row.name: row for row in DriveMap(bench.plant.catalogue.drives[DRIVE]).rows}
    shown = {
        leaf: (rows[leaf].table, rows[leaf].type)
        for leaf in ("command/target", "command/mode", "command/valve_a", "actual/in_position")
    }
    assert shown == {
        "command/target": (RegisterTable.HOLDING_REGISTER, "float32"),
        "command/mode": (RegisterTable.HOLDING_REGISTER, "uint32"),
        "command/valve_a": (RegisterTable.HOLDING_REGISTER, "uint32"),
        "actual/in_position": (RegisterTable.INPUT_REGISTER, "uint32"),
    }
    assert [rows[f"command/{word}"].address for word in ("speed", "target_low", "valves")] == [1, 2, 5]


def test_modbus_writes_an_enumeration_as_a_number(bench: Bench) -> None:
    rows = {row.name: row for row in DriveMap(bench.plant.catalogue.drives[DRIVE]).rows}
    dispatcher = dispatcher_of(bench.plant, lambda: bench.now, view=bench.view)
    answers: list[bytes] = []
    for number, code in ((3, 0x10), (2, 0x90)):
        pdu = struct.pack(">BHHBI", 16, rows["command/mode"].address, 2, 4, number)
        dispatcher.handle(1, pdu, PLC, answers.append)
        assert answers[-1][0] == code
    assert bench.value(f"{DRIVE}/command/mode") == 3


def test_zenoh_tells_the_text_of_an_enumeration(bench: Bench) -> None:
    assert command(bench, mode=1).ok
    image = bench.plant.image
    keys = KeySpace("drives", "hall", image.points)
    index = image.index[f"{DRIVE}/command/mode"]
    assert json.loads(keys.as_json(index, image[index], 0))["s"] == "profile position"


def test_the_monitor_reads_every_pdo(bench: Bench) -> None:
    node = bench.plant.nodes["spindle"]
    decoder = Decoder([node.table], {NAME: node.family})
    told = decoder.decode(Frame(0x309, bytes.fromhex("C6060000 0102")))
    assert told.text == "target_low 06C6h (target 12.34 mm), target_high 0000h, modes 0201h (mode 513)"
    assert decoder.decode(Frame(0x189, bytes.fromhex("27064001"))).text == (
        "status_word 0627h operation enabled (in_position true), speed_now 0140h"
    )
    assert decoder.decode(Frame(0x289, bytes(4))).text.endswith("4 bytes instead of 6")
