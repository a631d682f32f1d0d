"""Parameters through each protocol, with the clients that people use: asyncua, pymodbus and mbpoll, and a
zenoh client in a process of its own, at a bridge with the simulated NORD interface."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
import time
from collections.abc import AsyncIterator, Iterator, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass
from datetime import datetime
from functools import cached_property
from pathlib import Path
from typing import Any

import pytest
from asyncua.client.client import Client
from pymodbus.client import ModbusTcpClient

from bridge.uaserver.library import StatusCodes, get, make, node_id, ua, variant
from tests.support.opcua_raw import ask, explained
from tests.support.passwords import cheap_hash
from tests.support.process import drivebridge, drivebridge_called, free_port, peer_called, until

SITE = """
[site]
name = "shop"
state_dir = "{folder}/state"
runtime_dir = "{folder}/run"
[[bus]]
name = "can0"
interface = "virtual"
deadman_ms = 1000
[[bus.node]]
name = "conveyor"
id = 5
mapping = "nord/sk-tu4-cao"
sdo_channels = [2]
[[bus.node.drive]]
slot = "fu1"
unit_id = 1
control = "modbus"
fieldbus_timeout_ms = 0
parameters = {{ P105 = 50.0, P112 = 10.0 }}
[[bus.node.drive]]
slot = "fu2"
unit_id = 2
control = "zenoh"
fieldbus_timeout_ms = 0
parameters = {{ P105 = 50.0, P112 = 10.0 }}
[modbus]
listen = "127.0.0.1:{modbus}"
[opcua]
listen = "127.0.0.1:{opcua}"
no_security = true
anonymous = "operator"
[[opcua.user]]
name = "eve"
role = "engineer"
password_hash = "{password_hash}"
[zenoh]
listen = ["tcp/127.0.0.1:{zenoh}"]
"""
PASSWORD = "swordfish"
HOST = "127.0.0.1"
SECONDS = 20.0
ABORT_CODE = 18


@dataclass(frozen=True)
class Shop:
    """A running bridge."""

    folder: Path
    modbus: int
    opcua: int
    zenoh: int

    def map(self, name: str, table: str) -> int:
        """The address of a value of fu1, as ``export modbus`` says it."""
        rows = [row for row in self._export if row["unit_id"] == 1]
        (address,) = [row["address"] for row in rows if (row["name"], row["table"]) == (name, table)]
        return address

    @cached_property
    def _export(self) -> Any:
        done = drivebridge_called("export", "modbus", str(self.folder / "site.toml"), "--json")
        return json.loads(done.stdout)

    def ask(self, *questions: str) -> list[Any]:
        done = peer_called("zenoh_ask", f"tcp/{HOST}:{self.zenoh}", *questions)
        assert done.returncode == 0, done.stderr
        return [json.loads(line) for line in done.stdout.splitlines()]

    @asynccontextmanager
    async def engineer(self) -> AsyncIterator[tuple[Client, int]]:
        client = Client(f"opc.tcp://{HOST}:{self.opcua}", timeout=10)
        client.set_user("eve")
        client.set_password(PASSWORD)
        async with client:
            yield client, await client.get_namespace_index("urn:drivebridge:points")


@pytest.fixture(scope="module")
def shop(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Shop]:
    folder = tmp_path_factory.mktemp("shop")
    shop = Shop(folder, free_port(), free_port(), free_port())
    content = SITE.format(
        folder=folder,
        modbus=shop.modbus,
        opcua=shop.opcua,
        zenoh=shop.zenoh,
        password_hash=cheap_hash(PASSWORD),
    )
    (folder / "site.toml").write_text(content, "utf-8")
    with drivebridge(folder, "shop", "run", str(folder / "site.toml"), notify=True) as process:
        process.wait_ready()
        until(lambda: "OPC UA on" in process.output(), 60.0, "the OPC UA front is up")
        until(lambda: is_read(shop), SECONDS, "the parameters are read")
        yield shop


def is_read(shop: Shop) -> bool:
    ((answer,),) = shop.ask("drives/shop/conveyor/fu1/parameter/p560?cached=")
    return answer.get("q") == "good"


@pytest.fixture
def plc(shop: Shop) -> Iterator[ModbusTcpClient]:
    client = ModbusTcpClient(HOST, port=shop.modbus, timeout=5)
    assert client.connect()
    try:
        yield client
    finally:
        client.close()


def as_float(words: Sequence[int]) -> float:
    return ModbusTcpClient.convert_from_registers(list(words), ModbusTcpClient.DATATYPE.FLOAT32)  # pyright: ignore[reportReturnType]


def as_words(value: float) -> list[int]:
    return ModbusTcpClient.convert_to_registers(value, ModbusTcpClient.DATATYPE.FLOAT32)


# Modbus


@pytest.mark.landing
def test_modbus_reads_what_was_read_and_writes_the_drive(shop: Shop, plc: ModbusTcpClient) -> None:
    shown = shop.map("parameter/p103", "input register")
    place = shop.map("parameter/p103", "holding register")
    assert place >= 1000
    assert as_float(plc.read_input_registers(shown, count=2, device_id=1).registers) == 2.0
    assert not plc.write_registers(place, as_words(1.03), device_id=1).isError()
    for read, address in ((plc.read_input_registers, shown), (plc.read_holding_registers, place)):
        assert as_float(read(address, count=2, device_id=1).registers) == pytest.approx(1.03)


def test_modbus_says_what_the_drive_and_the_bridge_refuse(shop: Shop, plc: ModbusTcpClient) -> None:
    place = shop.map("parameter/p103", "holding register")
    assert plc.write_registers(place, as_words(321.0), device_id=1).exception_code == 3
    # half a value, more than one, and beyond the last
    assert plc.write_registers(place + 1, as_words(1.0), device_id=1).exception_code == 2
    assert plc.write_registers(place, as_words(1.0) * 2, device_id=1).exception_code == 2
    assert plc.write_register(place, 1, device_id=1).exception_code == 2
    assert plc.read_holding_registers(990, count=20, device_id=1).exception_code == 2
    memory = shop.map("parameter/p560", "holding register")
    assert plc.read_holding_registers(memory, count=2, device_id=1).registers == [0, 1]
    assert plc.write_registers(memory, [0, 11], device_id=1).exception_code == 3
    # the source of the control word: nobody but an engineer
    source = shop.map("parameter/p509", "holding register")
    assert plc.read_holding_registers(source, count=2, device_id=1).registers == [0, 3]
    assert plc.write_registers(source, [0, 0], device_id=1).exception_code == 1


def test_modbus_brings_the_drives_abort_code(shop: Shop, plc: ModbusTcpClient) -> None:
    ((answer,),) = shop.ask("drives/shop/conveyor/fu1/parameter/P999")
    assert (answer["code"], answer["abort_code"]) == ("refused_by_drive", "06020000")
    high, low = plc.read_input_registers(ABORT_CODE, count=2, device_id=1).registers
    assert high << 16 | low == 0x0602_0000


def test_mbpoll_writes_a_parameter(shop: Shop) -> None:
    program = shutil.which("mbpoll", path="/usr/bin:/usr/local/bin")
    if program is None:
        pytest.fail("mbpoll is missing: apt-get install mbpoll", pytrace=False)
    place = str(shop.map("parameter/p113", "holding register"))
    usual = [program, "-m", "tcp", "-p", str(shop.modbus), "-0", "-1", "-B", "-t", "4:float", "-r", place]
    done = subprocess.run([*usual, HOST, "12.5"], capture_output=True, text=True, check=False, timeout=10)
    assert done.returncode == 0, done.stdout + done.stderr
    done = subprocess.run([*usual, HOST], capture_output=True, text=True, check=False, timeout=10)
    assert re.search(rf"\[{place}\]:\s+12\.5", done.stdout), done.stdout


# OPC UA


async def test_opcua_shows_parameters_with_unit_range_and_age(shop: Shop) -> None:
    async with shop.engineer() as (client, ns):
        node = client.get_node(f"ns={ns};s=conveyor/fu2/parameter/p102")
        reading = await node.read_data_value()
        assert reading.Value is not None
        assert reading.Value.Value == 2.0
        assert reading.SourceTimestamp is not None
        units = await (await node.get_child("0:EngineeringUnits")).read_value()
        assert units.DisplayName.Text == "s"
        span = await (await node.get_child("0:EURange")).read_value()
        assert (span.Low, span.High) == (0.0, 320.0)


async def test_opcua_writes_the_drive_and_answers_with_its_outcome(shop: Shop) -> None:
    async with shop.engineer() as (client, ns):
        node = client.get_node(f"ns={ns};s=conveyor/fu2/parameter/p102")
        await node.write_value(1.5)
        ((answer,),) = shop.ask("drives/shop/conveyor/fu2/parameter/P102")
        assert answer["v"] == 1.5
        end = time.monotonic() + 2.0
        while await node.read_value() != 1.5:
            assert time.monotonic() < end
        with pytest.raises(ua.uaerrors.BadOutOfRange):
            await node.write_value(321.0)
        with pytest.raises(ua.uaerrors.BadNotWritable):
            await client.get_node(f"ns={ns};s=conveyor/fu2/parameter/p700_1").write_value(1.0)


async def test_opcua_reads_through_where_no_older_value_will_do(shop: Shop) -> None:
    async with shop.engineer() as (client, ns):
        wanted = ua.ReadValueId(ua.NodeId("conveyor/fu2/parameter/p102", ns), ua.AttributeIds.Value)

        async def read_at(age_ms: float) -> datetime:
            (found,) = (await ask(client, "Read", NodesToRead=[wanted], MaxAge=age_ms)).Results
            assert found.StatusCode.is_good()
            return found.SourceTimestamp

        before = await read_at(60_000.0)
        assert await read_at(60_000.0) == before, "the value read last"
        through = await read_at(0.0)
        assert through > before
        assert await read_at(60_000.0) >= through


async def test_opcua_says_in_the_diagnostics_why_the_drive_refused(shop: Shop) -> None:
    async with shop.engineer() as (client, ns):
        number = ua.Variant(1.0, ua.VariantType.Double)
        name = ua.Variant("P999")
        methods = {"ReadParameter": [name], "WriteParameter": [name, number]}
        calls = [
            ua.CallMethodRequest(
                ua.NodeId("conveyor/fu2", ns), ua.NodeId(f"conveyor/fu2/{method}", ns), arguments
            )
            for method, arguments in methods.items()
        ]
        answer = await explained(client, "Call", MethodsToCall=calls)
        table = answer.ResponseHeader.StringTable
        for result, info in zip(answer.Results, answer.DiagnosticInfos, strict=True):
            assert result.StatusCode.is_bad()
            assert info.AdditionalInfo.startswith("SDO abort 06020000h: ")
            assert table[info.NamespaceURI] == "urn:drivebridge:codes"
            assert "." in table[info.SymbolicId]
            assert "P999" in table[info.LocalizedText]
        write = ua.WriteValue(ua.NodeId("conveyor/fu2/parameter/p102", ns), ua.AttributeIds.Value)
        write.Value = ua.DataValue(ua.Variant(321.0, ua.VariantType.Double))
        answer = await explained(client, "Write", NodesToWrite=[write])
        (info,) = answer.DiagnosticInfos
        assert "321" in answer.ResponseHeader.StringTable[info.LocalizedText]


async def test_opcua_methods_say_what_came_of_them(shop: Shop) -> None:
    async with shop.engineer() as (client, ns):
        drive = client.get_node(f"ns={ns};s=conveyor/fu2")
        said = await drive.call_method(f"{ns}:WriteParameter", "P560", "EEPROM")
        assert said == ua.LocalizedText("the drive holds this value already: not written again", "en")


async def test_opcua_methods_take_any_name(shop: Shop) -> None:
    async with shop.engineer() as (client, ns):
        drive = client.get_node(f"ns={ns};s=conveyor/fu2")
        assert await drive.call_method(f"{ns}:ReadParameter", "P105.2") == 50.0
        assert await drive.call_method(f"{ns}:ReadParameter", "22BC:01") == 0.0
        await drive.call_method(f"{ns}:WriteParameter", "P426.3", 0.5)
        assert await drive.call_method(f"{ns}:ReadParameter", "P426.3") == 0.5
        await drive.call_method(f"{ns}:WriteParameter", "P560", "EEPROM")
        for method, arguments, argument in (
            ("ReadParameter", ("P1002",), 0),
            ("WriteParameter", ("P1002", 1), 0),
            ("WriteParameter", ("P426", 1e9), 1),
            ("ReadParameter", (7,), 0),
        ):
            request = make(
                ua.CallMethodRequest,
                ObjectId=drive.nodeid,
                MethodId=node_id(f"conveyor/fu2/{method}", ns),
                InputArguments=[variant(one) for one in arguments],
            )
            (result,) = await client.uaclient.call([request])
            assert get(result, "StatusCode").value == StatusCodes.BadInvalidArgument, (method, arguments)
            assert get(result, "InputArgumentResults")[argument].is_bad()
        with pytest.raises(ua.uaerrors.BadNotFound):
            await drive.call_method(f"{ns}:ReadParameter", "P999")


async def test_opcua_an_operator_reads_and_does_not_write(shop: Shop) -> None:
    async with Client(f"opc.tcp://{HOST}:{shop.opcua}", timeout=10) as client:
        ns = await client.get_namespace_index("urn:drivebridge:points")
        drive = client.get_node(f"ns={ns};s=conveyor/fu1")
        assert await drive.call_method(f"{ns}:ReadParameter", "P426") == 0.1
        with pytest.raises(ua.uaerrors.BadUserAccessDenied):
            await drive.call_method(f"{ns}:WriteParameter", "P426", 1.0)
        with pytest.raises(ua.uaerrors.BadUserAccessDenied):
            await drive.call_method(f"{ns}:SaveParameters")
        node = client.get_node(f"ns={ns};s=conveyor/fu1/parameter/p102")
        assert ua.AccessLevel.CurrentWrite not in await node.get_user_access_level()
        with pytest.raises(ua.uaerrors.BadUserAccessDenied):
            await node.write_value(1.0)


# zenoh


def test_zenoh_reads_writes_and_tells_what_is_wrong(shop: Shop) -> None:
    top = "drives/shop/conveyor/fu2/parameter"
    answers = shop.ask(
        f"{top}/P543[2]",
        f"{top}/P543%5B2%5D.3",
        f"{top}/2066:02",
        f"{top}/P102=1.03",
        f"{top}/p102?cached=",
        f'{top}/P560={{"v": "EEPROM"}}',
        f"{top}/P1002",
        f"{top}/P102=fast",
        f"{top}/P700[1]=1",
        "drives/shop/conveyor/fu2/command/save_parameters={}",
    )
    array, coded, by_object, written, cached, state, unknown, no_value, read_only, saved = [
        a for (a,) in answers
    ]
    assert (array["v"], coded["v"], by_object["v"]) == (3, 3, 2.0)
    assert array["q"] == "good"
    assert abs(array["t"] - time.time()) < SECONDS
    assert (written["ok"], written["v"]) == (True, 1.03)
    assert (cached["v"], cached["q"]) == (1.03, "good")
    assert (state["ok"], state["v"]) == (True, 1)
    assert unknown["code"] == "unknown_parameter"
    assert "did you mean P102" in unknown["message"]
    assert no_value["code"] == "out_of_range"
    assert read_only["code"] == "read_only"
    assert saved["ok"]


def test_zenoh_a_wildcard_gives_what_was_read(shop: Shop) -> None:
    (answers,) = shop.ask("drives/shop/conveyor/fu2/parameter/*")
    found = {answer["key"].rpartition("/")[2]: answer["v"] for answer in answers}
    assert {"p102", "p105", "p560", "p700_1"} <= found.keys()
    assert found["p560"] == 1


# kept


def test_writes_are_counted_in_the_sites_state_folder(shop: Shop) -> None:
    shop.ask("drives/shop/conveyor/fu2/parameter/P104=3.5")
    file = shop.folder / "state" / "eeprom.json"

    def counted() -> int:
        if not file.exists():
            return 0
        drives = json.loads(file.read_text("utf-8"))["writes"]
        return drives.get("conveyor/fu2", {}).get("2068:01", {}).get("writes", 0)

    until(lambda: counted() == 1, SECONDS, "the write is kept")
