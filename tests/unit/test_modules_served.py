"""A coupler with its modules, from the site file to the points."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.cli.simulation import simulated_nodes
from bridge.project import Project, load_project
from tests.support import sites
from tests.support.bench import Bench
from tests.support.couplers import coupler, written


def bench_of(path: Path, project: Project) -> Bench:
    """A bridge by ``project``, and a coupler as the site file at ``path`` has it."""
    (node,) = simulated_nodes(load_project(path).site.bus[0], path)
    (table,) = project.site.bus[0].node
    key = table.mapping_key
    bench = Bench(project.site, family=project.families[key], mapping=key, node=node)
    bench.run(2.0)
    return bench


def test_what_is_plugged_in_is_served(tmp_path: Path) -> None:
    path = written(tmp_path, "AC-DI8", "AC-DI4", "AC-DO8")
    project = load_project(path)
    (family,) = project.families.values()
    assert [(one.name, str(one.object), len(one.bits)) for one in family.input] == [
        ("digital_inputs_1", "6000:01", 8),
        ("digital_inputs_2", "6000:02", 8),
    ]
    assert [(one.name, str(one.object)) for one in family.output] == [("digital_outputs_1", "6200:01")]
    assert [str(one.error_mode) for one in family.output] == ["6206:01"]
    bench = bench_of(path, project)
    assert str(bench.value("io/node/boot_status")).startswith("ok")
    assert bench.value("io/input/digital_inputs_2") == 0


def test_nodes_with_other_modules_have_other_points(tmp_path: Path) -> None:
    (tmp_path / "coupler.eds").write_bytes(coupler())
    nodes = [
        sites.node(
            name=f"io{place}", node_id=20 + place, mapping="eds:coupler.eds", more=f"modules = [{modules}]"
        )
        for place, modules in enumerate(('"1"', '"1", "4"', '"1"'))
    ]
    project = load_project(sites.write(tmp_path, sites.bus(*nodes), sites.modbus(0)))
    tables = project.site.bus[0].node
    counts = [len(project.families[table.mapping_key].input) for table in tables]
    assert (counts, len(project.families)) == ([1, 3, 1], 2)


def test_analogue_inputs_that_no_pdo_of_the_file_carries_are_points_as_well(tmp_path: Path) -> None:
    """A coupler maps by itself what is plugged in; its file cannot say what."""
    project = load_project(written(tmp_path, "AC-AI2", outputs=""))
    (family,) = project.families.values()
    assert [one.name for one in family.input] == ["analogue_inputs_1", "analogue_inputs_2"]
    assert "6423" in {one.name for one in family.parameter}


def test_a_tpdo_that_carries_what_nobody_describes_says_so(tmp_path: Path) -> None:
    plugged = written(tmp_path, "AC-DI8", "AC-DI8", "AC-DO8", name="plugged")
    project = load_project(written(tmp_path, "AC-DI8", "AC-DO8"))
    status = str(bench_of(plugged, project).value("io/node/boot_status"))
    assert "TPDO1 carries 6000:02, which nothing here describes" in status


def test_a_module_that_there_is_not_is_a_fault_of_the_site_file(tmp_path: Path) -> None:
    path = written(tmp_path, "AC-DI8", "AC-DI16")
    with pytest.raises(FileFaults) as caught:
        load_project(path)
    (fault,) = caught.value.faults
    assert fault.file == str(path)
    assert path.read_text().splitlines()[fault.line - 1].startswith("modules = ")
    assert fault.message.endswith("coupler.eds: the device has no module AC-DI16")
    assert "AC-DI8" in fault.hint


def test_modules_of_a_mapping_that_has_none_are_a_fault(tmp_path: Path) -> None:
    node = sites.node(more='modules = ["AC-DI8"]')
    path = sites.write(tmp_path, sites.bus(node), sites.modbus(0))
    with pytest.raises(FileFaults) as caught:
        load_project(path)
    assert "nord/sk-tu4-cao knows of no modules" in [one.message for one in caught.value.faults]
