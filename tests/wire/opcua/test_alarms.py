"""Alarms and conditions (OPC 10000-9) as a client of asyncua's follows and handles them.

Each test has a drive of its own; what others have left behind is told with it.
"""

from __future__ import annotations

import asyncio
import gc
import json
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio
from asyncua import Client, ua

from bridge.command import Action
from bridge.config import OpcUaTable, UserTable
from bridge.northbound.opcua.alarms import alarm_server
from bridge.northbound.opcua.alarms.alarm_server import AlarmSite
from bridge.northbound.opcua.server import OpcUaServer
from bridge.text import Text, as_json
from bridge.uaserver.conditions.condition_fields import AlarmContent
from bridge.uaserver.conditions.conditions import Conditions
from tests.support.opcua_alarms import (
    Follower,
    alarm_of,
    cut_bus,
    event_and,
    following,
    is_active,
    is_over,
    many_drives,
    of,
    plant_of_many,
    tell,
    thousand,
    trouble,
)
from tests.support.opcua_site import LocalView, namespace, serving
from tests.support.passwords import cheap_hash
from tests.support.quiet import quiet_log

pytestmark = pytest.mark.asyncio(loop_scope="module")
Codes, Ids = ua.StatusCodes, ua.ObjectIds
PASSWORD = "swordfish"
ROLES = {"anna": "operator", "otto": "observer", "eva": "engineer"}
Served = tuple[OpcUaServer, LocalView]


def fault(drive: str, **more: Any) -> dict[str, Any]:
    facts = {
        "text": "E003/3.0 overcurrent",
        "number": "E003/3.0",
        "cause": "Motor blocked.",
        "remedy": "Free the motor.",
    }
    return trouble("drive_fault", drive, **facts) | more


def settings(**more: Any) -> OpcUaTable:
    line = cheap_hash(PASSWORD)
    users = [
        UserTable.model_validate({"name": name, "role": role, "password_hash": line})
        for name, role in ROLES.items()
    ]
    return OpcUaTable(listen="127.0.0.1:0", no_security=True, anonymous="observer", user=users, **more)


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def served(tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[Served]:
    async with serving(settings(), tmp_path_factory.mktemp("state"), plant_of_many()) as found:
        yield found


@pytest.fixture
def view(served: Served) -> LocalView:
    served[1].requests.clear()
    served[1].rejections.clear()
    return served[1]


@asynccontextmanager
async def logged_in(server: OpcUaServer, user: str, locale: str = "en") -> AsyncIterator[Client]:
    client = Client(server.endpoint_url, timeout=10, watchdog_intervall=10)
    if user:
        client.set_user(user)
        client.set_password(PASSWORD)
    client.set_locale([locale])
    async with client:
        yield client


@asynccontextmanager
async def followed(served: Served, user: str = "anna", locale: str = "en") -> AsyncIterator[Follower]:
    async with logged_in(served[0], user, locale) as client, following(client) as follower:
        yield follower


async def test_an_alarm_goes_its_way_from_the_trouble_to_its_confirmation(
    served: Served, view: LocalView
) -> None:
    drive = "n1/fu1"
    wrong = fault(drive)
    async with followed(served) as follower:
        tell(view, wrong)
        raised = await follower.until(of(drive), is_active)
        assert raised["EventType"] == ua.NodeId("DriveAlarmType", follower.space)
        assert (raised["SourceName"], raised["Severity"]) == (drive, 800)
        assert raised["Message"].Text == "Fault E003/3.0. E003/3.0 overcurrent."
        assert (raised["Cause"].Text, raised["Remedy"].Text) == ("Motor blocked.", "Free the motor.")
        assert (raised["Code"], raised["FaultNumber"]) == ("condition.drive_fault", "E003/3.0")
        assert json.loads(raised["Facts"]) == wrong["facts"]
        assert (raised["AckedState/Id"], raised["ConfirmedState/Id"], raised["Retain"]) == (False, True, True)

        given = event_and("Förderband geprüft", raised)
        assert await follower.call(alarm_of(drive), "Acknowledge", *given) == Codes.Good
        acked = await follower.until(of(drive), lambda event: event["AckedState/Id"])
        assert acked["Comment"] == ua.LocalizedText("Förderband geprüft", "de")
        assert (acked["ClientUserId"], acked["ConfirmedState/Id"]) == ("anna", False)
        twice = await follower.call(alarm_of(drive), "Acknowledge", *given)
        assert twice == Codes.BadConditionBranchAlreadyAcked

        tell(view)
        over = await follower.until(of(drive), is_over)
        assert over["Retain"]
        assert over["Message"].Text.startswith("over: Fault E003/3.0.")
        assert await follower.call(alarm_of(drive), "Confirm", *event_and("", over, "")) == Codes.Good
        done = await follower.until(of(drive), lambda event: not event["Retain"])
        assert done["Comment"].Text == "Förderband geprüft"
        assert view.requests == [], "an acknowledgement is no command"


@pytest.mark.parametrize(
    ("locale", "message", "remedy", "acked"),
    [
        ("de", "Kein Knoten antwortet. Alle 3 Knoten", "CAN-Kabel an der Box", "nicht quittiert"),
        ("en", "No node answers. All 3 nodes", "Check the CAN cable at the box", "unacknowledged"),
    ],
)
async def test_a_cut_bus_is_one_alarm_with_what_it_explains_in_the_clients_language(
    served: Served, view: LocalView, locale: str, message: str, remedy: str, acked: str
) -> None:
    places = ["n3/fu1", "n3/fu2", "n3/fu3"]
    async with followed(served, locale=locale) as follower:
        tell(view, cut_bus(*places) | {"since": time.time_ns()})
        raised = await follower.until(of("bus/can0"), is_active)
        assert (raised["SourceName"], raised["Explains"]) == ("can0", places)
        assert raised["Message"].Text.startswith(message)
        assert raised["Remedy"].Text.startswith(remedy)
        assert raised["AckedState"].Text == acked
        tell(view)
        await follower.until(of("bus/can0"), is_over)
        assert not [event for event in follower.events if event["SourceName"] in places]


async def test_a_refresh_tells_what_is_left_to_that_subscription_alone(
    served: Served, view: LocalView
) -> None:
    drive, ends = "n1/fu2", ua.NodeId(Ids.RefreshEndEventType)
    async with followed(served) as follower, following(follower.client) as other:
        tell(view, fault(drive))
        await follower.until(of(drive), is_active)
        await other.until(of(drive), is_active)
        heard = len(other.events)
        follower.events.clear()
        assert await follower.refresh() == Codes.Good
        await follower.until(lambda event: event["EventType"] == ends)
        first, *told, _ = follower.events
        assert first["EventType"] == ua.NodeId(Ids.RefreshStartEventType)
        assert all(event["Retain"] for event in told)
        assert drive in [event["SourceName"] for event in told]
        follower.events.clear()
        assert await follower.refresh(item=follower.item) == Codes.Good
        await follower.until(lambda event: event["EventType"] == ends)
        assert len(follower.events) == len(told) + 2
        assert len(other.events) == heard


async def test_a_refresh_of_what_is_not_ones_own_is_refused(served: Served) -> None:
    async with followed(served, user="otto") as follower, followed(served, user="") as other:
        theirs = other.subscription.subscription_id
        assert theirs
        assert await follower.refresh(subscription=theirs) == Codes.BadUserAccessDenied
        assert await follower.refresh(subscription=4711) == Codes.BadSubscriptionIdInvalid
        assert await follower.refresh(item=4711) == Codes.BadMonitoredItemIdInvalid
        assert await follower.refresh() == Codes.Good, "who may only read may refresh"


async def test_each_method_needs_its_role_and_refusals_are_in_the_audit_log(
    served: Served, view: LocalView
) -> None:
    drive = "n1/fu3"
    async with followed(served, user="otto") as follower:
        tell(view, fault(drive))
        raised = await follower.until(of(drive), is_active)
        given = event_and("ich war's", raised)
        for method in ("Acknowledge", "Confirm", "AddComment"):
            code = await follower.call(alarm_of(drive), method, *given)
            assert code == Codes.BadUserAccessDenied
        for method in ("OneShotShelve", "Unshelve", "Disable"):
            assert await follower.call(alarm_of(drive), method) == Codes.BadUserAccessDenied
    told = [(one.identity.user, one.target, one.action, one.code) for one in view.rejections]
    actions = ["acknowledge", "confirm", "add_comment", "one_shot_shelve", "unshelve", "disable"]
    assert told == [("otto", drive, action, "not_allowed") for action in actions]


async def test_an_alarm_is_shelved_and_taken_out_of_service(served: Served, view: LocalView) -> None:
    drive = "n1/fu4"
    alarm = alarm_of(drive)
    async with followed(served, user="eva") as follower:
        tell(view, fault(drive))
        await follower.until(of(drive), is_active)
        assert await follower.call(f"{alarm}/ShelvingState", "OneShotShelve") == Codes.Good
        shelved = ua.NodeId(Ids.ShelvedStateMachineType_OneShotShelved)
        await follower.until(of(drive), lambda event: event["ShelvingState/CurrentState/Id"] == shelved)
        assert await follower.call(alarm, "OneShotShelve") == Codes.BadConditionAlreadyShelved
        assert await follower.call(alarm, "Disable") == Codes.Good
        disabled = await follower.until(of(drive), lambda event: event["EnabledState/Id"] is False)
        assert not disabled["Retain"]
        heard = len(follower.events)
        tell(view)
        await asyncio.sleep(0.2)
        told = [event for event in follower.events[heard:] if of(drive)(event)]
        assert told == [], "nothing is told while it is disabled"
        assert await follower.call(alarm, "Enable") == Codes.Good
        await follower.until(of(drive), is_over)


BY_EVENT = (Ids.ConditionType_AddComment, Ids.AcknowledgeableConditionType_Acknowledge)
TIMED = Ids.AlarmConditionType_ShelvingState_TimedShelve
SAID = ua.Variant(ua.LocalizedText("x", "en"))


@pytest.mark.parametrize(
    ("number", "arguments", "code"),
    [
        (BY_EVENT[0], [], Codes.BadArgumentsMissing),
        (Ids.ConditionType_Enable, [ua.Variant(1)], Codes.BadTooManyArguments),
        (TIMED, [ua.Variant("long")], Codes.BadInvalidArgument),
        (TIMED, [ua.Variant(-1.0)], Codes.BadShelvingTimeOutOfRange),
        (
            BY_EVENT[0],
            [ua.Variant(b"x"), ua.Variant(ua.LocalizedText("x" * 1001, "en"))],
            Codes.BadInvalidArgument,
        ),
        (BY_EVENT[0], [ua.Variant(b"x"), SAID], Codes.BadEventIdUnknown),
        (BY_EVENT[1], [ua.Variant(None, ua.VariantType.ByteString), SAID], Codes.BadEventIdUnknown),
        (Ids.ConditionType_ConditionRefresh, [ua.Variant(1, ua.VariantType.UInt32)], Codes.BadMethodInvalid),
    ],
)
async def test_a_call_that_cannot_be_meant_says_why(
    served: Served, number: int, arguments: list[ua.Variant], code: int
) -> None:
    async with logged_in(served[0], "eva") as client:
        where = ua.NodeId(alarm_of("n2/fu1"), await namespace(client))
        request = ua.CallMethodRequest(where, ua.NodeId(number), arguments)
        nowhere = ua.CallMethodRequest(ua.NodeId("nowhere", 2), ua.NodeId(number), arguments)
        found, missed = await client.uaclient.call([request, nowhere])
        assert found.StatusCode.value == code
        assert not missed.StatusCode.is_good()


async def test_a_client_finds_an_alarm_by_browsing_and_reads_it(served: Served, view: LocalView) -> None:
    place = "n2/fu2"
    async with followed(served) as follower:
        client, space = follower.client, follower.space
        drive = client.get_node(ua.NodeId(place, space))
        (alarm,) = await drive.get_referenced_nodes(Ids.HasCondition, ua.BrowseDirection.Forward)
        assert alarm.nodeid == ua.NodeId(alarm_of(place), space)
        assert await drive.get_child(f"{space}:Alarm") == alarm
        assert await alarm.read_type_definition() == ua.NodeId("DriveAlarmType", space)
        sources = await alarm.get_referenced_nodes(Ids.HasCondition, ua.BrowseDirection.Inverse)
        assert sources == [drive]
        method = await alarm.get_child("0:Acknowledge")
        assert method.nodeid == ua.NodeId(Ids.AcknowledgeableConditionType_Acknowledge)
        active = await alarm.get_child(["0:ActiveState", "0:Id"])
        code = await alarm.get_child(f"{space}:Code")
        assert (await active.read_value(), await code.read_value()) == (False, "")
        tell(view, fault(place))
        await follower.until(of(place), is_active)
        assert (await active.read_value(), await code.read_value()) == (True, "condition.drive_fault")
        for part in await alarm.get_children():
            for attribute in (ua.AttributeIds.BrowseName, ua.AttributeIds.DisplayName):
                assert (await part.read_attribute(attribute)).StatusCode.is_good()


async def test_who_watches_a_field_is_told_of_its_changes(served: Served, view: LocalView) -> None:
    told: asyncio.Queue[Any] = asyncio.Queue()

    class Watcher:
        def datachange_notification(self, node: object, value: object, data: object) -> None:
            told.put_nowait(value)

    async with logged_in(served[0], "anna") as client, asyncio.timeout(5):
        watching = await client.create_subscription(50, Watcher())
        where = ua.NodeId(f"{alarm_of('n2/fu3')}/ActiveState/Id", await namespace(client))
        await watching.subscribe_data_change(client.get_node(where))
        assert await told.get() is False
        tell(view, fault("n2/fu3"))
        assert await told.get() is True


async def test_each_place_has_its_alarm_and_the_server_hears_of_all(served: Served, view: LocalView) -> None:
    """And the certificate, which this server has made for years."""
    places = ["bus/can0", "n4", "bridge", *(one for one in many_drives() if one.startswith("n4/"))]
    async with followed(served) as follower:
        tell(
            view,
            *(
                trouble("node_lost", place, since=time.time_ns() // 1_000_000, how="heartbeat")
                for place in places
            ),
        )
        for place in places:
            await follower.until(of(place), is_active)
        expires = ua.NodeId("bridge/CertificateAlarm/ExpirationDate", follower.space)
        assert (await follower.client.get_node(expires).read_value()).year > 2030
        tell(view)


def conditions_of(served: Served) -> Conditions:
    """The server's own, whatever the plant tells."""
    server: Any = served[0]._server
    return server.iserver.conditions


@pytest.mark.landing
async def test_a_thousand_alarms_at_once_are_told_within_a_second(served: Served) -> None:
    conditions = conditions_of(served)
    many = thousand(conditions)
    async with logged_in(served[0], "anna") as client, following(client, queue=2000) as follower:
        for turn in range(3):
            follower.events.clear()
            content = AlarmContent(ua.LocalizedText(f"turn {turn}", "en"), 700)
            began = time.monotonic()
            for one in many:
                conditions.raised(one, content, anew=True)
            async with asyncio.timeout(5):
                while len(follower.events) < len(many):
                    await follower.another()
            took_s = time.monotonic() - began
            assert took_s < 1, f"{took_s:.2f} s"
        follower.events.clear()
        assert await follower.refresh() == Codes.Good
        await follower.until(lambda event: event["EventType"] == ua.NodeId(Ids.RefreshEndEventType))
        assert len(follower.events) >= len(many) + 2
    for one in many:
        del conditions.conditions[one.place.node]


@pytest.mark.landing
async def test_events_leave_nothing_behind(served: Served) -> None:
    conditions = conditions_of(served)
    many = thousand(conditions)

    async def events(turns: int) -> int:
        for turn in range(turns):
            content = AlarmContent(ua.LocalizedText(f"turn {turn}", "en"), 700)
            for one in many:
                conditions.raised(one, content, anew=True)
            await conditions.send_waiting()
        gc.collect()
        return len(gc.get_objects())

    before = await events(15)
    assert await events(5) <= before + 100
    for one in many:
        del conditions.conditions[one.place.node]


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def special(tmp_path_factory: pytest.TempPathFactory) -> AsyncIterator[tuple[Served, list[str]]]:
    """A server that resets faults, knows fronts, lives when its certificate runs out, and has a broken file;
    with the lines of its log."""
    folder = tmp_path_factory.mktemp("special")
    (folder / "opcua").mkdir()
    (folder / "opcua" / "alarms.json").write_text('{"version": 1, "alarms": ')
    view = LocalView(plant_of_many())
    server = OpcUaServer(
        view,
        settings(acknowledge_resets=True),
        folder,
        "hall",
        alarm_site=AlarmSite(fronts=("modbus", "zenoh")),
    )
    years_ms = 40 * 365 * 86_400_000
    with pytest.MonkeyPatch.context() as patch, quiet_log() as log:
        patch.setattr(alarm_server, "_now_ms", lambda: time.time() * 1000 + years_ms)
        await server.start()
        yield (server, view), log.lines
        await server.close()


class TestSpecial:
    async def test_a_broken_file_is_named_and_alarms_begin_anew(
        self, special: tuple[Served, list[str]]
    ) -> None:
        _, lines = special
        assert any("alarms.json: Input data was truncated: alarms begin anew" in line for line in lines), (
            lines
        )

    async def test_a_certificate_that_runs_out_is_an_alarm(self, special: tuple[Served, list[str]]) -> None:
        async with followed(special[0]) as follower:
            assert await follower.refresh() == Codes.Good
            raised = await follower.until(is_active)
            assert raised[""] == ua.NodeId("bridge/CertificateAlarm", follower.space)
            assert raised["Message"].Text.startswith("This server's certificate runs out on 20")

    async def test_a_front_that_fails_has_an_alarm_of_its_own(
        self, special: tuple[Served, list[str]]
    ) -> None:
        part = Text.of("front.fails", front="zenoh", how=Text.of("front.has_ended"))
        fails = trouble("fronts_failing", "bridge", rank="warning", fronts="zenoh: it has ended")
        fails["texts"] = {"fronts": as_json(Text.of("front.failing", parts=(part,)))}
        async with followed(special[0]) as follower:
            tell(special[0][1], fails)
            raised = await follower.until(is_active)
            assert raised[""] == ua.NodeId("bridge/ZenohAlarm", follower.space)
            assert raised["Severity"] == 400

    @pytest.mark.parametrize(
        ("drive", "user", "is_acked"),
        [("n1/fu1", "anna", True), ("n1/fu2", "otto", False)],
    )
    async def test_the_drives_fault_is_reset_as_the_user_who_acknowledges(
        self, special: tuple[Served, list[str]], drive: str, user: str, is_acked: bool
    ) -> None:
        served, _ = special
        served[1].requests.clear()
        async with followed(served, user) as follower:
            tell(served[1], fault(drive))
            raised = await follower.until(of(drive), is_active)
            code = await follower.call(alarm_of(drive), "Acknowledge", *event_and("", raised))
            assert (code == Codes.Good) == is_acked
            if is_acked:
                await follower.until(of(drive), lambda event: event["AckedState/Id"])
        asked = [(one.action, one.target, one.identity.user) for one in served[1].requests]
        assert asked == ([(Action.RESET_FAULT, drive, user)] if is_acked else [])

    async def test_what_the_bridge_refuses_is_not_acknowledged(
        self, special: tuple[Served, list[str]]
    ) -> None:
        """The owner of the drive is somebody else."""
        (server, view), _ = special
        drive = "n2/fu1"
        async with followed((server, view), "eva") as owner, followed((server, view)) as follower:
            where = owner.client.get_node(ua.NodeId(drive, owner.space))
            await where.call_method(f"{owner.space}:TakeControl", ua.Variant(0, ua.VariantType.UInt32))
            tell(view, fault(drive))
            raised = await follower.until(of(drive), is_active)
            code = await follower.call(alarm_of(drive), "Acknowledge", *event_and("", raised))
            assert code == Codes.BadUserAccessDenied
            await asyncio.sleep(0.1)
            assert [one["AckedState/Id"] for one in follower.events if of(drive)(one)] == [False]


async def test_what_people_have_done_outlives_a_restart(tmp_path: Path) -> None:
    drive, alarm = "n1/fu1", alarm_of("n1/fu1")
    async with serving(settings(), tmp_path, plant_of_many()) as served, followed(served) as follower:
        tell(served[1], fault(drive))
        raised = await follower.until(of(drive), is_active)
        await follower.call(alarm, "Acknowledge", *event_and("kommt vom Encoder", raised))
        await follower.call(alarm, "TimedShelve", ua.Variant(3_600_000.0, ua.VariantType.Double))
    async with serving(settings(), tmp_path, plant_of_many()) as served, followed(served) as follower:
        assert await follower.refresh() == Codes.Good
        kept = await follower.until(of(drive))
        assert (kept["AckedState/Id"], kept["ConfirmedState/Id"]) == (True, False)
        assert (kept["Comment"].Text, kept["ClientUserId"]) == ("kommt vom Encoder", "anna")
        assert kept["ShelvingState/CurrentState/Id"] == ua.NodeId(Ids.ShelvedStateMachineType_TimedShelved)
        tell(served[1], fault(drive))
        await asyncio.sleep(0.2)
        assert all(event["AckedState/Id"] for event in follower.events if of(drive)(event))
        tell(served[1], fault(drive, since=2000))
        again = await follower.until(of(drive), lambda event: event["AckedState/Id"] is False)
        assert await follower.call(alarm, "Acknowledge", *event_and("", raised)) == Codes.BadEventIdUnknown
        assert await follower.call(alarm, "Acknowledge", *event_and("", again)) == Codes.Good
