"""What a changed value costs on its way to zenoh, with a subscriber and without one."""

from __future__ import annotations

import asyncio
import time
from pathlib import Path

from bridge.command import Plant
from bridge.config import ZenohTable
from bridge.northbound.zenoh import ZenohServer
from tests.bench.figures import record, show
from tests.support import sites
from tests.support.process import free_port, peer
from tests.support.views import view_of

PERIOD_S = 0.01
TURNS = 300
NODES = 10
DRIVES = [sites.drive(f"fu{number}", "zenoh", 1000) for number in (1, 2, 3, 4)]


async def turns(plant: Plant, names: list[int]) -> float:
    """Change each of the points so often, and wait in between. CPU seconds of this process."""
    spent = time.process_time()
    for turn in range(TURNS):
        now = time.monotonic()
        for index in names:
            plant.image.set(index, turn, now)
        await asyncio.sleep(PERIOD_S)
    return time.process_time() - spent


async def test_a_value_to_zenoh(tmp_path: Path) -> None:
    plant = sites.plant_of(
        sites.site(sites.bus(*(sites.node(*DRIVES, name=f"n{n}", node_id=n) for n in range(1, NODES + 1))))
    )
    numbers = [index for name, index in plant.image.index.items() if "/actual/value" in name]
    values = len(numbers) * TURNS
    changing, nothing = await turns(plant, numbers), await turns(plant, [])
    port = free_port()
    table = ZenohTable(listen=[f"tcp/127.0.0.1:{port}"])
    server = ZenohServer(view_of(plant), table, "bench", time.monotonic)
    await server.start()
    try:
        idle = await turns(plant, [])
        alone = await turns(plant, numbers)
        with peer(tmp_path, "watch_zenoh", str(port), str(NODES), str(tmp_path / "seen.json")) as reader:
            await asyncio.to_thread(reader.wait_output, "watching")
            await asyncio.sleep(0.5)
            read = await turns(plant, numbers)
    finally:
        await server.close()
    for name, spent in (("with a subscriber", read), ("without one", alone)):
        each_us = (spent - changing - (idle - nothing)) * 1e6 / values
        record(f"zenoh per value {name}, µs", each_us)
        show(f"a value to zenoh, {len(numbers)} change every 10 ms, {name}", f"{each_us:6.2f} µs of CPU")
