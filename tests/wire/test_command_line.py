"""The command line as its user meets it: exit codes and the one sentence that helps."""

from __future__ import annotations

import json
import signal
import socket
from pathlib import Path

import pytest

from bridge import __version__
from tests.support import sites
from tests.support.process import drivebridge, free_port
from tests.support.process import drivebridge_called as call


def write_site(folder: Path, interface: str = "virtual", port: int | None = None) -> Path:
    node = sites.node(sites.drive("fu1", "modbus", 0))
    bus = sites.bus(node, interface=interface, more='channel = "nosuchcan"')
    return sites.write(folder, bus, sites.modbus(port or free_port()))


def line_of(path: Path, start: str) -> int:
    """The number of the one line that begins like this."""
    [number] = [n for n, line in enumerate(path.read_text("utf-8").splitlines(), 1) if line.startswith(start)]
    return number


def test_version() -> None:
    done = call("version")
    assert (done.returncode, done.stdout) == (0, f"{__version__}\n")


def test_a_command_that_does_not_exist_is_bad_usage() -> None:
    assert call("fly").returncode == 2


def test_a_good_site_is_checked_and_its_decisions_repeated(tmp_path: Path) -> None:
    done = call("check", str(write_site(tmp_path)))
    assert done.returncode == 0
    assert "1 drive on 1 bus, no faults" in done.stdout
    assert "can0: predicted load 10 %" in done.stdout
    assert "drive[0].fieldbus_timeout_ms: is 0: a silent controller" in done.stderr


@pytest.mark.landing(2)
@pytest.mark.parametrize("command", ["check", "run"])
def test_a_bad_site_is_refused_with_all_its_faults(tmp_path: Path, command: str) -> None:
    path = write_site(tmp_path)
    text = path.read_text("utf-8").replace("id = 5", "id = 555").replace('slot = "fu1"', 'slot = "fu9"')
    path.write_text(text.replace('"modbus"', '"modbos"'), "utf-8")
    done = call(command, str(path))
    assert done.returncode == 2
    faults = done.stderr.splitlines()
    assert any(f":{line_of(path, 'id =')}: bus[0].node[0].id" in fault for fault in faults), faults
    control = line_of(path, "control =")
    assert any(f":{control}: bus[0].node[0].drive[0].control" in fault for fault in faults), faults


@pytest.mark.landing(2)
@pytest.mark.parametrize(
    ("timeout_ms", "level", "words"),
    [
        (0, "WARNING", "is 0: a silent controller"),
        (15, "ERROR", "15 ms is less than two RPDO periods"),
    ],
)
def test_what_check_doubts_is_in_the_log_of_run_which_runs_all_the_same(
    tmp_path: Path, timeout_ms: int, level: str, words: str
) -> None:
    path = write_site(tmp_path)
    text = path.read_text("utf-8").replace("fieldbus_timeout_ms = 0", f"fieldbus_timeout_ms = {timeout_ms}")
    path.write_text(text, "utf-8")
    with drivebridge(tmp_path, "run", "run", str(path), "--role", "bus", notify=True) as bridge:
        bridge.wait_ready()
        log = bridge.output()
    line = line_of(path, "fieldbus_timeout_ms")
    where = f"{path}:{line}: bus[0].node[0].drive[0].fieldbus_timeout_ms: "
    assert any(f" {level} " in entry and where in entry and words in entry for entry in log.splitlines()), log
    assert "can0: predicted load 10 %" in log


def test_faults_of_site_and_mapping_are_readable_by_scripts(tmp_path: Path) -> None:
    path = write_site(tmp_path)
    path.write_text(path.read_text("utf-8").replace('slot = "fu1"', 'slot = "fu9"'), "utf-8")
    done = call("check", str(path), "--json")
    assert done.returncode == 2
    [fault] = json.loads(done.stdout)["faults"]
    assert fault["line"] == line_of(path, "slot =")
    assert "fu9" in fault["message"]
    assert "fu1" in fault["hint"]


@pytest.mark.landing
def test_what_cannot_work_together_is_bad_usage_too(tmp_path: Path) -> None:
    path = write_site(tmp_path)
    path.write_text(path.read_text("utf-8").replace("timeout_ms = 0", "timeout_ms = 15"), "utf-8")
    done = call("check", str(path))
    assert done.returncode == 2
    line = line_of(path, "fieldbus_timeout_ms")
    what = "bus[0].node[0].drive[0].fieldbus_timeout_ms: 15 ms is less than two RPDO"
    assert f":{line}: {what}" in done.stderr
    assert "predicted load" in done.stdout
    done = call("check", str(path), "--json")
    assert done.returncode == 2
    result = json.loads(done.stdout)
    assert not result["ok"]
    assert [(fault["severity"], fault["line"]) for fault in result["faults"]] == [("error", line)]
    assert result["buses"][0]["load_percent"] > 5


def test_a_device_description_is_shown_with_what_is_odd_about_it(tmp_path: Path) -> None:
    path = tmp_path / "odd.dcf"
    text = "[DeviceComissioning]\nNodeID=5\n[2000]\nParameterName=Spindel für A\nDataType=6\nAccessType=rw\n"
    path.write_bytes((text + "ParameterValue=07\nnonsense\n").encode("cp1252"))
    concise = tmp_path / "odd.cdcf"
    done = call("eds", str(path), "--concise", str(concise))
    assert done.returncode == 0, done.stderr
    assert "2000h:00 = 07 00" in done.stdout
    assert "odd.dcf:8: error: is neither a section nor a key: nonsense" in done.stdout
    assert concise.read_bytes().hex() == "01000000" + "002000" + "02000000" + "0700"


def test_what_is_no_device_description_is_bad_usage(tmp_path: Path) -> None:
    done = call("eds", str(write_site(tmp_path)))
    assert done.returncode == 2
    assert "is not a device description" in done.stderr


def test_a_site_file_that_is_not_there(tmp_path: Path) -> None:
    done = call("run", str(tmp_path / "none.toml"))
    assert done.returncode == 2
    assert "No such file" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.landing
def test_a_bus_that_is_missing_is_exit_3(tmp_path: Path) -> None:
    done = call("run", str(write_site(tmp_path, interface="socketcan")))
    assert done.returncode == 3
    assert "can0" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.landing
def test_all_buses_that_are_missing_are_named_at_once(tmp_path: Path) -> None:
    drive = sites.drive("fu1", "none", 0)
    buses = [
        sites.bus(
            sites.node(drive, name=name), name=name, interface="carrier_pigeon", more=f'channel = "{name}"'
        )
        for name in ("north", "south")
    ]
    site = str(sites.write(tmp_path, *buses))
    for command in ("run", "simulate"):
        done = call(command, site)
        assert done.returncode == 3
        assert "bus north: interface 'carrier_pigeon'" in done.stderr
        assert "bus south: interface 'carrier_pigeon'" in done.stderr
        assert "Traceback" not in done.stderr


def test_an_interface_nobody_knows_is_exit_3(tmp_path: Path) -> None:
    done = call("run", str(write_site(tmp_path, interface="carrier_pigeon")))
    assert done.returncode == 3
    assert "carrier_pigeon" in done.stderr
    assert "Traceback" not in done.stderr


def test_a_port_that_is_taken_is_exit_3(tmp_path: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        done = call("run", str(write_site(tmp_path, port=port)))
    assert done.returncode == 3
    assert str(port) in done.stderr
    assert "Traceback" not in done.stderr


def test_run_serves_until_it_is_told_to_stop(tmp_path: Path) -> None:
    with drivebridge(tmp_path, "run", "run", str(write_site(tmp_path)), notify=True) as bridge:
        bridge.wait_ready()
        bridge.wait_output("node operational")
        bridge.signal(signal.SIGTERM)
        assert bridge.popen.wait(15) == 0
        assert "Traceback" not in bridge.output()
        lines = bridge.output().splitlines()
        assert lines[-1].endswith("INFO    stopped")
        assert sum("INFO    stopping all drives" in line for line in lines) == 1
        assert lines[-2].endswith("INFO    all drives are stopped")


@pytest.mark.landing
@pytest.mark.parametrize("what", ["modbus", "opcua"])
def test_exports_are_tables(tmp_path: Path, what: str) -> None:
    path = str(write_site(tmp_path))
    table = call("export", what, path)
    assert table.returncode == 0
    rows = json.loads(call("export", what, path, "--json").stdout)
    assert len(rows) == len(table.stdout.splitlines()) - 1
    assert table.stdout.splitlines()[0].split(",") == list(rows[0])


@pytest.mark.landing
def test_what_is_not_served_is_not_exported(tmp_path: Path) -> None:
    done = call("export", "zenoh", str(write_site(tmp_path)))
    assert done.returncode == 1
    assert "[zenoh]" in done.stderr


@pytest.mark.landing
def test_of_several_buses_one_is_exported_as_dbc(tmp_path: Path) -> None:
    buses = [
        sites.bus(sites.node(sites.drive("fu1", "none", 0), name=f"n{k}"), name=f"can{k}") for k in (0, 1)
    ]
    path = str(sites.write(tmp_path, *buses))
    assert call("export", "dbc", path).returncode == 2
    assert "can0, can1" in call("export", "dbc", path, "--bus", "can7").stderr
    done = call("export", "dbc", path, "--bus", "can1")
    assert done.returncode == 0
    assert "BU_: DRIVEBRIDGE n1" in done.stdout


@pytest.mark.landing
def test_a_mapping_of_ones_own_is_simulated_by_the_family_it_extends(tmp_path: Path) -> None:
    (tmp_path / "mappings").mkdir()
    (tmp_path / "mappings" / "fan.toml").write_text('extends = "cia402/velocity"\n', encoding="utf-8")
    node = sites.node(sites.drive("drive", "none", 0, ""), mapping="fan")
    path = sites.write(tmp_path, sites.bus(node))
    with drivebridge(tmp_path, "run", "run", str(path), notify=True) as bridge:
        bridge.wait_ready()
        bridge.wait_output("node operational")
