"""Simulated nodes that are no drives: as their device description says, or as a mapping without slots."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.canopen.frame import Frame
from bridge.cli.simulation import simulated_nodes
from bridge.config import read_site
from bridge.mapping import Family
from bridge.mapping.site_families import load_site_and_families
from bridge.sim.core.nmt_slave import SlaveState
from bridge.sim.core.simulated_device import SimulatedDevice
from bridge.sim.generic.generic_node import GenericNode
from tests.support import sites
from tests.support.devices import DEVICES, ENCODER, IO_BLOCK

_ID = 5
_START, _STOP = (Frame(0, bytes((command, _ID))) for command in (1, 2))
_DIGITAL, _ANALOGUE = 0x205, 0x305


def played(folder: Path, mapping: str) -> GenericNode:
    """The one node of a site in ``folder``, operational at 0 s."""
    path = sites.write(folder, sites.bus(sites.node(node_id=_ID, mapping=mapping)))
    _, site = read_site(path)
    assert site
    (node,) = simulated_nodes(site.bus[0], path)
    assert isinstance(node, GenericNode)
    node.start(0.0)
    node.on_frame(_START, 0.0)
    assert node.slave.state is SlaveState.OPERATIONAL
    node.take_frames()
    return node


def described(folder: Path, file: str) -> GenericNode:
    (folder / file).write_bytes((DEVICES / file).read_bytes())
    return played(folder, f"eds:{file}")


def sent(node: SimulatedDevice, cob_id: int, begin_s: float, end_s: float) -> list[bytes]:
    """Data that the node sends with this identifier within that time."""
    found: list[bytes] = []
    now = begin_s
    while now < end_s:
        node.on_time(now)
        found += [frame.data for frame in node.take_frames() if frame.can_id == cob_id]
        now += 0.01
    return found


def number(node: GenericNode, index: int, sub: int, *, signed: bool = False) -> int:
    data = node.dictionary.find(index, sub).upload()
    return int.from_bytes(data, "little", signed=signed)


def test_an_encoder_turns_as_fast_as_it_says(tmp_path: Path) -> None:
    node = described(tmp_path, "encoder.eds")
    frames = sent(node, 0x180 + _ID, 10.0, 12.0)
    positions = [int.from_bytes(data[:4], "little") for data in frames]
    speeds = {int.from_bytes(data[4:], "little", signed=True) for data in frames}
    assert speeds == {1000}
    assert 1900 <= positions[-1] - positions[0] <= 2000, "steps in two seconds"
    assert positions == sorted(positions)
    assert number(node, 0x6503, 0) == 0, "no alarm"


def test_an_encoder_begins_anew_at_the_end_of_its_range(tmp_path: Path) -> None:
    node = described(tmp_path, "encoder.eds")
    steps = number(node, 0x6002, 0)
    end_s = steps / 1000
    frames = sent(node, 0x180 + _ID, end_s - 1.0, end_s + 1.0)
    positions = [int.from_bytes(data[:4], "little") for data in frames]
    assert max(positions) < steps
    assert positions[-1] < positions[0]


def test_one_input_after_the_other_is_on(tmp_path: Path) -> None:
    node = described(tmp_path, "io16.eds")
    words = [int.from_bytes(data, "little") for data in sent(node, 0x180 + _ID, 0.0, 8.2)]
    assert list(dict.fromkeys(words)) == [1 << bit for bit in range(16)]


def test_analogue_inputs_go_up_and_down_apart_from_each_other(tmp_path: Path) -> None:
    node = described(tmp_path, "io16.eds")
    frames = sent(node, 0x280 + _ID, 0.0, 21.0)
    first, second = (
        [int.from_bytes(data[n : n + 2], "little", signed=True) for data in frames] for n in (0, 2)
    )
    assert min(first) == min(second) == 0
    assert max(first) == max(second) == 0x7FFF
    assert first != second


def test_outputs_are_what_the_rpdos_carry(tmp_path: Path) -> None:
    node = described(tmp_path, "io16.eds")
    node.on_frame(Frame(_DIGITAL, b"\x81\x01"), 1.0)
    node.on_frame(Frame(_ANALOGUE, b"\x10\x27\xf0\xd8"), 1.0)
    assert [number(node, 0x6200, sub) for sub in (1, 2)] == [0x81, 0x01]
    assert [number(node, 0x6411, sub, signed=True) for sub in (1, 2)] == [10_000, -10_000]


def _given(node: GenericNode) -> None:
    """Some outputs keep what they have, others have a value of their own to go to."""
    for at, value in (
        ((0x6206, 1), 0x0F),
        ((0x6207, 1), 0x05),
        ((0x6443, 2), 0),
        ((0x6444, 1), 500),
    ):
        node.set_value(at, value)
    node.on_frame(Frame(_DIGITAL, b"\xff\xff"), 1.0)
    node.on_frame(Frame(_ANALOGUE, b"\x10\x27\x10\x27"), 1.0)


def test_outputs_have_their_error_values_when_the_node_is_stopped(tmp_path: Path) -> None:
    node = described(tmp_path, "io16.eds")
    _given(node)
    node.on_frame(_STOP, 1.1)
    assert [number(node, 0x6200, sub) for sub in (1, 2)] == [0xF5, 0x00]
    assert [number(node, 0x6411, sub) for sub in (1, 2)] == [500, 10_000]


@pytest.mark.parametrize(
    ("behaviour", "state"),
    [(0, SlaveState.PRE_OPERATIONAL), (1, SlaveState.OPERATIONAL), (2, SlaveState.STOPPED)],
)
def test_without_its_master_the_node_does_what_1029h_says(
    tmp_path: Path, behaviour: int, state: SlaveState
) -> None:
    node = described(tmp_path, "io16.eds")
    _given(node)
    node.set_value((0x1029, 1), behaviour)
    watch = b"\x23\x16\x10\x01" + (127 << 16 | 200).to_bytes(4, "little")
    node.on_frame(Frame(0x600 + _ID, watch), 1.1)
    node.on_frame(Frame(0x700 + 127, b"\x05"), 1.2)
    node.on_time(1.5)
    assert node.slave.state is state
    assert [number(node, 0x6200, sub) for sub in (1, 2)] == [0xF5, 0x00]


def _family(folder: Path, text: str) -> Family:
    file = folder / "mappings" / "acme" / "encoder.toml"
    file.parent.mkdir(parents=True)
    file.write_text(text, encoding="utf-8")
    path = sites.write(folder, sites.bus(sites.node(node_id=_ID, mapping="acme/encoder")))
    return load_site_and_families(path)[1]["acme/encoder"]


def test_a_mapping_without_slots_is_played_with_its_inputs_in_tpdos(tmp_path: Path) -> None:
    family = _family(tmp_path, ENCODER)
    node = played(tmp_path, "acme/encoder")
    frames = sent(node, 0x180 + _ID, 1.0, 2.0)
    assert {len(data) for data in frames} == {8}
    assert len(set(frames)) > 5, "it turns"
    assert number(node, 0x1018, 1) == family.identity.vendor_id
    assert number(node, 0x6000, 0) == 0


def test_inputs_that_need_more_than_four_tpdos(tmp_path: Path) -> None:
    more = "".join(
        f'[[input]]\nname = "value_{n}"\nobject = "2001:{n:02X}"\ndata_type = "int64"\n' for n in range(1, 6)
    )
    _family(tmp_path, ENCODER.replace("[[parameter]]", more + "[[parameter]]"))
    node = played(tmp_path, "acme/encoder")
    node.set_value((0x2001, 5), -2)
    assert sent(node, 0x300 + _ID, 1.0, 1.1) == [(-2).to_bytes(8, "little", signed=True)]


def test_a_mapping_with_outputs_has_them_in_rpdos(tmp_path: Path) -> None:
    _family(tmp_path, IO_BLOCK)
    node = played(tmp_path, "acme/encoder")
    node.on_frame(Frame(_DIGITAL, b"\x81\x10\x27\xf0\xd8"), 1.0)
    assert number(node, 0x6200, 1) == 0x81
    assert [number(node, 0x6411, sub, signed=True) for sub in (1, 2)] == [10_000, -10_000]
    node.on_frame(_STOP, 1.1)
    assert number(node, 0x6200, 1) == 0
    assert [number(node, 0x6411, sub, signed=True) for sub in (1, 2)] == [0, -10_000], "has no error mode"
