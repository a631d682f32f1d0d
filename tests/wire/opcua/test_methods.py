"""The methods of drives and nodes in OPC UA."""

from __future__ import annotations

import asyncio
import time

import pytest
from asyncua import Client, ua

from bridge.command import Action, TakeControl
from tests.support.opcua_client import call, node
from tests.support.opcua_site import LocalView, namespace

pytestmark = pytest.mark.asyncio(loop_scope="module")
Codes = ua.StatusCodes


class TestMethods:
    async def test_a_drive_is_started_and_stopped(self, client: Client, view: LocalView) -> None:
        drive, space = await node(client, "conveyor/fu1"), await namespace(client)
        await drive.call_method(f"{space}:Stop")
        await asyncio.sleep(0.03)
        await drive.call_method(f"{space}:Start", ua.Variant(-1, ua.VariantType.Int32))
        assert view.plant.drives["conveyor/fu1"].channel.control_word == 0x147F
        for name in ("KeepAlive", "QuickStop", "DisableVoltage", "ResetFault", "ReleaseControl"):
            await drive.call_method(f"{space}:{name}")
        assert [request.action for request in view.requests] == [
            Action.STOP,
            Action.START,
            Action.KEEP_ALIVE,
            Action.QUICK_STOP,
            Action.DISABLE_VOLTAGE,
            Action.RESET_FAULT,
            Action.RELEASE_CONTROL,
        ]

    async def test_a_method_says_what_it_takes(self, client: Client) -> None:
        start = await node(client, "conveyor/fu1/Start")
        (argument,) = await (await start.get_child("0:InputArguments")).read_value()
        assert (argument.Name, argument.DataType) == ("direction", ua.NodeId(ua.ObjectIds.Int32))

    async def test_a_lease_is_taken_for_a_time(self, client: Client, view: LocalView) -> None:
        drive, space = await node(client, "conveyor/fu3"), await namespace(client)
        await drive.call_method(f"{space}:TakeControl", ua.Variant(500, ua.VariantType.UInt32))
        assert view.requests[-1].command == TakeControl(500)
        assert await (await node(client, "conveyor/fu3/supervision/owner")).read_value() == "opcua:anonymous"
        with pytest.raises(ua.uaerrors.BadOutOfRange):
            await drive.call_method(f"{space}:TakeControl", ua.Variant(1, ua.VariantType.UInt32))
        await drive.call_method(f"{space}:ReleaseControl")

    async def test_a_node_is_commanded(self, client: Client, view: LocalView) -> None:
        conveyor, space = await node(client, "conveyor"), await namespace(client)
        for name in ("Reset", "ResetCommunication", "Disable", "Enable"):
            await conveyor.call_method(f"{space}:{name}")
        assert [(request.target, request.action.value) for request in view.requests] == [
            ("conveyor", "reset"),
            ("conveyor", "reset_communication"),
            ("conveyor", "disable"),
            ("conveyor", "enable"),
        ]

    async def test_the_nodes_of_a_bus_are_commanded_together(self, client: Client, view: LocalView) -> None:
        bus, space = await node(client, "bus/can0"), await namespace(client)
        view.requests.clear()
        for name in ("Reset", "ResetCommunication", "StartNode", "StopNode", "EnterPreOperational"):
            await bus.call_method(f"{space}:{name}")
        assert [(request.target, request.action) for request in view.requests] == [
            ("bus/can0", action)
            for action in (
                Action.RESET,
                Action.RESET_COMMUNICATION,
                Action.START_NODE,
                Action.STOP_NODE,
                Action.ENTER_PRE_OPERATIONAL,
            )
        ]

    async def test_a_drive_of_another_controller_is_not_started(self, client: Client) -> None:
        drive, space = await node(client, "conveyor/fu2"), await namespace(client)
        with pytest.raises(ua.uaerrors.BadUserAccessDenied):
            await drive.call_method(f"{space}:Start", ua.Variant(1, ua.VariantType.Int32))

    async def test_a_tripped_drive_wants_an_acknowledge_first(self, client: Client, view: LocalView) -> None:
        drive, space = await node(client, "conveyor/fu3"), await namespace(client)
        start = ua.Variant(1, ua.VariantType.Int32)
        await drive.call_method(f"{space}:TakeControl", ua.Variant(60_000, ua.VariantType.UInt32))
        await drive.call_method(f"{space}:KeepAlive")
        await asyncio.sleep(0.4)
        with pytest.raises(ua.uaerrors.BadInvalidState):
            await drive.call_method(f"{space}:Start", start)
        await drive.call_method(f"{space}:ResetFault")
        await drive.call_method(f"{space}:ReleaseControl")

    @pytest.mark.parametrize(
        ("arguments", "code"),
        [
            ([], Codes.BadArgumentsMissing),
            ([ua.Variant(1, ua.VariantType.Int32)] * 2, Codes.BadTooManyArguments),
            ([ua.Variant(1.0, ua.VariantType.Double)], Codes.BadInvalidArgument),
            ([ua.Variant(7, ua.VariantType.Int32)], Codes.BadInvalidArgument),
            ([ua.Variant([1], ua.VariantType.Int32)], Codes.BadInvalidArgument),
        ],
    )
    async def test_wrong_arguments_start_nothing(
        self, client: Client, view: LocalView, arguments: list[ua.Variant], code: int
    ) -> None:
        assert await call(client, "conveyor/fu1", "conveyor/fu1/Start", arguments) == code
        assert view.requests == []
        (told,) = view.rejections
        assert (told.target, told.action, told.code) == ("conveyor/fu1", "start", "not_valid")

    async def test_a_method_belongs_to_its_object(self, client: Client, view: LocalView) -> None:
        assert await call(client, "conveyor/fu1", "conveyor/fu2/Stop", []) == Codes.BadMethodInvalid
        assert await call(client, "conveyor/fu1", "conveyor/fu1/Fly", []) == Codes.BadMethodInvalid
        assert view.requests == []
        told = [(one.target, one.action, one.code) for one in view.rejections]
        assert told == [("conveyor/fu2", "stop", "unknown_point"), ("conveyor/fu1", "call", "unknown_point")]

    async def test_a_start_that_takes_long_holds_nobody_up(self, client: Client, view: LocalView) -> None:
        """Not even the session that called it: its keep-alives are what keeps the drive going."""
        await call(client, "conveyor/fu1", "conveyor/fu1/Stop", [])
        await asyncio.sleep(0.05)
        view.answers = False
        try:
            start = [ua.Variant(1, ua.VariantType.Int32)]
            # From switch-on inhibited, with a drive that says nothing, until the channel gives up.
            view.plant.drives["conveyor/fu1"].on_process_data([0x0240, 0, 0, 0], time.monotonic())
            starting = asyncio.create_task(call(client, "conveyor/fu1", "conveyor/fu1/Start", start))
            began = time.monotonic()
            await asyncio.sleep(0.05)
            assert await call(client, "conveyor/fu1", "conveyor/fu1/KeepAlive", []) == Codes.Good
            await (await node(client, "conveyor/fu1/status/state")).read_value()
            assert time.monotonic() - began < 1
            assert not starting.done()
            assert await starting == Codes.BadTimeout
        finally:
            view.answers = True
