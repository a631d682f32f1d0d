"""Diagnostics of sessions and subscriptions, and who may see them; asyncua's client."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import fields
from typing import Any

import pytest
import pytest_asyncio
from asyncua import Client, ua

from bridge.config import OpcUaTable, UserTable
from bridge.uaserver.diagnostics.diagnostics import SecurityDiagnostics
from bridge.uaserver.session import Session
from tests.support.opcua_peers import PASSWORD, Served, logged_in, make_peer
from tests.support.opcua_raw import ask, item, monitored, published, sessions, subscribed, values
from tests.support.opcua_site import break_off, serving
from tests.support.passwords import cheap_hash
from tests.support.zenoh_peer import until

pytestmark = pytest.mark.asyncio(loop_scope="module")
Ids, Codes, Errors = ua.ObjectIds, ua.StatusCodes, ua.uaerrors
DIAGNOSTICS = Ids.Server_ServerDiagnostics
SUMMARY = Ids.Server_ServerDiagnostics_ServerDiagnosticsSummary
SESSIONS = Ids.Server_ServerDiagnostics_SessionsDiagnosticsSummary
ALL_SESSIONS = Ids.Server_ServerDiagnostics_SessionsDiagnosticsSummary_SessionDiagnosticsArray
ALL_SECURITY = Ids.Server_ServerDiagnostics_SessionsDiagnosticsSummary_SessionSecurityDiagnosticsArray
ALL_SUBSCRIPTIONS = Ids.Server_ServerDiagnostics_SubscriptionDiagnosticsArray


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def served(tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[Served]:
    line = cheap_hash(PASSWORD)
    users = [
        UserTable(name=name, role=role, password_hash=line)
        for name, role in (("anna", "operator"), ("emil", "engineer"))
    ]
    settings = OpcUaTable(
        listen="127.0.0.1:0", no_security=True, anonymous="observer", user=users, trust="anybody"
    )
    async with serving(settings, tmp_path_factory.mktemp("state")) as found:
        yield found


@pytest.fixture(autouse=True)
def _decoded(monkeypatch: pytest.MonkeyPatch) -> None:
    """asyncua cannot decode this structure; node-opcua reads what is on the wire (``test_node.py``)."""
    known = ua.extension_objects_by_typeid
    where = ua.NodeId(Ids.SessionSecurityDiagnosticsDataType_Encoding_DefaultBinary)
    monkeypatch.setitem(known, where, SecurityDiagnostics)


@asynccontextmanager
async def seen(served: Served, user: str, *, secret: bool = False) -> AsyncIterator[tuple[Client, Session]]:
    """A client and the session that the server has for it."""
    before = sessions(served[0])
    async with logged_in(served, make_peer("scada") if secret else None, user, PASSWORD) as client:
        [session] = [one for one in sessions(served[0]) if one not in before]
        yield client, session


async def read(client: Client, where: int | str) -> Any:
    node_id = ua.NodeId(f"Diagnostics/{where}", 1) if isinstance(where, str) else ua.NodeId(where)
    return await client.get_node(node_id).read_value()


async def code(client: Client, where: int | str) -> int:
    try:
        await read(client, where)
    except ua.UaStatusCodeError as error:
        return error.code
    return Codes.Good


async def test_an_engineer_sees_what_there_is(served: Served) -> None:
    async with seen(served, "anna") as (anna, hers), seen(served, "emil", secret=True) as (emil, his):
        made = await subscribed(anna, 100, Priority=7)
        await monitored(anna, made.SubscriptionId, [item(ua.NodeId(Ids.Server_ServerStatus_CurrentTime))])
        await published(anna)
        with pytest.raises(Errors.BadSubscriptionIdInvalid):
            await ask(anna, "Republish", SubscriptionId=4711)
        summary = await read(emil, SUMMARY)
        assert (summary.CurrentSessionCount, summary.CurrentSubscriptionCount) == (2, 1)
        assert summary.CumulatedSessionCount >= 2
        assert summary.RejectedRequestsCount >= 1
        rows = {row.SessionId: row for row in await read(emil, ALL_SESSIONS)}
        assert rows.keys() == {hers.session_id, his.session_id}
        row = rows[hers.session_id]
        assert (row.CurrentSubscriptionsCount, row.CurrentMonitoredItemsCount) == (1, 1)
        assert (row.RepublishCount.TotalCount, row.RepublishCount.ErrorCount) == (1, 1)
        assert (row.PublishCount.TotalCount, row.PublishCount.ErrorCount) == (1, 0)
        assert row.ClientDescription.ApplicationUri == anna.application_uri
        [subscription] = await read(emil, ALL_SUBSCRIPTIONS)
        assert subscription.SessionId == hers.session_id
        assert (subscription.Priority, subscription.PublishingInterval) == (7, 100)
        assert (subscription.NextSequenceNumber, subscription.UnacknowledgedMessageCount) == (2, 1)
        secrets = {row.SessionId: row for row in await read(emil, ALL_SECURITY)}
        assert secrets[hers.session_id].ClientUserIdHistory == ["anna"]
        mine = secrets[his.session_id]
        assert (mine.AuthenticationMechanism, mine.SecurityMode) == ("UserName", 3)
        assert mine.ClientCertificate == his.channel_certificate


async def test_others_see_their_own_and_no_more(served: Served) -> None:
    async with seen(served, "anna") as (anna, hers), seen(served, "emil") as (emil, his):
        number = (await subscribed(emil, 1000)).SubscriptionId
        assert (await read(anna, SUMMARY)).CurrentSessionCount == 2
        for where in (ALL_SESSIONS, ALL_SECURITY, ALL_SUBSCRIPTIONS):
            assert await code(anna, where) == Codes.BadUserAccessDenied
        for part in ("SessionDiagnostics", "SessionSecurityDiagnostics", "SubscriptionDiagnosticsArray"):
            assert await code(anna, f"{hers.label}/{part}") == Codes.Good
            assert await code(anna, f"{his.label}/{part}") == Codes.BadUserAccessDenied
        for where in (f"Subscription/{number}", f"Subscription/{number}/Priority"):
            assert await code(anna, where) == Codes.BadUserAccessDenied
            assert await code(emil, where) == Codes.Good
        # What is about security takes an encrypted channel, too.
        assert await code(emil, ALL_SESSIONS) == Codes.Good
        assert await code(emil, ALL_SECURITY) == Codes.BadUserAccessDenied
        assert await code(emil, f"{hers.label}/SessionSecurityDiagnostics") == Codes.BadUserAccessDenied


async def test_each_session_is_found_by_browsing_and_goes_with_its_end(served: Served) -> None:
    async with seen(served, "emil", secret=True) as (emil, his):
        assert await read(emil, Ids.Server_ServerDiagnostics_EnabledFlag) is True
        number = (await subscribed(emil, 1000)).SubscriptionId
        async with seen(served, "anna") as (_, hers):
            summary = emil.get_node(SESSIONS)
            names = {(await one.read_browse_name()).Name for one in await summary.get_children()}
            assert {hers.label, his.label} <= names
        names = {(await one.read_browse_name()).Name for one in await summary.get_children()}
        assert hers.label not in names
        assert await code(emil, f"{hers.label}/SessionDiagnostics") == Codes.BadNodeIdUnknown
        for where, kind in (
            (f"{his.label}/SessionDiagnostics", ua.SessionDiagnosticsDataType),
            (f"{his.label}/SessionSecurityDiagnostics", SecurityDiagnostics),
            (f"Subscription/{number}", ua.SubscriptionDiagnosticsDataType),
        ):
            whole, found = emil.get_node(ua.NodeId(f"Diagnostics/{where}", 1)), set[str]()
            assert isinstance(await whole.read_value(), kind)
            for child in await whole.get_children():
                name = (await child.read_browse_name()).Name
                found.add(name)
                assert await child.read_value() is not None or name == "LocaleIds", name
                assert (await child.get_parent()).nodeid == whole.nodeid
            assert found == {one.name.replace("EncodingName", "Encoding") for one in fields(kind)}
        array = emil.get_node(ua.NodeId(f"Diagnostics/{his.label}/SubscriptionDiagnosticsArray", 1))
        assert [one.nodeid.Identifier for one in await array.get_children()] == [
            f"Diagnostics/Subscription/{number}"
        ]
        assert await emil.get_node(f"i={DIAGNOSTICS}").get_children()
        for wrong in ("nobody", f"{his.label}/Else", f"Subscription/{number}/Priority/x", "Subscription/x"):
            assert await code(emil, wrong) == Codes.BadNodeIdUnknown


async def test_who_watches_them_is_told(served: Served) -> None:
    async with seen(served, "emil") as (emil, _):
        number = (await subscribed(emil, 100)).SubscriptionId
        counted = ua.NodeId(Ids.Server_ServerDiagnostics_ServerDiagnosticsSummary_CurrentSessionCount)
        async with seen(served, "anna") as (_, hers):
            its = ua.NodeId(f"Diagnostics/{hers.label}/SessionDiagnostics/SessionName", 1)
            made = await monitored(emil, number, [item(counted), item(its)])
            assert [one.StatusCode.value for one in made] == [Codes.Good, Codes.Good]
            told = values((await published(emil)).NotificationMessage)
            assert told[0].Value.Value == 2
        came: list[ua.DataValue] = []
        while len(came) < 2:
            came += values((await published(emil)).NotificationMessage)
        assert {one.StatusCode.value for one in came} == {Codes.Good, Codes.BadNodeIdUnknown}
        assert 1 in [one.Value.Value for one in came]
        # The node has gone; the item can be deleted all the same.
        ids = [one.MonitoredItemId for one in made]
        codes = await ask(emil, "DeleteMonitoredItems", SubscriptionId=number, MonitoredItemIds=ids)
        assert [one.value for one in codes.Results] == [Codes.Good, Codes.Good]


async def test_sessions_that_end_for_an_error_are_counted(served: Served) -> None:
    """Part 5 §12.9. One that is closed is none of them, and one with a subscription waits for its client."""
    async with seen(served, "emil") as (emil, _):

        async def aborted() -> int:
            return (await read(emil, SUMMARY)).SessionAbortCount

        before = await aborted()
        async with seen(served, "anna"):
            pass
        async with seen(served, "anna") as (lost, hers):
            await subscribed(lost, 1000)
            lost.disconnect_socket()
            await until(lambda: hers.holder is None, "its connection is gone")
            assert hers in sessions(served[0])
            await hers.close_session()
        assert await aborted() == before
        async with seen(served, "anna") as (lost, hers):
            lost.disconnect_socket()
            await until(lambda: hers not in sessions(served[0]), "it ends with its connection")
        assert await aborted() == before + 1
        hasty = Client(served[0].endpoint_url, timeout=5)
        await hasty.connect_socket()
        await hasty.send_hello()
        await hasty.open_secure_channel()
        await hasty.create_session()
        with pytest.raises(Errors.BadSessionNotActivated):
            await hasty.nodes.server_state.read_value()
        break_off(hasty)
        assert await aborted() == before + 2


async def test_what_a_client_says_of_itself_is_cut(served: Served) -> None:
    client = Client(served[0].endpoint_url, timeout=10)
    client.description = "x" * 10_000
    async with client:
        await until(lambda: len(sessions(served[0])) == 1, "its session")
        [session] = sessions(served[0])
        assert len((await read(client, f"{session.label}/SessionDiagnostics")).SessionName) == 256
