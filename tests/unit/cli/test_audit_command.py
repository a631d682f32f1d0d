"""``drivebridge audit`` and the report of ``drop-test``, without a bus."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from bridge.cli.app import make_app
from tests.support import sites
from tests.support.process import REPOSITORY

ACCEPTED = 'accepts = { runs_on = "a fan, which may turn" }'


def call(*arguments: str):
    return CliRunner().invoke(make_app(), list(arguments))


def site_of(folder: Path, mapping: str, slot: str = "drive", *, node: str = "", drive: str = "") -> str:
    whole = sites.node(sites.drive(slot, "modbus", 200, drive), name="n", mapping=mapping, more=node)
    return str(sites.write(folder, sites.bus(whole), sites.modbus()))


def test_lenzes_factory_setting_is_an_error_that_says_what_to_set(tmp_path):
    done = call("audit", site_of(tmp_path, "lenze/8400-motec"))
    assert done.exit_code == 1
    assert (
        "error: n/drive would run on when the bridge falls silent: C00593/1 is 0 (no reaction)" in done.stdout
    )
    lines = [line.partition("#")[0].strip() for line in done.stdout.splitlines()]
    start = lines.index("[[bus.node.configure]]")
    assert lines[start : start + 8] == [
        "[[bus.node.configure]]",
        'object = "5E9A:01"',
        'type = "uint16"',
        "value = 300",
        "[[bus.node.configure]]",
        'object = "5DAE:01"',
        'type = "uint8"',
        "value = 1",
    ]


def test_each_drive_of_the_demo_stops_when_the_bridge_falls_silent():
    done = call("audit", str(REPOSITORY / "bridge" / "demo" / "site.toml"), "--json")
    answer = json.loads(done.stdout)
    verdicts = {drive["drive"]: drive["verdict"] for drive in answer["drives"]}
    assert set(verdicts.values()) == {"stops"}
    assert len(verdicts) == 7
    assert (done.exit_code, answer["ok"]) == (0, True)


def test_what_it_says_to_set_makes_it_content(tmp_path):
    told = call("audit", site_of(tmp_path, "lenze/8400-motec")).stdout
    start = told.index("  [[bus.node.configure]]")
    remedy = told[start : told.index("# or")]
    done = call("audit", site_of(tmp_path, "lenze/8400-motec", drive=remedy))
    assert done.exit_code == 0, done.stdout
    assert "400 ms" in done.stdout


@pytest.mark.parametrize("slot", ["fu1", "fu2"])
def test_a_nord_interface_needs_p151(tmp_path, slot: str):
    done = call("audit", site_of(tmp_path, "nord/sk-tu4-cao", slot), "--json")
    answer = json.loads(done.stdout)
    assert (done.exit_code, answer["ok"]) == (1, False)
    (drive,) = answer["drives"]
    assert (drive["verdict"], drive["read"], drive["bridge_ms"]) == ("runs on", False, 0)
    assert {"object": "2097:01", "type": "uint16", "value": 300} in drive["configure"]


def test_an_accepted_drive_is_no_error(tmp_path):
    done = call("audit", site_of(tmp_path, "nord/sk-tu4-cao", "fu1", drive=ACCEPTED))
    assert done.exit_code == 0
    assert "runs on, accepted" in done.stdout
    assert "accepted: n/fu1 would run on when the bridge falls silent: a fan, which may turn" in done.stdout


def test_a_drive_that_has_guarding_alone_is_told_so(tmp_path):
    done = call("audit", site_of(tmp_path, "stoeber/5000", "axis1"))
    assert done.exit_code == 1
    assert '  supervision = "guarding"\n' in done.stdout
    guarded = site_of(tmp_path, "stoeber/5000", "axis1", node='supervision = "guarding"')
    assert call("audit", guarded).exit_code == 0


def test_a_bus_that_is_not_there_is_bad_usage(tmp_path):
    assert call("audit", site_of(tmp_path, "stoeber/5000", "axis1"), "--bus", "can7").exit_code == 2


def test_a_drop_test_needs_a_bus_and_somebody_at_the_machine(tmp_path):
    path = site_of(tmp_path, "lenze/8400-motec")
    assert call("drop-test", path, "n").exit_code == 2
    assert call("drop-test", path, "m", "--yes-i-am-at-the-machine").exit_code == 2
    text = Path(path).read_text("utf-8").replace('"virtual"', '"socketcan"\nchannel = "vcan77"')
    Path(path).write_text(text, "utf-8")
    done = call("drop-test", path, "n")
    assert done.exit_code == 2
    assert "somebody has to be at the machine" in " ".join(done.output.replace("│", " ").split())
