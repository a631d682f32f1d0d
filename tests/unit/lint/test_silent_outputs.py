"""Judgements on outputs of a node that is no drive, before it is asked and after."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from bridge.bustools.own_check import OwnCheck
from bridge.canopen.frame import Frame
from bridge.catalogue import Catalogue
from bridge.cli.app import make_app
from bridge.drive import OwnVerdict
from bridge.lint import CheckResult, Severity, lint
from bridge.project import Project, load_project
from bridge.sim.catalogue import simulate_description
from tests.support import sites
from tests.support.devices import DEVICES, description_of

RUN = CliRunner()
SAFE = "own_timeout_ms = 400\nenforce = true\n"
OWNED = '[bus.node.outputs]\ncontrol = "modbus"\nfieldbus_timeout_ms = 300\n'


def project_of(folder: Path, more: str) -> Project:
    (folder / "io16.eds").write_bytes((DEVICES / "io16.eds").read_bytes())
    block = sites.node(name="io", node_id=21, mapping="eds:io16.eds", more=more)
    return load_project(sites.write(folder, sites.socketcan(block), sites.modbus()))


def judged(folder: Path, more: str) -> CheckResult:
    project = project_of(folder, more)
    return lint(project.site, project.families, project.path, project.downloads)


def warnings(folder: Path, more: str) -> list[str]:
    return [finding.fault.message for finding in judged(folder, more).of(Severity.WARNING)]


def test_outputs_that_the_node_makes_safe_have_a_time(tmp_path: Path) -> None:
    verdict = judged(tmp_path, SAFE + OWNED)
    assert not verdict.findings
    (case,) = verdict.worst_cases
    assert case.drive == "io"
    assert 300 < case.stop.ms < 400
    assert case.own.bridge_ms == 500, "dead-man time and 1016h"


def test_the_rpdos_of_outputs_are_in_the_load(tmp_path: Path) -> None:
    verdict = judged(tmp_path, SAFE + OWNED)
    # Two RPDOs of 2 and 4 bytes every 10 ms are 14 % of 1 Mbit/s at most, SYNC and heartbeats the rest.
    assert verdict.loads[0].load_percent > 1.4
    assert verdict.worst_cases[0].wire.frames_ms > 0.1


@pytest.mark.parametrize(
    ("more", "said"),
    [
        pytest.param(OWNED, "stay as they are when the bridge falls silent: 1016:01 is 0", id="no watch"),
        pytest.param(
            f'{SAFE}[[bus.node.configure]]\nobject = "6206:01"\ntype = "uint8"\nvalue = 0x0F\n{OWNED}',
            "digital_outputs_1_to_8 keeps 4 of its bits: 6206:01 is Fh",
            id="error mode",
        ),
        pytest.param(
            f'{SAFE}[[bus.node.configure]]\nobject = "1029:01"\ntype = "uint8"\nvalue = 1\n{OWNED}',
            "",
            id="1029h is enforced",
        ),
        pytest.param(
            f"{SAFE}{OWNED}on_expiry = {{ digital_outputs_1_to_8 = 1 }}",
            "digital_outputs_1_to_8 becomes 0h by 6207:01, not 1h",
            id="another safe value",
        ),
        pytest.param(f"{SAFE}{OWNED}".replace("300", "0"), "is 0: the outputs of io stay", id="no time-out"),
    ],
)
def test_what_keeps_outputs_from_being_safe_is_told(tmp_path: Path, more: str, said: str) -> None:
    found = warnings(tmp_path, more)
    assert [said in one for one in found] == ([True] if said else [])


@pytest.mark.parametrize(
    "more",
    [
        pytest.param("", id="nobody commands them"),
        pytest.param(
            OWNED + "[bus.node.outputs.accepts]\nruns_on = 'a lamp, nothing moves'", id="it is accepted"
        ),
        pytest.param(
            OWNED + "on_expiry = { digital_outputs_1_to_8 = 'hold', digital_outputs_9_to_16 = 'hold', "
            "analogue_output_1 = 'hold', analogue_output_2 = 'hold' }",
            id="all hold",
        ),
    ],
)
def test_what_is_meant_so_is_not(tmp_path: Path, more: str) -> None:
    assert not warnings(tmp_path, more)


def test_audit_has_them_beside_the_drives(tmp_path: Path) -> None:
    path = project_of(tmp_path, OWNED).path
    said = RUN.invoke(make_app("audit"), ["audit", "--offline", str(path)])
    assert said.exit_code == 1
    assert "error: io would keep its outputs when the bridge falls silent: 1016:01 is 0" in said.stdout
    assert "own_timeout_ms = 300 and enforce = true" in said.stdout
    facts = json.loads(RUN.invoke(make_app("audit"), ["audit", "--offline", "--json", str(path)]).stdout)
    assert [(one["drive"], one["ok"]) for one in facts["drives"]] == [("io", False)]


@pytest.mark.parametrize(
    ("watch_ms", "mode", "verdict"),
    [(400, 0xFF, OwnVerdict.STOPS), (400, 0x7F, OwnVerdict.RUNS_ON), (0, 0xFF, OwnVerdict.RUNS_ON)],
)
def test_the_node_is_asked(tmp_path: Path, watch_ms: int, mode: int, verdict: OwnVerdict) -> None:
    project = project_of(tmp_path, OWNED)
    catalogue = Catalogue.of(project.site, project.families)
    simulated = simulate_description(description_of("io16.eds"), 21)
    simulated.start(0.0)
    word = (127 << 16 | watch_ms).to_bytes(4, "little")
    simulated.on_frame(Frame(0x615, b"\x23\x16\x10\x01" + word), 0.0)
    simulated.on_frame(Frame(0x615, bytes((0x2F, 0x06, 0x62, 0x02, mode, 0, 0, 0))), 0.0)
    simulated.take_frames()
    task = OwnCheck(list(catalogue.nodes.values()), 0.0)
    now = 0.0
    while not task.is_finished(now) and now < 5.0:
        task.on_time(now)
        for frame in task.take_frames():
            simulated.on_frame(frame._replace(time=now), now)
        for frame in simulated.take_frames():
            task.on_frame(frame._replace(time=now))
        now += 0.001
    assert not task.failed
    assert task.found["io"].verdict is verdict


@pytest.mark.parametrize(("name", "kind"), [("6200:01", "uint8"), ("6200:02", "uint8"), ("6411:01", "int16")])
def test_a_download_that_switches_an_output_at_every_boot_up_is_an_error(
    tmp_path: Path, name: str, kind: str
) -> None:
    more = f'{SAFE}configure = [{{ object = "{name}", type = "{kind}", value = 1 }}]\n{OWNED}'
    (error,) = judged(tmp_path, more).of(Severity.ERROR)
    assert error.fault.message.startswith(f"{name} of io is 1 at every boot-up")


@pytest.mark.parametrize(
    "download", ['"6200:01", type = "uint8", value = 0', '"6206:01", type = "uint8", value = 255']
)
def test_what_makes_outputs_safe_may_be_downloaded(tmp_path: Path, download: str) -> None:
    more = f"{SAFE}configure = [{{ object = {download} }}]\n{OWNED}"
    assert not judged(tmp_path, more).findings
