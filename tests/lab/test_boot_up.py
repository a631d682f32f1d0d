"""Boot-up against a slave that we did not write: another device, no device, a device that starts again and
again."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

import pytest

from tests.lab.sites import lab_site
from tests.support.process import Process, drivebridge, peer, until
from tests.support.sniffer import Sniffer, sniffing

START = b"\x01\x05"
BOOT_UP = b"\x00"
LONGEST_PAUSE_S = 60.0
"""So long a node that starts again and again is left in peace, where no boot-up got through in between."""


@contextmanager
def bridge_on(folder: Path, node: str, *, slave: bool) -> Iterator[tuple[Sniffer, Process]]:
    """The bridge on vcan0, with further keys of the node; ``slave`` is canopen.LocalNode."""
    site = lab_site(folder, timeout_ms=2000, controls=("modbus",), node=node).path
    with ExitStack() as stack:
        bus = stack.enter_context(sniffing())
        if slave:
            stack.enter_context(peer(folder, "foreign_slave", "vcan0", "5")).wait_output("is there")
        bridge = stack.enter_context(
            drivebridge(folder, "run", "run", str(site), "--role", "bus", "--role", "zenoh", notify=True)
        )
        bridge.wait_ready()
        yield bus, bridge


@pytest.mark.landing
def test_another_device_is_named_and_not_started(tmp_path: Path) -> None:
    identity = "[bus.node.identity]\nvendor_id = 0xB9\n"
    with bridge_on(tmp_path, identity, slave=True) as (bus, bridge):
        bridge.wait_output("D: 1018h:01 is 00001234h, expected 000000B9h by the site file")
        time.sleep(2.0)
        assert START not in [frame.data for frame in bus.of(0)]


@pytest.mark.landing
def test_a_mask_lets_a_device_of_the_same_kind_in(tmp_path: Path) -> None:
    identity = "[bus.node.identity]\nproduct_code = 0xFF02\nproduct_code_mask = 0xFF\n"
    with bridge_on(tmp_path, identity, slave=True) as (bus, bridge):
        bridge.wait_output("node operational")
        assert START in [frame.data for frame in bus.of(0)]


def test_a_missing_node_is_named_and_booted_when_it_comes(tmp_path: Path) -> None:
    with bridge_on(tmp_path, "", slave=False) as (bus, bridge):
        bridge.wait_output("B: 1000h:00: no valid answer")
        told = {seen.data for seen in bus.of(0)}
        assert told <= {b"\x80\x05", b"\x81\x05"}, "it may be stopped, or run; nobody is started"
        with peer(tmp_path, "foreign_slave", "vcan0", "5"):
            bridge.wait_output("node operational")


@pytest.mark.landing
def test_a_node_that_boots_in_a_loop_is_told_once_and_left_in_peace(tmp_path: Path) -> None:
    with bridge_on(tmp_path, "", slave=True) as (bus, bridge):
        bridge.wait_output("node operational")
        began = time.time()
        for _ in range(40):
            bus.send(0x705, BOOT_UP)
            time.sleep(0.25)
        assert bridge.output().count("the node starts again and again") == 1
        requests = bus.of(0x605, began + 4.0)
        assert len(requests) < 60, "it is asked less and less often"
        starts = bridge.output().count("node operational")
        until(
            lambda: bridge.output().count("node operational") > starts or starts > 1,
            LONGEST_PAUSE_S + 15.0,
            f"booted when it is calm: {bridge.output()}",
        )


@pytest.mark.landing
def test_another_master_and_a_foreign_node_are_reported(tmp_path: Path) -> None:
    with bridge_on(tmp_path, "", slave=True) as (bus, bridge):
        bridge.wait_output("node operational")
        bus.send(0x000, b"\x01\x00")
        bus.send(0x70C, BOOT_UP)
        bridge.wait_output("another NMT master is on the bus: it sent start for all nodes")
        bridge.wait_output("A: node 12 starts and is not in the site file")
