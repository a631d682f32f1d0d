"""The same bridge by an author who has seen it fall behind: one process that conflates.

careful.py CHANNEL NODES MODBUS_PORT OPCUA_PORT ZENOH_PORT

A PDO only leaves its words. Modbus reads are answered from the newest; OPC UA and zenoh get what has changed
every 50 ms, by the libraries' faster ways.
"""

from __future__ import annotations

import asyncio
import json
import sys
from functools import partial
from pathlib import Path

import canopen
import zenoh

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from tests.bench.reference.command_line import Ports, ports
from tests.bench.reference.served import (
    COMMANDS,
    POINTS,
    Drive,
    connected,
    drives_on,
    modbus_server,
    opcua_server,
    start_nodes,
    until_terminated,
    words_of,
    zenoh_session,
)

PERIOD_S = 0.05


async def serve(at: Ports) -> None:
    with connected(at.channel) as network:
        drives = drives_on(network, at.nodes)
        newest = {drive.number: [0] * len(COMMANDS) for drive in drives}
        written = {drive.number: [-1] * len(COMMANDS) for drive in drives}

        def on_pdo(drive: Drive, message: canopen.pdo.base.PdoMap) -> None:
            newest[drive.number] = words_of(message)

        def before_read(drive: Drive, registers: list[int]) -> None:
            words = newest[drive.number]
            for point in POINTS:
                new = point.registers(point.value(words))
                registers[point.register : point.register + len(new)] = new

        async def write_changed(drive: Drive, publishers: dict[str, zenoh.Publisher]) -> None:
            words, before = newest[drive.number], written[drive.number]
            written[drive.number] = words
            for point in POINTS:
                if words[point.word] != before[point.word]:
                    value = point.value(words)
                    where = drive.variables[point.name].nodeid
                    await opcua.write_attribute_value(where, point.data_value(value))
                    publishers[point.name].put(json.dumps({"v": value}))

        modbus = modbus_server(at.modbus, drives, before_read)
        opcua = await opcua_server(at.opcua, drives)
        with zenoh_session(at.zenoh, drives) as session:
            publishers = {
                drive.number: {
                    point.name: session.declare_publisher(drive.key(point.name)) for point in POINTS
                }
                for drive in drives
            }
            async with opcua:
                await modbus.serve_forever(background=True)
                for drive in drives:
                    drive.node.tpdo[1].add_callback(partial(on_pdo, drive))
                await asyncio.to_thread(start_nodes, drives)
                print("serving", flush=True)
                while True:
                    for drive in drives:
                        if newest[drive.number] is not written[drive.number]:
                            await write_changed(drive, publishers[drive.number])
                    await asyncio.sleep(PERIOD_S)


if __name__ == "__main__":
    arguments = ports()
    until_terminated(lambda: serve(arguments))
