"""Configuration files that a site names: relative to it, all read, each fault where it can be mended."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.config import load_site
from bridge.eds.site_configurations import read_configurations
from tests.support import sites
from tests.unit.eds.test_configuration import DCF

PLAIN = sites.drive("fu1", "none", 0, "")


def named(file: str) -> str:
    return f'configuration = "{file}"'


def site_of(folder: Path, *names: str) -> Path:
    nodes = [
        sites.node(
            sites.drive("fu1", "none", 0, ""),
            name=f"n{place}",
            node_id=place,
            more=f'configuration = "{name}"',
        )
        for place, name in enumerate(names, 5)
    ]
    return sites.write(folder, sites.bus(*nodes, sites.node(PLAIN, name="plain", node_id=9)))


def test_a_node_without_one_has_no_downloads_and_names_are_relative_to_the_site(tmp_path: Path) -> None:
    (tmp_path / "files").mkdir()
    (tmp_path / "files" / "a.dcf").write_text(DCF)
    path = site_of(tmp_path, "files/a.dcf")
    found = read_configurations(load_site(path), path)
    assert list(found) == ["n5"]
    assert found["n5"]


def test_every_file_that_cannot_be_read_is_named_at_its_key(tmp_path: Path) -> None:
    path = site_of(tmp_path, "gone.dcf", "lost.dcf")
    with pytest.raises(FileFaults) as caught:
        read_configurations(load_site(path), path)
    faults = caught.value.faults
    assert [fault.key for fault in faults] == ["bus[0].node[0].configuration", "bus[0].node[1].configuration"]
    lines = path.read_text().splitlines()
    assert [lines[fault.line - 1] for fault in faults] == [
        'configuration = "gone.dcf"',
        'configuration = "lost.dcf"',
    ]
    assert all(fault.file == str(path) for fault in faults)
    assert str(tmp_path / "gone.dcf") in faults[0].message


def test_a_fault_with_a_line_stands_in_its_own_file(tmp_path: Path) -> None:
    (tmp_path / "worse.dcf").write_bytes(b"[1018]\n" * 3)
    path = site_of(tmp_path, "worse.dcf")
    with pytest.raises(FileFaults) as caught:
        read_configurations(load_site(path), path)
    assert {Path(fault.file).name for fault in caught.value.faults if fault.line} == {"worse.dcf"}
