"""A plant behind an OPC UA server, without a bus: the drives answer a control word at once."""

from __future__ import annotations

import asyncio
import time
import tomllib
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from pathlib import Path

from asyncua import Client, ua

from bridge.command import Event, Identification, Outcome, Plant, Request, Role
from bridge.command.link import NodeState
from bridge.command.request import DONE, Code, Reply
from bridge.config import OpcUaTable, Site
from bridge.image import Image
from bridge.mapping import load_family
from bridge.northbound.opcua.server import OpcUaServer

FAMILY = "nord/sk-tu4-cao"
SITE = """
site.name = "hall"

[[bus]]
name = "can0"
interface = "virtual"

[[bus.node]]
name = "conveyor"
id = 5
mapping = "nord/sk-tu4-cao"

[[bus.node.drive]]
slot = "fu1"
control = "opcua"
fieldbus_timeout_ms = 0
parameters = { P105 = 50.0, P112 = 10.0 }

[[bus.node.drive]]
slot = "fu2"
control = "modbus"
fieldbus_timeout_ms = 200
parameters = { P105 = 50.0 }

[[bus.node.drive]]
slot = "fu3"
control = "lease"
fieldbus_timeout_ms = 300
parameters = { P105 = 50.0, P112 = 10.0 }

[[bus.node.drive]]
slot = "fu4"
control = "none"

[modbus]
[opcua]
"""

OPEN = OpcUaTable(listen="127.0.0.1:0", no_security=True, anonymous="operator")
SWITCH_ON_INHIBITED, READY, ENABLED = 0x0240, 0x0231, 0x0237


def make_plant() -> Plant:
    """Every node operational, every drive ready to be switched on."""
    site = Site.model_validate(tomllib.loads(SITE))
    plant = Plant(site, {FAMILY: load_family(FAMILY)}, "1.2.3")
    now = time.monotonic()
    for node in plant.nodes.values():
        plant.on_node(node, NodeState.OPERATIONAL, now)
        for drive in node.drives:
            drive.on_process_data([SWITCH_ON_INHIBITED, 0, 0, 0], now)
            drive.on_identification(Identification(0x38, 1, 2, 3, "SK TU4-CAO"), now)
    plant.refresh(now)
    return plant


class LocalView:
    """A ``View`` on a plant of this process; ``requests`` keeps what was asked.

    With ``answers`` False the drives say nothing to what they are sent.
    """

    def __init__(self, plant: Plant) -> None:
        self.plant = plant
        self.requests: list[Request] = []
        self.answers = True
        self._offset_ns = time.time_ns() - time.monotonic_ns()
        for node in plant.nodes.values():
            node.command = self._node_command

    @property
    def image(self) -> Image:
        return self.plant.image

    def epoch_ns(self, time: float) -> int:
        return int(time * 1e9) + self._offset_ns

    def on_event(self, listener: Callable[[Event], None]) -> None:
        self.plant.on_event(listener)

    async def request(self, request: Request) -> Outcome:
        self.requests.append(request)
        outcome: asyncio.Future[Outcome] = asyncio.get_running_loop().create_future()

        def reply(found: Outcome) -> None:
            if not outcome.done():
                outcome.set_result(found)

        self.plant.submit(request, time.monotonic(), reply)
        return await outcome

    def _node_command(self, request: Request, now: float, reply: Reply) -> None:
        allowed = request.identity.role >= Role.OPERATOR
        reply(DONE if allowed else Outcome(Code.NOT_ALLOWED, "may only read"))

    async def run(self) -> None:
        """The drives and the timers, every 5 ms."""
        while True:
            now = time.monotonic()
            for drive in self.plant.drives.values():
                if self.answers:
                    drive.on_process_data(_answer(drive.channel.output.words), now)
            self.plant.on_time(now)
            await asyncio.sleep(0.005)


def _answer(words: tuple[int, ...]) -> list[int]:
    control, setpoint = words[0] & 0x000F, words[1]
    status = {0x000E: READY, 0x0006: READY, 0x000F: ENABLED}.get(control, SWITCH_ON_INHIBITED)
    return [status, setpoint if status == ENABLED else 0, 0x2000, 0]


@asynccontextmanager
async def serving(
    settings: OpcUaTable, state_dir: Path, plant: Plant | None = None
) -> AsyncIterator[tuple[OpcUaServer, LocalView]]:
    view = LocalView(plant or make_plant())
    server = OpcUaServer(view, settings, state_dir, "hall")
    await server.start()
    drives = asyncio.create_task(view.run())
    try:
        yield server, view
    finally:
        drives.cancel()
        with suppress(asyncio.CancelledError):
            await drives
        await server.close()


@asynccontextmanager
async def connected(server: OpcUaServer, **how: object) -> AsyncIterator[Client]:
    client = Client(server.endpoint_url, timeout=10, **how)
    await client.connect()
    try:
        yield client
    finally:
        await client.disconnect()


async def namespace(client: Client) -> int:
    return await client.get_namespace_index("urn:drivebridge:points")


def status_of(error: ua.UaStatusCodeError) -> int:
    return error.code
