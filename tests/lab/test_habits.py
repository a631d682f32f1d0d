"""Habits of devices on real SocketCAN: played by ``simulate``, met by the command line."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.support import sites
from tests.support.process import drivebridge, free_port
from tests.support.process import drivebridge_called as call
from tests.support.sniffer import Sniffer, sniffing
from tests.unit.sim.generic.test_generic_node import LIGHT

pytestmark = pytest.mark.nightly

NAME = "acme/light"
TAG = "a rather long name " * 20
BY_BLOCKS = (0xA4, 0xC6)


@contextmanager
def simulated(folder: Path, habit: str) -> Iterator[Path]:
    """Node 5, a CiA 402 drive with a long text at 2002h, that has this habit."""
    mapping = folder / "mappings" / f"{NAME}.toml"
    mapping.parent.mkdir(parents=True)
    mapping.write_text(LIGHT, encoding="utf-8")
    node = sites.node(sites.drive("drive", "modbus", 0, ""), mapping=NAME)
    site = sites.write(folder, sites.socketcan(node), sites.modbus(free_port()), name="lab")
    with drivebridge(folder, "simulate", "simulate", str(site), "--habit", f"conveyor={habit}") as process:
        process.wait_output("simulating")
        yield site


def begun_blocks(bus: Sniffer) -> int:
    return sum(frame.data[0] in BY_BLOCKS for frame in bus.of(0x605))


def test_a_node_that_refuses_blocks_is_asked_for_them_by_one_command_and_by_no_other(tmp_path: Path) -> None:
    with simulated(tmp_path, "block-download-refused") as site, sniffing() as bus:
        write = ("sdo", "write", str(site), "conveyor", "2002", TAG, "--type", "string", "--yes")
        done = call(*write)
        assert done.returncode == 0, done.stderr
        assert done.stderr.count("block transfer is not used any more: the node refuses it") == 1
        done = call("sdo", "read", str(site), "conveyor", "2002", "--type", "string")
        assert (done.returncode, done.stdout.strip()) == (0, TAG.strip())
        again = call(*write)
        assert (again.returncode, again.stderr) == (0, "")
        assert begun_blocks(bus) == 1


def test_the_monitor_names_heartbeats_that_are_too_long(tmp_path: Path) -> None:
    with simulated(tmp_path, "long-heartbeats") as site:
        done = call(
            "sdo", "write", str(site), "conveyor", "1017", "100", "--type", "uint16", "--yes", "--force"
        )
        assert done.returncode == 0, done.stderr
        done = call("monitor", str(site), "--seconds", "1")
        assert done.returncode == 0, done.stderr
        assert "heartbeats of 8 bytes: not CiA 301 §7.2.8.3, a heartbeat has 1" in done.stderr


def test_a_habit_of_a_node_that_there_is_not_is_refused_with_the_nodes(tmp_path: Path) -> None:
    with simulated(tmp_path, "short-answers") as site:
        done = call("simulate", str(site), "--habit", "pump=short-answers")
        assert done.returncode == 2
        assert "pump is no node; conveyor" in done.stderr.replace("\n", " ")
