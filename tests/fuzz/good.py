"""The good clients: one of each protocol, each with a drive that it keeps turning.

good.py FILE MODBUS OPCUA ZENOH

Beside them somebody connects anew every few seconds. When all drives turn the word "running" is said. From
then on FILE gets a line ``<monotonic time>;<protocol>;<milliseconds>;<ok, busy or what was wrong>`` for each
exchange.
"""

from __future__ import annotations

import asyncio
import json
import os
import sys
import time
from collections.abc import Awaitable, Callable
from pathlib import Path

import zenoh
from asyncua import Client, Node, ua
from pymodbus.client import AsyncModbusTcpClient

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

from tests.fuzz.rig import CONTROL_WORD, GOOD, PASSWORD, SETPOINT

SHUT_DOWN, ENABLED_MASK, ENABLED = 0x047E, 0x6F, 0x27
PERIOD_S = 0.1
PATIENCE_S = 5.0
NEW_S = 3.0
MODBUS_BUSY = 6
DRIVES = "drives/hall/conveyor"
FILE = os.open(sys.argv[1], os.O_WRONLY | os.O_CREAT | os.O_APPEND)

Exchange = Callable[[int], Awaitable[int]]
"""Write a control word with its setpoint; the status word. Raises where anything was not answered well."""


class Wrong(Exception):
    pass


class Busy(Exception):
    """The telegram may have waited too long, or the value is said to be old: an answer, and to ask again. A
    busy machine is no fault."""


def check(condition: object, what: object) -> None:
    if not condition:
        raise Wrong(str(what))


def good_zenoh(port: int) -> zenoh.Session:
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([f"tcp/127.0.0.1:{port}"]))
    config.insert_json5("scouting/multicast/enabled", "false")
    return zenoh.open(config)


async def by_modbus(port: int) -> Exchange:
    client = AsyncModbusTcpClient("127.0.0.1", port=port, timeout=PATIENCE_S, retries=0)
    check(await client.connect(), "no connection")

    async def exchange(word: int) -> int:
        answer = await client.write_registers(0, [word, SETPOINT], device_id=1)
        if answer.isError() and answer.exception_code == MODBUS_BUSY:
            raise Busy
        check(not answer.isError(), answer)
        answer = await client.read_input_registers(0, count=21, device_id=1)
        check(not answer.isError(), answer)
        return answer.registers[0]

    return exchange


async def opcua_value(node: Node) -> int:
    found = await node.read_data_value(raise_on_bad_status=False)
    code = found.StatusCode or ua.StatusCode(ua.StatusCodes.Good)
    if code.value == ua.StatusCodes.UncertainLastUsableValue:
        raise Busy
    code.check()
    return int(found.Value.Value)


async def by_opcua(port: int) -> Exchange:
    # asyncua's client gives itself up where the server says nothing for this long, by default for a second:
    # every later call fails at once. A busy machine may take as long.
    client = Client(f"opc.tcp://127.0.0.1:{port}", timeout=PATIENCE_S, watchdog_intervall=PATIENCE_S)
    client.set_user(GOOD)
    client.set_password(PASSWORD)
    await client.connect()
    space = await client.get_namespace_index("urn:drivebridge:points")
    status = client.get_node(f"ns={space};s=conveyor/fu2/status/status_word")
    names = ("control_word", "setpoint_1")
    nodes = [ua.NodeId(f"conveyor/fu2/command/{name}", space) for name in names]

    async def exchange(word: int) -> int:
        values = [ua.DataValue(ua.Variant(value, ua.VariantType.UInt16)) for value in (word, SETPOINT)]
        wanted = [
            ua.WriteValue(NodeId=node, AttributeId=ua.AttributeIds.Value, Value=value)
            for node, value in zip(nodes, values, strict=True)
        ]
        results = await client.uaclient.write(ua.WriteParameters(NodesToWrite=wanted))
        if {result.value for result in results} == {ua.StatusCodes.BadTimeout}:
            raise Busy
        check(all(result.is_good() for result in results), results)
        return await opcua_value(status)

    return exchange


async def by_zenoh(port: int) -> Exchange:
    session = good_zenoh(port)
    who = json.dumps({"controller": GOOD})

    def ask(key: str, payload: str | None) -> dict[str, object]:
        replies = session.get(f"{DRIVES}/fu3/{key}", payload=payload, attachment=who, timeout=PATIENCE_S)
        found = [reply.ok or reply.err for reply in replies]
        check(len(found) == 1 and found[0] is not None, f"{len(found)} replies")
        return json.loads(found[0].payload.to_string())  # type: ignore[union-attr]

    async def exchange(word: int) -> int:
        telegram = json.dumps({"control_word": word, "setpoint_1": SETPOINT})
        answer = await asyncio.to_thread(ask, "command", telegram)
        if answer.get("code") == "stale":
            raise Busy
        check(answer.get("ok") is True and answer.get("forwarded") is True, answer)
        answer = await asyncio.to_thread(ask, "status/status_word", None)
        if answer.get("q") == "stale":
            raise Busy
        value = answer.get("v")
        check(isinstance(value, int), answer)
        return int(str(value))

    return exchange


# newcomers: nobody may be locked out


async def new_on_modbus(port: int) -> int:
    client = AsyncModbusTcpClient("127.0.0.1", port=port, timeout=PATIENCE_S, retries=0)
    try:
        check(await client.connect(), "no connection")
        answer = await client.read_input_registers(0, count=21, device_id=1)
        check(not answer.isError(), answer)
        return answer.registers[0]
    finally:
        client.close()


async def new_on_opcua(port: int) -> int:
    async with Client(f"opc.tcp://127.0.0.1:{port}", timeout=PATIENCE_S) as client:
        space = await client.get_namespace_index("urn:drivebridge:points")
        return await opcua_value(client.get_node(f"ns={space};s=conveyor/fu1/status/status_word"))


async def new_on_zenoh(port: int) -> int:
    def ask() -> int:
        with good_zenoh(port) as session:
            replies = session.get(f"{DRIVES}/fu1/status/status_word", timeout=PATIENCE_S)
            found = [json.loads(reply.ok.payload.to_string()) for reply in replies if reply.ok]
        check(len(found) == 1, f"{len(found)} replies")
        return int(found[0]["v"])

    return await asyncio.to_thread(ask)


async def lead(exchange: Exchange) -> None:
    """To operation enabled."""
    end = time.monotonic() + 30
    for word in (SHUT_DOWN, CONTROL_WORD):
        while True:
            try:
                status = await exchange(word)
                if word == SHUT_DOWN or status & ENABLED_MASK == ENABLED:
                    break
            except (Wrong, Busy) as error:
                if time.monotonic() > end:
                    raise
                print(error, flush=True)
            await asyncio.sleep(PERIOD_S)


async def go_on(name: str, exchange: Exchange, is_noted: asyncio.Event, period_s: float = PERIOD_S) -> None:
    while True:
        begin = time.monotonic()
        try:
            async with asyncio.timeout(PATIENCE_S):
                status = await exchange(CONTROL_WORD)
            verdict = "ok" if status & ENABLED_MASK == ENABLED else f"status word {status:04X}h"
        except Busy:
            verdict = "busy"
        except Exception as error:  # noqa: BLE001 - whatever it is, it is noted
            verdict = " ".join(f"{type(error).__name__} {error}".split())
        now = time.monotonic()
        if is_noted.is_set():
            os.write(FILE, f"{now:.3f};{name};{(now - begin) * 1000:.2f};{verdict}\n".encode())
        await asyncio.sleep(max(0.0, begin + period_s - now))


async def main(modbus: int, opcua: int, zenoh_port: int) -> None:
    makers = {"modbus": by_modbus(modbus), "opcua": by_opcua(opcua), "zenoh": by_zenoh(zenoh_port)}
    exchanges = {name: await maker for name, maker in makers.items()}
    running = asyncio.Event()
    led: set[str] = set()

    async def serve(name: str, exchange: Exchange) -> None:
        await lead(exchange)
        led.add(name)
        if len(led) == len(exchanges):
            running.set()
            print("running", flush=True)
        # Whose drive turns goes on while the others are led: it has a watchdog.
        await go_on(name, exchange, running)

    async def come_anew(name: str, new: Callable[[int], Awaitable[int]], port: int) -> None:
        await running.wait()
        await go_on(f"{name}, newly connected", lambda _: new(port), running, NEW_S)

    newcomers = (
        ("modbus", new_on_modbus, modbus),
        ("opcua", new_on_opcua, opcua),
        ("zenoh", new_on_zenoh, zenoh_port),
    )
    await asyncio.gather(
        *(serve(name, exchange) for name, exchange in exchanges.items()),
        *(come_anew(*newcomer) for newcomer in newcomers),
    )


asyncio.run(main(*map(int, sys.argv[2:5])))
