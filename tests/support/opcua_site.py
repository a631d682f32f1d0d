"""A plant behind an OPC UA server, without a bus: the drives answer a control word at once."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path

from asyncua import Client, ua

from bridge.command import Identification, Outcome, Plant, PlantView, Rejection, Request, Role
from bridge.command.drive_link import NodeState
from bridge.command.messages.request import DONE, NODE_ACTIONS, Code, Reply
from bridge.config import OpcUaTable
from bridge.northbound.opcua.models.nameplates import nameplates_of
from bridge.northbound.opcua.server import OpcUaServer
from tests.support import sites
from tests.support.node_states import node_goes, run_timers

SITE = sites.site(
    sites.bus(
        sites.node(
            sites.drive("fu1", "opcua", 0),
            sites.drive("fu2", "modbus", 200, "parameters = { P105 = 50.0 }"),
            sites.drive("fu3", "lease", 300, "fieldbus_timeout_writable = true"),
            '[[bus.node.drive]]\nslot = "fu4"\ncontrol = "none"\n',
        )
    ),
    sites.modbus(),
    "[opcua]\n",
)

OPEN = OpcUaTable(listen="127.0.0.1:0", no_security=True, anonymous="operator")
SWITCH_ON_INHIBITED, READY, ENABLED = 0x0240, 0x0231, 0x0237


def make_plant() -> Plant:
    """Every node operational, every drive ready to be switched on."""
    plant = sites.plant_of(SITE)
    now = time.monotonic()
    for node in plant.nodes.values():
        node_goes(plant, node, NodeState.OPERATIONAL, now)
        for drive in node.drives:
            drive.on_process_data([SWITCH_ON_INHIBITED, 0, 0, 0], now)
            drive.on_identification(Identification(0x38, 1, 2, 3, "SK TU4-CAO"), now)
    plant.refresh(now)
    return plant


class LocalView(PlantView):
    """Without a bus; ``requests`` and ``rejections`` keep what was asked.

    With ``answers`` False the drives say nothing to what they are sent.
    """

    def __init__(self, plant: Plant) -> None:
        self.plant = plant
        self.requests: list[Request] = []
        self.rejections: list[Rejection] = []
        self.answers = True
        offset_ns = time.time_ns() - time.monotonic_ns()
        super().__init__(plant, time.monotonic, lambda at: int(at * 1e9) + offset_ns, self._command_node)

    def submit(self, request: Request, reply: Reply) -> None:
        self.requests.append(request)
        super().submit(request, reply)

    def rejected(self, rejection: Rejection, at: float | None = None, count: int = 1) -> None:
        self.rejections.append(rejection)
        super().rejected(rejection, at, count)

    def _command_node(self, request: Request, now: float, reply: Reply) -> bool:
        if request.action not in NODE_ACTIONS or request.target not in ("bus/can0", *self.plant.nodes):
            return False
        allowed = request.identity.role >= Role.OPERATOR
        reply(DONE if allowed else Outcome(Code.NOT_ALLOWED, "may only read"))
        return True

    async def run(self) -> None:
        """The drives and the timers, every 5 ms."""
        while True:
            now = time.monotonic()
            for drive in self.plant.drives.values():
                if self.answers:
                    drive.on_process_data(_answer(drive.channel.output.words), now)
            run_timers(self.plant, now)
            self.plant.deliver_outcomes()
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
    nameplates = nameplates_of(view.plant.catalogue)
    server = OpcUaServer(view, settings, state_dir, "hall", nameplates=nameplates)
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
    # By default it gives itself up where the server, in the same process, says nothing for a second.
    client = Client(server.endpoint_url, timeout=10, watchdog_intervall=10, **how)
    await client.connect()
    try:
        yield client
    finally:
        await client.disconnect()


def break_off(client: Client) -> None:
    """End a client as if it had died: asyncua's own would go on asking and looking after itself for ever."""
    client.disconnect_socket()
    for task in (
        client.uaclient._publish_task,
        client._renew_channel_task,
        client._supervisor_task,
        client._stale_watchdog_task,
    ):
        if task:
            task.cancel()


async def namespace(client: Client) -> int:
    return await client.get_namespace_index("urn:drivebridge:points")


def status_of(error: ua.UaStatusCodeError) -> int:
    return error.code
