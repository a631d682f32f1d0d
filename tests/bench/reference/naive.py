"""A bridge as anyone would write it from the documentation of canopen, asyncua, pymodbus and zenoh.

naive.py CHANNEL NODES MODBUS_PORT OPCUA_PORT ZENOH_PORT

Each PDO calls back, and each value that it changes is written to each protocol.
"""

from __future__ import annotations

import asyncio
import json
import sys
from functools import partial
from pathlib import Path

import canopen

sys.path.insert(0, str(Path(__file__).resolve().parents[3]))

from tests.bench.reference.command_line import Ports, ports
from tests.bench.reference.served import (
    INPUT_REGISTERS,
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


async def serve(at: Ports) -> None:
    loop = asyncio.get_running_loop()
    latest: dict[str, int | float] = {}
    with connected(at.channel) as network:
        drives = drives_on(network, at.nodes)
        modbus = modbus_server(at.modbus, drives)
        opcua = await opcua_server(at.opcua, drives)

        async def publish(drive: Drive, words: list[int]) -> None:
            for point in POINTS:
                key, value = drive.key(point.name), point.value(words)
                if latest.get(key) == value:
                    continue
                latest[key] = value
                await drive.variables[point.name].write_value(point.data_value(value))
                registers = point.registers(value)
                await modbus.async_setValues(drive.number, INPUT_REGISTERS, point.register, registers)
                session.put(key, json.dumps({"v": value}))

        def on_pdo(drive: Drive, message: canopen.pdo.base.PdoMap) -> None:
            asyncio.run_coroutine_threadsafe(publish(drive, words_of(message)), loop)

        with zenoh_session(at.zenoh, drives) as session:
            async with opcua:
                await modbus.serve_forever(background=True)
                for drive in drives:
                    drive.node.tpdo[1].add_callback(partial(on_pdo, drive))
                await asyncio.to_thread(start_nodes, drives)
                print("serving", flush=True)
                await asyncio.Future()


if __name__ == "__main__":
    arguments = ports()
    until_terminated(lambda: serve(arguments))
