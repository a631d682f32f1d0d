"""What a client of the OPC UA server sees and writes: names, values, qualities."""

from __future__ import annotations

import asyncio
import math
import socket
import time
from datetime import UTC, datetime, timedelta
from pathlib import Path

import pytest
from asyncua import Client, ua

from bridge.base.errors import Unavailable
from bridge.command import Write
from bridge.image import Quality
from bridge.northbound.opcua.server import OpcUaServer
from bridge.text import render
from tests.support.opcua_client import call, node, word, write, write_all, write_value
from tests.support.opcua_raw import ask
from tests.support.opcua_site import OPEN, LocalView, make_plant, namespace

pytestmark = pytest.mark.asyncio(loop_scope="module")
Codes = ua.StatusCodes
_LEASE = ua.Variant(5000, ua.VariantType.UInt32)


class TestNames:
    async def test_the_application_and_its_namespace_are_the_contracts(self, client: Client) -> None:
        uris = await client.get_namespace_array()
        assert uris[1] == f"urn:{socket.gethostname()}:drivebridge"
        assert "urn:drivebridge:points" in uris

    @pytest.mark.parametrize(
        ("path", "name"),
        [
            ("Drives/conveyor/fu1/Actual/Frequency", "conveyor/fu1/actual/frequency"),
            ("Drives/conveyor/fu1/Command/ControlWord", "conveyor/fu1/command/control_word"),
            ("Drives/conveyor/fu1/Parameter", "conveyor/fu1/parameter"),
            (
                "Drives/conveyor/fu1/Supervision/WorstCaseStopMs",
                "conveyor/fu1/supervision/worst_case_stop_ms",
            ),
            ("Drives/conveyor/fu1/Status/StatusWord/Fault", "conveyor/fu1/status/status_word/fault"),
            ("Drives/conveyor/Node/NmtState", "conveyor/node/nmt_state"),
            ("Buses/can0/Load", "bus/can0/load"),
            ("Bridge/DrivesGood", "bridge/drives_good"),
        ],
    )
    async def test_a_point_is_found_by_path_and_by_name(self, client: Client, path: str, name: str) -> None:
        space = await namespace(client)
        found = await client.nodes.objects.get_child([f"{space}:{part}" for part in path.split("/")])
        assert found.nodeid == ua.NodeId(name, space)

    async def test_every_point_of_the_image_is_there_and_readable(
        self, client: Client, view: LocalView
    ) -> None:
        nodes = [await node(client, point.name) for point in view.image.points]
        values = await client.read_attributes(nodes)
        assert len(values) == len(view.image.points)
        # Nothing is behind this plant that a parameter could be read from.
        codes = {
            point.name: value.StatusCode.value for point, value in zip(view.image.points, values, strict=True)
        }
        assert {code for name, code in codes.items() if "/parameter/" in name} <= {
            Codes.BadNoCommunication,
            Codes.BadWaitingForInitialData,
        }
        assert {code for name, code in codes.items() if "/parameter/" not in name} <= {
            Codes.Good,
            Codes.BadWaitingForInitialData,
            Codes.BadConfigurationError,
            Codes.BadOutOfService,
        }

    async def test_a_number_with_a_unit_says_which_and_how_far(self, client: Client) -> None:
        frequency = await node(client, "conveyor/fu1/actual/frequency")
        assert await frequency.read_type_definition() == ua.NodeId(ua.ObjectIds.AnalogUnitType)
        unit = await (await frequency.get_child("0:EngineeringUnits")).read_value()
        assert (unit.UnitId, unit.DisplayName.Text) == (4740186, "Hz")
        limits = await (await frequency.get_child("0:EURange")).read_value()
        assert (limits.Low, limits.High) == pytest.approx((-100.0, 100.0), abs=0.01)

    async def test_a_state_has_its_texts_at_its_codes(self, client: Client) -> None:
        state = await node(client, "conveyor/fu1/status/state")
        assert await state.read_type_definition() == ua.NodeId(ua.ObjectIds.MultiStateDiscreteType)
        texts = await (await state.get_child("0:EnumStrings")).read_value()
        assert (texts[4].Text, texts[100].Text, texts[255].Text) == ("operation_enabled", None, "unknown")

    async def test_the_bits_of_a_word_are_two_state_and_follow_it(
        self, client: Client, view: LocalView
    ) -> None:
        bit = await node(client, "conveyor/fu2/status/status_word/switch_on_inhibited")
        assert await bit.read_type_definition() == ua.NodeId(ua.ObjectIds.TwoStateDiscreteType)
        assert await bit.read_value() is True
        assert (await (await bit.get_child("0:TrueState")).read_value()).Text == "true"


class TestQuality:
    @pytest.mark.parametrize(
        ("quality", "code", "value"),
        [
            (Quality.WAITING, Codes.BadWaitingForInitialData, None),
            (Quality.GOOD, Codes.Good, 7),
            (Quality.STALE, Codes.UncertainLastUsableValue, 7),
            (Quality.LOST, Codes.UncertainNoCommunicationLastUsableValue, 7),
            (Quality.DEAD, Codes.BadNoCommunication, None),
            (Quality.DEVICE_FAULT, Codes.BadDeviceFailure, None),
            (Quality.DISABLED, Codes.BadOutOfService, None),
            (Quality.CONFIG_ERROR, Codes.BadConfigurationError, None),
        ],
    )
    async def test_each_quality_has_its_status(
        self, client: Client, view: LocalView, quality: Quality, code: int, value: int | None
    ) -> None:
        view.plant.set("bus/can0/tx_errors", 7, time.monotonic(), quality)
        read = await (await node(client, "bus/can0/tx_errors")).read_data_value(raise_on_bad_status=False)
        assert (read.StatusCode.value, read.Value.Value) == (code, value)

    async def test_the_source_time_is_the_readings_and_the_servers_is_now(
        self, client: Client, view: LocalView
    ) -> None:
        view.plant.set("bus/can0/rx_errors", 1, time.monotonic() - 60)
        where = (await node(client, "bus/can0/rx_errors")).nodeid
        wanted = [ua.ReadValueId(NodeId=where, AttributeId=ua.AttributeIds.Value)]
        both = ua.TimestampsToReturn.Both
        (read,) = (await ask(client, "Read", NodesToRead=wanted, TimestampsToReturn=both)).Results
        now = datetime.now(UTC)
        assert abs(read.SourceTimestamp - (now - timedelta(seconds=60))) < timedelta(seconds=1)
        assert abs(read.ServerTimestamp - now) < timedelta(seconds=1)


class TestWrites:
    async def test_control_word_and_setpoint_in_one_call_are_one_telegram(
        self, client: Client, view: LocalView
    ) -> None:
        assert await write(client, control_word=word(0x047E), setpoint_1=word(0x2000)) == [0, 0]
        (request,) = view.requests
        assert request.target == "conveyor/fu1"
        assert request.command == Write({"control_word": 0x047E, "setpoint_1": 0x2000})
        assert str(request.identity) == "opcua:anonymous"

    async def test_bits_of_one_call_are_one_telegram_on_the_owners_word(
        self, client: Client, view: LocalView
    ) -> None:
        await write(client, control_word=word(0x0470))
        bits = [
            (await node(client, f"conveyor/fu1/command/control_word/{name}")).nodeid
            for name in ("ready_for_operation", "voltage_enabled", "quick_stop_lifted")
        ]
        assert await write_all(client, [write_value(one, ua.Variant(True)) for one in bits[1:]]) == [0, 0]
        assert view.requests[-1].command == Write({"control_word.1": True, "control_word.2": True})
        whole = await node(client, "conveyor/fu1/command/control_word")
        assert await whole.read_value() == 0x0476

    async def test_writes_to_two_drives_are_two_telegrams(self, client: Client, view: LocalView) -> None:
        wanted = [
            write_value((await node(client, f"conveyor/{drive}/command/control_word")).nodeid, word(0x047E))
            for drive in ("fu1", "fu2")
        ]
        assert await write_all(client, wanted) == [Codes.Good, Codes.BadUserAccessDenied]
        assert sorted(request.target for request in view.requests) == ["conveyor/fu1", "conveyor/fu2"]

    async def test_the_same_point_twice_keeps_its_edge(self, client: Client, view: LocalView) -> None:
        where = (await node(client, "conveyor/fu1/command/control_word")).nodeid
        wanted = [write_value(where, word(value)) for value in (0x04FE, 0x047E)]
        assert await write_all(client, wanted) == [0, 0]
        assert [request.command for request in view.requests] == [
            Write({"control_word": 0x04FE}),
            Write({"control_word": 0x047E}),
        ]

    async def test_the_manuals_example_moves_the_drive(self, client: Client) -> None:
        state = await node(client, "conveyor/fu1/status/state")
        frequency = await node(client, "conveyor/fu1/actual/frequency")
        await write(client, control_word=word(0x047E))
        await write(client, control_word=word(0x047F), setpoint_1=word(0x2000))
        await asyncio.sleep(0.05)
        assert (await state.read_value(), await frequency.read_value()) == (4, 25.0)
        await write(client, control_word=word(0x047E))
        await asyncio.sleep(0.05)
        assert (await state.read_value(), await frequency.read_value()) == (2, 0.0)

    @pytest.mark.parametrize(
        ("leaf", "value"),
        [
            ("control_word", ua.Variant(0x047E, ua.VariantType.Int64)),
            ("control_word", ua.Variant(0x047E, ua.VariantType.Int16)),
            ("setpoint_1", ua.Variant(5, ua.VariantType.Int16)),
            ("frequency", ua.Variant(-5, ua.VariantType.Int16)),
            ("frequency", ua.Variant(25, ua.VariantType.Byte)),
            ("frequency", ua.Variant(2.5, ua.VariantType.Float)),
        ],
    )
    async def test_any_integer_type_is_taken(
        self, client: Client, view: LocalView, leaf: str, value: ua.Variant
    ) -> None:
        assert await write(client, **{leaf: value}) == [Codes.Good]

    @pytest.mark.parametrize(
        ("leaf", "value", "code"),
        [
            ("control_word", ua.Variant(1.0, ua.VariantType.Double), Codes.BadTypeMismatch),
            ("control_word", ua.Variant(True, ua.VariantType.Boolean), Codes.BadTypeMismatch),
            ("control_word", ua.Variant("1146", ua.VariantType.String), Codes.BadTypeMismatch),
            ("control_word", ua.Variant([0x047E], ua.VariantType.UInt16), Codes.BadTypeMismatch),
            ("control_word", ua.Variant(None, ua.VariantType.Null), Codes.BadTypeMismatch),
            ("control_word", ua.Variant(70000, ua.VariantType.UInt32), Codes.BadOutOfRange),
            ("control_word", ua.Variant(0x007E, ua.VariantType.UInt16), Codes.BadOutOfRange),
            ("frequency", ua.Variant(math.nan, ua.VariantType.Double), Codes.BadOutOfRange),
            ("frequency", ua.Variant(math.inf, ua.VariantType.Double), Codes.BadOutOfRange),
            ("frequency", ua.Variant(100.5, ua.VariantType.Double), Codes.BadOutOfRange),
        ],
    )
    async def test_what_does_not_fit_changes_nothing(
        self, client: Client, view: LocalView, leaf: str, value: ua.Variant, code: int
    ) -> None:
        await write(client, control_word=word(0x047E), setpoint_1=word(0x1000))
        before = view.plant.drives["conveyor/fu1"].channel.output
        assert await write(client, **{leaf: value}) == [code]
        assert view.plant.drives["conveyor/fu1"].channel.output == before

    async def test_one_wrong_value_takes_its_telegram_with_it(self, client: Client, view: LocalView) -> None:
        wrong = ua.Variant("fast", ua.VariantType.String)
        assert await write(client, control_word=word(0x047F), frequency=wrong) == [Codes.BadTypeMismatch] * 2
        assert view.requests == []
        (told,) = view.rejections
        assert (told.target, told.action, told.code) == ("conveyor/fu1", "write", "not_valid")
        assert render(told.said) == "BadTypeMismatch"
        assert told.values == {"control_word": 0x047F, "frequency": "fast"}

    @pytest.mark.parametrize(
        ("name", "attribute", "code"),
        [
            ("conveyor/fu1/status/status_word", ua.AttributeIds.Value, Codes.BadNotWritable),
            (
                "conveyor/fu1/status/status_word/fault",
                ua.AttributeIds.Value,
                Codes.BadNotWritable,
            ),
            ("conveyor/fu1/command/control_word", ua.AttributeIds.DisplayName, Codes.BadNotWritable),
            ("conveyor/fu1/command/control_word", ua.AttributeIds.AccessLevel, Codes.BadNotWritable),
            ("conveyor/fu1/command/control_word", ua.AttributeIds.Executable, Codes.BadAttributeIdInvalid),
            ("conveyor/fu1/actual/frequency/EURange", ua.AttributeIds.Value, Codes.BadNotWritable),
            ("conveyor/fu9/command/control_word", ua.AttributeIds.Value, Codes.BadNodeIdUnknown),
        ],
    )
    async def test_nothing_but_the_value_of_a_command_point_is_written(
        self, client: Client, view: LocalView, name: str, attribute: ua.AttributeIds, code: int
    ) -> None:
        where = (await node(client, name)).nodeid
        wanted = ua.WriteValue(NodeId=where, AttributeId=attribute, Value=ua.DataValue(word(1)))
        assert await write_all(client, [wanted]) == [code]
        assert view.requests == []
        (told,) = view.rejections
        assert told.target == "/".join(name.split("/")[:2])
        assert told.values == {name.rpartition("/")[2]: 1}

    async def test_a_client_sets_neither_status_nor_server_time_nor_a_part(self, client: Client) -> None:
        uncertain = ua.DataValue(word(0x047E), ua.StatusCode(Codes.UncertainLastUsableValue))
        bad = ua.DataValue(word(0x047E), ua.StatusCode(Codes.BadDeviceFailure))
        timed = ua.DataValue(word(0x047E), ServerTimestamp=datetime.now(UTC))
        for value in (uncertain, bad, timed):
            assert await write(client, control_word=value) == [Codes.BadWriteNotSupported]
        where = (await node(client, "conveyor/fu1/command/control_word")).nodeid
        part = write_value(where, word(0x047E))
        part.IndexRange = "0:1"
        assert await write_all(client, [part]) == [Codes.BadWriteNotSupported]

    async def test_a_clients_source_time_is_not_taken_over(self, client: Client) -> None:
        point = await node(client, "conveyor/fu1/command/setpoint_2")
        await point.write_value(ua.DataValue(word(77), SourceTimestamp=datetime(2001, 1, 1, tzinfo=UTC)))
        read = await point.read_data_value()
        assert read.Value.Value == 77
        assert datetime.now(UTC) - read.SourceTimestamp < timedelta(seconds=5)

    async def test_a_number_that_is_no_word_becomes_none(self, client: Client, view: LocalView) -> None:
        int16 = ua.VariantType.Int16
        before = view.image.read("conveyor/fu1/command/control_word").value
        for value in (
            ua.Variant(-1, int16),
            ua.Variant(-32768, int16),
            ua.Variant(65536, ua.VariantType.Int32),
        ):
            assert await write(client, control_word=value) == [Codes.BadOutOfRange]
            assert await write(client, setpoint_1=value) == [Codes.BadOutOfRange]
        assert view.image.read("conveyor/fu1/command/control_word").value == before

    async def test_the_time_out_is_its_owners(self, client: Client, view: LocalView) -> None:
        where = (await node(client, "conveyor/fu3/supervision/fieldbus_timeout_ms")).nodeid
        other = (await node(client, "conveyor/fu1/supervision/fieldbus_timeout_ms")).nodeid

        async def set_to(timeout_ms: int, which: ua.NodeId = where) -> list[int]:
            return await write_all(
                client, [write_value(which, ua.Variant(timeout_ms, ua.VariantType.UInt32))]
            )

        def timeout_ms() -> object:
            return view.image.read("conveyor/fu3/supervision/fieldbus_timeout_ms").value

        assert await set_to(1000) == [Codes.BadUserAccessDenied]
        assert await call(client, "conveyor/fu3", "conveyor/fu3/TakeControl", [_LEASE]) == Codes.Good
        assert await set_to(1000) == [Codes.Good]
        assert timeout_ms() == 1000
        assert await set_to(0) == [Codes.BadOutOfRange]
        assert await set_to(3001) == [Codes.BadOutOfRange]
        assert await set_to(1000, other) == [Codes.BadNotWritable]
        assert await call(client, "conveyor/fu3", "conveyor/fu3/ReleaseControl", []) == Codes.Good
        assert timeout_ms() == 300

    async def test_a_drive_without_its_scale_says_so(self, client: Client) -> None:
        where = (await node(client, "conveyor/fu4/command/frequency")).nodeid
        (code,) = await write_all(client, [write_value(where, ua.Variant(1.0, ua.VariantType.Double))])
        # fu4 is commanded by nobody, which comes first.
        assert code == Codes.BadUserAccessDenied


async def test_a_port_in_use_is_one_helpful_sentence(
    served: tuple[OpcUaServer, LocalView], tmp_path: Path
) -> None:
    settings = OPEN.model_copy(update={"listen": f"127.0.0.1:{served[0].port}"})
    second = OpcUaServer(LocalView(make_plant()), settings, tmp_path, "hall")
    with pytest.raises(Unavailable, match="listen"):
        await second.start()
