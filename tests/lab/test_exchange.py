"""``exchange`` on real SocketCAN: simulated devices in the place of those that the backups are of."""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support import sites
from tests.support.process import drivebridge, drivebridge_called

pytestmark = pytest.mark.nightly

NODES = (
    sites.node(
        sites.drive("fu1", "none", 0),
        sites.drive("fu2", "none", 0),
        name="conveyor",
        more="own_timeout_ms = 400\nenforce = true\nsdo_channels = [2]",
    ),
    sites.node(sites.drive("drive", "none", 0, ""), name="pump", node_id=6, mapping="lenze/8400-motec"),
    sites.node(
        sites.drive("axis1", "none", 0, ""),
        name="lift",
        node_id=7,
        mapping="stoeber/5000",
        more='supervision = "guarding"\nsupervision_ms = 100',
    ),
)
SERIAL = 8_000_000
"""That of the simulated STÖBER; the other two have none."""
OLD_SERIAL = 7_999_999


class Commands:
    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.site = sites.write(folder, sites.socketcan(*NODES))

    def parameters(self, command: str, drive: str, *arguments: str) -> str:
        done = drivebridge_called("parameters", command, str(self.site), drive, *arguments)
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    def backup(self, drive: str, *changes: tuple[str, str]) -> Path:
        """A backup with ``changes``: patterns and what is in their place, such as what the old drive had."""
        file = self.folder / f"{drive.replace('/', '-')}.toml"
        self.parameters("backup", drive, str(file))
        for pattern, text in changes:
            changed, count = re.subn(pattern, text, file.read_text("utf-8"))
            assert count == 1, pattern
            file.write_text(changed, "utf-8")
        return file

    def exchange(self, node: str, *arguments: object) -> subprocess.CompletedProcess[str]:
        words = (str(one) for one in arguments)
        return drivebridge_called("exchange", str(self.site), node, *words, "--yes-i-am-at-the-machine")


@pytest.fixture
def commands(tmp_path: Path) -> Iterator[Commands]:
    commands = Commands(tmp_path)
    with drivebridge(tmp_path, "simulate", "simulate", str(commands.site)) as process:
        process.wait_output("simulating")
        yield commands


def test_new_drives_get_the_old_ones_settings_and_are_proven_to_stop(commands: Commands) -> None:
    """The interface has its second SDO channel closed, as delivered."""
    first = commands.backup("conveyor/fu1")
    text = first.read_text("utf-8")
    second = commands.folder / "fu2.toml"
    second.write_text(text.replace("conveyor/fu1", "conveyor/fu2").replace('"P513" = 1.0', '"P513" = 0.7'))
    first.write_text(text.replace('"P102.1" = 2.0', '"P102.1" = 1.5'), "utf-8")
    done = commands.exchange("conveyor", second, first)
    assert done.returncode == 1, "FU2 does not tell by SDO whether it is enabled"
    assert "--force" in done.stderr
    done = commands.exchange("conveyor", second, first, "--force", "--operator", "ann", "--json")
    assert done.returncode == 0, done.stdout + done.stderr
    assert "goes on with what was begun" in done.stderr
    report: dict[str, Any] = json.loads(done.stdout)
    written = {name: [one["name"] for one in drive["written"]] for name, drive in report["drives"].items()}
    assert written == {"conveyor/fu1": ["P102.1"], "conveyor/fu2": ["P513"]}
    assert [one["verdict"] for one in report["drop_test"]["drives"]] == ["reacted", "reacted"]
    assert [one["verdict"] for one in report["audit"]] == ["stops", "stops"]
    assert commands.parameters("read", "conveyor/fu1", "P102") == "P102 = 1.5 s\n"
    as_text = Path(report["report_files"][1]).read_text("utf-8")
    assert "# Exchange of conveyor: done\n" in as_text
    assert "| P102.1 | 2.0 | 1.5 |" in as_text
    assert report["sha256"] in as_text
    assert not list(commands.folder.rglob("*.unfinished.json"))


def test_a_node_with_the_old_serial_number_was_not_exchanged(commands: Commands) -> None:
    file = commands.backup("lift/drive")
    done = commands.exchange("lift", file)
    assert done.returncode == 1, done.stdout + done.stderr
    assert f"still has the serial number {SERIAL}: it was not exchanged" in done.stderr
    text = file.read_text("utf-8")
    file.write_text(text.replace(f"0x{SERIAL:08X}", f"0x{OLD_SERIAL:08X}"), "utf-8")
    done = commands.exchange("lift", file)
    assert done.returncode == 0, done.stdout + done.stderr
    assert f"serial number {SERIAL}, was {OLD_SERIAL}" in done.stderr


def test_a_device_of_another_kind_gets_nothing(commands: Commands) -> None:
    file = commands.backup(
        "pump/drive", (r"vendor = 0x\w+", "vendor = 0x00000001"), (r'"C00039/1" = .*', '"C00039/1" = 35.0')
    )
    done = commands.exchange("pump", file)
    assert done.returncode == 2, done.stdout + done.stderr
    assert "the file is of a node with vendor 00000001h" in done.stderr
    assert "35" not in commands.parameters("read", "pump/drive", "C00039/1")
    done = commands.exchange("lift", file)
    assert done.returncode == 2, "it is of a drive of another node"
    assert not list(commands.folder.rglob("exchanges"))


def test_what_ended_early_goes_on_and_reports_all_of_it(commands: Commands) -> None:
    """A Lenze as delivered runs on, so its drop test fails until somebody sets C00593/1."""
    file = commands.backup("pump/drive", (r'"C00039/1" = .*', '"C00039/1" = 35.0'))
    done = commands.exchange("pump", file)
    assert done.returncode == 1, done.stdout + done.stderr
    assert "# Exchange of pump: NOT done" in done.stdout
    assert list(commands.folder.rglob("pump.unfinished.json"))
    done = commands.exchange("pump", file, "--json")
    assert "goes on with what was begun" in done.stderr
    [written] = json.loads(done.stdout)["drives"]["pump/drive"]["written"]
    assert (written["name"], written["value"]) == ("C00039/1", 35.0)
