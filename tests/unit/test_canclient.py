"""python-canopen through the bridge: its SDO client and NMT over the gateway's socket."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import cast

import can
import canopen
import pytest

from bridge.canclient import DrivebridgeBus
from bridge.command import Action, Code, Outcome, ReadParameter, Reply, Request, WriteParameter
from bridge.dictionary import load_dictionary
from bridge.northbound.gateway.server import MOST_CLIENTS, GatewayServer
from bridge.northbound.view import View
from tests.unit.northbound.test_gateway import NET


class Plant:
    """Objects by their address, as bytes in hexadecimal."""

    def __init__(self) -> None:
        self.objects = {"2066:01": "67 00", "1008:00": b"SK TU4-CAO, a long name".hex(" ")}
        self.nmt: list[tuple[str, Action]] = []

    def submit(self, request: Request, reply: Reply) -> None:
        match request.command:
            case ReadParameter(parameter=name) if name in self.objects:
                reply(Outcome(Code.OK, value=self.objects[name]))
            case ReadParameter():
                reply(Outcome(Code.REFUSED_BY_DRIVE, abort_code=0x0602_0000))
            case WriteParameter(parameter="1017:00"):
                reply(Outcome(Code.NOT_ALLOWED))
            case WriteParameter(parameter=name, value=value):
                self.objects[name] = str(value)
                reply(Outcome(Code.OK))
            case _ if request.target.startswith("bus/"):
                reply(Outcome(Code.NOT_ALLOWED))
            case _:
                self.nmt.append((request.target, request.action))
                reply(Outcome(Code.OK))


@pytest.fixture
def plant() -> Plant:
    return Plant()


@pytest.fixture
def folder(plant: Plant, tmp_path: Path) -> Iterator[Path]:
    loop = asyncio.new_event_loop()
    path = tmp_path / "hall-can0.gateway"
    server = GatewayServer(cast("View", plant), NET, path, None, time.monotonic)
    loop.run_until_complete(server.start())
    thread = threading.Thread(target=loop.run_forever)
    thread.start()
    yield tmp_path
    asyncio.run_coroutine_threadsafe(server.close(), loop).result(5)
    loop.call_soon_threadsafe(loop.stop)
    thread.join(5)
    loop.close()


@pytest.fixture
def network(folder: Path) -> Iterator[canopen.Network]:
    network = canopen.Network()
    network.bus = DrivebridgeBus("hall/can0", runtime_dir=str(folder))
    network.connect()
    yield network
    network.disconnect()


@pytest.fixture
def node(network: canopen.Network) -> canopen.RemoteNode:
    node = canopen.RemoteNode(5, load_dictionary("nord/sk-tu4-cao", 5))
    network.add_node(node)
    return node


def test_a_parameter_is_read_and_written_by_its_name(node: canopen.RemoteNode, plant: Plant) -> None:
    time_ = node.sdo["P102.1"]
    assert (time_.phys, time_.od.unit) == (pytest.approx(1.03), "s")
    time_.phys = 2.5
    assert plant.objects["2066:01"] == "FA 00"


def test_long_values_go_in_segments(node: canopen.RemoteNode, plant: Plant) -> None:
    assert node.sdo.upload(0x1008, 0).startswith(b"SK TU4-CAO, a long")
    node.sdo.download(0x2500, 0, bytes(range(20)))
    assert bytes.fromhex(plant.objects["2500:00"]) == bytes(range(20))


def test_the_longest_value_goes_in_blocks_and_fits_a_line(node: canopen.RemoteNode, plant: Plant) -> None:
    longest = bytes(range(256)) * 128
    with node.sdo.open(0x2500, 0, "wb", size=len(longest), block_transfer=True) as file:
        file.write(longest)
    assert bytes.fromhex(plant.objects["2500:00"]) == longest
    with node.sdo.open(0x2500, 0, "rb", block_transfer=True) as file:
        assert file.read() == longest


def test_what_the_node_or_the_bridge_refuses_is_an_abort(node: canopen.RemoteNode) -> None:
    with pytest.raises(canopen.SdoAbortedError, match="0x06020000"):
        node.sdo.upload(0x5FFF, 0)
    with pytest.raises(canopen.SdoAbortedError, match="0x08000021"):
        node.sdo.download(0x1017, 0, b"\0\0")


def test_nmt_is_a_request(node: canopen.RemoteNode, network: canopen.Network, plant: Plant) -> None:
    node.nmt.send_command(0x80)
    assert plant.nmt == [("conveyor", Action.ENTER_PRE_OPERATIONAL)]
    with pytest.raises(can.CanOperationError):
        network.nmt.send_command(0x02)


def test_nobody_answers_for_a_node_that_the_site_does_not_have(folder: Path) -> None:
    with DrivebridgeBus("hall/can0", runtime_dir=str(folder)) as bus:
        bus.send(
            can.Message(
                arbitration_id=0x609, data=bytes((0x40, 0, 0x10, 0, 0, 0, 0, 0)), is_extended_id=False
            )
        )
        assert bus.recv(0.05) is None


def test_what_is_neither_sdo_nor_nmt_is_not_sent(folder: Path) -> None:
    with (
        DrivebridgeBus(str(folder / "hall-can0.gateway")) as bus,
        pytest.raises(can.CanOperationError, match="80h is not sent"),
    ):
        bus.send(can.Message(arbitration_id=0x80, is_extended_id=False))


def test_where_no_bridge_runs_the_message_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(can.CanInitializationError, match='gateway = "socket"'):
        DrivebridgeBus("hall/can0", runtime_dir=str(tmp_path))


def test_one_client_too_many_is_told_so(folder: Path) -> None:
    with ExitStack() as stack:
        for _ in range(MOST_CLIENTS):
            stack.enter_context(DrivebridgeBus("hall/can0", runtime_dir=str(folder)))
        with pytest.raises(can.CanInitializationError, match="clients enough"):
            DrivebridgeBus("hall/can0", runtime_dir=str(folder))
