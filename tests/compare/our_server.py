"""Our server with the address space of the comparison: ``python -m tests.compare.our_server``.

It prints its port. The points in namespace 2 are the bridge's, on a plant without a bus. What is in namespace
1 is served by an application of this module, whose writes and calls are not compared.
"""

from __future__ import annotations

import asyncio
import tempfile
import uuid
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from asyncua import ua
from asyncua.server.address_space import NodeManagementService

from bridge.northbound.opcua.backend import Backend
from bridge.uaserver.address_space import access_level_ex, constant
from bridge.uaserver.application import ServedApplication
from bridge.uaserver.conditions.condition import NORMAL
from bridge.uaserver.conditions.condition_fields import AlarmContent, ConditionPlace, common_fields
from bridge.uaserver.conditions.conditions import Condition
from bridge.uaserver.explanations import Explain
from bridge.uaserver.filters.eventfilter import Occurrence
from bridge.uaserver.history.history import ValueHistory
from bridge.uaserver.inner_server import InnerServer
from bridge.uaserver.library import make, text, variant
from tests.compare import space
from tests.support.opcua_site import OPEN, serving

Ids = ua.ObjectIds
_WRITABLE = {ua.NodeId(one.id, 1) for one in space.VARIABLES}
_EMIT = ua.NodeId(space.EMIT.id, 1)
_RAISE, _ALARM = ua.NodeId(space.RAISE, 1), ua.NodeId(space.ALARM, 1)


class _Application(ServedApplication[Any]):
    """The bridge's ``backend``, and besides it the nodes in namespace 1."""

    def __init__(self, backend: Backend, inner: InnerServer) -> None:
        self._backend = backend
        self._inner = inner

    def __getattribute__(self, name: str) -> Any:
        if name in ("write", "call", "value_history") or name.startswith("_"):
            return object.__getattribute__(self, name)
        return getattr(self._backend, name)

    async def write(
        self, user: Any, writes: Sequence[ua.WriteValue], explain: Explain
    ) -> list[ua.StatusCode]:
        if not all(one.NodeId in _WRITABLE for one in writes):
            return await self._backend.write(user, writes, explain)
        for one in writes:
            now = datetime.now(UTC)
            value = ua.DataValue(one.Value.Value, SourceTimestamp=now, ServerTimestamp=now)
            await self._inner.aspace.write_attribute_value(one.NodeId, one.AttributeId, value)
        return [ua.StatusCode() for _ in writes]

    async def call(
        self, user: Any, calls: Sequence[ua.CallMethodRequest], explain: Explain
    ) -> list[ua.CallMethodResult]:
        if [one.MethodId for one in calls] == [_RAISE]:
            return [self._raise()]
        if [one.MethodId for one in calls] != [_EMIT]:
            return await self._backend.call(user, calls, explain)
        self._emit(calls[0].InputArguments[0].Value)
        return [ua.CallMethodResult()]

    def _raise(self) -> ua.CallMethodResult:
        conditions = self._inner.conditions
        assert conditions
        condition = conditions.conditions[_ALARM]
        condition.state = NORMAL
        conditions.raised(condition, AlarmContent(text("raised"), 500), anew=True)
        told = variant(condition.event_id, ua.VariantType.ByteString)
        return ua.CallMethodResult(OutputArguments=[told])

    def value_history(self, where: ua.NodeId) -> ValueHistory | None:
        return _PAST.get(where) or self._backend.value_history(where)

    def _emit(self, severity: int) -> None:
        kinds, now = ua.VariantType, datetime.now(UTC)
        machine = ua.NodeId("machine", 1)
        fields = {
            "EventId": variant(uuid.uuid4().bytes, kinds.ByteString),
            "EventType": variant(ua.NodeId(Ids.BaseEventType), kinds.NodeId),
            "SourceNode": variant(machine, kinds.NodeId),
            "SourceName": variant("machine", kinds.String),
            "Time": variant(now, kinds.DateTime),
            "ReceiveTime": variant(now, kinds.DateTime),
            "Message": variant(text("emitted"), kinds.LocalizedText),
            "Severity": variant(severity, kinds.UInt16),
        }
        for emitter in (ua.NodeId(Ids.Server), machine):
            for subscription in list(self._inner.subscriptions.subscriptions.values()):
                if subscription.is_listening:
                    subscription.hear(Occurrence(emitter, fields))


class _Owner:
    """Owner of the condition in namespace 1, of which everybody may do everything."""

    def permits(self, user: Any, method: str) -> bool:
        return True

    async def acknowledging(self, user: Any, condition: ua.NodeId) -> int:
        return ua.StatusCodes.Good

    def on_call(self, user: Any, condition: ua.NodeId, method: str, code: int) -> None:
        pass


def _add_alarm(inner: InnerServer) -> None:
    conditions = inner.conditions
    assert conditions
    conditions._owner = _Owner()  # pyright: ignore[reportPrivateUsage]
    kind = ua.NodeId(Ids.AlarmConditionType)
    common = common_fields(kind, "Alarm", Ids.ProcessConditionClassType, text("process"), {})
    source = ua.NodeId(space.ALARM.rpartition("/")[0], 1)
    place = ConditionPlace(_ALARM, source, "source", (ua.NodeId(Ids.Server), source), common)
    conditions.add(Condition(place))


class _Past:
    """History of a variable in namespace 1, as a ``ValueHistory``."""

    stepped = False
    first = 0

    def __init__(self, kept: space.History) -> None:
        self.end = len(kept.samples)
        self._kept = kept

    def time_us(self, number: int) -> int:
        return round(self._kept.at(number).timestamp() * 1_000_000)

    def sample(self, number: int) -> ua.DataValue:
        value, code = self._kept.samples[number]
        held = ua.Variant(value, getattr(ua.VariantType, self._kept.variable.type))
        return ua.DataValue(
            held, ua.StatusCode(getattr(ua.StatusCodes, code)), SourceTimestamp=self._kept.at(number)
        )


_PAST = {ua.NodeId(one.variable.id, 1): _Past(one) for one in space.HISTORIES}


class _Builder:
    def __init__(self, inner: InnerServer) -> None:
        self._space = inner.aspace
        self._management = NodeManagementService(inner.aspace)

    def build(self) -> None:
        for one in space.OBJECTS:
            if one.namespace == 1:
                attributes = make(ua.ObjectAttributes, EventNotifier=1 if one.notifies else 0)
                kind = Ids.FolderType if one.is_folder else Ids.BaseObjectType
                self._add(one.id, one.parent, ua.NodeClass.Object, attributes, kind, Ids.Organizes)
            if one.notifies:
                self._notify(ua.NodeId(one.id, one.namespace))
        for one in (*space.VARIABLES, *(one.variable for one in space.HISTORIES)):
            self._variable(one)
        for one in space.METHODS:
            if one.namespace == 1:
                attributes = make(ua.MethodAttributes, Executable=True, UserExecutable=True)
                self._add(one.id, one.parent, ua.NodeClass.Method, attributes, Ids.Null, Ids.HasComponent)
                for name, arguments in (("InputArguments", one.inputs), ("OutputArguments", one.outputs)):
                    if arguments:
                        self._property(f"{one.id}/{name}", one.id, name, Ids.Argument, _arguments(arguments))

    def _notify(self, node: ua.NodeId) -> None:
        server = ua.NodeId(Ids.Server)
        for forward, start, end in ((True, server, node), (False, node, server)):
            item = make(
                ua.AddReferencesItem,
                SourceNodeId=start,
                ReferenceTypeId=ua.NodeId(Ids.HasNotifier),
                IsForward=forward,
                TargetNodeId=end,
                TargetNodeClass=ua.NodeClass.Object,
            )
            self._management.add_references([item])

    def _variable(self, one: space.Variable) -> None:
        attributes = make(
            ua.VariableAttributes,
            Value=ua.Variant(one.value, getattr(ua.VariantType, one.type)),
            DataType=ua.NodeId(getattr(Ids, one.type)),
            ValueRank=1 if isinstance(one.value, list) else -1,
            ArrayDimensions=[0] if isinstance(one.value, list) else None,
            AccessLevel=one.access,
            UserAccessLevel=one.access,
        )
        kind = Ids.AnalogItemType if one.range else Ids.BaseDataVariableType
        self._add(one.id, one.parent, ua.NodeClass.Variable, attributes, kind, Ids.HasComponent)
        if one.range:
            held = ua.Variant(ua.Range(*one.range), ua.VariantType.ExtensionObject)
            self._property(f"{one.id}/EURange", one.id, "EURange", Ids.Range, held)

    def _property(self, where: str, parent: str, name: str, kind: int, held: ua.Variant) -> None:
        rank = 1 if isinstance(held.Value, list) else -1
        attributes = make(
            ua.VariableAttributes,
            Value=held,
            DataType=ua.NodeId(kind),
            ValueRank=rank,
            AccessLevel=1,
            UserAccessLevel=1,
        )
        named = ua.QualifiedName(name, 0)
        self._add(where, parent, ua.NodeClass.Variable, attributes, Ids.PropertyType, Ids.HasProperty, named)

    def _add(
        self,
        where: str,
        parent: str,
        node_class: ua.NodeClass,
        attributes: Any,
        kind: int,
        reference: int,
        name: ua.QualifiedName | None = None,
    ) -> None:
        named = name or ua.QualifiedName(where.rpartition("/")[2], 1)
        attributes.DisplayName = text(named.Name or "")
        item = make(
            ua.AddNodesItem,
            RequestedNewNodeId=ua.NodeId(where, 1),
            BrowseName=named,
            NodeClass=node_class,
            ParentNodeId=ua.NodeId(parent, 1) if parent else ua.NodeId(Ids.ObjectsFolder),
            ReferenceTypeId=ua.NodeId(reference),
            NodeAttributes=attributes,
            TypeDefinition=ua.NodeId(kind),
        )
        (result,) = self._management.add_nodes([item])
        result.StatusCode.check()
        if isinstance(attributes, ua.VariableAttributes):
            extended = constant(access_level_ex(attributes.AccessLevel), ua.VariantType.UInt32)
            made = self._space[ua.NodeId(where, 1)]
            made.attributes[ua.AttributeIds.AccessLevelEx] = extended


def _arguments(named: dict[str, str]) -> ua.Variant:
    made = [
        make(ua.Argument, Name=name, DataType=ua.NodeId(getattr(Ids, kind)), ValueRank=-1)
        for name, kind in named.items()
    ]
    return ua.Variant(made, ua.VariantType.ExtensionObject)


async def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        async with serving(OPEN, Path(folder)) as (server, _):
            inner: InnerServer = server._server.iserver  # pyright: ignore
            _Builder(inner).build()
            _add_alarm(inner)
            inner.application = _Application(inner.application, inner)  # pyright: ignore
            print(f"port {server.port}", flush=True)
            await asyncio.Event().wait()


if __name__ == "__main__":
    asyncio.run(main())
