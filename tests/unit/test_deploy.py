"""Files for an edge box: the service unit, its user, the network files, the example site."""

from __future__ import annotations

import configparser
import re
import shutil
import signal
import subprocess
from pathlib import Path

import pytest
from annotated_types import Le

from bridge.cli.ending_signals import ENDING
from bridge.config import OpcUaTable
from bridge.lint import lint
from bridge.project import load_project
from bridge.service.bus_process import _START_S

ROOT = Path(__file__).parents[2]
UNIT = ROOT / "systemd" / "drivebridge.service"


def sections(path: Path) -> configparser.ConfigParser:
    # A key that comes twice adds to the first in systemd's files; none of what is read here does.
    parser = configparser.ConfigParser(strict=False, interpolation=None)
    parser.optionxform = str  # type: ignore[assignment, method-assign]
    parser.read_string(path.read_text())
    return parser


@pytest.fixture(scope="module")
def service() -> configparser.SectionProxy:
    return sections(UNIT)["Service"]


def seconds(text: str) -> float:
    number, unit = re.fullmatch(r"(\d+)(ms|s)", text).groups()  # type: ignore[union-attr]
    return int(number) / (1000 if unit == "ms" else 1)


def test_a_service_that_hangs_is_restarted_within_seconds(service: configparser.SectionProxy) -> None:
    assert service["Type"] == "notify"
    assert service["NotifyAccess"] == "main"
    assert service["Restart"] == "always"
    assert seconds(service["WatchdogSec"]) + seconds(service["TimeoutAbortSec"]) <= 5
    assert seconds(service["RestartSec"]) <= 1
    assert sections(UNIT)["Unit"]["StartLimitIntervalSec"] == "0"


def test_it_has_time_to_wait_for_its_fronts(service: configparser.SectionProxy) -> None:
    # And for the certificate that is made at the first start.
    assert seconds(service["TimeoutStartSec"]) >= _START_S + 30


def test_a_site_file_with_faults_is_not_tried_again(service: configparser.SectionProxy) -> None:
    assert service["RestartPreventExitStatus"] == "2"


def test_the_service_runs_the_contract_s_command_as_its_own_user(service: configparser.SectionProxy) -> None:
    assert service["ExecStart"] == "/usr/bin/drivebridge run /etc/drivebridge/site.toml"
    assert service["User"] == service["Group"] == "drivebridge"
    assert service["StateDirectory"] == service["RuntimeDirectory"] == "drivebridge"
    assert service["RuntimeDirectoryMode"] == "0700"
    users = (ROOT / "systemd" / "drivebridge.sysusers").read_text()
    assert re.search(r"^u\s+drivebridge\s+-\s.*/usr/sbin/nologin$", users, re.MULTILINE)


def test_the_service_may_open_port_502_and_nothing_else(service: configparser.SectionProxy) -> None:
    assert service["AmbientCapabilities"] == service["CapabilityBoundingSet"] == "CAP_NET_BIND_SERVICE"
    assert service["NoNewPrivileges"] == "yes"
    assert service["ProtectSystem"] == "strict"
    assert "AF_CAN" in service["RestrictAddressFamilies"].split()


def test_fronts_do_not_inherit_the_real_time_priority(service: configparser.SectionProxy) -> None:
    assert service["CPUSchedulingPolicy"] == "fifo"
    assert service["CPUSchedulingResetOnFork"] == "yes"


def test_no_front_outlives_the_bus_process(service: configparser.SectionProxy) -> None:
    assert service["KillMode"] == "mixed"


def test_the_bus_process_is_ended_by_a_signal_that_stops_its_drives(
    service: configparser.SectionProxy,
) -> None:
    assert getattr(signal, service.get("KillSignal", "SIGTERM")) in ENDING
    [bound] = [one.le for one in OpcUaTable.model_fields["shutdown_notice_s"].metadata if isinstance(one, Le)]
    # 3 s for a front, 2 s each for two zenoh sessions and the audit log: what it may take altogether. The
    # clients' notice comes on top of it at most.
    assert seconds(service["TimeoutStopSec"]) >= 15 + float(str(bound))


@pytest.mark.skipif(not shutil.which("systemd-analyze"), reason="systemd-analyze is not installed")
def test_systemd_finds_no_fault_in_the_unit(tmp_path: Path) -> None:
    # The command is not installed where the tests run, and systemd would say so.
    copy = tmp_path / UNIT.name
    copy.write_text(re.sub(r"^ExecStart=\S+", "ExecStart=/bin/true", UNIT.read_text(), flags=re.MULTILINE))
    result = subprocess.run(["systemd-analyze", "verify", str(copy)], capture_output=True, text=True)
    assert (result.returncode, result.stderr) == (0, "")


def test_the_example_site_is_valid_and_fits_the_network_files() -> None:
    project = load_project(ROOT / "deploy" / "site.example.toml")
    site = project.site
    assert not lint(site, project.families, project.path, {}).findings
    assert site.modbus
    assert site.opcua
    assert site.zenoh
    (bus,) = site.bus
    network = sections(ROOT / "deploy" / "80-can0.network")
    assert network["Match"]["Name"] == bus.channel
    assert network["CAN"]["BitRate"] == f"{bus.bitrate // 1000}K"
