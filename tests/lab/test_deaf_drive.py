"""A drive that no longer hears the bridge, or hears somebody else: named, and its node stopped."""

from __future__ import annotations

import signal
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from tests.lab.test_cia402 import ENABLED, RPDO, RUN, Lab, words

NMT_STOP = bytes((2, 7))
BOUND_S = 3 * 0.17 + 0.02 + 0.25
"""TPDO every 100 ms, RPDO every 10 ms, 250 ms for the drive."""
NOISE_S = 1.0


@pytest.fixture
def lab(tmp_path: Path) -> Iterator[Lab]:
    with ExitStack() as stack:
        # What follows is judged by what the drive does, not by the frames that make it do so.
        lab = Lab(tmp_path, stack, "profile-velocity", on_intruder="report")
        lab.enable(RUN, 100_000)
        yield lab


def make_deaf(lab: Lab) -> None:
    """As a foreign SDO client can: the RPDO waits for a SYNC that never comes."""
    for request in ("2f00140201000000", "23051000ff070000"):
        since = time.time()
        lab.bus.send(0x607, bytes.fromhex(request))
        answer = f"60{request[2:8]}00000000"
        lab.wait(lambda since=since, answer=answer: answer in hexes(lab, since), f"the answer to {request}")


def hexes(lab: Lab, since: float) -> list[str]:
    return [frame.data.hex() for frame in lab.bus.of(0x587, since)]


def nmt_stops(lab: Lab, since: float = 0.0) -> list[float]:
    return [frame.time for frame in lab.bus.of(0x000, since) if frame.data == NMT_STOP]


def test_a_drive_made_deaf_is_named_and_its_node_stopped(lab: Lab) -> None:
    make_deaf(lab)
    since = time.time()
    lab.owner.words = words(0)
    lab.bridge.wait_output("axis/drive: ignores its stop: 0000h is sent", 10.0)
    lab.wait(lambda: bool(nmt_stops(lab, since)), "NMT stop")
    (stopped,) = nmt_stops(lab, since)
    sent = next(frame.time for frame in lab.bus.of(RPDO, since) if frame.word == 0)
    assert BOUND_S <= stopped - sent <= BOUND_S + 2 * 0.17 + NOISE_S
    assert lab.state == ENABLED, "it did run on"


@pytest.mark.landing
def test_the_end_names_a_deaf_drive(lab: Lab) -> None:
    make_deaf(lab)
    since = time.time()
    lab.bridge.signal(signal.SIGTERM)
    lab.bridge.popen.wait(15)
    assert len(nmt_stops(lab, since)) == 1
    lines = lab.bridge.output().splitlines()
    named = [line for line in lines[-4:] if "NOT STOPPED: axis/drive did not follow the stop" in line]
    assert len(named) == 1
    assert "all drives are stopped" not in lab.bridge.output()


@pytest.mark.landing
def test_the_end_waits_for_the_ramp(lab: Lab) -> None:
    lab.wait(lambda: lab.value == 100_000, "the speed")
    lab.bridge.signal(signal.SIGTERM)
    lab.bridge.popen.wait(15)
    assert lab.value == 0, "at rest when the bridge ends"
    assert not nmt_stops(lab)
    assert lab.bridge.output().splitlines()[-2].endswith("all drives are stopped")


@pytest.mark.landing
def test_a_drive_that_another_master_runs_is_named(lab: Lab) -> None:
    lab.owner.words = words(0)
    lab.wait(lambda: lab.state != ENABLED, "off")
    time.sleep(BOUND_S)
    since = time.time()
    while not nmt_stops(lab, since) and time.time() < since + 10:
        for word in (0x0006, 0x000F, 0x000F):
            lab.bus.send(RPDO, word.to_bytes(2, "little") + bytes(4))
        time.sleep(0.001)
    assert nmt_stops(lab, since)
    lab.bridge.wait_output("axis/drive: is enabled although nothing that enables was sent", 5.0)
