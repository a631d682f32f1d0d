"""Boot-ups (CiA 302-2) of a node that answers one of its objects wrongly or not at all, each in turn.

Either the node goes into operation all the same, or the bridge names the rule of the site that needs it.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

from bridge.command.drive_link import NodeState
from bridge.sim.core.habit import Habit, Rule
from bridge.text import render
from tests.support.bench import Bench, write_site
from tests.unit.node.test_habits import CONFIGURE, REQUEST, bench_of, is_operational, status

NUMBER = """
[[bus.node.configure]]
object = "2001:00"
type = "uint16"
value = 77
"""
NAMES_A_RULE = re.compile(r"needed by [a-z_.0-9]+|by the (site file|mapping)")

Fault = Callable[[int, int], list[Rule]]


def silent(index: int, sub: int) -> list[Rule]:
    return [Rule(frames="request", like=f"40 {named(index, sub)}", silent=True)]


def misread(index: int, sub: int) -> list[Rule]:
    """20 bytes are announced, and seven come; the same for the second segmented transfer and all after it."""
    name = named(index, sub)
    return [
        Rule(frames="answer", like=f"4[1237BF] {name}", data=f"41 {name} 14 00 00 00"),
        Rule(frames="request", like="60", data="40 FF FF FF"),
        Rule(frames="answer", like="80 FF FF FF", data="01 41 41 41 41 41 41 41"),
    ]


def named(index: int, sub: int) -> str:
    return f"{index & 0xFF:02X} {index >> 8:02X} {sub:02X}"


def conclude(bench: Bench) -> None:
    """Until the first boot-up has ended, well or not."""
    for _ in range(60):
        bench.run(0.5)
        if bench.network.nodes[0].has_concluded:
            return


def asked(folder: Path) -> list[tuple[int, int]]:
    """What a boot-up reads, in order."""
    bench = bench_of(folder, None, NUMBER)
    conclude(bench)
    assert is_operational(bench), status(bench)
    reads = [frame.data for frame in bench.sent(REQUEST) if frame.data[0] == 0x40]
    return list(dict.fromkeys((int.from_bytes(data[1:3], "little"), data[3]) for data in reads))


@pytest.mark.landing
@pytest.mark.parametrize("fault", [silent, misread])
def test_what_no_rule_needs_keeps_no_node_out(tmp_path: Path, fault: Fault) -> None:
    objects = asked(tmp_path / "whole")
    assert (0x1008, 0) in objects and len(objects) > 20
    wrong: list[str] = []
    for place, (index, sub) in enumerate(objects):
        habit = Habit(title="t", source="s", rule=fault(index, sub))
        bench = bench_of(tmp_path / str(place), habit, NUMBER)
        conclude(bench)
        # A drive whose PDOs cannot be read is not served; its node is there.
        said = status(bench)
        is_left_out = is_operational(bench) and said.startswith("J: conveyor/drive") and "no valid" in said
        is_presence = (index, sub) == (0x1000, 0) and fault is silent
        if not (is_operational(bench) or NAMES_A_RULE.search(said) or is_left_out or is_presence):
            wrong.append(f"{index:04X}h:{sub:02X}: {said}")
    assert wrong == []


@pytest.mark.landing(6)
@pytest.mark.parametrize("index", [0x1000, 0x1001, 0x1008, 0x100A, 0x1014, 0x1018])
def test_a_site_file_without_rules_needs_nothing_of_who_the_node_is(tmp_path: Path, index: int) -> None:
    bench = Bench(write_site(tmp_path), present=False)
    bench.node.adopt_habits(misread(index, 4 if index == 0x1018 else 0))
    bench.power_on()
    bench.run(3.0)
    assert bench.network.nodes[0].state is NodeState.OPERATIONAL, status(bench)
    assert "cannot be read, and is not needed" in status(bench) or index == 0x1000


def test_a_name_that_the_site_asks_for_is_needed_and_the_rule_is_named(tmp_path: Path) -> None:
    rule = '[bus.node.identity]\ndevice_name = "SK TU4"'
    bench = Bench(write_site(tmp_path, node=rule), present=False)
    bench.node.adopt_habits(misread(0x1008, 0))
    bench.power_on()
    bench.run(3.0)
    assert status(bench).startswith("M: 1008h:00: no valid answer")
    assert "needed by identity.device_name" in status(bench)


def test_each_step_of_a_boot_up_says_which_rule_needs_it(tmp_path: Path) -> None:
    bench = bench_of(tmp_path, None, CONFIGURE)
    steps: list[str] = []
    bench.network.nodes[0].say = lambda said, now: steps.append(render(said))
    conclude(bench)
    assert "reading the identity" in steps, "of what nobody asks for there is nothing to say"
    assert "downloading the configuration, 1 of 2 (needed by configure)" in steps
    assert "setting error control (needed by supervision)" in steps
    assert any(step.endswith("(needed by drive.drive)") for step in steps), steps


def test_a_node_that_is_gone_is_not_asked_for_all_that_nothing_needs(tmp_path: Path) -> None:
    """Two silences may be its habit, a third one is its absence."""
    bench = Bench(write_site(tmp_path), present=False)
    bench.node.adopt_habits([Rule(frames="request", like="40 (?!00 10)", silent=True)])
    bench.power_on()
    conclude(bench)
    assert "the node does not answer" in status(bench)
    reads = {frame.data[1:4] for frame in bench.sent(REQUEST) if frame.data[0] == 0x40}
    assert len(reads) <= 4


@pytest.mark.parametrize(("count", "kind"), [("FE", "SAM-MPDO"), ("FF", "DAM-MPDO")])
def test_a_multiplexed_pdo_is_named_and_not_taken_for_a_mapping(
    tmp_path: Path, count: str, kind: str
) -> None:
    bench = Bench(write_site(tmp_path), present=False)
    bench.node.adopt_habits([Rule(frames="answer", like="4F 00 1A 00", data=f"4F 00 1A 00 {count} 00 00 00")])
    bench.power_on()
    bench.run(3.0)
    assert f"1A00h:00 is {count}h: a multiplexed PDO" in status(bench), status(bench)
    assert kind in status(bench)
