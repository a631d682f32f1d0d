"""Work of the demo's simulated nodes while nothing happens, in counts: a node that gets the same again has
nothing to look at."""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import Callable, Iterator
from importlib import resources
from pathlib import Path

import pytest

from bridge.can.virtual import VirtualWire
from bridge.canopen.frame import Frame
from bridge.cli.simulation import simulation
from bridge.config import load_site
from bridge.sim.core.canopen_slave import CanopenSlave
from bridge.sim.core.dictionary import Dictionary, Number
from bridge.sim.core.pdo_timing import ActiveTpdo
from bridge.sim.runner import Simulation
from tests.support.virtual_loop import VirtualLoop

NODES = (5, 6, 7, 8)
CYCLE_S = 0.01
SHUTDOWN = {5: bytes.fromhex("7E04000000000000"), 6: bytes(8), 7: bytes(3), 8: bytes.fromhex("060000000000")}
"""The word that keeps each node's drives where they are."""
RPDOS = [Frame(base + node, SHUTDOWN[node]) for node in NODES for base in (0x200, 0x300, 0x400, 0x500)]
BUNCH = [*(frame for frame in RPDOS if frame.can_id < 0x300 or frame.can_id & 0x7F == 5), Frame(0x080)]
SECONDS = 10
TPDOS = (0x180, 0x280, 0x380, 0x480)

COUNTED = [
    (Dictionary, "find"),
    (Number, "upload"),
    (ActiveTpdo, "payload"),
    (CanopenSlave, "poll"),
    (CanopenSlave, "on_frame"),
    (Simulation, "_pump"),
]


@pytest.fixture
def loop() -> Iterator[VirtualLoop]:
    loop = VirtualLoop()
    yield loop
    loop.close()


@pytest.fixture
def counts(monkeypatch: pytest.MonkeyPatch) -> Counter[str]:
    counts: Counter[str] = Counter()

    def counting(name: str, method: Callable[..., object]) -> Callable[..., object]:
        def counted(*args: object) -> object:
            counts[name] += 1
            return method(*args)

        return counted

    for owner, name in COUNTED:
        monkeypatch.setattr(owner, name, counting(name, getattr(owner, name)))
    return counts


async def say_the_same(seconds: float, send: Callable[[Frame], None]) -> None:
    for _ in range(round(seconds / CYCLE_S)):
        for frame in BUNCH:
            send(frame)
        await asyncio.sleep(CYCLE_S)


async def at_rest(site: Path, counts: Counter[str]) -> Counter[int]:
    """Frames of the nodes while the counts are taken."""
    wire = VirtualWire()
    loop = asyncio.get_running_loop()
    end = wire.end("master")
    end.open(lambda: None)
    sent: Counter[int] = Counter()
    simulated = simulation(wire.end("can0"), load_site(site).bus[0], site)
    running = asyncio.create_task(simulated.run())

    def send(frame: Frame) -> None:
        end.send(frame, loop.time(), loop.time())

    await asyncio.sleep(1.0)
    for node in NODES:
        send(Frame(0, bytes([1, node])))
    await say_the_same(1.0, send)
    counts.clear()
    wire.listeners.append(lambda frame: sent.update([frame.can_id]))
    await say_the_same(SECONDS, send)
    running.cancel()
    await asyncio.gather(running, return_exceptions=True)
    return sent


@pytest.mark.landing
def test_a_node_that_is_told_the_same_looks_at_nothing_anew(
    tmp_path: Path, loop: VirtualLoop, counts: Counter[str]
) -> None:
    site = tmp_path / "site.toml"
    site.write_text(resources.files("bridge.demo").joinpath("site.toml").read_text(encoding="utf-8"))
    sent = loop.run_until_complete(at_rest(site, counts))
    bunches, heard = round(SECONDS / CYCLE_S), 11
    assert counts["on_frame"] == heard * bunches, "each node hears its RPDOs and the SYNC"
    by_event_timer = dict.fromkeys((0x185, 0x285, 0x385, 0x485), 4 * SECONDS)
    answers = {0x187: bunches}
    assert {can_id: sent[can_id] for can_id in sent if can_id & 0x780 in TPDOS} == by_event_timer | answers
    assert counts["find"] == 0, "where an object is does not change"
    # The lift answers each RPDO, the fan may have been told something by its.
    assert counts["poll"] <= 2.1 * bunches
    assert counts["payload"] <= 2.2 * bunches
    assert counts["upload"] <= 6 * bunches
    assert counts["_pump"] <= 1.1 * bunches
