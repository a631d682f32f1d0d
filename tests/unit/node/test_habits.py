"""Every habit of a device that comes with the simulator, before the real master on a virtual clock."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from bridge.command.drive_link import NodeState
from bridge.config import load_site
from bridge.mapping import load_family
from bridge.mapping.loader import mapping_folders
from bridge.sim.catalogue import simulate_family
from bridge.sim.core.habit import Habit, load_habit, shipped_habits
from tests.support import sites
from tests.support.bench import Bench
from tests.unit.sim.generic.test_generic_node import CYCLIC, LIGHT

NAME, BASE = "acme/light", "cia402/velocity"
TAG = "a rather long name " * 20
"""380 bytes: 55 segments, which a server with block transfer takes in one block."""
CONFIGURE = f"""
[[bus.node.configure]]
object = "2002:00"
type = "string"
value = "{TAG}"
[[bus.node.configure]]
object = "2001:00"
type = "uint16"
value = 77
"""
REQUEST = 0x605
HABITS = sorted(shipped_habits())


def bench_of(folder: Path, habit: Habit | None, node: str = CONFIGURE) -> Bench:
    """A CiA 402 drive with two objects of its maker, both to be configured."""
    path = folder / "mappings" / f"{NAME}.toml"
    path.parent.mkdir(parents=True)
    path.write_text(LIGHT, encoding="utf-8")
    folders = (folder / "mappings", *mapping_folders())
    family = load_family(NAME, folders)
    text = sites.node(sites.drive("drive", "modbus", 0, CYCLIC), mapping=NAME, more=node)
    site = load_site(sites.write(folder, sites.bus(text), sites.modbus(), name="bench"))
    device = simulate_family([NAME, BASE], family, 5, {})
    if habit is not None:
        device.adopt_habits(habit.rule)
    return Bench(site, family=family, mapping=NAME, node=device)


def said(bench: Bench) -> list[str]:
    return [event.message for event in bench.events] + [status(bench)]


def status(bench: Bench) -> str:
    return str(bench.value("conveyor/node/boot_status"))


def is_operational(bench: Bench) -> bool:
    return bench.network.nodes[0].state is NodeState.OPERATIONAL


def block_requests(bench: Bench) -> int:
    return sum(frame.data[0] in (0xA4, 0xC6) for frame in bench.sent(REQUEST))


def test_a_device_without_habits_is_booted_by_blocks(tmp_path: Path) -> None:
    bench = bench_of(tmp_path, None)
    bench.run(4.0)
    assert status(bench).startswith("ok")
    assert block_requests(bench) == 2, "one download, one upload"


@pytest.mark.landing(5)
@pytest.mark.parametrize("name", HABITS)
def test_a_habit_keeps_no_node_out_that_can_be_used_and_is_named(tmp_path: Path, name: str) -> None:
    habit = load_habit(name)
    bench = bench_of(tmp_path, habit)
    bench.run(12.0)
    assert is_operational(bench) is habit.boots, status(bench)
    assert any(habit.says in one for one in said(bench)), said(bench)
    if habit.boots:
        (drive,) = bench.plant.drives.values()
        assert drive.channel is not None and drive.quality.name != "CONFIG_ERROR"


@pytest.mark.landing(3)
@pytest.mark.parametrize("name", [name for name in HABITS if name.startswith("block-")])
def test_a_broken_block_transfer_is_told_once_and_not_tried_again(tmp_path: Path, name: str) -> None:
    bench = bench_of(tmp_path, load_habit(name))
    bench.run(12.0)
    before = block_requests(bench)
    bench.node.power_cycle()
    bench.run(12.0)
    assert is_operational(bench)
    assert block_requests(bench) == before, "it is remembered for the node, also over its restart"
    told = [one for one in said(bench) if "block transfer is not used any more" in one]
    assert len(told) == 1, told


@pytest.mark.landing(3)
@pytest.mark.parametrize("name", [name for name in HABITS if not load_habit(name).boots])
def test_a_device_that_cannot_be_booted_is_named_by_its_habit_instead_of_by_its_plug(
    tmp_path: Path, name: str
) -> None:
    bench = bench_of(tmp_path, load_habit(name))
    bench.run(12.0)
    failures = [one.message for one in bench.events if one.message.startswith("boot-up failed")]
    assert failures and len(set(failures)) == len(failures), "not once more for each frame that was counted"
    for said in failures:
        assert "is it powered" not in said
        assert re.search(r"[0-9]+ (SDO answers?|heartbeats?) ", said), said
