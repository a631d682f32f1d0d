"""Requests that no honest client sends: each is answered, and none of them costs anybody else anything."""

from __future__ import annotations

import asyncio
import math
import tempfile
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager, suppress
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

import msgspec
import pytest
import pytest_asyncio
from asyncua import Client, ua
from asyncua.ua.ua_binary import struct_from_binary, struct_to_binary

from bridge.base.errors import OperationFailed
from bridge.mirror import MirrorClient, MirrorPublisher, socket_endpoint
from bridge.northbound.opcua import failed_logins
from bridge.northbound.opcua.server import OpcUaServer
from bridge.uaserver.services import REFUSED
from bridge.uaserver.session import Session
from tests.support.opcua_client import node, write_value
from tests.support.opcua_hostile import (
    DOUBLES,
    HOSTILE,
    NOT_UTF8,
    UNDECODABLE,
    requests,
    with_each,
    without_arrays,
)
from tests.support.opcua_site import (
    OPEN,
    LocalView,
    break_off,
    connected,
    make_plant,
    namespace,
    serving,
    status_of,
)
from tests.support.quiet import quiet_log
from tests.support.views import view_of
from tests.support.zenoh_peer import until

pytestmark = pytest.mark.asyncio(loop_scope="module")
Codes = ua.StatusCodes
LOAD = "bus/can0/load"
Served = tuple[OpcUaServer, LocalView]

NOT_DECODED = (
    Codes.BadDecodingError,
    # Refused before anybody looks at what they say.
    *REFUSED.values(),
    Codes.BadTooManySessions,
    Codes.BadUserAccessDenied,
)


class Seen:
    def __init__(self) -> None:
        self.values: list[object] = []
        self.events: list[str] = []

    def datachange_notification(self, node: object, value: object, data: object) -> None:
        self.values.append(value)

    def event_notification(self, event: Any) -> None:
        self.events.append(event.Message.Text)


async def sent(client: Client, request: Any) -> int:
    """The status code of a request; 0 for a good one."""
    try:
        await client.uaclient.protocol.send_request(request)
    except ua.UaStatusCodeError as error:
        return status_of(error)
    return Codes.Good


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def bystander(served: Served) -> AsyncIterator[Seen]:
    """A client that goes on being told of values and events."""
    seen = Seen()
    async with connected(served[0]) as client:
        subscription = await client.create_subscription(50, seen)
        await subscription.subscribe_data_change(await node(client, LOAD))
        kind = client.get_node(ua.NodeId("DriveEventType", await namespace(client)))
        await subscription.subscribe_events(client.nodes.server, kind)
        yield seen


async def assert_unharmed(served: Served, bystander: Seen) -> None:
    _, view = served
    value = float(time.monotonic())
    view.plant.set(LOAD, value, time.monotonic())
    await until(lambda: value in bystander.values, "the value at the bystander")
    for rejection in view.rejections:
        assert len(msgspec.msgpack.encode(rejection)) < 2_000, "what the bus process is told"


WITH_STRINGS = [kind for kind in requests() if next(with_each(kind, ""), None)]


WITH_DOUBLES = [kind for kind in requests() if next(with_each(kind, math.nan), None)]


@asynccontextmanager
async def come_far_enough_for(kind: type, served: Served) -> AsyncIterator[Client]:
    """A client that may ask for this service."""
    client = Client(served[0].endpoint_url, timeout=10)
    await client.connect_socket()
    try:
        await client.send_hello()
        await client.open_secure_channel()
        if kind is not ua.CreateSessionRequest:
            await client.create_session()
        if kind not in (ua.CreateSessionRequest, ua.ActivateSessionRequest):
            await client.activate_session()
        yield client
    finally:
        break_off(client)


def doubles_in(answer: Any) -> Iterator[float]:
    if isinstance(answer, float):
        yield answer
    elif isinstance(answer, list):
        for one in answer:
            yield from doubles_in(one)
    elif is_dataclass(answer):
        for field in fields(answer):
            yield from doubles_in(getattr(answer, field.name))


@pytest.mark.landing
@pytest.mark.parametrize("kind", WITH_DOUBLES, ids=lambda kind: kind.__name__)
@pytest.mark.parametrize("hostile", DOUBLES)
async def test_every_double_of_every_service(
    served: Served, bystander: Seen, kind: type, hostile: float
) -> None:
    """NaN passes every `min` and `max`, and no clock ever reaches it."""
    for request in with_each(kind, hostile):
        async with come_far_enough_for(kind, served) as client:
            if getattr(getattr(request, "Parameters", None), "SubscriptionId", None):
                # Not with the client's own method, which goes on to publish when the connection has ended.
                answer = await client.uaclient.protocol.send_request(ua.CreateSubscriptionRequest())
                made = struct_from_binary(ua.CreateSubscriptionResponse, answer).Parameters
                request.Parameters.SubscriptionId = made.SubscriptionId
            try:
                answer = await client.uaclient.protocol.send_request(request)
                told = list(doubles_in(struct_from_binary(type_of_answer(kind), answer)))
                assert all(0 <= one <= 3_600_000 for one in told), (request, told)
            except ua.UaStatusCodeError as error:
                assert status_of(error) != Codes.BadInternalError, request
            loop: Any = asyncio.get_running_loop()
            assert all(math.isfinite(timer.when()) for timer in loop._scheduled), request
    await assert_unharmed(served, bystander)


def type_of_answer(kind: type) -> type:
    return getattr(ua, kind.__name__.replace("Request", "Response"))


@pytest.mark.landing(8)
@pytest.mark.parametrize("kind", WITH_STRINGS, ids=lambda kind: kind.__name__)
async def test_every_string_of_every_service(
    served: Served, bystander: Seen, kind: type, monkeypatch: pytest.MonkeyPatch
) -> None:
    # Most of these logins fail, and the answers to so many would come later and later.
    monkeypatch.setattr(failed_logins, "_LONGEST_S", 0.0)
    async with come_far_enough_for(kind, served) as client:
        for hostile, words in HOSTILE.items():
            for request in with_each(kind, words):
                code = await sent(client, request)
                if hostile in UNDECODABLE:
                    assert code in NOT_DECODED, (hostile, request)
                assert code != Codes.BadInternalError, (hostile, request)
            # The connection and its session are not the worse for it.
            await client.uaclient.get_endpoints(ua.GetEndpointsParameters())
    await assert_unharmed(served, bystander)


@pytest.mark.landing(8)
@pytest.mark.parametrize("kind", requests(), ids=lambda kind: kind.__name__)
async def test_null_arrays_are_empty_ones(
    served: Served, bystander: Seen, kind: type, caplog: pytest.LogCaptureFixture
) -> None:
    async with connected(served[0]) as client:
        if kind not in (ua.OpenSecureChannelRequest, ua.CloseSecureChannelRequest, ua.PublishRequest):
            code = await sent(client, without_arrays(kind()))
            assert code != Codes.BadInternalError
        await client.uaclient.get_endpoints(ua.GetEndpointsParameters())
    assert not [record for record in caplog.records if "requests that failed" in record.getMessage()]


@pytest.mark.parametrize("hostile", HOSTILE)
async def test_the_strings_of_a_requests_header(served: Served, bystander: Seen, hostile: str) -> None:
    async with connected(served[0]) as client:
        request = ua.ReadRequest()
        request.RequestHeader.AuditEntryId = HOSTILE[hostile]
        code = await sent(client, request)
        assert code == (Codes.BadDecodingError if hostile in UNDECODABLE else Codes.BadNothingToDo)
        await client.nodes.server_state.read_value()
    await assert_unharmed(served, bystander)


ENDLESS = {
    "nothing, two billion times": b"\x80" + (2**31 - 1).to_bytes(4, "little"),
    "strings that go backwards": b"\x8c" + (2**31 - 1).to_bytes(4, "little") + b"\xfc\xff\xff\xff" * 8,
    "dimensions of nothing": b"\xc6" + bytes(4) + (2).to_bytes(4, "little") + b"\x0f\x27\0\0\x63\0\0\0",
    "a million dimensions": b"\xc6" + bytes(4) + (10**6).to_bytes(4, "little") + b"\xff\xff\xff\x7f" * 10**6,
    "a thousand variants deep": b"\x18" * 5_000,
    "a hundred thousand and one": b"\x98" + (100_001).to_bytes(4, "little") + b"\0" * 100_001,
}


@pytest.mark.parametrize("variant", ENDLESS)
@pytest.mark.parametrize("place", ["value", "header"])
async def test_no_variant_holds_the_server(served: Served, bystander: Seen, variant: str, place: str) -> None:
    """A few bytes that say they are many: asyncua would take the memory of the whole machine."""
    async with connected(served[0]) as client:
        request = ua.WriteRequest()
        where = await node(client, "conveyor/fu1/command/control_word")
        request.Parameters.NodesToWrite = [write_value(where.nodeid, ua.Variant(7777, ua.VariantType.UInt16))]
        if place == "header":
            extra = ua.LiteralOperand(Value=ua.Variant(7777, ua.VariantType.UInt16))
            request.RequestHeader.AdditionalHeader = extra
        began = time.monotonic()
        with suppress(ConnectionError, asyncio.TimeoutError):
            code = await sent_raw(client, request, ENDLESS[variant])
            assert code in (Codes.BadDecodingError, Codes.BadEncodingLimitsExceeded)
        assert time.monotonic() - began < 3
    await assert_unharmed(served, bystander)


def with_many(kind: type, count: int) -> Any:
    """A request of this kind with an array of so many elements."""
    request = kind()
    if kind is ua.GetEndpointsRequest:
        request.Parameters.ProfileUris = [""] * count
    elif kind is ua.FindServersRequest:
        request.Parameters.LocaleIds = [""] * count
    elif kind is ua.CreateSessionRequest:
        request.Parameters.ClientDescription.DiscoveryUrls = [""] * count
    else:
        request.Parameters.ClientSoftwareCertificates = [ua.SignedSoftwareCertificate()] * count
    return request


@pytest.mark.parametrize(
    "kind",
    [ua.GetEndpointsRequest, ua.FindServersRequest, ua.CreateSessionRequest, ua.ActivateSessionRequest],
    ids=lambda kind: kind.__name__,
)
async def test_before_a_session_little_is_decoded(served: Served, bystander: Seen, kind: type) -> None:
    """A message that is decoded holds up everybody, and who sends these may be anybody."""
    client = Client(served[0].endpoint_url, timeout=10)
    await client.connect_socket()
    try:
        await client.send_hello()
        await client.open_secure_channel()
        if kind is ua.ActivateSessionRequest:
            await client.create_session()
        assert await sent(client, with_many(kind, 1_001)) == Codes.BadEncodingLimitsExceeded
        assert await sent(client, with_many(kind, 300)) != Codes.BadEncodingLimitsExceeded
    finally:
        break_off(client)
    await assert_unharmed(served, bystander)


async def test_requests_that_come_together_leave_others_their_turn(
    served: Served, monkeypatch: pytest.MonkeyPatch
) -> None:
    turn = 0
    turns: list[int] = []
    seen = Session.seen

    async def count_turns() -> None:
        nonlocal turn
        while True:
            turn += 1
            await asyncio.sleep(0)

    def noted(
        self: Session, where: ua.NodeId, attribute: ua.AttributeIds, value: ua.DataValue
    ) -> ua.DataValue:
        turns.append(turn)
        return seen(self, where, attribute, value)

    async with connected(served[0]) as client:
        monkeypatch.setattr(Session, "seen", noted)
        counting = asyncio.create_task(count_turns())
        await asyncio.gather(*(client.nodes.server_state.read_value() for _ in range(30)))
        counting.cancel()
    assert len(set(turns)) >= 30


async def sent_raw(client: Client, request: Any, variant: bytes) -> int:
    """As ``sent``, with ``variant`` where the request has the number 7777."""
    protocol: Any = client.uaclient.protocol
    encode = struct_to_binary

    def altered(message: Any) -> bytes:
        content = encode(message)
        if message is not request:
            return content
        honest = b"\x05" + (7777).to_bytes(2, "little")
        assert honest in content
        at = content.index(honest)
        body = content[:at] + variant + content[at + len(honest) :]
        if isinstance(message.RequestHeader.AdditionalHeader, ua.LiteralOperand):
            length = at - 4
            grown = int.from_bytes(content[length:at], "little") + len(variant) - len(honest)
            body = body[:length] + grown.to_bytes(4, "little") + body[at:]
        return body

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("asyncua.client.ua_client.struct_to_binary", altered)
        answer = asyncio.ensure_future(protocol.send_request(request, 3))
        await asyncio.sleep(0)
        try:
            await answer
        except ua.UaStatusCodeError as error:
            return status_of(error)
    return Codes.Good


async def test_an_event_filter_that_cannot_be_used_ends_nobodys_notifications(
    served: Served, bystander: Seen
) -> None:
    nameless = ua.SimpleAttributeOperand(
        TypeDefinitionId=ua.NodeId(ua.ObjectIds.BaseEventType),
        BrowsePath=[ua.QualifiedName(None, 0)],
        AttributeId=ua.AttributeIds.Value,
    )
    async with connected(served[0]) as client:
        subscription = await client.create_subscription(50, Seen())
        item = ua.MonitoredItemCreateRequest(
            ItemToMonitor=ua.ReadValueId(
                NodeId=ua.NodeId(ua.ObjectIds.Server), AttributeId=ua.AttributeIds.EventNotifier
            ),
            MonitoringMode=ua.MonitoringMode.Reporting,
            RequestedParameters=ua.MonitoringParameters(
                ClientHandle=1, QueueSize=10, Filter=ua.EventFilter(SelectClauses=[nameless])
            ),
        )
        with suppress(ua.UaError):
            await subscription.create_monitored_items([item])
        before = len(bystander.events)
        assert await sent(client, bad_write(7)) == Codes.Good
        await until(lambda: len(bystander.events) > before, "the event at the bystander")
        await assert_unharmed(served, bystander)


def bad_write(number: int) -> ua.WriteRequest:
    value = ua.Variant(number, ua.VariantType.UInt16)
    request = ua.WriteRequest()
    request.Parameters.NodesToWrite = [write_value(ua.NodeId(f"attic/{number}", 2), value)]
    return request


async def test_a_stream_of_malformed_requests_costs_one_line(served: Served) -> None:
    (write, *_) = with_each(ua.WriteRequest, NOT_UTF8)
    with quiet_log() as log:
        async with connected(served[0]) as client:
            for _ in range(200):
                assert await sent(client, write) == Codes.BadDecodingError
    # asyncua's client, which is in this process, has two lines of its own.
    own = ("ServiceFault", "Requested session timeout")
    lines = [line for line in log.lines if not line.startswith(own)]
    assert len(lines) == 1, lines
    assert "malformed messages from 127.0.0.1" in lines[0]


@pytest.mark.landing
async def test_a_front_that_tells_of_no_change_any_more_is_started_anew(tmp_path: Path) -> None:
    async with serving(OPEN, tmp_path) as (server, _):
        failed = asyncio.create_task(server.failed())
        await asyncio.sleep(0.1)
        assert not failed.done()
        for task in asyncio.all_tasks():
            if task.get_name() == "opcua publisher" and task is vars(server)["_publisher"]:
                task.cancel()
        with pytest.raises(OperationFailed, match="no change any more"):
            await asyncio.wait_for(failed, 3)


async def test_what_a_front_refuses_does_not_end_it() -> None:
    """The whole way: client, front, and the link on which the bus process is told of refusals."""
    plant = make_plant()
    with tempfile.TemporaryDirectory(prefix="db-") as folder:
        endpoint = socket_endpoint(Path(folder) / "run", "demo")
        publisher = MirrorPublisher(view_of(plant), endpoint, time.monotonic)
        await publisher.start()
        mirror = MirrorClient(endpoint)
        await mirror.open()
        running = asyncio.create_task(mirror.run())
        server = OpcUaServer(mirror, OPEN, Path(folder), "hall")
        await server.start()
        try:
            async with connected(server) as client:
                for kind in (ua.WriteRequest, ua.CallRequest):
                    for hostile in HOSTILE.values():
                        for request in with_each(kind, hostile):
                            await sent(client, request)
                await asyncio.sleep(0.3)
                assert not running.done()
                await client.nodes.server_state.read_value()
        finally:
            await server.close()
            running.cancel()
            await asyncio.gather(running, return_exceptions=True)
            await mirror.close()
            await publisher.close()
