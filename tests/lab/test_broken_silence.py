"""A stop by anybody breaks a silence on SocketCAN, once: the drive's own supervision trips afterwards."""

from __future__ import annotations

import signal
import time
from pathlib import Path

import pytest

from tests.lab.sites import ask, lab_site
from tests.support.process import drivebridge, peer, until
from tests.support.sniffer import sniffing

RPDO1, TPDO1 = 0x205, 0x185
# BU 2500 §6.5.1: bit 0 at 0, ramp down.
STOP = 0x047E
OWN_TIMEOUT_S = 3.0


@pytest.mark.landing
def test_a_stop_while_the_drive_gets_nothing_goes_out_as_one_burst(tmp_path: Path) -> None:
    own = f"own_timeout_ms = {round(1000 * OWN_TIMEOUT_S)}\nenforce = true"
    site = lab_site(
        tmp_path, timeout_ms=300, controls=("modbus",), node=own, drives=('on_expiry = "silence"',)
    )
    with (
        drivebridge(tmp_path, "simulate", "simulate", str(site.path)),
        drivebridge(tmp_path, "run", "run", str(site.path), notify=True) as bridge,
        sniffing() as bus,
    ):
        bridge.wait_output("node operational")
        arguments = (str(site.modbus_port), "1", "0.05", str(tmp_path / "stamps"), "0x047F", "0x2000")
        with peer(tmp_path, "modbus_owner", *arguments) as owner:
            owner.wait_output("it runs", 30.0)
            owner.signal(signal.SIGSTOP)
            until(lambda: time.time() - bus.of(RPDO1)[-1].time > 0.3, 10.0, "silence")
            asked = time.time()
            [[first]] = ask(site, "drives/lab/conveyor/fu1/command/stop={}")
            assert (first["ok"], first["forwarded"]) == (True, True)
            until(lambda: bus.of(TPDO1)[-1].word & 0x4F == 0x08, 20.0, "P151 has tripped")
            burst = bus.of(RPDO1, asked)
    assert {frame.word for frame in burst} == {STOP}
    assert burst[-1].time - burst[0].time < 0.3, "and nothing after it"
