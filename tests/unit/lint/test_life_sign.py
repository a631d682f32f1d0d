"""``check`` says with which time-outs a life sign cannot work, or hardly."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.lint import Severity, lint
from bridge.project import load_project
from tests.support import sites


def warnings(folder: Path, timeout_ms: int, more: str = "", control: str = "modbus") -> list[str]:
    node = sites.node(sites.drive("fu1", control, timeout_ms, f"life_sign = true\n{more}"))
    path = sites.write(folder, sites.bus(node), sites.modbus())
    project = load_project(path)
    verdict = lint(project.site, project.families, path, project.downloads)
    return [str(one) for one in verdict.of(Severity.WARNING) if "life sign" in str(one)]


@pytest.mark.parametrize(("timeout_ms", "left_ms"), [(1001, 1), (1499, 499), (1500, None), (5000, None)])
def test_a_time_out_that_leaves_little_for_the_way_of_a_token_is_a_warning(
    tmp_path: Path, timeout_ms: int, left_ms: int | None
) -> None:
    told = warnings(tmp_path, timeout_ms)
    assert len(told) == (left_ms is not None)
    if left_ms is not None:
        assert f"leaves {left_ms} ms for a token" in told[0]
        assert "at least 1500" in told[0]


@pytest.mark.parametrize("timeout_ms", [0, 1, 1000])
def test_one_within_which_a_living_program_may_have_read_nothing_newer_is_refused(
    tmp_path: Path, timeout_ms: int
) -> None:
    with pytest.raises(FileFaults, match=r"fieldbus_timeout_ms.*more than 1000 ms"):
        warnings(tmp_path, timeout_ms)


def test_nor_may_the_owner_set_one(tmp_path: Path) -> None:
    writable = "fieldbus_timeout_writable = true\n"
    with pytest.raises(FileFaults, match="fieldbus_timeout_range_ms"):
        warnings(tmp_path, 2000, f"{writable}fieldbus_timeout_range_ms = [1000, 3000]")
    assert not warnings(tmp_path, 2000, writable)


def test_nobody_brings_one_back_to_a_drive_that_nobody_controls(tmp_path: Path) -> None:
    with pytest.raises(FileFaults, match="life_sign: has no effect"):
        warnings(tmp_path, 2000, control="none")
