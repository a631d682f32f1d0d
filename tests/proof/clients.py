"""Real clients of the three protocols that write telegrams to several drives."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Coroutine, Sequence
from contextlib import suppress
from typing import Any, Protocol

from tests.proof.board import RELEASE
from tests.proof.drives import PORTS, SERVERS, Drive, drives_of
from tests.proof.settings import PLANT

_LIMIT_S = PLANT.fieldbus_timeout_ms / 1000 + 1.5
"""Longer than the bridge or the network is held up here: waiting on is quicker than connecting anew, which a
drive that is to hold takes for another owner."""
_CONNECT_S = 20.0
_KEEP_ALIVE = 10
"""Holding register (docs/reference/modbus.md): 0 releases the drive."""


class ClientFault(Exception):
    """The connection is gone, or nobody answers: connect anew."""


class Client(Protocol):
    async def connect(self) -> None: ...

    async def write(self, telegrams: Sequence[tuple[Drive, int, int]]) -> list[bool]:
        """One telegram for each drive: control word and setpoint; with ``RELEASE``, which only Modbus drives
        get, their owner gives them back. Whether each was accepted."""
        ...

    async def close(self) -> None: ...


class ModbusClient:
    """pymodbus, a connection for each drive."""

    def __init__(self) -> None:
        self._clients: dict[Drive, Any] = {}

    async def connect(self) -> None:
        from pymodbus.client import AsyncModbusTcpClient

        for drive in drives_of("modbus"):
            client = self._clients[drive] = AsyncModbusTcpClient(
                SERVERS["modbus"], port=PORTS["modbus"], timeout=_LIMIT_S, retries=0, reconnect_delay=0
            )
            if not await client.connect():
                raise ClientFault

    async def write(self, telegrams: Sequence[tuple[Drive, int, int]]) -> list[bool]:
        return await asyncio.gather(*(self._write(*telegram) for telegram in telegrams))

    async def _write(self, drive: Drive, control_word: int, setpoint: int) -> bool:
        from pymodbus.exceptions import ModbusException

        register, *values = (_KEEP_ALIVE, 0) if control_word == RELEASE else (0, control_word, setpoint)
        try:
            answer = await self._clients[drive].write_registers(register, values, device_id=drive.unit)
        except ModbusException as error:
            raise ClientFault from error
        return not answer.isError()

    async def close(self) -> None:
        for client in self._clients.values():
            client.close()


async def _within(seconds: float, doing: Coroutine[Any, Any, Any]) -> Any:
    """What it gives. Raises ``TimeoutError``, also where a task swallows its cancellation, as asyncua's may:
    it is left to itself then."""
    task = asyncio.ensure_future(doing)
    done, _ = await asyncio.wait({task}, timeout=seconds)
    if not done:
        task.cancel()
        raise TimeoutError
    return task.result()


class OpcUaClient:
    """asyncua: all drives in one Write call."""

    def __init__(self) -> None:
        from asyncua import Client as UaClient

        url = f"opc.tcp://{SERVERS['opcua']}:{PORTS['opcua']}"
        # Its own look at the server would give the connection up after a second.
        self._client = UaClient(url, timeout=_LIMIT_S, watchdog_intervall=_CONNECT_S)
        self._client.session_timeout = 60_000
        self._space = 0

    async def connect(self) -> None:
        from asyncua import ua

        try:
            await _within(_CONNECT_S, self._client.connect())
            self._space = await _within(
                _CONNECT_S, self._client.get_namespace_index("urn:drivebridge:points")
            )
        except (OSError, TimeoutError, ConnectionError, ua.UaError, ValueError) as error:
            raise ClientFault from error

    async def write(self, telegrams: Sequence[tuple[Drive, int, int]]) -> list[bool]:
        from asyncua import ua

        def item(drive: Drive, leaf: str, value: int) -> Any:
            node = ua.NodeId(f"{drive.path}/command/{leaf}", self._space)
            variant = ua.DataValue(ua.Variant(value, ua.VariantType.UInt16))
            return ua.WriteValue(NodeId=node, AttributeId=ua.AttributeIds.Value, Value=variant)

        items = [
            item(drive, leaf, value)
            for drive, control_word, setpoint in telegrams
            for leaf, value in (("control_word", control_word), ("setpoint_1", setpoint))
        ]
        try:
            parameters = ua.WriteParameters(NodesToWrite=items)
            results = await _within(2 * _LIMIT_S, self._client.uaclient.write(parameters))
        except (OSError, TimeoutError, ConnectionError, ua.UaError) as error:
            raise ClientFault from error
        good = [result.is_good() for result in results]
        return [one and two for one, two in zip(good[::2], good[1::2], strict=True)]

    async def close(self) -> None:
        with suppress(Exception):
            await _within(0.2, self._client.disconnect())
        with suppress(Exception):
            self._client.disconnect_socket()


class ZenohClient:
    """A zenoh session; the queries of all drives are asked side by side."""

    def __init__(self) -> None:
        self._session: Any = None

    async def connect(self) -> None:
        import zenoh

        settings = {
            "mode": "client",
            "connect": {"endpoints": [f"tcp/{SERVERS['zenoh']}:{PORTS['zenoh']}"], "timeout_ms": 1000},
            "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        }
        try:
            self._session = await asyncio.to_thread(zenoh.open, zenoh.Config.from_json5(json.dumps(settings)))
        except zenoh.ZError as error:
            raise ClientFault from error

    async def write(self, telegrams: Sequence[tuple[Drive, int, int]]) -> list[bool]:
        return await asyncio.to_thread(self._ask, telegrams)

    def _ask(self, telegrams: Sequence[tuple[Drive, int, int]]) -> list[bool]:
        import zenoh

        try:
            answers = [
                self._session.get(
                    f"drives/proof/{drive.path}/command",
                    payload=json.dumps({"control_word": control_word, "setpoint_1": setpoint}),
                    timeout=_LIMIT_S,
                )
                for drive, control_word, setpoint in telegrams
            ]
            replies = [list(answer) for answer in answers]
        except zenoh.ZError as error:
            raise ClientFault from error
        if not any(replies):
            raise ClientFault
        return [len(found) == 1 and found[0].ok is not None for found in replies]

    async def close(self) -> None:
        session, self._session = self._session, None
        if session is not None:
            with suppress(Exception):
                await asyncio.to_thread(session.close)


CLIENTS: dict[str, type[ModbusClient] | type[OpcUaClient] | type[ZenohClient]] = {
    "modbus": ModbusClient,
    "opcua": OpcUaClient,
    "zenoh": ZenohClient,
}
