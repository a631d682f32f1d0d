"""A node that is simulated from nothing but its mapping."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import OperationFailed
from bridge.canopen.frame import Frame
from bridge.command import Action, Outcome, Request, Start
from bridge.config import load_site
from bridge.drive import DriveState
from bridge.image import Quality
from bridge.mapping import load_family
from bridge.mapping.loader import mapping_folders
from bridge.sim.catalogue import SIMULATED, simulate_family
from bridge.sim.cia402.cia402_drive import Cia402Drive
from bridge.sim.core.dictionary import Number
from bridge.sim.core.nmt_slave import SlaveState
from bridge.sim.generic.generic_family import plan_of_family
from bridge.sim.generic.generic_node import GenericNode
from tests.support import sites
from tests.support.bench import PLC, Bench
from tests.support.invented import NAME, SPIN

CYCLIC = "tpdo = { event_ms = 100 }"
"""A node that sends on a change only has sent before the bridge takes it for operational."""
DRIVE = f"parameters = {{ P7 = 1500.0 }}\n{CYCLIC}"
LIGHT = """
extends = "cia402/velocity"
[family]
name = "Spin Light"
vendor = "Acme"
source = "nobody's manual"
[identity]
vendor_id = 0xACE
product_code = 0x1234_0000
product_code_mask = 0xFFFF_0000
[[parameter]]
name = "2001"
title = "full load"
data_type = "uint16"
factor = 0.1
default = 50
[[parameter]]
name = "2002"
title = "tag"
data_type = "string"
default = "light"
"""


def bench_of(folder: Path, name: str, text: str, drive: str = "") -> Bench:
    path = folder / "mappings" / f"{name}.toml"
    path.parent.mkdir(parents=True)
    path.write_text(text, encoding="utf-8")
    folders = (folder / "mappings", *mapping_folders())
    family = load_family(name, folders)
    node = sites.node(sites.drive(family.slot[0].name, "modbus", 0, drive), mapping=name)
    site = load_site(sites.write(folder, sites.bus(node), sites.modbus(), name="bench"))
    names = [name] if family.extends is None else [name, family.extends]
    bench = Bench(site, family=family, mapping=name, node=simulate_family(names, family, 5, {}))
    bench.run(1.5)
    return bench


def start(bench: Bench) -> list[Outcome]:
    outcomes: list[Outcome] = []
    bench.view.submit(Request(PLC, "conveyor/drive", Start(direction=0)), outcomes.append)
    bench.run(0.7)
    return outcomes


def test_a_family_of_its_own_is_booted_started_and_stopped(tmp_path: Path) -> None:
    bench = bench_of(tmp_path, NAME, SPIN, DRIVE)
    (drive,) = bench.plant.drives.values()
    assert [one.ok for one in start(bench)] == [True]
    assert drive.channel.state is DriveState.OPERATION_ENABLED
    bench.ask(Action.DISABLE_VOLTAGE, drive.name)
    bench.run(0.3)
    assert drive.channel.state is DriveState.SWITCH_ON_INHIBITED


@pytest.mark.landing(22)
@pytest.mark.parametrize("mapping", SIMULATED)
def test_every_mapping_can_be_played(tmp_path: Path, mapping: str) -> None:
    family = load_family(mapping)
    node = sites.node(
        *(sites.drive(slot.name, "none", 0, CYCLIC) for slot in family.slot[:1]), mapping=mapping
    )
    site = load_site(sites.write(tmp_path, sites.bus(node), name="bench"))
    simulated = GenericNode(5, plan_of_family(family, 5))
    bench = Bench(site, family=family, mapping=mapping, node=simulated)
    bench.run(2.0)
    assert simulated.slave.state is SlaveState.OPERATIONAL, bench.value("conveyor/node/boot_status")
    (drive,) = bench.plant.drives.values()
    assert bench.plant.image.read(f"{drive.name}/status/status_word").quality is Quality.GOOD


def test_a_mapping_that_extends_one_is_played_by_its_simulation_under_its_own_name(tmp_path: Path) -> None:
    bench = bench_of(tmp_path, "acme/light", LIGHT)
    assert isinstance(bench.node, Cia402Drive)
    assert [one.ok for one in start(bench)] == [True]
    vendor, product = (bench.node.dictionary.find(0x1018, sub) for sub in (1, 2))
    assert isinstance(vendor, Number) and isinstance(product, Number)
    assert vendor.read and vendor.read() == 0xACE
    assert product.read and product.read() >> 16 == 0x1234
    assert bench.node.dictionary.find(0x2001, 0).upload() == (50).to_bytes(2, "little")
    assert bench.node.dictionary.find(0x2002, 0).upload() == b"light"


def test_the_sites_parameters_are_those_of_the_mapping(tmp_path: Path) -> None:
    bench_of(tmp_path, "acme/light", LIGHT)
    family = load_family("acme/light", (tmp_path / "mappings", *mapping_folders()))
    names = ["acme/light", "cia402/velocity"]
    node = simulate_family(names, family, 5, {"drive/2001": 7.5, "6046:02": 1200})
    assert node.dictionary.find(0x2001, 0).upload() == (75).to_bytes(2, "little")
    assert node.dictionary.find(0x6046, 2).upload() == (1200).to_bytes(4, "little")
    with pytest.raises(OperationFailed, match="2001 = 70000: a uint16 is 0…65535"):
        simulate_family(names, family, 5, {"2001": 70000.0})
    own = load_family("cia402/velocity")
    with pytest.raises(OperationFailed, match="P9: the simulated acme/spin has no such parameter"):
        simulate_family([NAME], own, 5, {"P9": 1.0})


def test_a_drive_without_its_master_has_no_voltage(tmp_path: Path) -> None:
    bench = bench_of(tmp_path, NAME, SPIN, DRIVE)
    start(bench)
    node = bench.node
    bench.cut = True
    node.on_frame(Frame(0, bytes([0x02, 5])), bench.now)
    assert not node.axes[0].is_enabled


def test_saved_numbers_last_and_others_do_not() -> None:
    node = GenericNode(5, plan_of_family(load_family("cia402/velocity"), 5))
    node.start(0.0)

    def write(index: int, sub: int, data: bytes) -> None:
        command = 0x23 | (4 - len(data)) << 2
        content = bytes([command]) + index.to_bytes(2, "little") + bytes([sub]) + data.ljust(4, b"\0")
        node.on_frame(Frame(0x605, content), 0.1)

    for save in (False, True):
        write(0x6083, 0, (77).to_bytes(4, "little"))
        assert node.value((0x6083, 0)) == 77
        if save:
            write(0x1010, 1, b"save")
        node.on_frame(Frame(0, bytes([0x81, 5])), 0.2)
        assert node.value((0x6083, 0)) == (77 if save else 0)
