"""``drivebridge exchange`` without a bus: what is refused before anything is asked, what is kept."""

from __future__ import annotations

from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from bridge.cli import exchange_report
from bridge.cli.app import make_app
from bridge.cli.drop_report import Occasion
from tests.support import sites

BACKUP = """format = 2
mapping = "nord/sk-tu4-cao"
drive = "{drive}"
saved = ""
[parameters]
"P102.1" = 2.0
"""


def site_of(folder: Path) -> Path:
    node = sites.node(sites.drive("fu1", "none", 0), sites.drive("fu2", "none", 0))
    return sites.write(folder, sites.socketcan(node))


def backup(folder: Path, drive: str, name: str = "") -> Path:
    file = folder / f"{name or drive.replace('/', '-')}.toml"
    file.write_text(BACKUP.format(drive=drive), "utf-8")
    return file


def refused(site: Path, *files: Path) -> str:
    done = CliRunner().invoke(make_app(), ["exchange", str(site), "conveyor", *map(str, files)])
    assert done.exit_code == 2, done.output
    return " ".join(done.output.replace("│", " ").split())


def test_each_drive_of_the_node_needs_its_own_backup(tmp_path: Path) -> None:
    site, first = site_of(tmp_path), backup(tmp_path, "conveyor/fu1")
    assert "no backup is given of conveyor/fu2" in refused(site, first)
    again = backup(tmp_path, "conveyor/fu1", "again")
    assert "are both of conveyor/fu1" in refused(site, first, again)
    other = backup(tmp_path, "pump/drive")
    assert "is of pump/drive, and conveyor has conveyor/fu1, conveyor/fu2" in refused(site, first, other)
    half = tmp_path / "half.toml"
    half.write_text(first.read_text("utf-8")[:30], "utf-8")
    done = CliRunner().invoke(make_app(), ["exchange", str(site), "conveyor", str(half)])
    assert done.exit_code != 0
    assert "is not TOML" in str(done.exception)


def begun(folder: Path, file: Path, serial: int = 1) -> exchange_report.DeviceExchange:
    occasion = Occasion("ann", "box", "agreed", datetime.now(UTC), folder / "site.toml")
    return exchange_report.begin(folder / "state", occasion, "conveyor", {"serial": serial}, [file])


WRITTEN: dict[str, Any] = {"written": [{"name": "P102.1", "value": 1.5, "before": 2.0}], "same": 3}


def test_what_was_begun_goes_on_with_the_same_device_and_files(tmp_path: Path) -> None:
    file = backup(tmp_path, "conveyor/fu1")
    begun(tmp_path, file).keep("conveyor/fu1", WRITTEN)
    again = begun(tmp_path, file)
    assert again.is_unsaved
    again.keep("conveyor/fu1", WRITTEN | {"written": []})
    assert again.drives["conveyor/fu1"]["written"] == WRITTEN["written"]
    again.saved("")
    assert not begun(tmp_path, file).is_unsaved
    assert not begun(tmp_path, file, serial=2).drives, "another device"


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", '{"drives": 3}', '{"node": "conveyor"}'])
def test_half_a_file_of_what_was_begun_is_begun_anew(tmp_path: Path, text: str) -> None:
    file = backup(tmp_path, "conveyor/fu1")
    begun(tmp_path, file).path.write_text(text, "utf-8")
    assert begun(tmp_path, file).drives == {}
