"""Every family through every protocol: it starts, follows a setpoint, faults, is acknowledged and stops."""

from __future__ import annotations

import json
import struct
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any

import pytest
import zenoh
from asyncua import ua
from asyncua.sync import Client as OpcUaClient
from pymodbus.client import ModbusTcpClient

from bridge.drive import ControlWords, DriveState
from bridge.mapping import Family, family_names
from bridge.northbound.modbus.registers import DriveMap, Row
from bridge.sim.catalogue import SIMULATED
from tests.support.families import FamilyBridge, family_bridge, setpoint_of, speed_of
from tests.support.process import until
from tests.support.telegrams import answered

PROTOCOLS = ("modbus", "opcua", "zenoh")
_LIMIT_S = 8.0
_READY = (DriveState.READY, DriveState.SWITCHED_ON)


class Controller(ABC):
    """One drive as a client of one protocol sees it."""

    @abstractmethod
    def read(self, leaf: str) -> Any: ...

    @abstractmethod
    def start(self) -> None: ...

    @abstractmethod
    def stop(self) -> None: ...

    @abstractmethod
    def acknowledge(self) -> None: ...

    @abstractmethod
    def write(self, name: str, value: float) -> None:
        """A setpoint by its meaning."""

    def wait(self, leaf: str, is_so: Callable[[Any], bool]) -> None:
        def holds() -> bool:
            return is_so(self.read(leaf))

        until(holds, _LIMIT_S, f"{leaf}, which is {self.read(leaf)!r}")

    def wait_state(self, *states: DriveState) -> None:
        self.wait("status/state", lambda value: DriveState(int(value)) in states)


class ModbusController(Controller):
    """A PLC: it knows the control words of the drive's manual."""

    def __init__(self, client: ModbusTcpClient, map_: DriveMap, family: Family) -> None:
        self._client = client
        self._unit = map_.unit_id
        self._inputs = {row.name: row for row in map_.rows if row.table.value == "input register"}
        self._holding = {row.name: row for row in map_.rows if row.table.value == "holding register"}
        self._model = family.control_word
        self._words = ControlWords(family.control_word)

    def read(self, leaf: str) -> Any:
        row = self._inputs[leaf]
        answer = self._client.read_input_registers(row.address, count=row.size, device_id=self._unit)
        assert not answer.isError(), answer
        return answer.registers[0] if row.size == 1 else _from_registers(row, answer.registers)

    def _put(self, address: int, *registers: int) -> None:
        answer = self._client.write_registers(address, list(registers), device_id=self._unit)
        assert not answer.isError(), answer

    def start(self) -> None:
        self._put(0, self._model.ready)
        self.wait_state(*_READY)
        self._put(0, self._model.run | self._model.forward)
        self.wait_state(DriveState.OPERATION_ENABLED)
        if self._model.begin:
            self._put(0, self._model.run | self._model.begin)

    def stop(self) -> None:
        self._put(0, self._words.stop(self._model.run))

    def acknowledge(self) -> None:
        self._put(0, self._model.ready)
        self._put(11, 1)

    def write(self, name: str, value: float) -> None:
        row = self._holding[f"command/{name}"]
        self._put(row.address, *_to_registers(row, value))


def _from_registers(row: Row, registers: list[int]) -> Any:
    code = {"float32": ">f", "int32": ">i", "uint32": ">I"}[row.type]
    return struct.unpack(code, struct.pack(">HH", *registers))[0]


def _to_registers(row: Row, value: float) -> tuple[int, ...]:
    data = struct.pack(">f", value) if row.type == "float32" else struct.pack(">i", int(value))
    return struct.unpack(">HH", data)


class OpcUaController(Controller):
    def __init__(self, client: OpcUaClient, drive: str) -> None:
        self._space = client.get_namespace_index("urn:drivebridge:points")
        self._client = client
        self._drive = drive

    def _node(self, leaf: str = "") -> Any:
        return self._client.get_node(f"ns={self._space};s={self._drive}{leaf}")

    def read(self, leaf: str) -> Any:
        return self._node(f"/{leaf}").read_value()

    def _call(self, method: str, *arguments: object) -> None:
        self._node().call_method(f"{self._space}:{method}", *arguments)

    def start(self) -> None:
        self._call("Start", 1)

    def stop(self) -> None:
        self._call("Stop")

    def acknowledge(self) -> None:
        self._call("ResetFault")

    def write(self, name: str, value: float) -> None:
        node = self._node(f"/command/{name}")
        kind = node.read_data_type_as_variant_type()
        number = value if kind in (ua.VariantType.Float, ua.VariantType.Double) else int(value)
        node.write_value(ua.Variant(number, kind))


class ZenohController(Controller):
    def __init__(self, session: zenoh.Session, drive: str) -> None:
        self._session = session
        self._key = f"drives/families/{drive}"

    def _ask(self, leaf: str, payload: str | None = None) -> Any:
        (reply,) = self._session.get(f"{self._key}/{leaf}", payload=payload, timeout=_LIMIT_S)
        answer = reply.ok or reply.err
        assert answer is not None
        return json.loads(answer.payload.to_string())

    def read(self, leaf: str) -> Any:
        return self._ask(leaf)["v"]

    def _command(self, leaf: str, payload: str = "{}") -> None:
        answer = answered(lambda: self._ask(f"command/{leaf}", payload))
        assert answer["ok"], answer

    def start(self) -> None:
        self._command("start", '{"direction": 1}')

    def stop(self) -> None:
        self._command("stop")

    def acknowledge(self) -> None:
        self._command("reset_fault")

    def write(self, name: str, value: float) -> None:
        self._command(name, json.dumps(value))


@contextmanager
def modbus_clients(bridge: FamilyBridge) -> Iterator[Callable[[str], Controller]]:
    with ModbusTcpClient("127.0.0.1", port=bridge.site.port, timeout=_LIMIT_S) as client:
        drives = bridge.call(lambda: dict(bridge.service.plant.catalogue.drives))

        def make(mapping: str) -> Controller:
            map_ = DriveMap(drives[bridge.site.drives[mapping]])
            return ModbusController(client, map_, bridge.site.families[mapping])

        yield make


@contextmanager
def opcua_clients(bridge: FamilyBridge) -> Iterator[Callable[[str], Controller]]:
    client = OpcUaClient(f"opc.tcp://127.0.0.1:{bridge.site.port}", timeout=_LIMIT_S)
    client.aio_obj.session_timeout = 60_000  # ms
    with client:
        yield lambda mapping: OpcUaController(client, bridge.site.drives[mapping])


@contextmanager
def zenoh_clients(bridge: FamilyBridge) -> Iterator[Callable[[str], Controller]]:
    settings = {
        "mode": "client",
        "connect": {"endpoints": [f"tcp/127.0.0.1:{bridge.site.port}"]},
        "scouting": {"multicast": {"enabled": False}},
    }
    with zenoh.open(zenoh.Config.from_json5(json.dumps(settings))) as session:
        yield lambda mapping: ZenohController(session, bridge.site.drives[mapping])


CLIENTS = {"modbus": modbus_clients, "opcua": opcua_clients, "zenoh": zenoh_clients}
Controllers = tuple[FamilyBridge, Callable[[str], Controller]]


@pytest.fixture(scope="module", params=PROTOCOLS)
def controllers(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[Controllers]:
    with ExitStack() as stack:
        folder = tmp_path_factory.mktemp(request.param)
        bridge = stack.enter_context(family_bridge(folder, SIMULATED, request.param))
        yield bridge, stack.enter_context(CLIENTS[request.param](bridge))


@pytest.mark.landing(5)
@pytest.mark.parametrize("mapping", SIMULATED)
def test_it_starts_follows_faults_is_acknowledged_and_stops(controllers: Controllers, mapping: str) -> None:
    bridge, make = controllers
    drive, family = bridge.site.drives[mapping], bridge.site.families[mapping]
    controller = make(mapping)

    run(controller, family, 1)
    text = bridge.fail(drive)
    controller.wait_state(DriveState.FAULT)
    controller.wait("status/emcy_code", bool)
    assert text in str(bridge.value(f"{drive}/status/fault_text"))
    assert bridge.value(f"{drive}/status/fault_number")

    controller.acknowledge()
    controller.wait("status/state", lambda state: int(state) != DriveState.FAULT)
    run(controller, family, 2)
    controller.stop()
    setpoint = setpoint_of(family)
    if setpoint is None or setpoint[0] == "position":
        controller.wait("status/state", lambda state: int(state) != DriveState.OPERATION_ENABLED)
    else:
        controller.wait(f"actual/{setpoint[0]}", lambda actual: abs(actual) < 0.02 * setpoint[1])


def run(controller: Controller, family: Family, multiple: int) -> None:
    """Start the drive and give it a setpoint, until it is there."""
    controller.start()
    controller.wait_state(DriveState.OPERATION_ENABLED)
    setpoint = setpoint_of(family)
    if setpoint is None:
        if any(value.name == "homing_attained" for value in family.value):
            controller.wait("actual/homing_attained", bool)
        return
    for name, speed in speed_of(family).items():
        controller.write(name, speed)
    name, value = setpoint[0], multiple * setpoint[1]
    controller.write(name, value)
    controller.wait(f"actual/{name}", lambda actual: abs(actual - value) <= 0.02 * value)


def test_every_family_can_be_simulated() -> None:
    assert list(SIMULATED) == family_names()
