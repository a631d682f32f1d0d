"""The Modbus server on a real socket, with clients that we did not write."""

from __future__ import annotations

import asyncio
import json
import logging
import re
import shutil
import struct
import time
from collections import Counter
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from pymodbus.client import AsyncModbusTcpClient

from bridge.base.errors import Unavailable
from bridge.command import Code, Identification, Outcome, Plant, PlantView, Reply, Request
from bridge.command.drive_link import FurtherTpdo, NodeState
from bridge.config import ModbusTable
from bridge.config.model import AuditTable
from bridge.northbound.modbus import connection
from bridge.northbound.modbus.registers import DriveMap
from bridge.northbound.modbus.server import ModbusServer
from bridge.northbound.modbus.units import units_of
from bridge.service.audit_log import AuditLog
from tests.support import sites
from tests.support.modbus_site import ENABLED, READY, SWITCH_ON_INHIBITED, float_words, make_plant
from tests.support.node_states import node_goes
from tests.support.views import view_of

HOST = "127.0.0.1"


def drive_says(plant: Plant, *words: int) -> None:
    now = time.monotonic()
    node_goes(plant, plant.nodes["conveyor"], NodeState.OPERATIONAL, now)
    plant.drives["conveyor/fu1"].on_process_data([*words, 0, 0, 0][:4], now)


def on_the_bus(plant: Plant) -> tuple[int, ...]:
    return plant.drives["conveyor/fu1"].channel.output.words


@asynccontextmanager
async def serving(plant: Plant, **settings: object) -> AsyncIterator[ModbusServer]:
    table = ModbusTable.model_validate({"listen": f"{HOST}:0", **settings})
    server = ModbusServer(view_of(plant), units_of(plant.catalogue), table, time.monotonic)
    await server.start()
    try:
        yield server
    finally:
        await server.close()


@pytest.fixture
def plant() -> Plant:
    plant = make_plant()
    drive_says(plant, SWITCH_ON_INHIBITED)
    return plant


@pytest.fixture
async def server(plant: Plant) -> AsyncIterator[ModbusServer]:
    async with serving(plant) as server:
        yield server


@asynccontextmanager
async def pymodbus(server: ModbusServer, address: str = HOST) -> AsyncIterator[AsyncModbusTcpClient]:
    client = AsyncModbusTcpClient(
        HOST, port=server.port, source_address=(address, 0), timeout=2, retries=0, reconnect_delay=0
    )
    assert await client.connect()
    try:
        yield client
    finally:
        client.close()


async def mbpoll(server: ModbusServer, *arguments: str) -> tuple[int, str]:
    """Exit status and output of one ``mbpoll`` run with 0-based addresses."""
    program = shutil.which("mbpoll", path="/usr/bin:/usr/local/bin")
    if program is None:
        pytest.fail("mbpoll is missing: apt-get install mbpoll", pytrace=False)
    before, values = arguments, ()
    if "--" in arguments:
        at = arguments.index("--")
        before, values = arguments[:at], arguments[at:]
    process = await asyncio.create_subprocess_exec(
        program,
        *("-m", "tcp", "-p", str(server.port), "-0", "-1", "-o", "2"),
        *before,
        HOST,
        *values,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.STDOUT,
    )
    output, _ = await asyncio.wait_for(process.communicate(), 10)
    return process.returncode or 0, output.decode()


def polled(output: str) -> dict[int, str]:
    """The values that mbpoll printed, by address."""
    return {int(a): v for a, v in re.findall(r"^\[(\d+)\]:\s+(\S+)", output, re.MULTILINE)}


def adu(transaction: int, unit: int, pdu: bytes) -> bytes:
    return struct.pack(">HHHB", transaction, 0, len(pdu) + 1, unit) + pdu


async def one_answer(reader: asyncio.StreamReader) -> tuple[int, int, bytes]:
    head = await asyncio.wait_for(reader.readexactly(7), 5)
    transaction, protocol, length, unit = struct.unpack(">HHHB", head)
    assert protocol == 0
    return transaction, unit, await asyncio.wait_for(reader.readexactly(length - 1), 5)


# mbpoll


async def test_the_example_of_bu_2500_6_8_with_mbpoll(plant: Plant, server: ModbusServer):
    """047E → ready, 047F/2000h → 25 Hz at P105 = 50 Hz, 047E → stop."""
    status, output = await mbpoll(server, "-a", "1", "-r", "0", "-t", "4", "--", str(0x047E), "0")
    assert status == 0, output
    assert on_the_bus(plant) == (0x047E, 0, 0, 0, 0)
    drive_says(plant, READY)
    status, output = await mbpoll(server, "-a", "1", "-r", "0", "-t", "4", "--", str(0x047F), str(0x2000))
    assert status == 0, output
    assert on_the_bus(plant) == (0x047F, 0x2000, 0, 0, 0)
    drive_says(plant, ENABLED, 0x2000)
    _, output = await mbpoll(server, "-a", "1", "-r", "0", "-c", "2", "-t", "3:hex")
    assert polled(output) == {0: "0x0237", 1: "0x2000"}
    _, output = await mbpoll(server, "-a", "1", "-r", "32", "-c", "1", "-t", "3:float", "-B")
    assert polled(output) == {32: "25"}
    status, output = await mbpoll(server, "-a", "1", "-r", "0", "-t", "4", "--", str(0x047E))
    assert status == 0, output
    assert on_the_bus(plant)[0] == 0x047E


async def test_mbpoll_sees_bits_and_exceptions(plant: Plant, server: ModbusServer):
    _, output = await mbpoll(server, "-a", "1", "-r", "0", "-c", "16", "-t", "1")
    bits = [int(value) for _, value in sorted(polled(output).items())]
    assert sum(bit << position for position, bit in enumerate(bits)) == SWITCH_ON_INHIBITED
    _, output = await mbpoll(server, "-a", "77", "-r", "0", "-t", "3")
    assert "gateway path unavailable" in output.lower()
    _, output = await mbpoll(server, "-a", "1", "-r", "40", "-t", "4")
    assert "illegal data address" in output.lower()
    _, output = await mbpoll(server, "-a", "2", "-r", "0", "-t", "4", "--", "1150")
    assert "illegal function" in output.lower()
    _, output = await mbpoll(server, "-a", "9", "-r", "0", "-c", "1", "-t", "3")
    assert "target device failed to respond" in output.lower()


# pymodbus


async def test_every_function_with_pymodbus(plant: Plant, server: ModbusServer):
    async with pymodbus(server) as client:
        answer = await client.write_registers(0, [0x047E, 0x2000, 1, 2], device_id=1)
        assert not answer.isError()
        answer = await client.read_holding_registers(0, count=13, device_id=1)
        assert answer.registers == [0x047E, 0x2000, 1, 2, *[0] * 6, 1, 0, 200]
        answer = await client.read_input_registers(0, count=2, device_id=1)
        assert answer.registers == [SWITCH_ON_INHIBITED, 0]
        answer = await client.read_discrete_inputs(0, count=24, device_id=1)
        assert answer.bits == [bool(SWITCH_ON_INHIBITED >> i & 1) for i in range(16)] + [
            i == 1 for i in range(8)
        ]
        assert not (await client.write_register(1, 5, device_id=1)).isError()
        assert not (await client.write_coil(11, True, device_id=1)).isError()
        answer = await client.read_coils(8, count=8, device_id=1)
        assert answer.bits[:8] == [False, False, True, True, False, False, False, False]
        assert not (await client.write_coils(11, [False, True], device_id=1)).isError()
        answer = await client.mask_write_register(address=0, and_mask=0xFFFE, or_mask=0, device_id=1)
        assert not answer.isError()
        answer = await client.readwrite_registers(
            read_address=0, read_count=2, write_address=1, values=[7], device_id=1
        )
        assert answer.registers == [0x147E, 7]
        answer = await client.read_input_registers(0, count=8, device_id=255)
        assert answer.registers[3:5] == [3, 1]
        answer = await client.diag_query_data(b"\x12\x34", device_id=1)
        assert not answer.isError()


async def test_identification_with_pymodbus(plant: Plant, server: ModbusServer):
    plant.drives["conveyor/fu1"].on_identification(Identification(1, 2, 0x0003_0004, 5, "TU4"), 0.0)
    async with pymodbus(server) as client:
        answer = await client.read_device_information(read_code=3, device_id=1)
        assert answer.information[0] == b"Getriebebau NORD"
        assert answer.information[2] == b"3.4"
        assert answer.information[6] == b"conveyor/fu1"
        assert answer.information[0x83] == b"00000005"
        answer = await client.read_device_information(read_code=4, object_id=6, device_id=9)
        assert answer.information == {6: b"conveyor/fu3"}


async def test_exceptions_with_pymodbus(server: ModbusServer):
    async with pymodbus(server) as client:
        for unit, address, values, code in (
            (33, 0, [0x047E], 0x0A),
            (2, 0, [0x047E], 0x01),
            (1, 40, [0], 0x02),
            (1, 32, [0], 0x02),
            (1, 0, [0x007E], 0x03),
            (1, 32, list(float_words(500.0)), 0x03),
            (9, 32, list(float_words(1.0)), 0x0A),
        ):
            answer = await client.write_registers(address, values, device_id=unit)
            assert (answer.function_code, answer.exception_code) == (0x90, code)
        answer = await client.read_input_registers(0, count=1, device_id=9)
        assert answer.exception_code == 0x0B


async def test_a_second_controller_is_refused(plant: Plant, server: ModbusServer):
    async with pymodbus(server) as owner, pymodbus(server, "127.0.0.2") as other:
        assert not (await owner.write_registers(0, [0x047E, 0], device_id=1)).isError()
        answer = await other.write_registers(0, [0x047F, 0x2000], device_id=1)
        assert (answer.function_code, answer.exception_code) == (0x90, 0x01)
        assert on_the_bus(plant)[0] == 0x047E
        assert (await other.read_input_registers(20, count=1, device_id=1)).registers == [2]
        assert (await other.read_holding_registers(10, count=1, device_id=1)).registers == [0]
        assert not (await owner.write_register(10, 0, device_id=1)).isError()
        assert not (await other.write_registers(0, [0x047E, 0], device_id=1)).isError()


async def test_anybody_stops_a_drive_by_register_13(plant: Plant, server: ModbusServer):
    async with pymodbus(server) as owner, pymodbus(server, "127.0.0.2") as other:
        for code, word in ((1, 0x047E), (2, 0x047B), (3, 0x0474)):
            drive_says(plant, READY)
            assert not (await owner.write_registers(0, [0x047E, 0], device_id=1)).isError()
            assert not (await owner.write_registers(0, [0x047F, 0x2000], device_id=1)).isError()
            assert on_the_bus(plant)[:2] == (0x047F, 0x2000)
            assert not (await other.write_register(13, code, device_id=1)).isError()
            assert on_the_bus(plant)[:2] == (word, 0)
        assert (await other.read_holding_registers(13, count=1, device_id=1)).registers == [0]
        assert not (await other.write_registers(13, [2], device_id=1)).isError()
        answer = await other.readwrite_registers(
            read_address=13, read_count=1, write_address=13, values=[1], device_id=1
        )
        assert answer.registers == [0]
        for value in (0, 4, 0xFFFF):
            assert (await other.write_register(13, value, device_id=1)).exception_code == 3
        assert (await other.write_register(13, 1, device_id=2)).isError() is False, "OPC UA's drive, too"
        await owner.write_register(10, 1, device_id=9)
        assert (await other.write_register(13, 1, device_id=9)).exception_code == 1, "stop_by_anyone = false"


async def test_an_owner_that_is_gone_and_not_watched_holds_nobody_up():
    """Its drive moves on until somebody stops it: the site file has switched the watchdog off."""
    plant = sites.plant_of(sites.site(sites.bus(sites.node(sites.drive("fu1", "modbus", 0, "unit_id = 1")))))
    drive_says(plant, READY)
    later = 0.0

    def clock() -> float:
        return time.monotonic() + later

    table = ModbusTable.model_validate({"listen": f"{HOST}:0"})
    server = ModbusServer(view_of(plant, clock), units_of(plant.catalogue), table, clock)
    await server.start()
    try:
        async with pymodbus(server, "127.0.0.2") as other:
            async with pymodbus(server) as owner:
                await owner.write_registers(0, [0x047E, 0], device_id=1)
                await owner.write_registers(0, [0x047F, 0x2000], device_id=1)
                later = 3600.0
                assert (await other.write_register(0, 0x047E, device_id=1)).exception_code == 1
            for _ in range(500):
                if len(server._sessions) == 1:
                    break
                await asyncio.sleep(0.01)
            assert (await other.write_register(0, 0x047E, device_id=1)).exception_code == 1
            later += 10.0
            assert not (await other.write_register(13, 1, device_id=1)).isError()
            assert on_the_bus(plant)[:2] == (0x047E, 0)
            assert not (await other.write_registers(0, [0x047F, 0x2000], device_id=1)).isError()
            assert on_the_bus(plant)[:2] == (0x047E, 0), "it is enabled anew, not taken over moving"
            assert str(plant.drives["conveyor/fu1"].channel.owner) == "modbus:127.0.0.2"
    finally:
        await server.close()


# raw sockets


async def test_sixteen_requests_in_one_segment_are_answered_in_order(server: ModbusServer):
    reader, writer = await asyncio.open_connection(HOST, server.port)
    units = [1, 2, 33, 255] * 4
    writer.write(b"".join(adu(i, unit, bytes.fromhex("04 0000 0002")) for i, unit in enumerate(units)))
    answers = [await one_answer(reader) for _ in units]
    assert [(t, u) for t, u, _ in answers] == list(enumerate(units))
    assert [pdu[0] for _, _, pdu in answers] == [4, 0x84, 0x84, 4] * 4
    writer.close()


async def test_an_outcome_that_comes_later_keeps_its_place(
    server: ModbusServer, monkeypatch: pytest.MonkeyPatch
):
    def submit_later(self: PlantView, request: Request, reply: Reply) -> None:
        asyncio.get_running_loop().call_later(0.01, reply, Outcome(Code.TIMED_OUT))

    monkeypatch.setattr(PlantView, "submit", submit_later)
    reader, writer = await asyncio.open_connection(HOST, server.port)
    pair = (bytes.fromhex("06 0000 047E"), bytes.fromhex("03 0000 0001"))
    writer.write(b"".join(adu(i, 1, pair[i % 2]) for i in range(200)))
    answers = [await one_answer(reader) for _ in range(200)]
    assert [(t, pdu[0]) for t, _, pdu in answers] == [(i, (0x86, 0x03)[i % 2]) for i in range(200)]
    writer.close()


async def test_a_frame_in_single_bytes(server: ModbusServer):
    reader, writer = await asyncio.open_connection(HOST, server.port)
    for byte in adu(7, 1, bytes.fromhex("03 0000 0001")):
        writer.write(bytes((byte,)))
        await writer.drain()
        await asyncio.sleep(0)
    assert await one_answer(reader) == (7, 1, bytes.fromhex("03 02 0400"))
    writer.close()


async def test_a_wrong_protocol_id_ends_the_connection(plant: Plant, server: ModbusServer):
    reader, writer = await asyncio.open_connection(HOST, server.port)
    writer.write(adu(1, 1, bytes.fromhex("03 0000 0001")) + bytes.fromhex("0002 0001 0002 01 03"))
    assert (await one_answer(reader))[0] == 1
    assert await asyncio.wait_for(reader.read(), 5) == b""
    assert plant.image.read("bridge/modbus_broken_connections").value == 1
    assert len(server._sessions) == 0
    writer.close()


async def test_strangers_are_turned_away(plant: Plant, caplog: pytest.LogCaptureFixture):
    async with serving(plant, allow=["127.0.0.1/32"]) as server:
        for _ in range(3):
            reader, writer = await asyncio.open_connection(HOST, server.port, local_addr=("127.0.0.2", 0))
            assert await closed_by_the_other_side(reader)
            writer.close()
        async with pymodbus(server) as client:
            assert (await client.read_holding_registers(0, count=1, device_id=1)).registers == [0x0400]
        assert plant.image.read("bridge/modbus_refused_connections").value == 3
        assert {source_of(record) for record in caplog.records if "refused" in record.message} == {
            "127.0.0.2"
        }


async def test_idle_connections_make_room_and_the_owner_goes_last(
    plant: Plant, caplog: pytest.LogCaptureFixture
):
    async with serving(plant, max_connections=3) as server, pymodbus(server) as plc:
        assert not (await plc.write_registers(0, [0x047E, 0], device_id=1)).isError()
        async with pymodbus(server, "127.0.0.2") as reader:
            idle = [await asyncio.open_connection(HOST, server.port, local_addr=("127.0.0.3", 0))]
            for _ in range(5):
                assert not (await reader.read_holding_registers(0, count=1, device_id=1)).isError()
                idle.append(await asyncio.open_connection(HOST, server.port, local_addr=("127.0.0.3", 0)))
                assert await closed_by_the_other_side(idle[-2][0]), "who does nothing makes room"
                assert len(server._sessions) == 3
            assert not (await reader.read_holding_registers(0, count=1, device_id=1)).isError()
        for _ in range(5):
            idle += [await asyncio.open_connection(HOST, server.port, local_addr=("127.0.0.3", 0))]
        assert not (await plc.write_registers(0, [0x047F, 0], device_id=1)).isError(), "the owner stays"
        said = [source_of(record) for record in caplog.records if "made room" in record.message]
        assert set(said) == {"127.0.0.3"}, "of one kind and source: the log has one line and a count"
        for _, writer in idle:
            writer.close()


async def test_where_all_are_of_an_owners_address_the_idlest_makes_room(plant: Plant):
    async with serving(plant, max_connections=2) as server, pymodbus(server) as old, pymodbus(server) as new:
        assert not (await old.write_registers(0, [0x047E, 0], device_id=1)).isError()
        assert not (await new.read_holding_registers(0, count=1, device_id=1)).isError()
        async with pymodbus(server) as third:
            assert not (await third.write_registers(0, [0x047E, 0], device_id=1)).isError()
            assert not (await new.read_holding_registers(0, count=1, device_id=1)).isError()
            assert len(server._sessions) == 2


def source_of(record: logging.LogRecord) -> object:
    """Whom the log counts a line for."""
    return vars(record)["line_source"]


async def closed_by_the_other_side(reader: asyncio.StreamReader) -> bool:
    try:
        return await asyncio.wait_for(reader.read(), 5) == b""
    except ConnectionResetError:
        return True


async def test_a_client_that_reads_nothing_is_dropped_and_harms_no_other(
    plant: Plant, server: ModbusServer, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr(connection, "STALL_LIMIT_S", 0.3)
    _, writer = await asyncio.open_connection(HOST, server.port)
    request = adu(1, 1, bytes.fromhex("03 0000 0020")) * 1000
    flood = asyncio.create_task(pour(writer, request))
    async with pymodbus(server) as client:
        slowest = 0.0
        while len(server._sessions) == 2:
            begin = time.monotonic()
            assert not (await client.read_holding_registers(0, count=1, device_id=1)).isError()
            slowest = max(slowest, time.monotonic() - begin)
        assert slowest < 0.5
    await flood
    assert plant.image.read("bridge/modbus_broken_connections").value == 1


async def pour(writer: asyncio.StreamWriter, data: bytes) -> None:
    try:
        while True:
            writer.write(data)
            await writer.drain()
    except ConnectionError:
        writer.close()


# starting


async def test_a_taken_port_is_said_in_one_sentence(plant: Plant, server: ModbusServer):
    with pytest.raises(Unavailable, match=rf"modbus.listen = '127.0.0.1:{server.port}': port .* is taken"):
        async with serving(plant, listen=f"{HOST}:{server.port}"):
            pass
    with pytest.raises(Unavailable, match=r"no interface of this machine has the address 192\.0\.2\.1"):
        async with serving(plant, listen="192.0.2.1:0"):
            pass


async def test_a_port_without_privilege_is_said_in_one_sentence(
    plant: Plant, monkeypatch: pytest.MonkeyPatch
):
    def denied(*arguments: object, **more: object) -> None:
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("socket.create_server", denied)
    with pytest.raises(Unavailable, match="port 502 needs CAP_NET_BIND_SERVICE: "):
        async with serving(plant, listen="127.0.0.1:502"):
            pass


@pytest.mark.skipif(not Path("/proc/net/if_inet6").exists(), reason="this machine has no IPv6")
async def test_an_ipv4_client_of_an_ipv6_socket_is_an_ipv4_client(plant: Plant):
    async with serving(plant, listen="[::]:0", allow=["127.0.0.0/8"]) as server, pymodbus(server) as client:
        assert not (await client.write_register(0, 0x047E, device_id=1)).isError()
        assert str(plant.drives["conveyor/fu1"].channel.owner) == "modbus:127.0.0.1"


async def test_close_ends_every_session(plant: Plant):
    async with serving(plant) as server:
        reader, writer = await asyncio.open_connection(HOST, server.port)
        writer.write(adu(1, 1, bytes.fromhex("03 0000 0001")))
        await one_answer(reader)
        assert len(server._sessions) == 1
        await server.close()
        assert await closed_by_the_other_side(reader)
        writer.close()
    assert len(server._sessions) == 0


# words that are not good


class Lacking:
    """fu1 with its third word in a TPDO of its own, which never came; a server beside it."""

    def __init__(self, plant: Plant) -> None:
        self.plant = plant
        self.drive = plant.drives["conveyor/fu1"]
        self.further = FurtherTpdo("TPDO2", frozenset((3,)), 0.5)
        self.drive.on_pdos({}, [self.further], time.monotonic(), deadline_s=None, rpdo_type=255)
        drive_says(plant, ENABLED, 0x2000, 0x1000, 7)

    def comes(self) -> None:
        self.drive.on_further_data(self.further, time.monotonic())


async def test_mbpoll_sees_which_words_are_not_good(plant: Plant, server: ModbusServer):
    lacking = Lacking(plant)
    _, output = await mbpoll(server, "-a", "1", "-r", "21", "-c", "1", "-t", "3")
    assert polled(output) == {21: "4"}
    _, output = await mbpoll(server, "-a", "1", "-r", "3", "-c", "1", "-t", "3")
    assert "target device failed to respond" in output.lower()
    lacking.comes()
    _, output = await mbpoll(server, "-a", "1", "-r", "21", "-c", "1", "-t", "3")
    assert polled(output) == {21: "0"}
    await asyncio.sleep(0.5)
    _, output = await mbpoll(server, "-a", "1", "-r", "21", "-c", "1", "-t", "3")
    assert polled(output) == {21: "4"}


async def test_pymodbus_sees_which_words_and_values_are_not_good(plant: Plant, server: ModbusServer):
    Lacking(plant)
    async with pymodbus(server) as client:
        words, high, low = (await client.read_input_registers(21, count=3, device_id=1)).registers
    assert words == 4
    rows = [row.name for row in DriveMap(plant.catalogue.drives["conveyor/fu1"]).inputs]
    bad = {name for place, name in enumerate(rows[:32]) if (high << 16 | low) >> place & 1}
    assert "actual/frequency" not in bad
    assert "identity/serial" in bad, "not read yet"


# the audit log


async def test_who_writes_to_made_up_units_washes_nothing_out_of_the_audit_log(
    plant: Plant, server: ModbusServer, tmp_path: Path
):
    settings = {"file": str(tmp_path / "audit.jsonl"), "max_bytes": 20_000, "keep": 0}
    site = plant.site.model_copy(update={"audit": AuditTable.model_validate(settings)})
    audit = AuditLog(plant, site, time.monotonic, lambda at: round(at * 1e9))
    audit.start()
    async with pymodbus(server, "127.0.0.2") as plc, pymodbus(server, "127.0.0.3") as stranger:
        assert not (await plc.write_registers(0, [0x047E, 0], device_id=1)).isError()
        for number in range(3000):
            assert (await stranger.write_register(number, 1, device_id=10 + number % 230)).isError()
        async with pymodbus(server, "127.0.0.4") as other:
            assert (await other.write_register(0, 1, device_id=99)).isError()
        assert not (await plc.write_registers(0, [0x047F, 0], device_id=1)).isError()
    audit.close()

    def said(name: str) -> list[dict[str, Any]]:
        return [json.loads(line) for line in (tmp_path / name).read_text("utf-8").splitlines()]

    done = [line["new"]["control_word"] for line in said("audit.jsonl") if line["action"] == "write"]
    assert done == [0x047E, 0x047F]
    refused = said("audit-refused.jsonl")
    assert len(refused) < 60
    counts = Counter[str]()
    for line in refused:
        counts[line["user"]] += line.get("count", 1)
    assert counts == {"127.0.0.3": 3000, "127.0.0.4": 1}


async def test_a_crowd_from_one_address_pushes_out_itself_alone(plant: Plant):
    """Also one that owns a drive."""
    async with serving(plant, max_connections=6) as server, pymodbus(server, "127.0.0.2") as hmi:
        assert not (await hmi.read_holding_registers(0, count=1, device_id=1)).isError()
        async with pymodbus(server, "127.0.0.3") as intruder:
            assert not (await intruder.write_registers(0, [0x047E, 0], device_id=1)).isError()
            crowd = [
                await asyncio.open_connection(HOST, server.port, local_addr=("127.0.0.3", 0))
                for _ in range(20)
            ]
            assert not (await hmi.read_holding_registers(0, count=1, device_id=1)).isError()
            async with pymodbus(server, "127.0.0.4") as other:
                assert not (await other.read_holding_registers(0, count=1, device_id=1)).isError()
            for _, writer in crowd:
                writer.close()


async def test_a_crowd_that_says_nothing_leaves_those_alone_who_poll(plant: Plant):
    """Each connection from another address: no address has more than its share."""
    async with serving(plant, max_connections=6) as server, pymodbus(server, "127.0.0.2") as hmi:
        assert not (await hmi.read_holding_registers(0, count=1, device_id=1)).isError()
        crowd = [
            await asyncio.open_connection(HOST, server.port, local_addr=(f"127.0.1.{number}", 0))
            for number in range(1, 21)
        ]
        assert not (await hmi.read_holding_registers(0, count=1, device_id=1)).isError()
        for _, writer in crowd:
            writer.close()
