"""What clients are told of the server's end and of its service level; time passes where it is waited for."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from datetime import UTC, datetime, timedelta
from typing import Any

import pytest
from asyncua import ua

from bridge.uaserver.selfdescription import describe
from bridge.uaserver.serverstatus import HEALTHY, MAINTENANCE, NO_DATA, UNKNOWN_TIME, ServerStatus
from tests.support.standard_space import standard_space
from tests.support.virtual_loop import VirtualLoop

Ids = ua.ObjectIds
REASON = ua.LocalizedText("it is stopped", "en")


class Rig:
    """The standard's address space, and what a client was told of it."""

    def __init__(self) -> None:
        self.space = standard_space()
        held = self.space[ua.NodeId(Ids.Server_ServerStatus)].attributes[ua.AttributeIds.Value]
        held.value = ua.DataValue(ua.Variant(ua.ServerStatusDataType(), ua.VariantType.ExtensionObject))
        describe(self.space, ("en",))
        self.status = ServerStatus(self.space)
        self.told: list[tuple[float, int]] = []
        """(time, seconds till shutdown)"""

    def value(self, name: str) -> Any:
        where = ua.NodeId(getattr(Ids, name))
        found = self.space.read_attribute_value(where, ua.AttributeIds.Value)
        assert found.Value is not None
        return found.Value.Value

    async def end(self, has_clients: Callable[[], bool], **more: float) -> None:
        async def tell(_: int, value: ua.DataValue) -> None:
            assert value.Value is not None
            self.told.append((asyncio.get_running_loop().time(), value.Value.Value))

        where = ua.NodeId(Ids.Server_ServerStatus_SecondsTillShutdown)
        self.space.add_datachange_callback(where, ua.AttributeIds.Value, tell)
        await self.status.announce_end(2.0, REASON, has_clients, **more)


@pytest.fixture
def rig() -> Rig:
    return Rig()


def run(work: Coroutine[Any, Any, None]) -> float:
    """Seconds that it takes."""
    loop = VirtualLoop()
    try:
        loop.run_until_complete(work)
        return loop.time()
    finally:
        loop.close()


def test_a_server_that_runs_is_healthy(rig: Rig) -> None:
    assert rig.value("Server_ServiceLevel") == HEALTHY
    assert rig.value("Server_EstimatedReturnTime") == UNKNOWN_TIME


def test_the_level_is_that_which_was_set_last(rig: Rig) -> None:
    for level in (NO_DATA, HEALTHY):
        run(rig.status.set_level(level))
        assert rig.value("Server_ServiceLevel") == level


def test_an_end_is_announced_and_counted_down(rig: Rig) -> None:
    assert run(rig.end(lambda: True)) == pytest.approx(2.0, abs=0.01)
    assert [seconds for _, seconds in rig.told] == [2, 1, 0]
    assert [at for at, _ in rig.told] == pytest.approx([0.0, 1.0, 2.0], abs=0.11)
    whole = rig.value("Server_ServerStatus")
    for shown in (
        (whole.State, whole.SecondsTillShutdown, whole.ShutdownReason),
        tuple(
            rig.value(f"Server_ServerStatus_{name}")
            for name in ("State", "SecondsTillShutdown", "ShutdownReason")
        ),
    ):
        assert shown == (ua.ServerState.Shutdown, 0, REASON)
    assert rig.value("Server_ServiceLevel") == MAINTENANCE
    assert rig.value("Server_EstimatedReturnTime") == UNKNOWN_TIME


def test_a_level_does_not_take_an_end_back(rig: Rig) -> None:
    run(rig.end(lambda: False))
    run(rig.status.set_level(HEALTHY))
    assert rig.status.is_ending
    assert rig.value("Server_ServiceLevel") == MAINTENANCE


def test_nobody_is_waited_for_who_is_not_there(rig: Rig) -> None:
    assert run(rig.end(lambda: False)) == 0.0
    left = iter((True, True, False))
    assert run(rig.end(lambda: next(left))) == pytest.approx(0.2, abs=0.01)


def test_the_time_of_the_return_is_told_where_it_is_known(rig: Rig) -> None:
    before = datetime.now(UTC)
    run(rig.end(lambda: False, return_after_s=60.0))
    back_in = rig.value("Server_EstimatedReturnTime") - before
    assert timedelta(seconds=62) <= back_in < timedelta(seconds=70)
