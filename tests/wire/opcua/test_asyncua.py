"""What we override and use of asyncua's inside: with another version each of it must still be there, and be
reached, because the server's safety hangs on it."""

from __future__ import annotations

import ast
import importlib
import inspect
import pkgutil
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from asyncua import Client, ua
from asyncua.common import utils
from asyncua.server.internal_server import InternalServer
from asyncua.ua import ua_binary

from bridge import uaserver
from bridge.northbound import opcua
from bridge.uaserver import decoding
from tests.support.opcua_client import call, node, word, write
from tests.support.opcua_raw import ask
from tests.support.opcua_site import OPEN, break_off, connected, serving

OVERRIDDEN = {
    "BoundServer": {"start", "stop"},
    "SecureChannel": {"open", "select_policy"},
    "TcpAcceptor": {"_make_protocol", "start", "stop"},
    "Processor": {
        "_process_message",
        "_session_watchdog_loop",
        "_should_close_session_on_transport_loss",
        "close",
        "open_secure_channel",
        "process",
        "process_message",
        "send_response",
    },
    "InnerServer": {"_mangle_endpoint_url", "create_session", "find_servers", "get_endpoints", "stop"},
    "Session": {"_timeout_loop", "activate_session", "close_session", "create_session"},
    "_UaProtocol": {"_process_one_msg", "connection_lost", "connection_made", "data_received"},
}
"""A name that asyncua no longer has would be no override any more, and nobody would call it."""

BY_OURSELVES = {
    "BoundServer.start",
    "BoundServer.stop",
    "TcpAcceptor.start",
    "Processor._process_message",
    "InnerServer.stop",
    # by asyncio
    "TcpAcceptor._make_protocol",
    "_UaProtocol.connection_lost",
    "_UaProtocol.connection_made",
    "_UaProtocol.data_received",
}
"""What asyncua does not call itself; it is enough that it is called."""

SETTINGS = (
    "allow_remote_admin",
    "aspace",
    "max_connections",
    "max_pending_activation_seconds",
    "max_session_timeout_ms",
    "subscription_service",
    "time_task",
    "user_manager",
)


def modules() -> Iterator[Any]:
    for package in (uaserver, opcua):
        for found in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            yield importlib.import_module(found.name)


def ours() -> dict[str, type]:
    """Our classes that are made from one of asyncua's."""
    return {
        name: kind
        for module in modules()
        for name, kind in inspect.getmembers(module, inspect.isclass)
        if kind.__module__ == module.__name__
        and any(base.__module__.startswith("asyncua.") for base in kind.__mro__)
    }


def overridden(kind: type) -> set[str]:
    bases = [base for base in kind.__mro__ if base.__module__.startswith("asyncua.")]
    return {
        name
        for name, held in vars(kind).items()
        if inspect.isfunction(held)
        and not name.startswith("__")
        and any(name in vars(base) for base in bases)
    }


def test_each_overridden_name_is_one_of_asyncuas() -> None:
    assert {name: names for name, kind in ours().items() if (names := overridden(kind))} == OVERRIDDEN


def test_each_setting_is_one_of_asyncuas() -> None:
    plain = InternalServer()
    assert [name for name in SETTINGS if not hasattr(plain, name)] == []


def private_names() -> set[str]:
    """Names with an underscore that our modules use but nobody of us defines."""
    used: set[str] = set()
    defined: set[str] = set()
    for path in (file for package in (uaserver, opcua) for file in Path(package.__path__[0]).rglob("*.py")):
        for part in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(part, ast.Attribute) and part.attr.startswith("_") and not part.attr.endswith("__"):
                used.add(part.attr)
            if isinstance(part, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                defined.add(part.name)
            if isinstance(part, ast.ClassDef):
                defined |= set(fields_of(part))
    return used - defined


def fields_of(kind: ast.ClassDef) -> Iterator[str]:
    """What the class declares, and what its ``__init__`` sets."""
    for part in kind.body:
        if isinstance(part, ast.AnnAssign) and isinstance(part.target, ast.Name):
            yield part.target.id
        if isinstance(part, ast.FunctionDef) and part.name == "__init__":
            for inner in ast.walk(part):
                if isinstance(inner, ast.Attribute) and isinstance(inner.ctx, ast.Store):
                    yield inner.attr


class Reached:
    """Wraps each override; ``by_asyncua`` and ``by_anyone`` say which were called."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.by_asyncua: set[str] = set()
        self.by_anyone: set[str] = set()
        for name, kind in ours().items():
            for method in overridden(kind):
                patch.setattr(kind, method, self._noting(f"{name}.{method}", vars(kind)[method]))

    def _noting(self, name: str, method: Callable[..., Any]) -> Callable[..., Any]:
        def noted(*arguments: Any, **named: Any) -> Any:
            self.by_anyone.add(name)
            if sys._getframe(1).f_globals["__name__"].startswith("asyncua."):  # pyright: ignore[reportPrivateUsage]
                self.by_asyncua.add(name)
            return method(*arguments, **named)

        return noted


async def test_each_override_is_reached(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    reached = Reached(monkeypatch)
    async with serving(OPEN, tmp_path) as (server, view):
        async with connected(server) as client:
            await walk(client)
            await client.find_servers()
            view.plant.set("bus/can0/load", 12.5, 1.0)
            first = await client.create_subscription(50, Listens())
            await first.subscribe_data_change(await node(client, "bus/can0/load"))
        await move(server.endpoint_url)
    everything = {f"{name}.{method}" for name, kind in ours().items() for method in overridden(kind)}
    assert everything - reached.by_anyone == set()
    assert everything - reached.by_asyncua <= BY_OURSELVES


class Listens:
    def datachange_notification(self, node: object, value: object, data: object) -> None:
        pass


async def walk(client: Client) -> None:
    """Each service that we have a hand in."""
    await client.nodes.objects.get_child("0:Server")
    await ask(client, "BrowseNext", ContinuationPoints=[b"none"])
    await ask(client, "RegisterNodes", NodesToRegister=[client.nodes.objects.nodeid])
    await ask(client, "UnregisterNodes", NodesToUnregister=[client.nodes.objects.nodeid])
    await client.nodes.objects.get_children()
    await write(client, control_word=word(0x047E))
    await call(client, "conveyor/fu1", "conveyor/fu1/Stop", [])
    subscription = await client.create_subscription(50, Listens())
    number = subscription.subscription_id
    load = await node(client, "bus/can0/load")
    item = await subscription.subscribe_data_change(load)
    service = client.uaclient
    await service.modify_monitored_items(
        ua.ModifyMonitoredItemsParameters(
            SubscriptionId=number,
            ItemsToModify=[ua.MonitoredItemModifyRequest(MonitoredItemId=item)],
        )
    )
    await subscription.set_monitoring_mode(ua.MonitoringMode.Reporting)
    await subscription.set_publishing_mode(True)
    for request in (
        ua.ModifySubscriptionRequest(
            Parameters=ua.ModifySubscriptionParameters(SubscriptionId=number, RequestedPublishingInterval=50)
        ),
        ua.RepublishRequest(Parameters=ua.RepublishParameters(number, 4711)),
        ua.TransferSubscriptionsRequest(Parameters=ua.TransferSubscriptionsParameters([number], False)),
    ):
        # Whether it is granted is another matter.
        try:
            await service.protocol.send_request(request)
        except ua.UaStatusCodeError:
            continue
    await subscription.unsubscribe(item)
    await subscription.delete()


async def move(url: str) -> None:
    """A session that is activated on another connection and does not end with the first one."""
    first, second = Client(url, timeout=5), Client(url, timeout=5)
    await first.connect()
    await second.connect_socket()
    try:
        await second.send_hello()
        await second.open_secure_channel()
        second.uaclient.protocol.authentication_token = first.uaclient.protocol.authentication_token
        await second.uaclient.activate_session(ua.ActivateSessionParameters())
        break_off(first)
        for _ in range(3):
            await second.nodes.server_state.read_value()
    finally:
        break_off(second)


@pytest.mark.landing
async def test_each_private_name_is_there(tmp_path: Path) -> None:
    async with serving(OPEN, tmp_path) as (server, _), connected(server) as client:
        await (await client.create_subscription(500, Listens())).subscribe_data_change(
            client.nodes.server_state
        )
        outer: Any = vars(server)["_server"]
        inner, protocol = outer.iserver, outer.bserver.clients[0]
        processor = protocol.processor
        holders = [outer, inner, outer.bserver, protocol, processor, processor.session]
        holders += [processor._connection, ua_binary, ua_binary._String, utils.Buffer(b"")]
        missing = {name for name in private_names() if not any(hasattr(one, name) for one in holders)}
    assert missing == set()


def test_the_decoder_stays_strict() -> None:
    """In this process a server was started."""
    decoding.install()
    for name in ("_String", "_reshape", "_create_list_deserializer", "_create_uatype_array_deserializer"):
        assert hasattr(ua_binary, name)
    for content in (b"\x02\0\0\0\xff\xfe", b"\xfe\xff\xff\xff"):
        with pytest.raises((UnicodeDecodeError, utils.NotEnoughData)):
            ua_binary.from_binary(ua.String, utils.Buffer(content))
