"""SDO1 … SDO4 of one SK TU4-CAO at their own COB-IDs (BU 2500 §6.4), on real SocketCAN."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.lab.sites import LabSite, lab_site
from tests.support.process import drivebridge, drivebridge_called
from tests.support.sniffer import Sniffer, sniffing

pytestmark = pytest.mark.nightly

CHANNELS = {2: (0x345, 0x2C5), 3: (0x445, 0x3C5), 4: (0x545, 0x4C5)}
READ_P105 = bytes.fromhex("40692001")
"""2069h:1, the drive's maximum frequency."""
READ_P426 = bytes.fromhex("40AA2101")
"""21AAh:1, the quick stop time, which the bridge does not ask for by itself."""


@pytest.fixture
def wired(tmp_path: Path) -> Iterator[tuple[LabSite, Sniffer]]:
    site = lab_site(
        tmp_path,
        timeout_ms=0,
        controls=("modbus", "opcua", "zenoh", "none"),
        node="sdo_channels = [2, 3, 4]\nsdo_timeout_ms = 2000",
    )
    with ExitStack() as stack:
        bus = stack.enter_context(sniffing())
        simulation = stack.enter_context(drivebridge(tmp_path, "simulate", "simulate", str(site.path)))
        simulation.wait_output("simulating")
        run = ("run", str(site.path), "--role", "bus", "--role", "zenoh")
        bridge = stack.enter_context(drivebridge(tmp_path, "run", *run, notify=True))
        bridge.wait_ready()
        bridge.wait_output("node operational")
        yield site, bus


def sdo(*arguments: str) -> subprocess.CompletedProcess[str]:
    return drivebridge_called("sdo", *arguments)


def test_the_boot_up_opens_them_and_reads_each_drive_over_its_own(wired: tuple[LabSite, Sniffer]) -> None:
    _, bus = wired
    for number, (request, reply) in CHANNELS.items():
        opened = bus.of(0x605)
        for sub, cob_id in ((1, request), (2, reply)):
            wanted = bytes((0x23, number - 1, 0x12, sub)) + cob_id.to_bytes(4, "little")
            assert wanted in [frame.data for frame in opened], f"SDO{number}:{sub}"
        asked = [frame for frame in bus.of(request) if frame.data[:4] == READ_P105]
        assert asked, f"P105 over SDO{number}"
        answers = [frame for frame in bus.of(reply) if frame.time > asked[0].time]
        assert answers[0].data[1:4] == READ_P105[1:4]
        assert answers[0].data[0] & 0xE0 == 0x40, "an upload's answer, no abort"


def test_the_command_line_takes_any_of_them_beside_the_bridge(wired: tuple[LabSite, Sniffer]) -> None:
    site, bus = wired
    arguments = (str(site.path), "conveyor", "21AA:01", "--type", "uint16", "--json")
    seen: list[int] = []
    for number, (request, _) in CHANNELS.items():
        done = sdo("read", *arguments, "--sdo-channel", str(number))
        assert done.returncode == 0, done.stderr
        assert json.loads(done.stdout)["value"] == 10
        seen += [request]
        assert [frame.can_id for frame in bus.frames if frame.data[:4] == READ_P426] == seen
    unknown = sdo("read", *arguments, "--sdo-channel", "9")
    assert unknown.returncode == 2
    assert "has no SDO channel 9: 1, 2, 3, 4" in unknown.stderr
