"""Outputs of a coupler with modules, as the witness knows them."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.project import load_project
from bridge.witness.plan import plan
from tests.support.couplers import connected, coupler, written


@pytest.mark.parametrize("modules", [("AC-DO8",), ("AC-DI8", "AC-DO8", "AC-DI4"), ("3",)])
def test_the_witness_knows_the_same_outputs(tmp_path: Path, modules: tuple[str, ...]) -> None:
    path = written(tmp_path, *modules)
    (family,) = load_project(path).families.values()
    (bus,) = plan(load_project(path).site, path.parent)
    (outputs,) = bus.outputs
    assert not outputs.why_unknown
    assert [one.name for one in family.output] == ["digital_outputs_1"]
    assert outputs.rpdos[0x215].are_active(b"\x01") is True
    assert outputs.rpdos[0x215].are_active(b"\x00") is False


def test_the_witness_says_what_it_cannot_know(tmp_path: Path) -> None:
    """The second element is in no RPDO of the file."""
    path = written(tmp_path, "AC-DO8", "AC-DO8")
    (bus,) = plan(load_project(path).site, path.parent)
    (outputs,) = bus.outputs
    assert outputs.why_unknown == "no file says which RPDO carries 6200:02"


@pytest.mark.parametrize("plugged", [(3,), (1, 3, 2, 2)])
def test_what_the_file_connects_counts_where_the_site_file_names_nothing(
    tmp_path: Path, plugged: tuple[int, ...]
) -> None:
    path = written(tmp_path)
    (tmp_path / "coupler.eds").write_bytes(coupler(more=connected(*plugged)))
    (bus,) = plan(load_project(path).site, path.parent)
    (outputs,) = bus.outputs
    assert set(outputs.rpdos) == {0x215}
    assert [one.name for family in load_project(path).families.values() for one in family.output] == [
        "digital_outputs_1"
    ]
