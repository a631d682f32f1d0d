"""Writes control word and setpoint 1 of a drive every 20 ms: writer.py PROTOCOL PORT NODE COUNT REPORT

The setpoint is the number of the write. SIGUSR1 begins them; the first was written before that, so that the
drive is ours. REPORT becomes a JSON file, at the end or on SIGTERM: when each was begun (monotonic s).
"""

import asyncio
import json
import signal
import struct
import sys
import time
from collections.abc import Awaitable, Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.peers.last_words import report_on_sigterm
from tests.peers.watch_modbus import answer
from tests.peers.watch_modbus import connected as modbus_connection
from tests.peers.watch_opcua import connected as opcua_client
from tests.peers.watch_zenoh import TOP
from tests.peers.watch_zenoh import connected as zenoh_session

PERIOD_S = 0.02
SHUTDOWN = 0x047E
"""A control word that moves nothing."""
Write = Callable[[int], Awaitable[None]]


async def modbus(port: int, node: int) -> Write:
    stream = modbus_connection(port)

    def write(setpoint: int) -> None:
        stream.sendall(
            struct.pack(">HHHBBHHBHH", setpoint, 0, 11, node, 16, 0, 2, 4, SHUTDOWN, setpoint),
        )
        said = answer(stream)
        assert said[7] == 16, said.hex()

    async def in_turn(setpoint: int) -> None:
        write(setpoint)

    return in_turn


async def opcua(port: int, node: int) -> Write:
    from asyncua import ua

    client = await opcua_client(port)
    space = await client.get_namespace_index("urn:drivebridge:points")
    names = [f"n{node}/fu1/command/{leaf}" for leaf in ("control_word", "setpoint_1")]
    nodes = [client.get_node(ua.NodeId(name, space)) for name in names]

    async def write(setpoint: int) -> None:
        words = [ua.Variant(word, ua.VariantType.UInt16) for word in (SHUTDOWN, setpoint)]
        await client.write_values(nodes, [ua.DataValue(word) for word in words])

    return write


async def zenoh(port: int, node: int) -> Write:
    session = zenoh_session(port)

    async def write(setpoint: int) -> None:
        words = json.dumps({"control_word": SHUTDOWN, "setpoint_1": setpoint})
        for reply in session.get(f"{TOP}/n{node}/fu1/command", payload=words):
            assert reply.ok and json.loads(reply.ok.payload.to_string())["ok"], reply

    return write


async def main(protocol: str, port: int, node: int, count: int, times: list[float]) -> None:
    begin = asyncio.Event()
    asyncio.get_running_loop().add_signal_handler(signal.SIGUSR1, begin.set)
    write = await {"modbus": modbus, "opcua": opcua, "zenoh": zenoh}[protocol](port, node)
    times.append(time.monotonic())
    await write(1)
    print("there", flush=True)
    while not begin.is_set():
        # Still the same telegram: it keeps the drive ours.
        await write(1)
        await asyncio.sleep(PERIOD_S)
    for setpoint in range(2, count + 2):
        times.append(time.monotonic())
        await write(setpoint)
        await asyncio.sleep(max(0.0, times[-1] + PERIOD_S - time.monotonic()))


if __name__ == "__main__":
    begun: list[float] = []
    report = Path(sys.argv[5])

    report_on_sigterm(report, lambda: begun)
    try:
        asyncio.run(main(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), int(sys.argv[4]), begun))
    finally:
        # A server that breaks off the connection is a figure as well.
        report.write_text(json.dumps(begun), encoding="utf-8")
        print("ended", flush=True)
