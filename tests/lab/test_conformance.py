"""``conformance`` on real SocketCAN: our simulated devices, and a slave that we did not write."""

from __future__ import annotations

import json
import signal
from pathlib import Path
from typing import Any

import pytest

from tests.lab.test_exchange import NODES
from tests.support import sites
from tests.support.process import drivebridge, drivebridge_called, peer, until
from tests.support.sniffer import sniffing

pytestmark = pytest.mark.nightly


def report_of(site: Path, node: str, *options: str, status: int = 0) -> dict[str, Any]:
    done = drivebridge_called("conformance", str(site), node, "--yes", "--json", *options)
    assert done.returncode == status, done.stdout + done.stderr
    return json.loads(done.stdout)


def verdicts(report: dict[str, Any]) -> dict[str, str]:
    return {one["rule"]: one["verdict"] for one in report["checks"]}


def test_our_own_devices_have_no_faults(tmp_path: Path) -> None:
    site = sites.write(tmp_path, sites.socketcan(*NODES))
    with drivebridge(tmp_path, "simulate", "simulate", str(site)) as process:
        process.wait_output("simulating")
        for node in ("conveyor", "pump", "lift"):
            report = report_of(site, node)
            assert report["ok"]
            assert verdicts(report)["1017h holds again what it held"] == "passed"
        assert all(Path(file).exists() for file in report["files"])


def test_ended_by_a_signal_it_puts_back_what_it_has_changed(tmp_path: Path) -> None:
    site = sites.write(tmp_path, sites.socketcan(NODES[0]))
    with (
        peer(tmp_path, "foreign_slave", "vcan0", "5") as slave,
        sniffing() as bus,
        drivebridge(tmp_path, "try", "conformance", str(site), "conveyor", "--yes") as trying,
    ):
        slave.wait_output("is there")
        until(lambda: len(bus.of(0x705)) > 2, 30.0, "a heartbeat that was not there before")
        trying.signal(signal.SIGINT)
        trying.wait_output("interrupted; what was changed is put back")
        written = [seen.data for seen in bus.of(0x605) if seen.data[:4] == bytes.fromhex("2B171000")]
        assert [int.from_bytes(data[4:6], "little") for data in written] == [100, 0]


def test_the_faults_of_a_foreign_slave_are_found(tmp_path: Path) -> None:
    """canopen.LocalNode answers SDO although it is stopped."""
    site = sites.write(tmp_path, sites.socketcan(NODES[0]))
    with peer(tmp_path, "foreign_slave", "vcan0", "5") as slave:
        slave.wait_output("is there")
        report = report_of(site, "conveyor", "--reset", status=1)
        failed = [rule for rule, verdict in verdicts(report).items() if verdict == "failed"]
        assert failed == ["stopped, SDO is not answered"]
        # It answers by segments, and does not say that it has no blocks.
        assert verdicts(report)["1008h is read as a block"] == "not seen"
        assert verdicts(report)["1017h holds again what it held"] == "passed"
