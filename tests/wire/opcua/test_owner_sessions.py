"""One owner is one session: two sessions of one user are two controllers (docs/adr/0009)."""

from __future__ import annotations

from collections.abc import AsyncIterator
from pathlib import Path

import pytest
from asyncua import Client, ua

from bridge.command import Event, EventKind
from tests.support.opcua_client import node
from tests.support.opcua_site import OPEN, LocalView, namespace, serving

SHUT_DOWN, RUN = 0x047E, 0x047F
"""NORD's (BU 2500 §6.8)."""
FU1 = "conveyor/fu1"


class Hall:
    def __init__(self, url: str, view: LocalView) -> None:
        self.url, self.view = url, view
        self.events: list[Event] = []
        view.on_event(self.events.append)

    def told(self, kind: EventKind) -> list[str]:
        return [event.message for event in self.events if event.kind is kind]

    def runs(self, drive: str = FU1) -> bool:
        return self.view.plant.drives[drive].channel.output.words[0] & 0xF == 0xF


@pytest.fixture
async def hall(tmp_path: Path) -> AsyncIterator[Hall]:
    async with serving(OPEN, tmp_path) as (server, view):
        yield Hall(server.endpoint_url, view)


async def write(client: Client, word: int, drive: str = FU1) -> None:
    variable = await node(client, f"{drive}/command/control_word")
    await variable.write_value(ua.DataValue(ua.Variant(word, ua.VariantType.UInt16)))


async def test_two_sessions_of_one_user_do_not_move_a_drive_in_turns(hall: Hall) -> None:
    async with Client(hall.url) as one, Client(hall.url) as other:
        await write(one, SHUT_DOWN)
        await write(one, RUN)
        for _ in range(20):
            with pytest.raises(ua.uaerrors.BadUserAccessDenied):
                await write(other, SHUT_DOWN)
            assert hall.runs()
            await write(one, RUN)
        (why,) = set(hall.told(EventKind.REFUSED))
        words = why.split()
        assert words[:3] == ["write", "by", "opcua:anonymous"]
        assert why.count("opcua:anonymous session ") == 2
        assert words[4] != words[-1], "both are named"


async def test_the_second_one_may_stop_the_drive(hall: Hall) -> None:
    async with Client(hall.url) as one, Client(hall.url) as other:
        await write(one, SHUT_DOWN)
        await write(one, RUN)
        drive, space = await node(other, FU1), await namespace(other)
        await drive.call_method(f"{space}:Stop")
        assert not hall.runs()


@pytest.mark.landing(2)
@pytest.mark.parametrize("is_killed", [False, True])
async def test_the_next_session_goes_on_where_the_first_one_has_ended(hall: Hall, is_killed: bool) -> None:
    one = Client(hall.url)
    await one.connect()
    await write(one, SHUT_DOWN)
    await write(one, RUN)
    if is_killed:
        protocol = one.uaclient.protocol
        assert protocol
        assert protocol.transport
        protocol.transport.abort()
    else:
        await one.disconnect()
    async with Client(hall.url) as other:
        await write(other, RUN)
        assert hall.runs()
    if is_killed:
        await one.disconnect()
    assert not hall.told(EventKind.REFUSED)


async def test_a_lease_is_one_sessions(hall: Hall) -> None:
    drive = "conveyor/fu3"
    async with Client(hall.url) as one, Client(hall.url) as other:
        space = await namespace(one)
        ttl = ua.Variant(60_000, ua.VariantType.UInt32)
        await (await node(one, drive)).call_method(f"{space}:TakeControl", ttl)
        with pytest.raises(ua.uaerrors.BadUserAccessDenied):
            await (await node(other, drive)).call_method(f"{space}:TakeControl", ttl)
        with pytest.raises(ua.uaerrors.BadUserAccessDenied):
            await write(other, SHUT_DOWN, drive)
        await write(one, SHUT_DOWN, drive)
