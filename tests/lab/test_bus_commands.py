"""scan, sdo, nmt and monitor on real SocketCAN, beside a simulated node, a foreign one, and a bridge."""

from __future__ import annotations

import json
import signal
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.lab.sites import LabSite, lab_site
from tests.support.process import drivebridge, peer, until
from tests.support.process import drivebridge_called as call
from tests.support.sniffer import sniffing

pytestmark = pytest.mark.nightly

DIRECT = ("--interface", "socketcan", "--channel", "vcan0", "--bitrate", "1000000")
SCAN_LIMIT_S = 2.0


def answer(*arguments: str) -> Any:
    """What a script gets from a command that does what it should."""
    done = call(*arguments, "--json")
    assert done.returncode == 0, done.stdout + done.stderr
    return json.loads(done.stdout)


@pytest.fixture
def site(tmp_path: Path) -> LabSite:
    return lab_site(tmp_path, timeout_ms=0, controls=("modbus",))


@pytest.fixture
def simulation(site: LabSite, tmp_path: Path) -> Iterator[LabSite]:
    with drivebridge(tmp_path, "simulate", "simulate", str(site.path)) as process:
        process.wait_output("simulating")
        yield site


def test_scan_finds_the_simulated_node_and_names_its_mapping(simulation: LabSite) -> None:
    with sniffing() as bus:
        [node] = answer("scan", *DIRECT)
        asked = [
            frame for frame in bus.frames if 0x601 <= frame.can_id <= 0x67F or frame.can_id >= 0x4000_0000
        ]
    assert node["id"] == 5
    assert node["name"] == "SK TU4-CAO"
    assert set(node["identity"]) == {"vendor", "product", "revision", "serial", "device_type"}
    assert all(isinstance(value, int) for value in node["identity"].values())
    assert node["nmt_state"] == "pre_operational"
    assert (node["mapping"], node["site_node"]) == ("nord/sk-tu4-cao", None)
    assert asked[-1].time - asked[0].time < SCAN_LIMIT_S


def test_scan_with_a_site_knows_its_names(simulation: LabSite) -> None:
    [node] = answer("scan", str(simulation.path), "--bus", "can0")
    assert node["site_node"] == "conveyor"
    assert "conveyor" in call("scan", str(simulation.path)).stdout


def test_scan_works_while_a_bridge_is_running(simulation: LabSite, tmp_path: Path) -> None:
    with drivebridge(
        tmp_path, "run", "run", str(simulation.path), "--role", "bus", "--role", "zenoh", notify=True
    ) as bridge:
        bridge.wait_ready()
        bridge.wait_output("node operational")
        [node] = answer("scan", str(simulation.path))
        assert (node["id"], node["nmt_state"]) == (5, "operational")
        [node] = answer("scan", str(simulation.path), "--passive", "--seconds", "0.5")
        assert (node["id"], node["nmt_state"], node["name"]) == (5, "operational", "")
        assert bridge.output().count("node operational") == 1, bridge.output()


def test_scan_never_lists_a_phantom(tmp_path: Path) -> None:
    with peer(tmp_path, "phantom_slave", "vcan0") as slave:
        slave.wait_output("is there")
        with sniffing() as bus:
            done = call("scan", *DIRECT, "--json")
            assert bus.of(0x5C5), "the phantom has answered"
    assert [node["id"] for node in json.loads(done.stdout)] == [5]
    assert "answers for id 69 are no node" in done.stderr


def test_scan_finds_a_foreign_slave(tmp_path: Path) -> None:
    with peer(tmp_path, "foreign_slave", "vcan0", "6") as slave:
        slave.wait_output("is there")
        [node] = answer("scan", *DIRECT)
    assert (node["id"], node["name"], node["mapping"]) == (6, "canopen.LocalNode", "cia402/profile-velocity")
    assert node["identity"]["vendor"] == 0x1234


def test_scan_of_an_empty_bus_finds_nothing() -> None:
    assert answer("scan", *DIRECT) == []


def test_sdo_reads_and_writes(simulation: LabSite) -> None:
    site = str(simulation.path)
    read = answer("sdo", "read", site, "conveyor", "1008", "--type", "string")
    assert read["value"] == "SK TU4-CAO"
    assert call("sdo", "read", "5", "1008", *DIRECT).stdout == '"SK TU4-CAO"\n'
    written = call("sdo", "write", "5", "1017", "500", "--type", "uint16", "--yes", *DIRECT)
    assert (written.returncode, written.stdout) == (0, "1017h:00 of node 5 written: 500\n")
    assert answer("sdo", "read", "0x5", "1017:00", "--type", "uint16", *DIRECT)["value"] == 500


def test_sdo_says_why_a_node_refuses(simulation: LabSite) -> None:
    refused = call("sdo", "read", "5", "5FFF:01", *DIRECT)
    assert refused.returncode == 1
    assert "object does not exist in the object dictionary (06020000h)" in refused.stderr
    silent = call("sdo", "read", "9", "1000", "--timeout-ms", "100", *DIRECT)
    assert silent.returncode == 1
    assert "timed out" in silent.stderr


def test_nmt_tells_the_state_that_the_node_reports(simulation: LabSite) -> None:
    call("sdo", "write", "5", "1017", "50", "--type", "uint16", *DIRECT)
    assert answer("nmt", "start", "5", *DIRECT)["nodes"] == [
        {"id": 5, "nmt_state": "operational", "reached": True}
    ]
    assert call("nmt", "stop", "all", *DIRECT, "--seconds", "0.5").stdout == "node 5: stopped\n"
    assert call("nmt", str(simulation.path), "reset-node", "conveyor").stdout == "node 5: pre operational\n"
    nobody = call("nmt", "start", "9", *DIRECT, "--seconds", "0.2")
    assert nobody.returncode == 0
    assert "nothing was heard" in nobody.stdout


def test_monitor_says_what_is_on_the_bus(simulation: LabSite, tmp_path: Path) -> None:
    log = tmp_path / "candump.log"
    arguments = ("monitor", str(simulation.path), "--json", "--log", str(log))
    with sniffing() as bus, drivebridge(tmp_path, "monitor", *arguments) as monitor:

        def it_listens() -> bool:
            bus.send(0x77F, b"\x05")
            return bool(monitor.output())

        until(it_listens, 60.0, "a heartbeat is shown")
        call("sdo", "read", "5", "1018:09", *DIRECT)
        call("nmt", "start", "5", *DIRECT, "--seconds", "0.3")
        monitor.wait_output("TPDO1 conveyor/fu1")
        monitor.signal(signal.SIGINT)
        until(lambda: monitor.popen.poll() is not None, 40.0, "Ctrl-C ends it")
        assert monitor.popen.returncode == 0
        seen = [json.loads(line) for line in monitor.output().splitlines()]
    kinds = {frame["kind"] for frame in seen}
    assert kinds >= {"sdo", "nmt", "pdo"}
    texts = [frame["text"] for frame in seen]
    assert "start: conveyor" in texts
    assert any("aborts: sub-index does not exist" in text for text in texts)
    pdo = next(frame for frame in seen if frame["label"] == "TPDO1 conveyor/fu1")
    assert pdo["values"]["state"] == "switch_on_inhibited"
    assert [frame["time"] for frame in seen] == sorted(frame["time"] for frame in seen)
    assert len(log.read_text().splitlines()) == len(seen)


def test_monitor_filters_counts_and_ends(simulation: LabSite) -> None:
    call("sdo", "write", "5", "1017", "20", "--type", "uint16", *DIRECT)
    done = call("monitor", *DIRECT, "--kind", "heartbeat", "--node", "5", "--count", "3")
    assert done.returncode == 0
    assert [line.split("  ")[-1] for line in done.stdout.splitlines()] == ["pre operational"] * 3
    tally = answer("monitor", *DIRECT, "--statistics", "--seconds", "1")
    [row] = [row for row in tally["cob_ids"] if row["cob_id"] == "705"]
    assert row["frames_per_s"] == pytest.approx(50, rel=0.3)
    assert "705" in call("monitor", *DIRECT, "--statistics", "--seconds", "0.5").stdout


@pytest.mark.parametrize(
    "command", [("scan",), ("monitor",), ("nmt", "start", "5"), ("sdo", "read", "5", "1000")]
)
def test_a_bus_that_is_not_there_is_exit_3(command: tuple[str, ...]) -> None:
    done = call(*command, "--interface", "socketcan", "--channel", "vcan99")
    assert done.returncode == 3
    assert "vcan99" in done.stderr
