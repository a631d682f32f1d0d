"""Two nodes on one bus: a mandatory one that is awaited, the order of their start, and what its loss does."""

from __future__ import annotations

import signal
import time
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.lab.sites import lab_site
from tests.support import sites
from tests.support.process import drivebridge, until
from tests.support.sniffer import sniffing

NMT, RPDO = 0x000, {5: 0x205, 6: 0x206}
START = {node_id: bytes((0x01, node_id)) for node_id in RPDO}
STOPS = (b"\x02\x00", b"\x02\x05")
"""NMT stop for all, or for the one that is there."""


@pytest.mark.landing
def test_the_mandatory_node_comes_first_and_its_loss_stops_all(tmp_path: Path) -> None:
    pump = sites.node(
        sites.drive("fu1", "none", 0),
        name="pump",
        node_id=6,
        more='mandatory = true\nstart_order = 1\non_loss = "stop_all"',
    )
    bus_keys, node_keys = 'mandatory_missing = "hold_all"', "start_order = 2"
    site = lab_site(
        tmp_path, timeout_ms=5000, controls=("modbus",), bus=bus_keys, node=node_keys, more=pump
    ).path
    conveyor_only, pump_only = (tmp_path / name for name in ("conveyor.toml", "pump.toml"))
    drive = sites.drive("fu1", "none", 0)
    conveyor_only.write_text(sites.site(sites.socketcan(sites.node(drive))), "utf-8")
    pump_only.write_text(sites.site(sites.socketcan(pump)), "utf-8")
    with ExitStack() as stack:
        bus = stack.enter_context(sniffing())
        one = stack.enter_context(drivebridge(tmp_path, "conveyor", "simulate", str(conveyor_only)))
        one.wait_output("simulating conveyor")
        run = ("run", str(site), "--role", "bus", "--role", "zenoh")
        bridge = stack.enter_context(drivebridge(tmp_path, "run", *run, notify=True))
        bridge.wait_ready()

        # Without the mandatory node nobody is started.
        until(lambda: bus.of(0x585), 20.0, "the conveyor is booted")
        time.sleep(3.0)
        assert START[5] not in [frame.data for frame in bus.of(NMT)]

        # Once it is there, in their order.
        other = stack.enter_context(drivebridge(tmp_path, "pump", "simulate", str(pump_only)))
        other.wait_output("simulating pump")
        until(lambda: bridge.output().count("node operational") == 2, 40.0, f"both: {bridge.output()}")
        started = [frame.data for frame in bus.of(NMT) if frame.data in START.values()]
        assert started == [START[6], START[5]]

        # It is lost: stopped words and NMT stop for the others, and they wait for it.
        other.signal(signal.SIGSTOP)
        stopped = time.time()
        bridge.wait_output("pump: node lost", 15.0)
        until(lambda: [f for f in bus.of(NMT, stopped) if f.data in STOPS], 5.0, "an NMT stop")
        assert START[5] not in [frame.data for frame in bus.of(NMT, stopped)]
        assert {frame.word for frame in bus.of(RPDO[5], stopped)} <= {0x0400}

        # It is back: both are started again.
        other.signal(signal.SIGCONT)
        until(lambda: bridge.output().count("node operational") == 4, 40.0, f"again: {bridge.output()}")
        started = [frame.data for frame in bus.of(NMT, stopped) if frame.data in START.values()]
        assert started == [START[6], START[5]]
