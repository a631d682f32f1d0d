"""``drivebridge lss`` against slaves of our own test's making, on real SocketCAN."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.process import Process, drivebridge_called, peer

pytestmark = pytest.mark.nightly

ON_VCAN0 = ("--interface", "socketcan", "--channel", "vcan0")
ONE, OTHER = "00000038:00010203:00000007:00000A01", "00000038:00010203:00000007:80000B02"


@pytest.fixture
def slaves(tmp_path: Path) -> Iterator[Process]:
    with peer(tmp_path, "lss_slave", "vcan0", ONE, OTHER) as slaves:
        slaves.wait_output("the slaves are there")
        yield slaves


def lss(*arguments: str) -> subprocess.CompletedProcess[str]:
    return drivebridge_called("lss", *arguments, *ON_VCAN0)


def test_two_new_devices_are_found_named_and_stored(slaves: Process) -> None:
    found = lss("scan", "--json", "--known", "38:10203:7:0", "--timeout-ms", "50")
    assert found.returncode == 0, found.stderr
    assert {device["serial"] for device in json.loads(found.stdout)} == {0x0A01, 0x8000_0B02}

    named = lss("set-id", "--id", "17", "--identity", OTHER, "--store")
    assert (named.returncode, named.stdout) == (0, "node id 17 stored\n"), named.stderr
    slaves.wait_output("80000B02: id 17, stored (17, 0)", 5.0)
    assert "A01:" not in slaves.output(), "the other device was left alone"

    asked = lss("inquire", "--identity", OTHER, "--json")
    assert json.loads(asked.stdout)["node_id"] == 17

    rate = lss("set-bitrate", "--new", "250000", "--identity", ONE, "--store", "--json")
    assert json.loads(rate.stdout) == {"ok": True, "bitrate": 250000, "stored": True, "active": False}
    slaves.wait_output("A01: id 255, stored (255, 3)", 5.0)


def test_devices_that_keep_answering_are_found_all_the_same(tmp_path: Path) -> None:
    """As two nodes of CANopenNode 4 do, which hid each other for good."""
    with peer(tmp_path, "lss_slave", "vcan0", f"talks={ONE}", f"talks={OTHER}") as slaves:
        slaves.wait_output("the slaves are there")
        found = lss("scan", "--json", "--known", "38:10203:7:0", "--timeout-ms", "50")
    assert found.returncode == 0, found.stderr
    devices = json.loads(found.stdout)
    assert {device["serial"]: device["keeps_answering"] for device in devices} == {
        0x0A01: True,
        0x8000_0B02: False,
    }
    assert f"{ONE} keeps answering after it was found" in found.stderr


def test_what_fails_says_so_and_fails(slaves: Process) -> None:
    absent = lss("store", "--identity", "1:2:3:4", "--timeout-ms", "100")
    assert absent.returncode == 1
    assert "no device has this identity" in absent.stderr
    refused = lss("set-bitrate", "--new", "800000", "--identity", ONE)
    assert refused.returncode == 1
    assert "this bit rate is not supported" in refused.stderr
    assert lss("set-id", "--id", "5").returncode == 2
