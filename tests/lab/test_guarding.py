"""Node guarding on real SocketCAN: asked with a toggle bit, lost after the life time, on both sides."""

from __future__ import annotations

import signal
import time
from contextlib import ExitStack
from itertools import pairwise
from pathlib import Path

import pytest

from tests.lab.sites import lab_site
from tests.support.process import drivebridge, until
from tests.support.sniffer import sniffing

ASKED, ANSWER, EMCY, SDO = 0x4000_0705, 0x705, 0x085, 0x605
OPERATIONAL, PRE_OPERATIONAL = 0x05, 0x7F
GUARD_S, FACTOR = 0.1, 5
LIFE_S = GUARD_S * FACTOR
NOISE_S = 0.3
STARTED, LOST = "conveyor: node operational", "conveyor: node lost"
NODE = f"""
supervision = "guarding"
supervision_ms = {GUARD_S * 1000:.0f}
life_time_factor = {FACTOR}
"""


@pytest.mark.landing
def test_both_sides_watch_each_other(tmp_path: Path) -> None:
    site = lab_site(tmp_path, timeout_ms=5000, controls=("modbus",), node=NODE)
    with ExitStack() as stack:
        bus = stack.enter_context(sniffing())
        simulation = stack.enter_context(drivebridge(tmp_path, "simulate", "simulate", str(site.path)))
        simulation.wait_output("simulating")
        run = ("run", str(site.path), "--role", "bus", "--role", "zenoh")
        bridge = stack.enter_context(drivebridge(tmp_path, "run", *run, notify=True))
        bridge.wait_ready()
        bridge.wait_output(STARTED)
        asked = [frame.data for frame in bus.of(SDO)]
        assert bytes.fromhex("2B0C100064000000") in asked, "100Ch := 100 ms"
        assert bytes.fromhex("2F0D100005000000") in asked, "100Dh := 5"

        # Every question has one answer, and its bit 7 alternates.
        begin = time.time()
        time.sleep(2.0)
        questions, answers = bus.of(ASKED, begin), bus.of(ANSWER, begin)
        assert len(questions) > 10
        assert abs(len(questions) - len(answers)) <= 1
        assert {frame.data[0] & 0x7F for frame in answers} == {OPERATIONAL}
        assert all((a.data[0] ^ b.data[0]) & 0x80 for a, b in pairwise(answers))

        # A master that falls silent is lost, too: the node says so and is pre-operational.
        bridge.signal(signal.SIGSTOP)
        hung = time.time()
        until(lambda: bus.of(EMCY, hung), LIFE_S + 10.0, "an emergency message of the node")
        lost = bus.of(EMCY, hung)[0]
        assert lost.data[:2] == b"\x00\x81", "8100h: telegram downtime (BU 2500 §8.3.3)"
        last = max(frame.time for frame in bus.of(ASKED))
        assert LIFE_S - GUARD_S <= lost.time - last <= LIFE_S + NOISE_S
        bridge.signal(signal.SIGCONT)
        until(lambda: bridge.output().count(STARTED) == 2, 40.0, f"again: {bridge.output()}")
        assert bus.of(ANSWER, lost.time)[0].data[0] & 0x7F == PRE_OPERATIONAL

        # A node that falls silent is lost, and booted again when it is back.
        lost_before, started_before = (bridge.output().count(text) for text in (LOST, STARTED))
        simulation.signal(signal.SIGSTOP)
        until(lambda: bridge.output().count(LOST) > lost_before, LIFE_S + 10.0, "node lost")
        simulation.signal(signal.SIGCONT)
        until(lambda: bridge.output().count(STARTED) > started_before, 40.0, f"it is back: {bridge.output()}")
