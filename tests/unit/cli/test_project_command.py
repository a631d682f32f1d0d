"""``drivebridge check``: what it prints of a site, for people and for machines, and its exit code."""

from __future__ import annotations

import json
from pathlib import Path

from typer.testing import CliRunner, Result

from bridge.base.errors import FileFaults
from bridge.cli.app import make_app
from tests.support import sites


def check(folder: Path, *arguments: str, drive: str = sites.ACCEPTED, bus: str = "") -> Result:
    whole = sites.bus(sites.node(sites.drive("fu1", "zenoh", 200, drive)), more=bus)
    path = sites.write(folder, whole, sites.zenoh())
    return CliRunner().invoke(make_app(), ["check", str(path), *arguments])


def test_a_sound_site_is_told_in_one_line_at_the_end(tmp_path: Path) -> None:
    done = check(tmp_path)
    assert done.exit_code == 0
    assert done.stdout.splitlines()[-1] == f"{tmp_path / 'site.toml'}: 1 drive on 1 bus, no faults"


def test_a_fault_of_the_file_is_2(tmp_path: Path) -> None:
    done = check(tmp_path, "--json", drive="nonsense = 1")
    assert done.exit_code == 2
    told = json.loads(done.stdout)
    assert told["ok"] is False
    (fault,) = told["faults"]
    assert (fault["severity"], fault["key"]) == ("error", "bus[0].node[0].drive[0].nonsense")


def test_machines_get_drives_buses_and_sums(tmp_path: Path) -> None:
    told = json.loads(check(tmp_path, "--json").stdout)
    assert told["ok"] is True
    assert (told["drives"], told["devices"], told["faults"]) == (["conveyor/fu1"], [], [])
    assert [one["bus"] for one in told["buses"]] == ["can0"]
    assert told["worst_cases"][0]["drive"] == "conveyor/fu1"


def test_a_warning_is_no_fault_and_stands_beside_the_answer(tmp_path: Path) -> None:
    done = check(tmp_path, bus="sync_period_ms = 10\nsync_window_us = 5000")
    assert done.exit_code == 0
    assert "warning: " in done.stderr


def test_what_cannot_work_is_a_fault_of_the_file(tmp_path: Path) -> None:
    """Two nodes would send on one identifier."""
    taken = f"{sites.ACCEPTED}\nrpdo = {{ cob_id = 0x205 }}"
    nodes = [
        sites.node(sites.drive("fu1", "none", 0, sites.ACCEPTED)),
        sites.node(sites.drive("fu1", "none", 0, taken), name="b", node_id=6),
    ]
    path = str(sites.write(tmp_path, sites.bus(*nodes)))
    done = CliRunner().invoke(make_app(), ["check", path])
    assert isinstance(done.exception, FileFaults)
    assert "RPDO1 of b has COB-ID 205h" in str(done.exception)
    done = CliRunner().invoke(make_app(), ["check", path, "--json"])
    assert done.exit_code == 2
    assert json.loads(done.stdout)["ok"] is False


def test_more_drives_than_modbus_has_units_are_a_fault(tmp_path: Path) -> None:
    """1 … 247 (Modbus over serial line V1.02, 2.2), and `run` refuses them."""
    drives = [sites.drive(slot, "none", 0, sites.ACCEPTED) for slot in ("fu1", "fu2")]
    nodes = [sites.node(*drives, name=f"n{n}", node_id=n % 60 + 1) for n in range(124)]
    buses = [sites.bus(*nodes[at : at + 60], name=f"can{at}") for at in range(0, 124, 60)]
    done = CliRunner().invoke(make_app(), ["check", "--json", str(sites.write(tmp_path, *buses))])
    assert done.exit_code == 2
    (fault,) = json.loads(done.stdout)["faults"]
    assert (fault["key"], fault["message"]) == ("unit_id", "more than 247 drives have no Modbus unit id")
