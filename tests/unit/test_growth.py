"""Nothing grows faster than what there is: four times the nodes cost at most four times the calls."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import Callable
from pathlib import Path
from types import FrameType

import pytest

from bridge.can.virtual import VirtualWire
from bridge.canopen.frame import Frame
from bridge.catalogue import Catalogue
from bridge.cli.simulation import simulation
from bridge.command import Plant
from bridge.config import load_site
from bridge.master.network import Network
from bridge.project import load_project
from tests.support import sites
from tests.support.virtual_loop import VirtualLoop

FEW, MANY = 30, 120
MOST = MANY / FEW


def site(folder: Path, nodes: int) -> Path:
    folder.mkdir(exist_ok=True)
    all_of_them = [
        sites.node(
            sites.drive("drive", "modbus", 1000, f"unit_id = {number}"),
            name=f"n{number}",
            node_id=number,
            mapping="cia402/velocity",
        )
        for number in range(1, nodes + 1)
    ]
    slow = "bitrate = 1000000\nsync_period_ms = 100\nrpdo_period_ms = 200\ndeadman_ms = 1000"
    slow += "\nmaster_node_id = 127"
    return sites.write(folder, sites.bus(*all_of_them, more=slow), sites.modbus())


def calls_of(work: Callable[[], object]) -> int:
    count = 0

    def profiled(frame: FrameType, event: str, argument: object) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(profiled)
    try:
        work()
    finally:
        sys.setprofile(None)
    return count


def loaded(path: Path) -> None:
    project = load_project(path)
    plant = Plant(Catalogue.of(project.site, project.families), "0", 0.0)
    for table in project.site.bus:
        Network(table, plant.side_of(table))


def booted(path: Path) -> None:
    """Simulated nodes are started, told something each, and run for a second."""
    table = load_site(path).bus[0]

    async def play() -> None:
        wire = VirtualWire()
        end = wire.end("master")
        end.accept([])
        end.open(lambda: None)
        nodes = simulation(wire.end("simulation"), table, path)
        running = asyncio.create_task(nodes.run())
        await asyncio.sleep(0.5)
        now = asyncio.get_running_loop().time()
        for node in table.node:
            end.send(Frame(0x600 + node.id, bytes.fromhex("2B171000E8030000")), now, now)
        end.send(Frame(0x000, b"\x01\x00"), now, now)
        await asyncio.sleep(0.5)
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)

    with asyncio.Runner(loop_factory=VirtualLoop) as runner:
        runner.run(play())


@pytest.mark.landing(2)
@pytest.mark.parametrize("work", [loaded, booted], ids=lambda work: work.__name__)
def test_calls_grow_no_faster_than_nodes(tmp_path: Path, work: Callable[[Path], None]) -> None:
    few, many = site(tmp_path / "few", FEW), site(tmp_path / "many", MANY)
    work(few)  # what is made once for all
    grown = calls_of(lambda: work(many)) / calls_of(lambda: work(few))
    assert grown <= MOST
