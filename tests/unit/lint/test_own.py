"""The drives' own supervision as the site file and the factory tell it; what the site file may ask for."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.lint import Severity, WorstCase, lint
from bridge.project import load_project
from tests.support import sites

SLOTS = {"nord/sk-tu4-cao": "fu1", "stoeber/5000": "axis1"}


def site_of(folder: Path, mapping: str, node: str, *, bus: str = "", drive: str = "") -> Path:
    slot = SLOTS.get(mapping, "drive")
    whole = sites.node(sites.drive(slot, "modbus", 200, drive), name="n", mapping=mapping, more=node)
    return sites.write(folder, sites.bus(whole, more=bus), sites.modbus())


def judge(path: Path) -> tuple[WorstCase, list[str]]:
    project = load_project(path)
    verdict = lint(project.site, project.families, path, project.downloads)
    (case,) = verdict.worst_cases
    return case, [str(one) for one in verdict.of(Severity.ERROR)]


@pytest.mark.landing(11)
@pytest.mark.parametrize(
    ("mapping", "node", "shown"),
    [
        ("lenze/8400-motec", "", "dead bridge: runs on"),
        ("lenze/8400-motec", "own_timeout_ms = 300", "dead bridge: runs on"),
        ("lenze/8400-motec", "own_timeout_ms = 300\nenforce = true", "dead bridge: 400 ms"),
        ("nord/sk-tu4-cao", "", "dead bridge: runs on"),
        (
            "nord/sk-tu4-cao",
            'configure = [{ object = "2097:01", type = "uint16", value = 250 }]',
            "dead bridge: not known",  # P513 may be -0.1
        ),
        ("nord/sk-tu4-cao", "own_timeout_ms = 250\nenforce = true", "dead bridge: 350 ms"),
        ("nord/sk-tu3-cao", "", "dead bridge: not known"),
        ("stoeber/5000", "", "dead bridge: runs on"),
        ("stoeber/5000", 'supervision = "guarding"', "dead bridge: 700 ms"),
        ("cia402/velocity", "", "dead bridge: runs on"),
        ("cia402/velocity", "own_timeout_ms = 300\nenforce = true", "dead bridge: 400 ms"),
    ],
)
def test_check_tells_what_a_dead_bridge_leads_to(tmp_path, mapping: str, node: str, shown: str):
    case, _ = judge(site_of(tmp_path, mapping, node))
    assert f"dead controller: {case.stop.ms} ms" in str(case)
    assert 25 + 200 + 20 + 10 + 10 < case.stop.ms <= 271
    assert shown in str(case)


@pytest.mark.parametrize(
    ("mapping", "node", "message"),
    [
        ("stoeber/5000", "own_timeout_ms = 300", "it has life guarding alone"),
        ("nord/sk-tu3-cao", "own_timeout_ms = 250", "250 is no multiple of 100 ms"),
        ("nord/sk-tu4-cao", "own_timeout_ms = 40000", "takes 1…32767 ms"),
        ("lenze/8400-motec", "own_timeout_ms = 65400", "takes 1…65000 ms"),
        ("nord/sk-tu4-cao", "enforce = true", "has no effect without own_timeout_ms"),
        ("nord/sk-tu4-cao", "own_timeout_ms = 0", "must be at least 1"),
    ],
)
def test_impossible_times_are_faults_of_the_site_file(tmp_path, mapping: str, node: str, message: str):
    with pytest.raises(FileFaults) as caught:
        load_project(site_of(tmp_path, mapping, node))
    (fault,) = caught.value.faults
    assert message in str(fault)
    assert fault.line > 0


@pytest.mark.parametrize(
    ("mapping", "bus", "time_ms", "message"),
    [
        ("nord/sk-tu4-cao", "", 15, "less than two RPDO periods of 10 ms"),
        ("cia402/velocity", "", 150, "less than two heartbeat periods of 100 ms"),
        (
            "cia402/velocity",
            "heartbeat_ms = 0",
            300,
            "waits for the bridge's heartbeat",
        ),
    ],
)
def test_times_that_a_living_bridge_cannot_keep_are_errors(
    tmp_path, mapping: str, bus: str, time_ms: int, message: str
):
    node = f"own_timeout_ms = {time_ms}\nenforce = true"
    _, errors = judge(site_of(tmp_path, mapping, node, bus=bus))
    assert any(message in error and "own_timeout_ms" in error for error in errors), errors


def test_running_on_is_accepted_with_a_reason_only(tmp_path):
    accepted = 'accepts = { runs_on = "an exhaust fan" }'
    case, _ = judge(site_of(tmp_path, "nord/sk-tu4-cao", "", drive=accepted))
    assert case.own.accepted == "an exhaust fan"
    with pytest.raises(FileFaults, match="must say why, in 10 characters or more"):
        load_project(site_of(tmp_path, "nord/sk-tu4-cao", "", drive='accepts = { runs_on = "fan" }'))


def warnings_of(path: Path) -> list[str]:
    project = load_project(path)
    verdict = lint(project.site, project.families, path, project.downloads)
    return [str(one) for one in verdict.of(Severity.WARNING) if "silent" in str(one)]


@pytest.mark.parametrize(
    ("mapping", "node", "message", "remedy"),
    [
        ("stoeber/5000", 'supervision = "heartbeat"', "runs on when the bridge", 'supervision = "guarding"'),
        ("nord/sk-tu4-cao", "", "runs on when the bridge falls silent: P151 is 0", "own_timeout_ms and"),
        (
            "nord/sk-tu4-cao",
            'configure = [{ object = "2097:01", type = "uint16", value = 250 }]',
            "may run on when the bridge falls silent: P513 is not known",
            "own_timeout_ms and enforce",
        ),
        ("nord/sk-tu3-cao", "", "may run on", "own_timeout_ms and enforce"),
        ("cia402/velocity", "", "runs on when the bridge falls silent: 1016:01 is 0", "own_timeout_ms and"),
        ("lenze/8400-motec", "", "does nothing by itself when the bridge falls silent", "own_timeout_ms and"),
    ],
)
def test_a_drive_that_nothing_stops_is_a_warning_with_a_remedy(
    tmp_path: Path, mapping: str, node: str, message: str, remedy: str
) -> None:
    (warning,) = warnings_of(site_of(tmp_path, mapping, node))
    assert message in warning
    assert remedy in warning
    accepted = 'accepts = { runs_on = "an exhaust fan" }'
    assert warnings_of(site_of(tmp_path, mapping, node, drive=accepted)) == []


@pytest.mark.parametrize(
    ("mapping", "node"),
    [
        ("stoeber/5000", 'supervision = "guarding"'),
        ("nord/sk-tu4-cao", "own_timeout_ms = 250\nenforce = true"),
        ("cia402/velocity", "own_timeout_ms = 300\nenforce = true"),
    ],
)
def test_a_drive_that_stops_by_itself_is_none(tmp_path: Path, mapping: str, node: str) -> None:
    assert warnings_of(site_of(tmp_path, mapping, node)) == []
