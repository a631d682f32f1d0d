"""Nodes of the diagnostics of sessions and subscriptions, described by their paths (OPC 10000-5 §6.3.4,
§6.3.5, §7.11 to §7.15). Their fields follow from the types of the standard's address space.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, Final, Protocol

from asyncua.server.address_space import AddressSpace

from bridge.uaserver.counts import ServerCounts
from bridge.uaserver.diagnostics.diagnostics import (
    DiagnosedSession,
    security_diagnostics,
    session_diagnostics,
    subscription_diagnostics,
)
from bridge.uaserver.hierarchy import related
from bridge.uaserver.library import AttributeIds, ObjectIds, get, node_id, ua
from bridge.uaserver.subscriptions.subscription import Subscription

NAMESPACE: Final = 1
"""That of the server's own application URI."""
_TOP: Final = "Diagnostics"
SUBSCRIPTION: Final = "Subscription"
SESSION: Final = "SessionDiagnostics"
SECURITY: Final = "SessionSecurityDiagnostics"
_ARRAY: Final = "SubscriptionDiagnosticsArray"
_Ids = ObjectIds
_Type = ua.VariantType

_SESSIONS: Final = _Ids.Server_ServerDiagnostics_SessionsDiagnosticsSummary
ALL_SESSIONS: Final = _Ids.Server_ServerDiagnostics_SessionsDiagnosticsSummary_SessionDiagnosticsArray
ALL_SECURITY: Final = _Ids.Server_ServerDiagnostics_SessionsDiagnosticsSummary_SessionSecurityDiagnosticsArray
ALL_SUBSCRIPTIONS: Final = _Ids.Server_ServerDiagnostics_SubscriptionDiagnosticsArray

_SIMPLE: Final = {
    _Ids.Duration: _Type.Double,
    _Ids.UtcTime: _Type.DateTime,
    _Ids.LocaleId: _Type.String,
    _Ids.MessageSecurityMode: _Type.Int32,
}
"""Built-in types of the simple data types that the fields have; all others are structures."""


class ShownSession(DiagnosedSession, Protocol):
    label: str
    """Name by which it is told from all others."""


class Sources(Protocol):
    """Server that there is something to tell of."""

    @property
    def counts(self) -> ServerCounts: ...

    @property
    def sessions(self) -> list[Any]:
        """Sessions, as ``ShownSession`` describes them."""
        ...

    @property
    def diagnosed_subscriptions(self) -> dict[int, Subscription]: ...


@dataclass(frozen=True, slots=True)
class Content:
    """Content of a variable: ``make`` makes it anew each time."""

    make: Callable[[], Any]
    data_type: ua.NodeId
    is_array: bool = False

    @property
    def kind(self) -> ua.VariantType:
        number = self.data_type.Identifier
        assert isinstance(number, int), "a type of the standard's"
        return (
            _Type(number)
            if number < _Type.ExtensionObject.value
            else _SIMPLE.get(number, _Type.ExtensionObject)
        )


@dataclass(frozen=True, slots=True)
class Shape:
    """A node: an object, or with ``content`` a variable. It is a component of ``parents``, and those of
    ``below`` are its own."""

    path: str
    type_id: int
    parents: tuple[ua.NodeId, ...]
    content: Content | None = None
    below: tuple[str, ...] = ()

    @property
    def nodeid(self) -> ua.NodeId:
        return node_id(f"{_TOP}/{self.path}", NAMESPACE)

    @property
    def browse_name(self) -> ua.QualifiedName:
        # The names of variables are the standard's, in the standard's namespace.
        return ua.QualifiedName(self.path.rpartition("/")[2], 0 if self.content else NAMESPACE)

    @property
    def node_class(self) -> ua.NodeClass:
        return ua.NodeClass.Variable if self.content else ua.NodeClass.Object


def path_of(where: ua.NodeId) -> str:
    """The path that a NodeId names; "" for one of other nodes."""
    name = where.Identifier
    if where.NamespaceIndex != NAMESPACE or not isinstance(name, str):
        return ""
    top, _, path = name.partition("/")
    return path if top == _TOP else ""


class Shapes:
    """Shapes by paths: ``<session>``, ``<session>/SessionDiagnostics/<field>``, ``Subscription/<number>``."""

    def __init__(self, space: AddressSpace, sources: Sources) -> None:
        self._space = space
        self._sources = sources
        self._fields = cache(self._fields_of)

    def of(self, path: str) -> Shape | None:
        owner, *rest = path.split("/")
        if owner == SUBSCRIPTION:
            found = self.subscription(rest[0]) if rest else None
            return self._subscription(found, rest[1:]) if found else None
        session = next((one for one in self._sources.sessions if one.label == owner), None)
        if session is None:
            return None
        if not rest:
            below = tuple(f"{owner}/{one}" for one in (SESSION, SECURITY, _ARRAY))
            type_id = _Ids.SessionDiagnosticsObjectType
            return Shape(owner, type_id, (node_id(_SESSIONS),), below=below)
        return self._of_session(session, *rest)

    def subscription(self, number: str) -> Subscription | None:
        is_number = number.isascii() and number.isdigit() and len(number) <= len(str(0xFFFF_FFFF))
        return self._sources.diagnosed_subscriptions.get(int(number)) if is_number else None

    def subscriptions_of(self, session: ShownSession) -> list[Subscription]:
        everything = self._sources.diagnosed_subscriptions.values()
        return [one for one in everything if one.session_id == session.session_id]

    def _of_session(self, session: ShownSession, part: str, *rest: str) -> Shape | None:
        path = f"{session.label}/{part}"
        above = node_id(f"{_TOP}/{session.label}", NAMESPACE)
        if part == SESSION:
            content = Content(
                lambda: session_diagnostics(session, self.subscriptions_of(session)),
                node_id(_Ids.SessionDiagnosticsDataType),
            )
            parents = above, node_id(ALL_SESSIONS)
            return self._structure(path, rest, _Ids.SessionDiagnosticsVariableType, parents, content)
        if part == SECURITY:
            content = Content(
                lambda: security_diagnostics(session), node_id(_Ids.SessionSecurityDiagnosticsDataType)
            )
            parents = above, node_id(ALL_SECURITY)
            return self._structure(path, rest, _Ids.SessionSecurityDiagnosticsType, parents, content)
        if part != _ARRAY or rest:
            return None
        content = Content(
            lambda: [subscription_diagnostics(one) for one in self.subscriptions_of(session)],
            node_id(_Ids.SubscriptionDiagnosticsDataType),
            is_array=True,
        )
        below = tuple(f"{SUBSCRIPTION}/{one.number}" for one in self.subscriptions_of(session))
        return Shape(path, _Ids.SubscriptionDiagnosticsArrayType, (above,), content, below)

    def _subscription(self, found: Subscription, rest: list[str]) -> Shape | None:
        content = Content(
            lambda: subscription_diagnostics(found), node_id(_Ids.SubscriptionDiagnosticsDataType)
        )
        path, parents = f"{SUBSCRIPTION}/{found.number}", (node_id(ALL_SUBSCRIPTIONS),)
        return self._structure(path, rest, _Ids.SubscriptionDiagnosticsType, parents, content)

    def _structure(
        self,
        path: str,
        rest: list[str] | tuple[str, ...],
        type_id: int,
        parents: tuple[ua.NodeId, ...],
        content: Content,
    ) -> Shape | None:
        """A variable with a structure, or that one of its fields that ``rest`` names."""
        fields = self._fields(type_id)
        if not rest:
            return Shape(path, type_id, parents, content, tuple(f"{path}/{name}" for name in fields))
        name, *more = rest
        if more or name not in fields:
            return None
        data_type, is_array = fields[name]
        part = Content(lambda: get(content.make(), name), data_type, is_array)
        whole = node_id(f"{_TOP}/{path}", NAMESPACE)
        return Shape(f"{path}/{name}", _Ids.BaseDataVariableType, (whole,), part)

    def _fields_of(self, type_id: int) -> dict[str, tuple[ua.NodeId, bool]]:
        """Fields of a structure by their names, each with its data type and whether it is an array."""
        found: dict[str, tuple[ua.NodeId, bool]] = {}
        for below in related(self._space, node_id(type_id), _Ids.HasComponent):
            where: ua.NodeId = get(below, "NodeId")
            data_type = self._space.read_attribute_value(where, AttributeIds.DataType).Value
            rank = self._space.read_attribute_value(where, AttributeIds.ValueRank).Value
            assert data_type and rank, "each variable of the standard's has both"
            found[get(below, "BrowseName").Name] = data_type.Value, rank.Value >= 0
        return found
