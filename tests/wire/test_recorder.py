"""A service is recorded while it runs; whoever has its files replays them, and reads them as traces."""

from __future__ import annotations

import json
import signal
import stat
import time
from pathlib import Path

import can
import pytest
from pymodbus.client import ModbusTcpClient

from tests.support import sites
from tests.support.process import drivebridge, drivebridge_called, free_port, until

_CYCLES = 20


@pytest.fixture
def recorded(tmp_path: Path) -> Path:
    """The site of a service that was killed while a controller moved a drive."""
    port = free_port()
    node = sites.node(sites.drive("fu1", "modbus", 400, f"unit_id = 1\n{sites.ACCEPTED}\n{sites.SCALED}"))
    site = sites.write(tmp_path, sites.bus(node), sites.modbus(port), name="recorded")
    with drivebridge(tmp_path, "run", "run", str(site), notify=True) as service:
        service.wait_ready()
        service.wait_output("node operational")
        with ModbusTcpClient("127.0.0.1", port=port) as client:
            client.write_registers(0, [0x047E, 0], device_id=1)
            for _ in range(_CYCLES):
                client.write_registers(0, [0x047F, 0x2000], device_id=1)
                time.sleep(0.05)
            service.wait_output("was silent for")
        until(lambda: any((tmp_path / "state" / "recorder").glob("*.state")), 60.0, "the checkpoint is there")
        time.sleep(1.0)
        service.signal(signal.SIGKILL)
        service.popen.wait()
    return site


def written(site: Path, name: str) -> Path:
    """The recording of a site's service as a file of this name."""
    target = site.parent / name
    done = drivebridge_called("record", str(site), "--output", str(target))
    assert done.returncode == 0, done.stderr
    return target


def test_a_killed_service_is_replayed(recorded: Path) -> None:
    recording = written(recorded, "x.recording")
    assert stat.S_IMODE(recording.stat().st_mode) == 0o640
    done = drivebridge_called("replay", str(recording), "--json")
    assert done.returncode == 0, done.stdout
    told = json.loads(done.stdout)
    assert told["same"] is True
    assert told["segments"][0]["outputs"] > 100
    for at, owner, state in ((0.0, "", "node not seen yet"), (600.0, "modbus:127.0.0.1", 7)):
        done = drivebridge_called("replay", str(recording), "--until", str(at), "--json")
        [segment] = json.loads(done.stdout)["segments"]
        shown = segment["state"]["conveyor/fu1"]
        assert (shown["supervision/owner"], shown["status/state"]) == (owner, state)


def test_its_turns_are_told_in_words(recorded: Path) -> None:
    done = drivebridge_called("replay", str(written(recorded, "x.recording")), "--step")
    assert done.returncode == 0
    for said in ("request", "modbus", "control_word", "received", "repeated", "was silent for 400 ms"):
        assert said in done.stdout
    assert "as recorded" in done.stdout


def test_it_is_read_as_a_trace(recorded: Path) -> None:
    whole = written(recorded, "x.recording")
    counts = set[int]()
    for suffix in ("log", "asc", "blf"):
        trace = recorded.parent / f"x.{suffix}"
        assert drivebridge_called("record", str(whole), "-o", str(trace)).returncode == 0
        with can.LogReader(str(trace)) as reader:
            messages = list(reader)
        assert {0x205, 0x185, 0x705, 0x605, 0x585} <= {message.arbitration_id for message in messages}
        counts.add(len(messages))
    assert len(counts) == 1
    done = drivebridge_called("monitor", str(recorded), str(recorded.parent / "x.log"))
    assert "conveyor/fu1" in done.stdout


def test_it_is_read_as_lines(recorded: Path) -> None:
    lines = [json.loads(line) for line in written(recorded, "x.jsonl").read_text("utf-8").splitlines()]
    asked = [line for line in lines if line["what"] == "request"]
    assert len(asked) >= _CYCLES + 1
    assert asked[1]["command"]["values"] == {"control_word": 0x047F, "setpoint_1": 0x2000}
    answered = {line["number"] for line in lines if line["what"] == "outcome"}
    assert answered == {line["number"] for line in asked}
    assert {line["what"] for line in lines} >= {"segment", "received", "sent", "repeated", "event"}
    times = [line["t"] for line in lines]
    assert abs(times[-1] - time.time()) < 600


def test_a_site_without_recording_and_a_file_that_is_none_are_named(tmp_path: Path) -> None:
    site = sites.write(tmp_path, sites.bus(sites.node()), sites.modbus(free_port()), name="quiet")
    done = drivebridge_called("record", str(site), "-o", str(tmp_path / "x.recording"))
    assert (done.returncode, "has no recording" in done.stderr) == (1, True)
    done = drivebridge_called("record", str(site), "-o", str(tmp_path / "x.pcap"))
    assert done.returncode == 2
    for command in ("replay", "record"):
        none = tmp_path / "none.recording"
        none.write_bytes(b"(1.0) can0 705#05\n")
        further = ["-o", str(tmp_path / "y.log")] if command == "record" else []
        done = drivebridge_called(command, str(none), *further)
        assert (done.returncode, "is no recording" in done.stderr) == (1, True)
