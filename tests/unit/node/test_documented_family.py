"""The family that the how-to invents works: its file, as the page has it, and a slave of no maker."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.command import Action, Code, Outcome, Request, command_of
from bridge.drive import DriveState
from bridge.mapping import load_family
from bridge.mapping.loader import mappings_dir
from bridge.mapping.site_families import load_site_and_families
from tests.support.bench import PLC, Bench
from tests.support.docs import page
from tests.support.pdo_node import PdoNode

DRIVE = "spindle/drive"
_STATUS = {0x0: 0x0240, 0x6: 0x0221, 0x7: 0x0223, 0xF: 0x0227}
_FAULT = 0x0208


class Spin:
    """The invented drive: states by the lowest bits of the control word, the speed at once."""

    def __init__(self) -> None:
        self.failed = False

    def __call__(self, node: PdoNode) -> None:
        word = node.number("6040:00")
        if word & 0x80:
            self.failed = False
        runs = word & 0xF == 0xF and not self.failed
        node.put("6041:00", 2, _FAULT if self.failed else _STATUS.get(word & 0xF, 0x0240))
        node.put("6044:00", 2, node.number("6042:00") if runs else 0)
        node.put("2300:00", 2, 25 if runs else 0)


def block(name: str) -> str:
    """What the page tells its reader to save as ``name``."""
    (text,) = (one.text for one in page("how-to/add-a-drive-family.md").blocks if one.file_name == name)
    return text


@pytest.fixture
def spin() -> Spin:
    return Spin()


@pytest.fixture
def bench(tmp_path: Path, spin: Spin) -> Bench:
    mapping = tmp_path / "mappings" / "acme" / "spin.toml"
    mapping.parent.mkdir(parents=True)
    mapping.write_text(block("spin.toml"), encoding="utf-8")
    site = tmp_path / "hall.toml"
    site.write_text(block("hall.toml"), encoding="utf-8")
    node = PdoNode(9, spin)
    node.put("1018:01", 4, 0xACE)
    node.put("2007:00", 2, 250)
    node.put("205A:00", 2, 0)
    node.pdo("rpdo", 1, 0x200, ["6040:00/16", "6042:00/16"])
    node.pdo("tpdo", 1, 0x180, ["6041:00/16"])  # as the factory has it
    node.put("6041:00", 2, 0x0240)
    node.put("6044:00", 2, 0)
    node.put("2300:00", 2, 0)
    loaded, families = load_site_and_families(site)
    bench = Bench(loaded, family=families["acme/spin"], mapping="acme/spin", node=node)
    bench.run(2.0)
    return bench


def ask(bench: Bench, action: Action) -> Code:
    """The code of the outcome, and a moment for the drive to do it."""
    outcomes: list[Outcome] = []
    bench.view.submit(Request(PLC, DRIVE, command_of(action)), outcomes.append)
    bench.run(0.2)
    (outcome,) = outcomes
    return outcome.code


def node_of(bench: Bench) -> PdoNode:
    assert isinstance(bench.node, PdoNode)
    return bench.node


def state(bench: Bench) -> DriveState:
    return bench.plant.drives[DRIVE].channel.state


def test_it_boots_starts_follows_and_stops(bench: Bench) -> None:
    assert str(bench.value("spindle/node/boot_status")).startswith("ok")
    assert ask(bench, Action.START) is Code.OK
    assert state(bench) is DriveState.OPERATION_ENABLED
    assert bench.write(DRIVE, velocity=-1200.0).forwarded
    bench.run(0.2)
    assert (bench.value(f"{DRIVE}/actual/velocity"), bench.value(f"{DRIVE}/actual/current")) == (-1200.0, 2.5)
    assert bench.write(DRIVE, velocity=3001.0).code is Code.OUT_OF_RANGE
    assert ask(bench, Action.STOP) is Code.OK
    assert state(bench) is DriveState.SWITCHED_ON
    assert bench.value(f"{DRIVE}/actual/velocity") == 0


def test_its_faults_are_told_in_its_own_words_and_acknowledged(bench: Bench, spin: Spin) -> None:
    assert ask(bench, Action.START) is Code.OK
    spin.failed = True
    node_of(bench).put("6041:00", 2, _FAULT)
    node_of(bench).put("205A:00", 2, 70)
    node_of(bench).emcy(bytes.fromhex("1043090000000000"))
    bench.run(0.1)
    assert state(bench) is DriveState.FAULT
    assert "temperature of the motor" in str(bench.value(f"{DRIVE}/status/fault_text"))
    assert bench.value(f"{DRIVE}/supervision/current_fault") == 7.0
    assert ask(bench, Action.RESET_FAULT) is Code.OK
    assert state(bench) is not DriveState.FAULT


def test_a_variant_is_what_it_says_and_the_rest_of_its_base(tmp_path: Path) -> None:
    folder = tmp_path / "mappings"
    folder.mkdir()
    variants = [one.text for one in page("how-to/add-a-drive-family.md").blocks if "extends =" in one.text]
    (folder / "light.toml").write_text(variants[-1], encoding="utf-8")
    base = load_family("cia402/velocity")
    light = load_family("light", (folder, mappings_dir()))
    assert light.family.name == "Spin Light"
    assert {value.low for value in light.value if value.leaf == "command/velocity"} == {-1500.0}
    assert light.emcy.codes == {**base.emcy.codes, "FF01": "door open"}
    assert light.control_word == base.control_word
