"""A process with the master and simulated nodes is held up: the nodes were not silent, the process was."""

from __future__ import annotations

import asyncio
import random
from collections.abc import Iterator
from importlib import resources
from pathlib import Path

import pytest

from bridge.can.virtual import VirtualWire
from bridge.canopen.frame import Frame
from bridge.cli.simulation import simulation
from bridge.config import load_site
from tests.support.virtual_loop import VirtualLoop

NODES = (5, 6, 7, 8)
PERIOD_S = 0.1
HEARTBEAT_TIME = bytes.fromhex("2B17100064000000")
ROUND_S = 0.033
"""Period of looks at the bus, seconds."""


@pytest.fixture
def loop() -> Iterator[VirtualLoop]:
    loop = VirtualLoop()
    yield loop
    loop.close()


async def longest_silence(loop: VirtualLoop, site: Path, seed: int) -> dict[int, float]:
    """Longest silence of each node in ms, as a reader finds it who drains the bus, also right after
    pauses."""
    pauses = random.Random(seed)
    wire = VirtualWire()
    end = wire.end("master")
    end.open(lambda: None)
    simulated = simulation(wire.end("can0"), load_site(site).bus[0], site)
    wire.players.append(simulated.catch_up)
    running = asyncio.create_task(simulated.run())
    await asyncio.sleep(1.0)
    for node in NODES:
        end.send(Frame(0x600 + node, HEARTBEAT_TIME), loop.time(), loop.time())
    await asyncio.sleep(2 * PERIOD_S)
    heard = {0x700 + node: loop.time() for node in NODES}
    silence = dict.fromkeys(heard, 0.0)

    def look() -> None:
        now = loop.time()
        for frame in end.drain(now):
            if frame.can_id in heard:
                heard[frame.can_id] = frame.time
        for can_id in heard:
            silence[can_id] = max(silence[can_id], now - heard[can_id])

    for _ in range(200):
        loop.call_later(ROUND_S, look)
        await asyncio.sleep(pauses.uniform(0, 0.2))
        loop.hold_up(pauses.uniform(0, 1.5))
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)
    return silence


@pytest.mark.landing
@pytest.mark.parametrize("seed", range(5))
def test_a_pause_of_the_process_is_no_silence_of_its_nodes(
    tmp_path: Path, loop: VirtualLoop, seed: int
) -> None:
    site = tmp_path / "site.toml"
    site.write_text(resources.files("bridge.demo").joinpath("site.toml").read_text(encoding="utf-8"))
    silence = loop.run_until_complete(longest_silence(loop, site, seed))
    assert silence == dict.fromkeys(silence, pytest.approx(PERIOD_S, abs=0.021)), "by the 20 ms of being late"
