"""drivebridge on the bus of the reference bridges: ``drivebridge run``, but for where its frames come from.

ours.py CHANNEL NODES MODBUS_PORT OPCUA_PORT ZENOH_PORT

The site is written into the present folder.
"""

from __future__ import annotations

import socket
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

import bridge.service.bus_process
from bridge.can import Bus
from bridge.can.socketcan import SocketCanBus
from bridge.cli.serve import run
from bridge.config import BusTable
from tests.bench.pair import PairBus
from tests.bench.reference.command_line import Ports, ports
from tests.support import sites

CONTROL = {2: "opcua", 3: "zenoh"}
"""Who commands a node's drive; Modbus those that are not named."""


def site(at: Ports, folder: Path) -> Path:
    nodes = [
        sites.node(
            sites.drive("fu1", CONTROL.get(number, "modbus"), 1000, f"unit_id = {number}\n{sites.SCALED}"),
            name=f"n{number}",
            node_id=number,
            more="supervision_ms = 300",
        )
        for number in range(1, at.nodes + 1)
    ]
    tables = sites.modbus(at.modbus), sites.opcua(at.opcua), sites.zenoh(at.zenoh)
    return sites.write(folder, sites.socketcan(*nodes), *tables, name="bench")


def bus(channel: str) -> Bus:
    number = channel.removeprefix("fd:")
    if number == channel:
        return SocketCanBus("can0", channel)
    frames, manager = (socket.socket(fileno=int(one)) for one in number.split(","))
    return PairBus(frames, manager)


def main(at: Ports) -> None:
    def make_bus(table: BusTable) -> Bus:
        return bus(at.channel)

    bridge.service.bus_process.make_bus = make_bus
    run(site(at, Path.cwd()), role="all", parent=0, signs=None, listening=None, verbose=False)


if __name__ == "__main__":
    main(ports())
