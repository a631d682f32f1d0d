"""A drive with several axes from its description to its points: site file, check, simulator, boot-up."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

from bridge.catalogue import Catalogue
from bridge.cli.simulation import simulated_nodes
from bridge.drive import OwnVerdict
from bridge.exports import modbus_table
from bridge.lint import lint
from bridge.northbound.page.parameter_page import holders_of
from bridge.project import Project, load_project
from bridge.sim.generic.generic_node import GenericNode
from tests.support import sites
from tests.support.bench import Bench
from tests.support.invented_eds import (
    BASIC,
    I32,
    U32,
    Section,
    axis_objects,
    axis_pdos,
    eds,
    mapped,
    record,
    var,
)

WATCHED = record("1016", "consumer heartbeat", var("entry", U32, "rw", "0"))
TWO: Mapping[str, Section] = {
    **BASIC,
    **WATCHED,
    **axis_objects(1),
    **axis_objects(2),
    **axis_pdos(1, 0, ("$NODEID+0x200", "$NODEID+0x180")),
    **axis_pdos(2, 64, ("$NODEID+0x300", "$NODEID+0x280")),
    "6083": mapped("acceleration", U32),
    "6883": mapped("acceleration", U32),
}
NO_REACTION = {"6807": {**TWO["6807"], "DefaultValue": "0"}}
ENFORCED = "own_timeout_ms = 300\nenforce = true"
FIRST, SECOND = "winder/axis1", "winder/axis2"


FACTORS = {
    name: one
    for index in ("604C", "684C")
    for name, one in record(
        index, "factor", *(mapped(of, I32, default="1") for of in ("number", "by"))
    ).items()
}


def configured(more: str = "") -> str:
    """The heartbeat of the bridge is watched for 300 ms."""
    watched = '{ object = "1016:01", type = "uint32", value = 0x7F012C }'
    return f"configure = [{watched}{more}]"


def site(folder: Path, node: str = "", sections: Mapping[str, Section] = TWO, second: str = "") -> Project:
    (folder / "two.eds").write_bytes(eds(sections))
    drives = [sites.drive("axis1", "modbus", 200, ""), sites.drive("axis2", "modbus", 500, second)]
    more = f'supervision = "heartbeat"\n{node}'
    table = sites.node(*drives, name="winder", mapping="eds:two.eds", more=more)
    return load_project(sites.write(folder, sites.bus(table), sites.modbus()))


def running(project: Project) -> Bench:
    (bus,) = project.site.bus
    (node,) = simulated_nodes(bus, project.path)
    (key,) = project.families
    bench = Bench(project.site, family=project.families[key], mapping=key, node=node)
    bench.run(2.0)
    return bench


def told(bench: Bench) -> str:
    return str(bench.value("winder/node/boot_status"))


def test_each_axis_is_published_with_its_own_time(tmp_path: Path) -> None:
    project = site(tmp_path)
    verdict = lint(project.site, project.families, project.path, project.downloads)
    first, second = verdict.worst_cases
    assert (first.drive, second.drive) == (FIRST, SECOND)
    assert 200 < first.stop.ms < 500 < second.stop.ms


def test_each_axis_has_its_own_reaction_to_a_silent_bridge(tmp_path: Path) -> None:
    bench = running(site(tmp_path, configured(), {**TWO, **NO_REACTION}))
    first, second = (drive.own for drive in bench.plant.drives.values())
    assert first and second
    assert (first.verdict, second.verdict) == (OwnVerdict.STOPS, OwnVerdict.RUNS_ON)
    assert "6007 is 0" in second.reason
    assert "the drive runs on when the bridge falls silent (axis2): 6007 is 0" in told(bench)


def test_what_is_enforced_is_written_into_each_axis_that_needs_it(tmp_path: Path) -> None:
    bench = running(site(tmp_path, ENFORCED, {**TWO, **NO_REACTION}))
    written = [frame.data[:4].hex() for frame in bench.sent(0x605) if frame.data[0] & 0xE0 == 0x20]
    assert [head for head in written if head[2:6] in ("0760", "0768")] == ["2b076800"], "axis 1 stops already"
    assert "winder/axis2: 6007 was 0, is 3 now (enforced)" in told(bench)
    assert [drive.own and drive.own.verdict for drive in bench.plant.drives.values()] == [
        OwnVerdict.STOPS
    ] * 2


@pytest.mark.parametrize(("reaction", "runs_on"), [("6007:00", FIRST), ("6807:00", SECOND)])
def test_a_reaction_in_the_site_file_is_that_of_its_axis(tmp_path: Path, reaction: str, runs_on: str) -> None:
    project = site(tmp_path, configured(f', {{ object = "{reaction}", type = "int16", value = 0 }}'))
    verdict = lint(project.site, project.families, project.path, project.downloads)
    assert [case.drive for case in verdict.worst_cases if "6007 is 0" in case.own.reason] == [runs_on]


@pytest.mark.landing
def test_points_and_registers_are_alike_for_both(tmp_path: Path) -> None:
    bench = running(site(tmp_path))
    leaves = [
        {name.removeprefix(drive) for name in bench.plant.image.index if name.startswith(f"{drive}/")}
        for drive in (FIRST, SECOND)
    ]
    assert leaves[0] == leaves[1]
    assert "/parameter/603f" in leaves[0]


def test_the_page_knows_the_objects_of_each(tmp_path: Path) -> None:
    project = site(tmp_path)
    holders = holders_of(Catalogue.of(project.site, project.families))
    found = [str(holders[drive].names.resolve("6083").address) for drive in (FIRST, SECOND)]
    assert found == ["6083:00", "6883:00"]


def test_the_simulated_axis_has_the_parameters_of_its_drive(tmp_path: Path) -> None:
    project = site(tmp_path, sections={**TWO, **FACTORS}, second='parameters = { "604C:01" = 3.0 }')
    (bus,) = project.site.bus
    (node,) = simulated_nodes(bus, project.path)
    assert isinstance(node, GenericNode)
    assert [node.value((index, 1)) for index in (0x604C, 0x684C)] == [1, 3]


def test_each_axis_has_its_registers(tmp_path: Path) -> None:
    rows = modbus_table(site(tmp_path)).rows
    of_axes = [[row[2:] for row in rows if row[1] == drive] for drive in (FIRST, SECOND)]
    assert of_axes[0] == of_axes[1]
    assert len(of_axes[0]) > 20
    assert {row[0] for row in rows if row[1] == SECOND}.isdisjoint(row[0] for row in rows if row[1] == FIRST)
