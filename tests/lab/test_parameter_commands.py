"""``drivebridge parameters`` on real SocketCAN, with the simulated NORD interface."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from bridge.parameter.ledger_file import LedgerFile
from tests.lab.sites import LabSite, lab_site
from tests.support.process import drivebridge, drivebridge_called

pytestmark = pytest.mark.nightly

FU1 = "conveyor/fu1"


class Commands:
    def __init__(self, site: LabSite, folder: Path) -> None:
        self.site = str(site.path)
        self.folder = folder

    def call(self, command: str, *arguments: str) -> subprocess.CompletedProcess[str]:
        return drivebridge_called("parameters", command, self.site, FU1, *arguments)

    def answer(self, command: str, *arguments: str) -> Any:
        done = self.call(command, *arguments, "--json")
        assert done.returncode == 0, done.stdout + done.stderr
        return json.loads(done.stdout)

    def counted(self) -> dict[str, Any]:
        content = json.loads((self.folder / "state" / "eeprom.json").read_text("utf-8"))
        return content["writes"]


@pytest.fixture
def commands(tmp_path: Path) -> Iterator[Commands]:
    site = lab_site(tmp_path, timeout_ms=0, controls=("modbus",))
    with drivebridge(tmp_path, "simulate", "simulate", str(site.path)) as process:
        process.wait_output("simulating")
        yield Commands(site, tmp_path)


def test_read_write_and_save(commands: Commands) -> None:
    [first, second] = commands.answer("read", "P102", "P543[2].3")
    assert (first["value"], first["unit"], first["object"]) == (2.0, "s", "2066:01")
    assert (second["name"], second["object"]) == ("P543[2].3", "221F:07")
    assert commands.call("read", "P513").stdout == "P513 = 1 s\n"
    done = commands.call("write", "P102", "1.03", "--yes")
    assert (done.returncode, done.stdout) == (0, "P102 = 1.03 s, was 2 s\n")
    assert commands.call("write", "P102", "1.03", "--yes").stdout == "P102 = 1.03 s already: not written\n"
    assert commands.call("save", "--yes").stdout == "conveyor: saved\n"
    writes = commands.counted()
    assert writes[FU1]["2066:01"]["writes"] == 1
    assert writes["conveyor"]["1010:01"]["writes"] == 1


def test_a_drive_tells_the_faults_that_it_remembers(commands: Commands) -> None:
    done = drivebridge_called("faults", commands.site, "--drive", FU1)
    assert (done.returncode, done.stdout) == (0, f"{FU1}: remembers no fault\n"), done.stderr
    done = drivebridge_called("faults", commands.site, "--drive", FU1, "--json")
    assert json.loads(done.stdout) == []


def test_what_is_wrong_is_told_with_its_exit_code(commands: Commands) -> None:
    for code, text, arguments in (
        (2, "did you mean P102", ("read", "P1002")),
        (1, "object does not exist", ("read", "P999")),
        (1, "takes 0…320 s, not 400", ("write", "P102", "400", "--yes")),
        (2, "'fast' is no number", ("write", "P102", "fast", "--yes")),
        (1, "is read-only", ("write", "P700[1]", "0", "--yes")),
    ):
        done = commands.call(*arguments)
        assert done.returncode == code, done.stdout + done.stderr
        assert text in " ".join(done.stderr.replace("│", " ").split()), done.stderr


def test_what_is_protected_takes_force_and_a_drive_that_stands(commands: Commands, tmp_path: Path) -> None:
    file = tmp_path / "fu1.toml"
    assert commands.call("backup", str(file)).returncode == 0
    text = file.read_text("utf-8")
    text = text.replace('"P513" = 1.0', '"P513" = 2.5').replace('"P102.1" = 2.0', '"P102.1" = 1.0')
    file.write_text(text, "utf-8")
    done = commands.call("restore", str(file), "--yes")
    assert done.returncode == 2, done.stdout + done.stderr
    assert "P513" in done.stderr
    assert commands.call("read", "P102").stdout == "P102 = 2 s\n", "nothing half applied"
    assert commands.call("write", "P513", "2.5", "--yes").returncode == 2
    done = commands.call("write", "P513", "2.5", "--yes", "--force")
    assert done.returncode == 0, done.stdout + done.stderr
    assert commands.call("restore", str(file), "--yes").returncode == 0


def test_nothing_is_written_beside_another_master(commands: Commands) -> None:
    line = ["cangen", "vcan0", "-I", "77F", "-L", "1", "-D", "05", "-g", "100"]
    with subprocess.Popen(line) as master:
        try:
            for arguments in (("write", "P102", "1.03", "--yes"), ("save", "--yes")):
                done = commands.call(*arguments)
                assert done.returncode == 1, done.stdout + done.stderr
                assert "another master is active" in done.stderr
        finally:
            master.terminate()
    assert commands.call("read", "P102").stdout == "P102 = 2 s\n"


def test_cyclic_writing_is_refused_across_commands(commands: Commands) -> None:
    assert commands.call("write", "P104", "1", "--yes").returncode == 0
    ((place, count),) = commands.counted()[FU1].items()
    assert count["writes"] == 1
    # As eight more commands leave it.
    LedgerFile(commands.folder / "state").merge({(FU1, place): 8 * count["last"]})
    assert commands.call("write", "P104", "10", "--yes").returncode == 0
    done = commands.call("write", "P104", "50", "--yes")
    assert done.returncode == 1
    assert "was written 10 times within 10 min" in done.stderr


def test_a_set_is_backed_up_compared_and_restored(commands: Commands, tmp_path: Path) -> None:
    file = tmp_path / "fu1.toml"
    done = commands.call("backup", str(file))
    assert done.returncode == 0, done.stderr
    assert '"P102.1" = 2.0  # s, acceleration time\n' in file.read_text("utf-8")
    assert commands.call("backup", str(file)).returncode == 2, "a file is not written over by accident"
    assert commands.answer("compare", str(file))["differences"] == []
    commands.call("write", "P102", "1.5", "--yes")
    done = commands.call("compare", str(file))
    assert done.returncode == 1
    assert "P102.1  1.5 s         2 s" in done.stdout
    dry = commands.answer("restore", str(file), "--dry-run")
    assert [one["name"] for one in dry["differences"]] == ["P102.1"]
    restored = commands.answer("restore", str(file), "--yes")
    assert restored["written"] == [{"name": "P102.1", "value": 2.0, "before": 1.5}]
    assert commands.answer("compare", str(file))["ok"]
