"""A site file with everything it names: read whole, and silence that would stop nobody is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.project import count, load_project
from bridge.text import render
from tests.support import sites


def write(folder: Path, drive: str, *more: str, mapping: str = sites.FAMILY) -> Path:
    drives = [
        sites.drive("fu1", "zenoh", 200, drive),
        *(sites.drive(slot, "zenoh", 200, "") for slot in more),
    ]
    return sites.write(folder, sites.bus(sites.node(*drives, mapping=mapping)), sites.zenoh())


def test_a_project_has_its_site_its_families_and_where_they_came_from(tmp_path: Path) -> None:
    path = write(tmp_path, "")
    project = load_project(path)
    assert project.path == path
    assert list(project.families) == [sites.FAMILY]
    assert project.downloads == {}


def test_silence_that_stops_nobody_is_refused_with_what_would(tmp_path: Path) -> None:
    """P151 of a SK TU4-CAO is of the node: the RPDOs of another drive keep it from running out."""
    path = write(tmp_path, 'on_expiry = "silence"', "fu2")
    with pytest.raises(FileFaults) as caught:
        load_project(path)
    (fault,) = caught.value.faults
    assert fault.key == "bus[0].node[0].drive[0].on_expiry"
    assert fault.message.startswith(
        "silence does not stop this drive: P151 watches the RPDOs of all 2 drives"
    )
    assert '"disable_voltage", "quick_stop" or "stop"' in fault.hint
    assert render(fault.advice, "de") == (
        '"disable_voltage", "quick_stop" oder "stop"; oder own_timeout_ms und enforce = true, falls er seine '
        "Prozessdaten selbst überwacht"
    )


def test_what_holds_is_never_silent(tmp_path: Path) -> None:
    path = write(tmp_path, 'on_expiry = "hold"\nthen_silence_ms = 500')
    with pytest.raises(FileFaults) as caught:
        load_project(path)
    assert [fault.key for fault in caught.value.faults] == ["bus[0].node[0].drive[0].then_silence_ms"]
    assert 'has no effect with on_expiry = "hold"' in caught.value.faults[0].message


@pytest.mark.parametrize(
    ("number", "what", "text"),
    [(1, "bus", "1 bus"), (2, "bus", "2 buses"), (0, "drive", "0 drives"), (4, "drive", "4 drives")],
)
def test_numbers_with_their_nouns(number: int, what: str, text: str) -> None:
    assert count(number, what) == text
