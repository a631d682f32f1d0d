"""Recorder of the messages of asyncua and node-opcua."""

from __future__ import annotations

import asyncio
import contextlib
import struct
import subprocess
from collections.abc import Sequence
from dataclasses import fields
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Final, get_args

from asyncua import Client, ua
from asyncua.common.utils import Buffer
from asyncua.ua.ua_binary import get_safe_type_hints, struct_from_binary

from tests.fuzz.case import Case, Recorded, save
from tests.fuzz.recorder.opcua_requests import requests
from tests.fuzz.recorder.proxy import Link, Proxy, recording
from tests.fuzz.rig import Rig
from tests.fuzz.targets.opcua_channel import HEAD, SESSION, SUBSCRIPTION, type_name
from tests.support.process import REPOSITORY

_MOST_OF_A_KIND: Final = 6
_HEADER: Final = 4 + 39 + 8 + 4
"""Type, session token, time and handle."""
_NODE_CLIENT: Final = REPOSITORY / "tests" / "wire" / "node" / "client.mjs"
_FU4: Final = "conveyor/fu4"
_ENDING: Final = ("CloseSessionRequest", "CloseSecureChannelRequest", "OpenSecureChannelRequest")


def record(rig: Rig) -> list[Path]:
    with recording(rig.opcua) as proxy:
        asyncio.run(_walk(proxy.port))
        by_asyncua = _noted(proxy)
    with recording(rig.opcua) as proxy:
        command = ["node", str(_NODE_CLIENT), f"opc.tcp://127.0.0.1:{proxy.port}"]
        subprocess.run(command, check=True, timeout=60, capture_output=True)
        by_node = _noted(proxy)
    with recording(rig.opcua) as proxy:
        scada = asyncio.run(_scada(proxy))
    return [
        save("opcua", "asyncua-scada", "what SCADA systems and an authority's tools ask", scada),
        save("opcua", "asyncua", "a walk through all services that a client may call", by_asyncua),
        save("opcua", "node-opcua", "tests/wire/node/client.mjs", by_node),
    ]


def _noted(proxy: Proxy) -> list[Recorded]:
    recorded: list[Recorded] = []
    counts: dict[str, int] = {}
    for link in proxy.links:
        known = _known(link)
        for message in _messages(link.sent):
            what, case = _case(message, known)
            counts[what] = counts.get(what, 0) + 1
            if counts[what] <= _MOST_OF_A_KIND and all(case != one.case for one in recorded):
                recorded.append(Recorded(what, case))
    return recorded


def _messages(stream: bytes) -> list[bytes]:
    found: list[bytes] = []
    while len(stream) >= 8:
        end = int.from_bytes(stream[4:8], "little")
        found.append(stream[:end])
        stream = stream[end:]
    return found


def _case(message: bytes, known: dict[bytes, bytes]) -> tuple[str, Case]:
    if message[:3] != b"MSG":
        return message[:3].decode(), Case("raw", (message,))
    body = message[HEAD.size :]
    # A subscription's id is a small number, which stands in the header of a request for something else.
    for value, marker in known.items():
        begin = 0 if marker == SESSION else _HEADER
        body = body[:begin] + body[begin:].replace(value, marker)
    return type_name(body) or "an unknown message", Case("service", (body,))


def _known(link: Link) -> dict[bytes, bytes]:
    """Bytes that the server has given in this connection, and the markers for them."""
    known: dict[bytes, bytes] = {}
    for message in _messages(link.received):
        body = message[HEAD.size :]
        if message[:3] != b"MSG":
            continue
        if type_name(body) == "CreateSessionResponse":
            session = struct_from_binary(ua.CreateSessionResponse, Buffer(body))
            known[bytes(session.Parameters.AuthenticationToken.Identifier)] = SESSION
        elif type_name(body) == "CreateSubscriptionResponse":
            made = struct_from_binary(ua.CreateSubscriptionResponse, Buffer(body))
            known[struct.pack("<I", made.Parameters.SubscriptionId)] = SUBSCRIPTION
    return known


async def _scada(proxy: Proxy) -> list[Recorded]:
    """Each of the requests once."""
    recorded: list[Recorded] = []
    client = Client(f"opc.tcp://127.0.0.1:{proxy.port}", timeout=10)
    await client.connect()
    (link,) = proxy.links
    for what, request, kind in requests(await client.get_namespace_index("urn:drivebridge:points")):
        before = len(link.sent)
        await _try(client.uaclient.protocol.send_request(request))
        known = {token: marker for token, marker in _known(link).items() if marker == SESSION}
        for message in _messages(link.sent[before:]):
            name, case = _case(message, known)
            if name == type(request).__name__:
                recorded.append(Recorded(what, Case(kind, case.parts)))
    await client.disconnect()
    return recorded


# a walk


async def _walk(port: int) -> None:
    url = f"opc.tcp://127.0.0.1:{port}"
    await _try(Client(url, timeout=10).connect_and_get_server_endpoints())
    await _try(Client(url, timeout=10).connect_and_find_servers())
    client = Client(url, timeout=10)
    await client.connect()
    space = await client.get_namespace_index("urn:drivebridge:points")

    def node(name: str) -> ua.NodeId:
        return ua.NodeId(name, space)

    await _browse(client, node)
    await _read_and_write(client, node)
    await _call(client, node)
    await _subscribe(client, node)
    await _rare(client, node)
    await client.disconnect()


async def _try(work: Any) -> Any:
    """A refusal is an answer, too: what was sent counts."""
    with contextlib.suppress(ua.UaError, OSError, AttributeError, TypeError):
        return await work


async def _browse(client: Client, node: Any) -> None:
    drive = client.get_node(node(_FU4))
    await _try(drive.get_children())
    await _try(drive.get_references())
    await _try(client.nodes.objects.get_child([f"{node('').NamespaceIndex}:Drives"]))
    await _try(client.get_node(node(f"{_FU4}/actual/frequency")).get_properties())
    await _try(client.register_nodes([drive]))
    await _try(client.unregister_nodes([drive]))


async def _read_and_write(client: Client, node: Any) -> None:
    word = client.get_node(node(f"{_FU4}/command/control_word"))
    await _try(word.read_attributes([ua.AttributeIds(number) for number in range(1, 23)]))
    await _try(
        client.read_values(
            [client.get_node(node(f"{_FU4}/actual/{leaf}")) for leaf in ("frequency", "current")]
        )
    )
    values: Sequence[ua.Variant] = (
        ua.Variant(0x047E, ua.VariantType.UInt16),
        ua.Variant("run", ua.VariantType.String),
        ua.Variant([1, 2, 3], ua.VariantType.Int32),
        ua.Variant(1.5, ua.VariantType.Double),
        ua.Variant(ua.LocalizedText("run", "en"), ua.VariantType.LocalizedText),
        ua.Variant(b"run", ua.VariantType.ByteString),
    )
    for value in values:
        await _try(word.write_value(value))
    for leaf in ("command/frequency", "status/status_word", "parameter/p102"):
        await _try(client.get_node(node(f"{_FU4}/{leaf}")).write_value(25.0))
    await _try(client.get_node(node("no/such/point")).write_value("x"))
    await _try(word.write_attribute(ua.AttributeIds.DisplayName, ua.DataValue(ua.LocalizedText("x"))))


async def _call(client: Client, node: Any) -> None:
    for name, arguments in (
        ("TakeControl", [ua.Variant(3000, ua.VariantType.UInt32)]),
        ("KeepAlive", []),
        ("Start", [ua.Variant(1, ua.VariantType.Int32)]),
        ("Stop", []),
        ("ReadParameter", [ua.Variant("P102", ua.VariantType.String)]),
        ("WriteParameter", [ua.Variant("P102"), ua.Variant(1.0)]),
        ("SaveParameters", []),
        ("ResetFault", []),
        ("ReleaseControl", []),
        ("NoSuchMethod", [ua.Variant("x")]),
    ):
        await _try(client.get_node(node(_FU4)).call_method(node(f"{_FU4}/{name}"), *arguments))
    await _try(client.get_node(node("spare")).call_method(node("spare/ResetCommunication")))


class _Handler:
    def datachange_notification(self, *_: object) -> None: ...

    def event_notification(self, *_: object) -> None: ...

    def status_change_notification(self, *_: object) -> None: ...


async def _subscribe(client: Client, node: Any) -> None:
    subscription = await client.create_subscription(50, _Handler())
    points = [client.get_node(node(f"{_FU4}/actual/{leaf}")) for leaf in ("frequency", "current", "value_1")]
    items = await _try(subscription.subscribe_data_change(points))
    await _try(subscription.deadband_monitor(points[0], 0.5))
    await _try(subscription.subscribe_events())
    await asyncio.sleep(0.5)
    if items:
        await _try(subscription.modify_monitored_item(items[0], 100.0))
        await _try(subscription.set_monitoring_mode(ua.MonitoringMode.Sampling))
        await _try(subscription.set_publishing_mode(False))
        await _try(subscription.unsubscribe(items[1]))
    await _try(subscription.update(ua.ModifySubscriptionParameters(subscription.subscription_id, 100.0)))
    await _try(subscription.delete())


async def _rare(client: Client, node: Any) -> None:
    """Services that asyncua's client seldom calls, and all that there are with nothing in them."""
    point = node(f"{_FU4}/actual/frequency")
    history = client.get_node(point)
    await _try(history.read_raw_history(datetime(2026, 1, 1, tzinfo=UTC), numvalues=1))
    session = client.uaclient
    for name in sorted(dir(ua)):
        request = getattr(ua, name)
        if name.endswith("Request") and hasattr(request, "RequestHeader") and name not in _ENDING:
            await _try(session.protocol.send_request(_filled(request()), 1))


def _filled(request: Any) -> Any:
    """The request with one element in each list, and a text in its header."""
    request.RequestHeader.AuditEntryId = "audit"
    parameters = getattr(request, "Parameters", request)
    hints = get_safe_type_hints(type(parameters), {"ua": ua})
    for field in fields(parameters):
        inner = get_args(hints.get(field.name))
        if getattr(parameters, field.name) == [] and len(inner) == 1:
            with contextlib.suppress(TypeError):
                one = inner[0](1) if issubclass(inner[0], int) else inner[0]()
                setattr(parameters, field.name, [one])
    return request
