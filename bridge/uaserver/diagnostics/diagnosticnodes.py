"""Nodes of the diagnostics below ``Server/ServerDiagnostics`` (OPC 10000-5 §6.3.3 to §6.3.5).

Those of sessions and subscriptions are made when somebody looks: there would be six thousand for a hundred
sessions. What they say of a session is for that session and for whom the application lets look at all of
them, of security only on a channel that is encrypted (§6.3.4).
"""

# asyncua's NodeData has a list where _OpenNode has a property:
# pyright: reportIncompatibleVariableOverride=false

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Iterator
from datetime import UTC, datetime
from typing import Any, Final

from asyncua.server.address_space import AddressSpace, AttributeValue, NodeData

from bridge.base.guard import Guard
from bridge.uaserver.address_space import Watchers, access_level_ex, put_behind
from bridge.uaserver.diagnostics.diagnostics import (
    security_diagnostics,
    session_diagnostics,
    subscription_diagnostics,
    summary,
)
from bridge.uaserver.diagnostics.shapes import (
    ALL_SECURITY,
    ALL_SESSIONS,
    ALL_SUBSCRIPTIONS,
    SECURITY,
    SESSION,
    SUBSCRIPTION,
    Shape,
    Shapes,
    ShownSession,
    Sources,
    path_of,
)
from bridge.uaserver.hierarchy import related
from bridge.uaserver.library import AttributeIds, ObjectIds, data_value, get, node_id, ua, variant

_LOOK_EVERY_S: Final = 1.0
_SUMMARY: Final = ObjectIds.Server_ServerDiagnostics_ServerDiagnosticsSummary
_SESSIONS: Final = ObjectIds.Server_ServerDiagnostics_SessionsDiagnosticsSummary
_ALL: Final = (ALL_SESSIONS, ALL_SECURITY, ALL_SUBSCRIPTIONS)
_COMPONENT: Final = node_id(ObjectIds.HasComponent)
_Type = ua.VariantType


class _OpenNode(NodeData):
    """A node of the standard's with references to what there is just now, behind those that it has."""

    def __init__(self, node: NodeData, more: Callable[[], Iterable[ua.ReferenceDescription]]) -> None:
        self._more = more
        super().__init__(node.nodeid)
        self.attributes = node.attributes
        self._held = node.references

    @property
    def references(self) -> list[ua.ReferenceDescription]:
        return [*self._held, *self._more()]

    @references.setter
    def references(self, held: list[ua.ReferenceDescription]) -> None:
        self._held = held


class DiagnosticNodes:
    """``install`` puts them into ``space``, ``run`` tells who watches them once in a second."""

    def __init__(self, space: AddressSpace, sources: Sources) -> None:
        self._space = space
        self._sources = sources
        self._shapes = Shapes(space, sources)
        self._guard = Guard("OPC UA diagnostics")
        self._watched: dict[ua.NodeId, Watchers] = {}

    @staticmethod
    def is_about_someone(where: ua.NodeId) -> bool:
        """Whether its value is about a session or a subscription: those of ``is_hidden``."""
        return where.Identifier in _ALL if where.NamespaceIndex == 0 else bool(path_of(where))

    def is_hidden(self, where: ua.NodeId, session: ShownSession, *, may_see_all: bool) -> bool:
        """Whether a value that is about someone is not for this session."""
        is_encrypted = session.channel_certificate is not None
        if where.NamespaceIndex == 0:
            return not may_see_all or (where.Identifier == ALL_SECURITY and not is_encrypted)
        owner, _, rest = path_of(where).partition("/")
        if owner == session.label:
            return False
        if owner == SUBSCRIPTION:
            found = self._shapes.subscription(rest.partition("/")[0])
            return not may_see_all and (found is None or found.session_id != session.session_id)
        return not may_see_all or (rest.startswith(SECURITY) and not is_encrypted)

    def install(self) -> None:
        """Called once the address space is complete."""
        sources, space, shapes = self._sources, self._space, self._shapes

        def whole() -> ua.ServerDiagnosticsSummaryDataType:
            return summary(sources.counts, len(sources.sessions), sources.diagnosed_subscriptions)

        def part(name: str) -> Callable[[], Any]:
            return lambda: get(whole(), name)

        self._set(node_id(_SUMMARY), whole)
        for below in related(space, node_id(_SUMMARY), ObjectIds.HasComponent):
            self._set(get(below, "NodeId"), part(get(below, "BrowseName").Name), _Type.UInt32)
        self._set(
            node_id(ALL_SESSIONS),
            lambda: [session_diagnostics(one, shapes.subscriptions_of(one)) for one in sources.sessions],
        )
        self._set(node_id(ALL_SECURITY), lambda: [security_diagnostics(one) for one in sources.sessions])
        self._set(
            node_id(ALL_SUBSCRIPTIONS),
            lambda: [subscription_diagnostics(one) for one in sources.diagnosed_subscriptions.values()],
        )
        self._open(_SESSIONS, lambda: [one.label for one in sources.sessions])
        self._open(ALL_SESSIONS, lambda: [f"{one.label}/{SESSION}" for one in sources.sessions])
        self._open(ALL_SECURITY, lambda: [f"{one.label}/{SECURITY}" for one in sources.sessions])
        self._open(
            ALL_SUBSCRIPTIONS, lambda: [f"{SUBSCRIPTION}/{one}" for one in sources.diagnosed_subscriptions]
        )
        put_behind(space, self._find)

    def _set(
        self, where: ua.NodeId, make: Callable[[], Any], kind: ua.VariantType = _Type.ExtensionObject
    ) -> None:
        self._space[where].attributes[AttributeIds.Value] = self._value(where, make, kind)

    def _value(self, where: ua.NodeId, make: Callable[[], Any], kind: ua.VariantType) -> AttributeValue:
        def read(*_: object) -> ua.DataValue:
            now = datetime.now(UTC)
            return data_value(variant(make(), kind), None, now, now)

        made = AttributeValue(data_value(variant(None, _Type.Null)))
        made.value_callback = read
        made.datachange_callbacks = self._watched.setdefault(where, {})
        return made

    def _open(self, where: int, paths: Callable[[], Iterable[str]]) -> None:
        node = self._space[node_id(where)]
        self._space[node_id(where)] = _OpenNode(node, lambda: self._refer_all(paths()))

    # nodes that are made when somebody looks

    def _find(self, where: ua.NodeId) -> NodeData | None:
        path = path_of(where)
        shape = self._shapes.of(path) if path else None
        if shape is None:
            return None
        made = NodeData(shape.nodeid)
        made.attributes = {
            one: AttributeValue(data_value(variant(*content))) for one, content in _attributes(shape).items()
        }
        if shape.content:
            value = self._value(shape.nodeid, shape.content.make, shape.content.kind)
            made.attributes[AttributeIds.Value] = value
        made.references = list(self._references(shape))
        return made

    def _references(self, shape: Shape) -> Iterator[ua.ReferenceDescription]:
        yield self._refer_to_standard(
            node_id(ObjectIds.HasTypeDefinition), node_id(shape.type_id), forward=True
        )
        for where in shape.parents:
            above = self._shapes.of(path_of(where)) if where.NamespaceIndex else None
            if above:
                yield _refer(above, forward=False)
            else:
                yield self._refer_to_standard(_COMPONENT, where, forward=False)
        yield from self._refer_all(shape.below)

    def _refer_all(self, paths: Iterable[str]) -> Iterator[ua.ReferenceDescription]:
        shapes = (self._shapes.of(path) for path in paths)
        return (_refer(shape) for shape in shapes if shape)

    def _refer_to_standard(
        self, reference: ua.NodeId, where: ua.NodeId, *, forward: bool
    ) -> ua.ReferenceDescription:
        name, words, node_class = (
            get(self._space.read_attribute_value(where, attribute).Value, "Value")
            for attribute in (AttributeIds.BrowseName, AttributeIds.DisplayName, AttributeIds.NodeClass)
        )
        nothing = node_id(ObjectIds.Null)
        return ua.ReferenceDescription(reference, forward, where, name, words, node_class, nothing)

    # who watches

    async def run(self) -> None:
        """Tell who watches one of them what it has now, until cancelled."""
        while True:
            await asyncio.sleep(_LOOK_EVERY_S)
            for where, watchers in list(self._watched.items()):
                if watchers:
                    with self._guard:
                        await self._tell(where, watchers)
                if where.NamespaceIndex and (not watchers or where not in self._space):
                    del self._watched[where]

    async def _tell(self, where: ua.NodeId, watchers: Watchers) -> None:
        value = self._space.read_attribute_value(where, AttributeIds.Value)
        for handle, watcher in list(watchers.items()):
            await watcher(handle, value)
            await asyncio.sleep(0)


def _attributes(shape: Shape) -> dict[AttributeIds, tuple[Any, ua.VariantType]]:
    name = shape.browse_name
    found: dict[AttributeIds, tuple[Any, ua.VariantType]] = {
        AttributeIds.NodeId: (shape.nodeid, _Type.NodeId),
        AttributeIds.NodeClass: (shape.node_class, _Type.Int32),
        AttributeIds.BrowseName: (name, _Type.QualifiedName),
        AttributeIds.DisplayName: (ua.LocalizedText(name.Name), _Type.LocalizedText),
        AttributeIds.WriteMask: (0, _Type.UInt32),
        AttributeIds.UserWriteMask: (0, _Type.UInt32),
    }
    if not shape.content:
        return found | {AttributeIds.EventNotifier: (0, _Type.Byte)}
    return found | {
        AttributeIds.DataType: (shape.content.data_type, _Type.NodeId),
        AttributeIds.ValueRank: (1 if shape.content.is_array else -1, _Type.Int32),
        AttributeIds.AccessLevel: (1, _Type.Byte),
        AttributeIds.UserAccessLevel: (1, _Type.Byte),
        AttributeIds.AccessLevelEx: (access_level_ex(1), _Type.UInt32),
        AttributeIds.MinimumSamplingInterval: (_LOOK_EVERY_S * 1000, _Type.Double),
        AttributeIds.Historizing: (False, _Type.Boolean),
    }


def _refer(shape: Shape, *, forward: bool = True) -> ua.ReferenceDescription:
    name = shape.browse_name
    words = ua.LocalizedText(name.Name)
    type_id = node_id(shape.type_id)
    return ua.ReferenceDescription(_COMPONENT, forward, shape.nodeid, name, words, shape.node_class, type_id)
