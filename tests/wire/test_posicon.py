"""BU 2500 §5.4 by each protocol: three axes behind a SK TU4-CAO, each with a set speed and a set position.

Steps 1 to 4 and 7 are switches and parameters of NORD's own system bus. Step 5 is done: the simulated drives
are delivered with it. Of step 8, P748 is left out: the manual says nothing of its value.
"""

from __future__ import annotations

import json
import time
from abc import ABC, abstractmethod
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Final

import pytest
import zenoh
from asyncua import ua
from asyncua.sync import Client as OpcUaClient
from pymodbus.client import ModbusTcpClient

from tests.support import sites
from tests.support.families import FamilyBridge, FamilySite
from tests.support.process import free_port, until
from tests.support.telegrams import answered

READY, ENABLE, ACKNOWLEDGE = 0x047E, 0x047F, 0x0080
FAULT = 0x0008
READY_TOLD = 0x0B31
"""§5.4, step 8: P741[-01], "Einschaltbereit"."""
OPERATIONAL, ONLINE = 0x0002, 0b10
"""P173 (§7.1.3): bit 1; from bit 8 on two bits for each drive."""
FULL_HZ: Final = 50.0
_CLIENT_S: Final = 8.0
DRIVES = {"modbus": "fu1", "opcua": "fu2", "zenoh": "fu3"}


class PosiconSite(FamilySite):
    """FU1 … FU3, each commanded by one protocol; P151 is 200 ms (step 6)."""

    def __init__(self, folder: Path) -> None:
        self.drives = {protocol: f"hall/{slot}" for protocol, slot in DRIVES.items()}
        self.ports = {protocol: free_port() for protocol in DRIVES}
        drives = [
            sites.drive(slot, protocol, 3_000, f"unit_id = {unit}\nparameters = {{ P105 = {FULL_HZ} }}")
            for unit, (protocol, slot) in enumerate(DRIVES.items(), 1)
        ]
        node = sites.node(
            *drives,
            name="hall",
            mapping="nord/sk-tu4-cao-posicon",
            more="sdo_channels = [2, 3]\nown_timeout_ms = 200\nenforce = true",
        )
        servers = [
            make(self.ports[protocol])
            for protocol, make in (("modbus", sites.modbus), ("opcua", sites.opcua), ("zenoh", sites.zenoh))
        ]
        bus = sites.bus(node, more="bitrate = 1000000")
        self.path = sites.write(folder, bus, *servers, name="posicon")


class Axis(ABC):
    """One drive as a controller of one protocol sees it."""

    @abstractmethod
    def write(self, word: int, hz: float, revolutions: float) -> None:
        """One telegram: control word, set speed, set position."""

    @abstractmethod
    def status(self) -> int: ...

    @abstractmethod
    def position(self) -> float: ...

    @abstractmethod
    def frequency(self) -> float: ...

    def make_ready(self) -> None:
        """Between the tests its controller is silent: the fault of that is acknowledged (bit 7, §6.5.1)."""
        if self.status() & FAULT:
            self.write(READY | ACKNOWLEDGE, 0.0, 0.0)
        self.keep(READY, 0.0, 0.0, status=READY_TOLD & 0x01FF)

    def keep(self, word: int, hz: float, revolutions: float, *, status: int) -> None:
        """Write in a cycle until the drive says this in the low byte and in bit 8 of its status word."""
        end = time.monotonic() + _CLIENT_S
        while self.status() & 0x01FF != status:
            assert time.monotonic() < end, f"{self.status():04X}h, {self.position()} rev"
            self.write(word, hz, revolutions)
            time.sleep(0.05)


class ModbusAxis(Axis):
    """A PLC with the words of the manual: registers 0 … 3, the position low word first (§6.5.4)."""

    def __init__(self, client: ModbusTcpClient) -> None:
        self._client = client

    def _inputs(self) -> list[int]:
        answer = self._client.read_input_registers(0, count=4, device_id=1)
        assert not answer.isError(), answer
        return list(answer.registers)

    def write(self, word: int, hz: float, revolutions: float) -> None:
        increments = round(revolutions * 1000) & 0xFFFF_FFFF
        words = [word, round(hz / FULL_HZ * 0x4000), increments & 0xFFFF, increments >> 16]
        answer = self._client.write_registers(0, words, device_id=1)
        assert not answer.isError(), answer

    def status(self) -> int:
        return self._inputs()[0]

    def position(self) -> float:
        low, high = self._inputs()[2:]
        return ((high << 16 | low) ^ 0x8000_0000) / 1000 - 0x8000_0000 / 1000

    def frequency(self) -> float:
        word = self._inputs()[1]
        return ((word ^ 0x8000) - 0x8000) / 0x4000 * FULL_HZ


class OpcUaAxis(Axis):
    def __init__(self, client: OpcUaClient) -> None:
        self._client = client
        self._space = client.get_namespace_index("urn:drivebridge:points")

    def _node(self, leaf: str) -> Any:
        return self._client.get_node(f"ns={self._space};s=hall/fu2{leaf}")

    def write(self, word: int, hz: float, revolutions: float) -> None:
        nodes = [self._node(f"/command/{name}") for name in ("control_word", "frequency", "position")]
        kinds = (ua.VariantType.UInt16, ua.VariantType.Float, ua.VariantType.Float)
        values = [
            ua.DataValue(ua.Variant(value, kind))
            for value, kind in zip((word, hz, revolutions), kinds, strict=True)
        ]
        self._client.write_values(nodes, values)  # one Write, one telegram

    def status(self) -> int:
        return int(self._node("/status/status_word").read_value())

    def position(self) -> float:
        return float(self._node("/actual/position").read_value())

    def frequency(self) -> float:
        return float(self._node("/actual/frequency").read_value())


class ZenohAxis(Axis):
    def __init__(self, session: zenoh.Session) -> None:
        self._session = session

    def _ask(self, leaf: str, payload: object = None) -> Any:
        text = None if payload is None else json.dumps(payload)
        (reply,) = self._session.get(f"drives/posicon/hall/fu3/{leaf}", payload=text, timeout=_CLIENT_S)
        answer = reply.ok or reply.err
        assert answer is not None
        return json.loads(answer.payload.to_string())

    def write(self, word: int, hz: float, revolutions: float) -> None:
        command = {"control_word": word, "frequency": hz, "position": revolutions}
        told = answered(lambda: self._ask("command", command))
        assert told["ok"], told

    def status(self) -> int:
        return int(self._ask("status/status_word")["v"])

    def position(self) -> float:
        return float(self._ask("actual/position")["v"])

    def frequency(self) -> float:
        return float(self._ask("actual/frequency")["v"])


class Rig:
    """The bridge with a client of each protocol."""

    def __init__(self, site: PosiconSite, stack: ExitStack) -> None:
        bridge = FamilyBridge(site)
        stack.callback(bridge.stop)
        bridge.start()
        modbus = ModbusTcpClient("127.0.0.1", port=site.ports["modbus"], timeout=_CLIENT_S)
        self._opcua = OpcUaClient(f"opc.tcp://127.0.0.1:{site.ports['opcua']}", timeout=_CLIENT_S)
        self._opcua.aio_obj.session_timeout = 60_000  # ms
        settings = {
            "mode": "client",
            "connect": {"endpoints": [f"tcp/127.0.0.1:{site.ports['zenoh']}"]},
            "scouting": {"multicast": {"enabled": False}},
        }
        stack.enter_context(modbus)
        stack.enter_context(self._opcua)
        session = stack.enter_context(zenoh.open(zenoh.Config.from_json5(json.dumps(settings))))
        self.axes: dict[str, Axis] = {
            "modbus": ModbusAxis(modbus),
            "opcua": OpcUaAxis(self._opcua),
            "zenoh": ZenohAxis(session),
        }

    def parameter(self, slot: str, name: str) -> int:
        """Over the SDO channel of this drive."""
        space = self._opcua.get_namespace_index("urn:drivebridge:points")
        drive = self._opcua.get_node(f"ns={space};s=hall/{slot}")
        return int(drive.call_method(f"{space}:ReadParameter", name))


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    with ExitStack() as stack:
        yield Rig(PosiconSite(tmp_path_factory.mktemp("posicon")), stack)


@pytest.mark.landing
@pytest.mark.parametrize("slot", DRIVES.values())
def test_steps_5_and_6_the_words_and_p151(rig: Rig, slot: str) -> None:
    assert [rig.parameter(slot, f"P543[{n}]") for n in (1, 2, 3)] == [1, 10, 15]
    assert [rig.parameter(slot, f"P546[{n}]") for n in (1, 2, 3)] == [1, 23, 24]
    assert rig.parameter("fu1", "P151") == 200


@pytest.mark.landing
@pytest.mark.parametrize("protocol", DRIVES)
def test_steps_8_and_9_what_the_parameters_show(rig: Rig, protocol: str) -> None:
    axis, slot = rig.axes[protocol], DRIVES[protocol]
    axis.make_ready()
    assert axis.status() == READY_TOLD
    assert rig.parameter(slot, "P740[1]") == READY
    assert rig.parameter(slot, "P741[1]") == READY_TOLD
    place = int(slot[-1]) - 1
    state = rig.parameter("fu1", "P173")
    assert state & OPERATIONAL
    assert state >> 8 + 2 * place & 3 == ONLINE
    assert rig.parameter("fu1", f"P176[{2 + 4 * place}]") == READY
    assert rig.parameter("fu1", f"P177[{2 + 4 * place}]") == READY_TOLD


@pytest.mark.landing(3)
@pytest.mark.parametrize("protocol", DRIVES)
def test_an_axis_goes_where_it_is_told(rig: Rig, protocol: str) -> None:
    """37h is *enabled*, and bit 8 says that the position is reached. The others stay where they are."""
    axis = rig.axes[protocol]
    others = [other for other in rig.axes.values() if other is not axis]
    were = [other.position() for other in others]
    axis.make_ready()
    for revolutions in (12.5, -3.25):
        axis.keep(ENABLE, FULL_HZ, revolutions, status=0x0037)
        axis.keep(ENABLE, FULL_HZ, revolutions, status=0x0137)
        assert (axis.position(), axis.frequency()) == (revolutions, 0.0)
    axis.keep(READY, 0.0, 0.0, status=0x0131)
    assert axis.position() == -3.25, "a drive that is not enabled follows no position"
    assert [other.position() for other in others] == were


@pytest.mark.landing
def test_all_three_at_once_each_to_its_own(rig: Rig) -> None:
    """§5.4: independently of each other."""
    goals = {"modbus": 5.0, "opcua": -7.5, "zenoh": 2.125}
    for axis in rig.axes.values():
        axis.make_ready()

    def are_there() -> bool:
        for protocol, axis in rig.axes.items():
            axis.write(ENABLE, FULL_HZ, goals[protocol])
        return {protocol: axis.position() for protocol, axis in rig.axes.items()} == goals

    until(are_there, _CLIENT_S, "all three are there")
    for axis in rig.axes.values():
        axis.write(READY, 0.0, 0.0)
