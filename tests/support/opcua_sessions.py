"""Sessions of an OPC UA server as its subscriptions see them: no server, no clock."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from asyncua import ua
from asyncua.common.utils import Buffer
from asyncua.ua.ua_binary import extensionobject_from_binary, extensionobject_to_binary

from bridge.uaserver.subscriptions.publishing import PublishQueue


@dataclass
class User:
    name: str
    has_rights: bool = True

    @property
    def rank(self) -> int:
        return int(self.has_rights)

    @property
    def is_anonymous(self) -> bool:
        return self.name == "anonymous"

    def is_same(self, other: object) -> bool:
        return self == other


@dataclass
class Session:
    session_id: ua.NodeId = field(default_factory=lambda: ua.NodeId(7))
    address: str = "10.0.0.1"
    locales: Sequence[str] = ()
    identity: User = field(default_factory=lambda: User("anna"))
    channel_certificate: bytes | None = None
    publishing: PublishQueue = field(default_factory=PublishQueue)
    is_gone: bool = False

    def looks_alike(self, where: ua.NodeId, attribute: ua.AttributeIds) -> bool:
        return True

    def seen(self, where: ua.NodeId, attribute: ua.AttributeIds, value: ua.DataValue) -> ua.DataValue:
        return value


def decoded_changes(data: ua.ExtensionObject) -> list[ua.MonitoredItemNotification]:
    """Changes of a DataChangeNotification as a client decodes them."""
    return extensionobject_from_binary(Buffer(extensionobject_to_binary(data))).MonitoredItems
