"""``audit`` and ``drop-test`` on real SocketCAN, with the simulated drives of four families."""

from __future__ import annotations

import hashlib
import json
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.support import sites
from tests.support.process import drivebridge, drivebridge_called
from tests.support.sniffer import sniffing

pytestmark = pytest.mark.nightly

NODES = (
    sites.node(
        sites.drive("fu1", "modbus", 1000, "parameters = { P105 = 50.0 }"),
        sites.drive("fu2", "modbus", 1000, "parameters = { P105 = 50.0 }"),
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
    sites.node(
        sites.drive("drive", "none", 0, 'accepts = { runs_on = "a fan, which may turn" }'),
        name="fan",
        node_id=8,
        mapping="cia402/profile-velocity",
    ),
)


class Commands:
    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.site = sites.write(folder, sites.socketcan(*NODES), sites.modbus())

    def call(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        command, *others = arguments
        return drivebridge_called(command, str(self.site), *others)

    def verdicts(self) -> dict[str, Any]:
        done = self.call("audit", "--json")
        assert done.returncode == 1, done.stdout + done.stderr
        return {one["drive"]: one for one in json.loads(done.stdout)["drives"]}


@pytest.fixture
def commands(tmp_path: Path) -> Iterator[Commands]:
    commands = Commands(tmp_path)
    with drivebridge(tmp_path, "simulate", "simulate", str(commands.site)) as process:
        process.wait_output("simulating")
        yield commands


def test_audit_reads_what_the_drives_would_do_before_and_beside_the_bridge(commands: Commands) -> None:
    before = commands.verdicts()
    assert {name: one["verdict"] for name, one in before.items()} == {
        "conveyor/fu1": "runs on",
        "conveyor/fu2": "runs on",
        "pump/drive": "runs on",
        "lift/drive": "runs on",
        "fan/drive": "runs on",
    }
    assert before["pump/drive"]["reason"].startswith("C00593/1 is 0 (no reaction)")
    assert (before["fan/drive"]["ok"], before["pump/drive"]["ok"]) == (True, False)
    folder, site = commands.folder, str(commands.site)
    with drivebridge(folder, "run", "run", site, "--role", "bus", "--role", "zenoh", notify=True) as bridge:
        bridge.wait_ready()
        for node in ("conveyor", "pump", "lift", "fan"):
            bridge.wait_output(f"{node}: node operational")
        beside = commands.verdicts()
    assert {name: (one["verdict"], one["bridge_ms"]) for name, one in beside.items()} == {
        "conveyor/fu1": ("stops", 500),
        "conveyor/fu2": ("stops", 500),
        "pump/drive": ("runs on", 0),
        "lift/drive": ("stops", 400),
        "fan/drive": ("runs on", 0),
    }
    assert all(one["read"] for one in beside.values())


def test_drop_test_proves_measures_and_signs(commands: Commands) -> None:
    with sniffing() as bus:
        done = commands.call(
            "drop-test", "conveyor", "--yes-i-am-at-the-machine", "--operator", "ann", "--json"
        )
        assert done.returncode == 0, done.stdout + done.stderr
        enabling = [frame for can_id in (0x205, 0x305) for frame in bus.of(can_id) if frame.data[0] & 8]
        assert not enabling, "no drive was ever enabled"
    report = json.loads(done.stdout)
    for drive in report["drives"]:
        assert drive["verdict"] == "reacted"
        assert (drive["own_ms"], drive["state_after"]) == (400, "fault")
        assert 350 <= drive["reacted_ms"] <= drive["bound_ms"] == 450
    assert report["operator"] == "ann"
    assert report["site"]["sha256"] == hashlib.sha256(commands.site.read_bytes()).hexdigest()
    as_json, as_text = map(Path, report.pop("files"))
    assert json.loads(as_json.read_text("utf-8")) == report
    signed = report.pop("sha256")
    text = json.dumps(report, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    assert hashlib.sha256(text.encode()).hexdigest() == signed
    assert signed in as_text.read_text("utf-8")
    assert "Signature: ___" in as_text.read_text("utf-8")


def test_drop_test_of_a_drive_that_runs_on_fails(commands: Commands) -> None:
    done = commands.call("drop-test", "pump", "--yes-i-am-at-the-machine")
    assert done.returncode == 1, done.stdout + done.stderr
    assert "NOT passed" in done.stdout
    assert "pump/drive: did nothing" in done.stdout


def test_drop_test_is_refused_without_consent_and_beside_a_bridge(commands: Commands) -> None:
    assert commands.call("drop-test", "pump").returncode == 2
    folder, site = commands.folder, str(commands.site)
    with drivebridge(folder, "run", "run", site, "--role", "bus", "--role", "zenoh", notify=True) as bridge:
        bridge.wait_ready()
        done = commands.call("drop-test", "pump", "--yes-i-am-at-the-machine")
    assert done.returncode == 1
    assert "another master is active on can0" in done.stderr
