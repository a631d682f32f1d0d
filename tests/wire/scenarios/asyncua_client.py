"""asyncua's client as the scenarios use it, down to the status code of each request.

Whatever is refused is the name of its code, so that a step can say what it expects.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import Any

from asyncua import Client, Node, ua
from asyncua.crypto import security_policies
from asyncua.crypto.uacrypto import CertProperties
from asyncua.ua.status_codes import get_name_and_doc
from asyncua.ua.ua_binary import struct_from_binary

from tests.support.certificates import CLIENT_URI
from tests.support.scenario_plant import PASSWORD
from tests.wire.scenarios.steps import Steps

POINTS = "urn:drivebridge:points"
POLICY = security_policies.SecurityPolicyAes256Sha256RsaPss
Kind, Ids, Attribute = ua.VariantType, ua.ObjectIds, ua.AttributeIds


def code_of(status: ua.StatusCode | int) -> str:
    return get_name_and_doc(status if isinstance(status, int) else status.value)[0]


async def outcome(work: Any) -> str:
    """Good, or the code with which it is refused."""
    try:
        await work
    except ua.UaStatusCodeError as error:
        return code_of(error.code)
    return "Good"


async def until(fits: Callable[[], bool], seconds: float) -> None:
    """Wait until it fits, without an error where it never does."""
    for _ in range(int(seconds / 0.02)):
        if fits():
            return
        await asyncio.sleep(0.02)


async def prepared(steps: Steps, certificate: str, locale: str = "en") -> Client:
    """A client with a certificate of the folder, as an encrypted channel needs it."""
    client = Client(steps.url, timeout=10, watchdog_intervall=10)
    client.application_uri = CLIENT_URI
    files = [steps.folder / "shown" / f"{certificate}.{end}" for end in ("der", "pem")]
    shown, key = (CertProperties(file.read_bytes(), file.suffix[1:]) for file in files)
    await client.set_security(POLICY, shown, key)
    client.set_locale([locale])
    return client


@asynccontextmanager
async def logged_in(
    steps: Steps,
    user: str,
    *,
    password: str = PASSWORD,
    certificate: str = "trusted",
    locale: str = "en",
) -> AsyncIterator[Client]:
    """A session of ``user``, or of nobody."""
    client = await prepared(steps, certificate, locale)
    if user:
        client.set_user(user)
        client.set_password(password)
    async with client:
        yield client


@asynccontextmanager
async def by_certificate(steps: Steps, person: str) -> AsyncIterator[Client]:
    client = await prepared(steps, "trusted")
    await client.load_client_certificate((steps.folder / f"{person}.der").read_bytes(), "der")
    await client.load_private_key((steps.folder / f"{person}.pem").read_bytes(), extension="pem")
    async with client:
        yield client


class Session:
    """A client's requests by the names of points, with their codes."""

    def __init__(self, client: Client, space: int) -> None:
        self.client = client
        self.space = space

    @classmethod
    async def of(cls, client: Client) -> Session:
        return cls(client, await client.get_namespace_index(POINTS))

    def id(self, name: str) -> ua.NodeId:
        return ua.NodeId(name, self.space)

    def node(self, name: str) -> Node:
        return self.client.get_node(self.id(name))

    async def value(self, where: str | ua.NodeId, attribute: int = Attribute.Value) -> Any:
        """The value, or the code that it has instead."""
        node = self.client.get_node(where) if isinstance(where, ua.NodeId) else self.node(where)
        data = await node.read_attribute(attribute, raise_on_bad_status=False)
        return data.Value.Value if data.StatusCode.is_good() else code_of(data.StatusCode)

    async def write(self, name: str, value: object, kind: ua.VariantType = Kind.UInt16) -> str:
        data = ua.DataValue(ua.Variant(value, kind))
        wanted = ua.WriteValue(NodeId=self.id(name), AttributeId=Attribute.Value, Value=data)
        (code,) = await self.client.uaclient.write(ua.WriteParameters(NodesToWrite=[wanted]))
        return code_of(code)

    async def call(self, where: str | ua.NodeId, method: str | int, *given: ua.Variant) -> list[Any]:
        """Code and what the method gives; ``method`` is a name in ``where``, or a number in namespace 0."""
        owner = where if isinstance(where, ua.NodeId) else self.id(where)
        named = ua.NodeId(method) if isinstance(method, int) else self.id(f"{where}/{method}")
        request = ua.CallMethodRequest(ObjectId=owner, MethodId=named, InputArguments=list(given))
        (result,) = await self.client.uaclient.call([request])
        return [code_of(result.StatusCode), *(one.Value for one in result.OutputArguments or [])]

    async def ask(self, service: str, **params: object) -> Any:
        """A service as it is on the wire. Raises ``UaStatusCodeError``."""
        request = getattr(ua, f"{service}Request")()
        for name, value in params.items():
            setattr(request.Parameters, name, value)
        data = await self.client.uaclient.protocol.send_request(request)
        return struct_from_binary(getattr(ua, f"{service}Response"), data)

    async def until(self, name: str, fits: Callable[[Any], bool], seconds: float = 10) -> Any:
        """The value once it fits; else the last one."""
        value = None
        for _ in range(int(seconds / 0.05)):
            if fits(value := await self.value(name)):
                break
            await asyncio.sleep(0.05)
        return value


def text(value: str, locale: str) -> ua.Variant:
    return ua.Variant(ua.LocalizedText(value, locale), Kind.LocalizedText)


def string(value: str) -> ua.Variant:
    return ua.Variant(value, Kind.String)
