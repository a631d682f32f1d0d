"""``drivebridge scan --write``: a site file for what is on the bus."""

from __future__ import annotations

import re
import shutil
from collections.abc import Sequence
from pathlib import Path

import pytest
from typer.testing import CliRunner

from bridge.base.errors import OperationFailed
from bridge.bustools.scan import FoundNode, Scanner
from bridge.cli.app import make_app
from bridge.cli.scan_site import write_site
from bridge.cli.simulation import simulated_nodes
from bridge.config import BusTable
from bridge.eds import read_device_file
from bridge.mapping import family_names, load_family
from bridge.mapping.match import Found, Match, best_match
from bridge.project import load_project
from bridge.sim.catalogue import simulate_description, simulate_node
from bridge.sim.core.simulated_device import SimulatedDevice
from bridge.sim.generic.generic_eds import plan_of_description
from bridge.sim.generic.generic_node import GenericNode
from tests.support.devices import DEVICES
from tests.support.invented_eds import BASIC, SPIN, U8, U16, U32, described, eds, identity, var

BUS = BusTable.model_validate({"name": "can0", "interface": "virtual", "bitrate": 500_000})
FAMILIES = {name: load_family(name) for name in family_names()}
ENCODER = {**BASIC, "1000": var("device type", U32, "ro", "0x196")}


def scanned(*nodes: SimulatedDevice) -> list[tuple[FoundNode, Match | None]]:
    """Nodes found by a scan of a bus with these nodes, each with its match."""
    now, scanner = 0.0, Scanner(0.0, 1_000_000, passive=False)
    for node in nodes:
        node.start(now)
    while not scanner.is_finished(now):
        scanner.on_time(now)
        for node in nodes:
            node.on_time(now)
        while frames := scanner.take_frames():
            for node in nodes:
                for frame in frames:
                    node.on_frame(frame._replace(time=now), now)
        for node in nodes:
            for frame in node.take_frames():
                scanner.on_frame(frame._replace(time=now))
        now += 0.001
    return [(node, matched(node)) for node in scanner.nodes()]


def matched(node: FoundNode) -> Match | None:
    return best_match(Found(node.device_type, node.vendor, node.product, node.revision, node.name), FAMILIES)


def written(folder: Path, found: Sequence[tuple[FoundNode, Match | None]], eds: Path | None = None) -> str:
    said = write_site(folder / "hall.toml", eds, BUS, found, FAMILIES)
    return said.replace(f"{folder}/", "")


def test_known_families_become_a_site_that_can_be_simulated(tmp_path: Path) -> None:
    found = scanned(
        simulate_node("nord/sk-tu4-cao", 5, {}),
        simulate_node("lenze/8400-motec", 6, {}),
        simulate_node("cia402/velocity", 8, {}),
    )
    assert written(tmp_path, found) == "hall.toml: 3 of 3 nodes have a mapping"
    project = load_project(tmp_path / "hall.toml")
    (bus,) = project.site.bus
    assert [(node.id, node.mapping, len(node.drive)) for node in bus.node] == [
        (5, "nord/sk-tu4-cao", 4),
        (6, "lenze/8400-motec", 1),
        (8, "cia402/profile-velocity", 1),
    ]
    assert {drive.control for node in bus.node for drive in node.drive} == {"none"}
    assert len(simulated_nodes(bus, project.path)) == 3


def test_a_node_without_a_mapping_is_a_comment(tmp_path: Path) -> None:
    node = GenericNode(7, plan_of_description(described(ENCODER), 7))
    assert written(tmp_path, scanned(node)) == "hall.toml: 0 of 1 nodes have a mapping"
    text = (tmp_path / "hall.toml").read_text(encoding="utf-8")
    assert "# node 7, 1000h 196h, vendor ACEh, product 3000h" in text.replace("Spin 3000: ", "")
    assert "# [[bus.node]]" in text


def test_a_mapping_is_made_of_the_nodes_eds(tmp_path: Path) -> None:
    folder = tmp_path / "eds"
    folder.mkdir()
    (folder / "spin.eds").write_bytes(eds())
    (folder / "broken.eds").write_bytes(b"no")
    nodes = [GenericNode(number, plan_of_description(described(SPIN), number)) for number in (3, 4)]
    said = written(tmp_path, scanned(*nodes), folder)
    assert said == "hall.toml, mappings/acme-gmbh/spin-3000.toml: 2 of 2 nodes have a mapping"
    project = load_project(tmp_path / "hall.toml")
    assert [node.mapping for node in project.site.bus[0].node] == ["acme-gmbh/spin-3000"] * 2
    assert len({node.name for node in project.site.bus[0].node}) == 2


def test_half_an_eds_says_why_it_does_not_help(tmp_path: Path) -> None:
    folder = tmp_path / "eds"
    folder.mkdir()
    (folder / "spin.eds").write_bytes(eds()[:-4])
    written(tmp_path, scanned(GenericNode(3, plan_of_description(described(SPIN), 3))), folder)
    text = (tmp_path / "hall.toml").read_text("utf-8")
    assert re.search(r"\n# .*spin.eds:[0-9]+: the file breaks off", text)
    (node,) = load_project(tmp_path / "hall.toml").site.bus[0].node
    assert node.mapping.startswith("cia402/")
    assert not (tmp_path / "mappings").exists()


def test_a_node_that_says_nobody_and_nothing_is_told_why_no_file_is_its(tmp_path: Path) -> None:
    folder = tmp_path / "eds"
    folder.mkdir()
    (folder / "spin.eds").write_bytes(eds())
    nobody = {**SPIN, **identity("0", "0")}
    written(tmp_path, scanned(GenericNode(3, plan_of_description(described(nobody), 3))), folder)
    text = (tmp_path / "hall.toml").read_text("utf-8")
    assert re.search(
        r"\n# .*it says neither vendor nor product \(0/0\), by which its file would be found\n", text
    )


def test_nodes_that_are_no_drives_name_their_eds_where_it_lies_with_the_site(tmp_path: Path) -> None:
    shutil.copytree(DEVICES, tmp_path / "eds")
    found = scanned(
        simulate_node("nord/sk-tu4-cao", 5, {}),
        simulate_node("cia402/velocity", 8, {}),
        simulate_description(read_device_file(DEVICES / "encoder.eds"), 20),
        simulate_description(read_device_file(DEVICES / "io16.eds"), 21),
    )
    assert written(tmp_path, found, tmp_path / "eds") == "hall.toml: 4 of 4 nodes have a mapping"
    project = load_project(tmp_path / "hall.toml")
    (bus,) = project.site.bus
    assert [(node.name, node.mapping) for node in bus.node[2:]] == [
        ("shaft_25", "eds:eds/encoder.eds"),
        ("io_16", "eds:eds/io16.eds"),
    ]
    assert len(simulated_nodes(bus, project.path)) == 4
    assert not (tmp_path / "mappings").exists()
    checked = CliRunner().invoke(make_app("check"), ["check", str(tmp_path / "hall.toml")])
    assert checked.exit_code == 0
    assert checked.stdout.endswith("5 drives and 2 devices on 1 bus, no faults\n")


def test_an_eds_elsewhere_becomes_a_mapping_beside_the_site(tmp_path: Path) -> None:
    found = scanned(simulate_description(read_device_file(DEVICES / "encoder.eds"), 20))
    said = written(tmp_path, found, DEVICES)
    assert said == "hall.toml, mappings/acme/shaft-25.toml: 1 of 1 nodes have a mapping"
    project = load_project(tmp_path / "hall.toml")
    assert [one.name for one in project.families["acme/shaft-25"].input][:1] == ["position_value"]


def test_a_node_that_has_the_bridges_own_id_moves_the_bridge(tmp_path: Path) -> None:
    written(tmp_path, scanned(simulate_node("cia402/velocity", 127, {})))
    assert load_project(tmp_path / "hall.toml").site.bus[0].master_node_id == 126


@pytest.mark.parametrize(("lacking", "by"), [({"1017"}, "guarding"), ({"1017", "100C", "100D"}, "none")])
def test_a_node_is_supervised_by_what_it_has(tmp_path: Path, lacking: set[str], by: str) -> None:
    sections = {
        **SPIN,
        "100C": var("guard time", U16, "rw", "0"),
        "100D": var("life time factor", U8, "rw", "0"),
    }
    silent = {name: keys for name, keys in sections.items() if name not in lacking}
    found = scanned(GenericNode(7, plan_of_description(described(silent), 7)))
    written(tmp_path, found)
    assert load_project(tmp_path / "hall.toml").site.bus[0].node[0].supervision == by


def test_a_site_that_is_there_is_kept(tmp_path: Path) -> None:
    (tmp_path / "hall.toml").write_text("mine", encoding="utf-8")
    with pytest.raises(OperationFailed, match="is there already"):
        written(tmp_path, [])
    assert (tmp_path / "hall.toml").read_text(encoding="utf-8") == "mine"
