"""python-canopen through the bridge: its SDO client and NMT over the gateway's socket."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Callable, Coroutine, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from pathlib import Path
from typing import cast

import can
import canopen
import pytest

from bridge.can.virtual import VirtualWire
from bridge.can.wiretap import Wiretap
from bridge.canclient import DrivebridgeBus
from bridge.canopen.frame import Frame
from bridge.command import Action, Code, Outcome, ReadParameter, Reply, Request, WriteParameter
from bridge.dictionary import load_dictionary
from bridge.northbound.gateway.server import MOST_CLIENTS, GatewayServer
from bridge.northbound.view import View
from tests.unit.northbound.gateway.test_gateway_session import NET


class Plant:
    """Objects by their address, as bytes in hexadecimal; ``send`` puts a frame of a node on its bus."""

    def __init__(self) -> None:
        wire = VirtualWire()
        self.ours, self.theirs = wire.end("ours"), wire.end("theirs")
        self.loop: asyncio.AbstractEventLoop | None = None
        self.close_tap: Callable[[], Coroutine[None, None, None]] | None = None
        self.objects = {"2066:01": "67 00", "1008:00": b"SK TU4-CAO, a long name".hex(" ")}
        self.nmt: list[tuple[str, Action]] = []

    def send(self, can_id: int, data: bytes) -> None:
        def carry_out() -> None:
            now = time.monotonic()
            self.theirs.send(Frame(can_id, data), now, now)

        assert self.loop
        self.loop.call_soon_threadsafe(carry_out)

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
    tap = Wiretap(plant.ours, tmp_path / "frames")
    net = replace(NET, frames=f"tap {tmp_path / 'frames'}")
    server = GatewayServer(cast("View", plant), net, path, None, time.monotonic)
    plant.loop, plant.close_tap = loop, tap.close
    for end in (plant.ours, plant.theirs):
        loop.call_soon(end.open, lambda: None)
    loop.run_until_complete(tap.start())
    loop.run_until_complete(server.start())
    thread = threading.Thread(target=loop.run_forever)
    thread.start()
    yield tmp_path
    asyncio.run_coroutine_threadsafe(server.close(), loop).result(5)
    asyncio.run_coroutine_threadsafe(tap.close(), loop).result(5)
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


def test_what_is_refused_is_logged_with_object_and_reason(
    node: canopen.RemoteNode, caplog: pytest.LogCaptureFixture
) -> None:
    with pytest.raises(canopen.SdoAbortedError):
        node.sdo.upload(0x5FFF, 0)
    assert caplog.messages == ["node 5: 5FFFh:00: object does not exist in the object dictionary (06020000h)"]


# what the nodes send by themselves


@contextmanager
def sent_again_and_again(plant: Plant, *frames: tuple[int, bytes]) -> Iterator[None]:
    """python-canopen hears of what comes while it waits, and its bus of what comes when it listens."""
    is_over = threading.Event()

    def send() -> None:
        while not is_over.wait(0.05):
            for frame in frames:
                plant.send(*frame)

    sending = threading.Thread(target=send)
    sending.start()
    try:
        yield
    finally:
        is_over.set()
        sending.join()


def test_heartbeats_and_a_boot_up_tell_the_state_of_a_node(node: canopen.RemoteNode, plant: Plant) -> None:
    with sent_again_and_again(plant, (0x705, b"\x05")):
        assert node.nmt.wait_for_heartbeat(5) == "OPERATIONAL"
    with sent_again_and_again(plant, (0x705, b"\x00")):
        node.nmt.wait_for_bootup(5)
        assert node.nmt.state == "PRE-OPERATIONAL"


def test_emergency_messages_reach_whoever_waits(node: canopen.RemoteNode, plant: Plant) -> None:
    heard: list[int] = []
    node.emcy.add_callback(lambda error: heard.append(error.code))
    with sent_again_and_again(plant, (0x085, bytes.fromhex("1023010000000000"))):
        assert node.emcy.wait(0x2310, 5).register == 1
    assert set(heard) == {0x2310}


def test_values_of_a_tpdo_are_received(node: canopen.RemoteNode, plant: Plant) -> None:
    pdo = node.tpdo[1]
    pdo.cob_id, pdo.enabled = 0x185, True
    pdo.clear()
    pdo.add_variable(0x1001, 0)
    pdo.subscribe()
    with sent_again_and_again(plant, (0x185, b"\x21")):
        assert pdo.wait_for_reception(5)
    assert pdo[0].raw == 0x21


def test_conversations_of_the_bridge_are_none_of_the_scripts(
    network: canopen.Network, node: canopen.RemoteNode, plant: Plant
) -> None:
    assert network.bus is not None
    heard: list[int] = []
    network.subscribe(0x585, lambda can_id, *_: heard.append(can_id))
    network.subscribe(0x605, lambda can_id, *_: heard.append(can_id))
    request, reply = bytes.fromhex("4000100000000000"), bytes.fromhex("4300100092010000")
    with sent_again_and_again(plant, (0x605, request), (0x585, reply), (0x705, b"\x05")):
        node.nmt.wait_for_heartbeat(5)
    assert heard == []


def test_who_does_not_hear_gets_answers_alone(folder: Path, plant: Plant) -> None:
    with (
        DrivebridgeBus("hall/can0", runtime_dir=str(folder), hears=False) as bus,
        sent_again_and_again(plant, (0x705, b"\x05")),
    ):
        assert bus.recv(0.3) is None


def test_a_script_is_told_when_the_bus_is_not_heard_any_more(folder: Path, plant: Plant) -> None:
    with DrivebridgeBus("hall/can0", runtime_dir=str(folder)) as bus:
        assert plant.loop
        assert plant.close_tap is not None
        with sent_again_and_again(plant, (0x705, b"\x05")):
            assert bus.recv(5)
        asyncio.run_coroutine_threadsafe(plant.close_tap(), plant.loop).result(5)
        with pytest.raises(can.CanOperationError, match="not heard any more"):
            while bus.recv(5):
                pass


def test_where_nothing_can_be_heard_the_message_says_what_to_do(folder: Path, plant: Plant) -> None:
    assert plant.loop
    assert plant.close_tap is not None
    asyncio.run_coroutine_threadsafe(plant.close_tap(), plant.loop).result(5)
    with pytest.raises(can.CanInitializationError, match="hears=False"):
        DrivebridgeBus("hall/can0", runtime_dir=str(folder))


# what is not given


@pytest.mark.parametrize(
    ("can_id", "is_remote", "whose"),
    [
        (0x080, False, "sync_period_ms"),
        (0x205, False, "OPC UA, Modbus or zenoh"),
        (0x705, True, "supervision of the node"),
        (0x185, True, "site file"),
        (0x7E5, False, "drivebridge lss"),
        (0x100, False, "SDO and NMT"),
    ],
)
def test_what_is_not_sent_says_whose_it_is(folder: Path, can_id: int, is_remote: bool, whose: str) -> None:
    with DrivebridgeBus(str(folder / "hall-can0.gateway")) as bus:
        message = can.Message(arbitration_id=can_id, is_extended_id=False, is_remote_frame=is_remote)
        with pytest.raises(can.CanOperationError, match=f"{can_id:X}h is not sent: .*{whose}"):
            bus.send(message)
        with pytest.raises(can.CanOperationError, match=whose):
            bus.send_periodic(message, 0.1)


def test_what_a_script_starts_in_vain_fails_where_it_is_called(
    network: canopen.Network, node: canopen.RemoteNode
) -> None:
    with pytest.raises(can.CanOperationError, match="SYNC is the bridge's"):
        network.sync.start(0.1)
    with pytest.raises(can.CanOperationError, match="error control is the bridge's"):
        node.nmt.start_node_guarding(0.1)
    node.rpdo[1].cob_id = 0x205
    with pytest.raises(can.CanOperationError, match="process data is the bridge's"):
        node.rpdo[1].start(0.1)


def test_where_no_bridge_runs_the_message_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(can.CanInitializationError, match='gateway = "socket"'):
        DrivebridgeBus("hall/can0", runtime_dir=str(tmp_path))


def test_one_client_too_many_is_told_so(folder: Path) -> None:
    with ExitStack() as stack:
        for _ in range(MOST_CLIENTS):
            stack.enter_context(DrivebridgeBus("hall/can0", runtime_dir=str(folder)))
        with pytest.raises(can.CanInitializationError, match="clients enough"):
            DrivebridgeBus("hall/can0", runtime_dir=str(folder))
