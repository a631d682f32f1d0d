"""open62541's server, as PyPI's o6 has it, with the address space of the comparison.

``python -m tests.compare.open62541_server PORT`` prints the port once it listens. In this mode o6 ends the
process after ten minutes.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import o6
from o6.ns import ns0

from tests.compare import space

_EVENT_NOTIFIER = 12
_URI = "urn:drivebridge:points"


def _node_id(where: str, namespace: int) -> o6.NodeId:
    return o6.NodeId(f"ns={namespace};s={where}") if where else o6.NodeId("i=85")


def _native(kind: str, value: Any) -> Any:
    made = getattr(o6, kind)
    return [made(one) for one in value] if isinstance(value, list) else made(value)


def _variable(server: Any, one: space.Variable) -> None:
    where = _node_id(one.id, one.namespace)
    is_array = isinstance(one.value, list)
    attributes = ns0.datatypes.VariableAttributes(
        displayName=o6.LocalizedText(_name(one.id)),
        dataType=o6.NodeId(getattr(o6, one.type)),
        valueRank=1 if is_array else -1,
        accessLevel=one.access,
        userAccessLevel=one.access,
        historizing=bool(one.access & space.HISTORY_READ),
        value=_native(one.type, one.value),
    )
    if is_array:
        attributes.arrayDimensions = [o6.UInt32(0)]
    kind = ns0.vartypes.AnalogItemType if one.range else ns0.vartypes.BaseDataVariableType
    parent = _node_id(one.parent, one.namespace)
    reference = o6.NodeId(ns0.reftypes.HasComponent)
    name = o6.QualifiedName(f"{one.namespace}:{_name(one.id)}")
    server._add_variable_node(where, parent, reference, name, o6.NodeId(kind), attributes)
    if one.range:
        low, high = one.range
        server.write(server[where].eURange, ns0.datatypes.Range(low=low, high=high))


def _name(where: str) -> str:
    return where.rpartition("/")[2]


def _arguments(named: dict[str, str]) -> list[Any]:
    return [
        ns0.datatypes.Argument(name=name, dataType=o6.NodeId(getattr(o6, kind)), valueRank=-1)
        for name, kind in named.items()
    ]


def build(server: Any) -> None:
    server._add_namespace(_URI, 2)
    for one in space.OBJECTS:
        kind = ns0.objtypes.FolderType if one.is_folder else ns0.objtypes.BaseObjectType
        where, parent = _node_id(one.id, one.namespace), _node_id(one.parent, one.namespace)
        server.addObject(
            _name(one.id), parent, nodeId=where, typeDefinition=o6.NodeId(kind), ns=one.namespace
        )
        if one.notifies:
            server._write_attribute(where, _EVENT_NOTIFIER, o6.Byte(1))
            server.addReferenceLegacy(server.serverNode, where, o6.NodeId(ns0.reftypes.HasNotifier))
    for one in (*space.VARIABLES, *space.POINTS, *(one.variable for one in space.HISTORIES)):
        _variable(server, one)

    def add(_: Any, *inputs: Any) -> tuple[Any, ...]:
        return o6.StatusCode.GOOD, o6.Int32(sum(map(int, inputs)))

    async def emit(_: Any, severity: Any) -> tuple[Any, ...]:
        await server.createEvent(
            "i=2041",
            source=_node_id("machine", 1),
            message="emitted",
            severity=int(severity),
        )
        return (o6.StatusCode.GOOD,)

    def done(_: Any, *inputs: Any) -> tuple[Any, ...]:
        return o6.StatusCode.GOOD, o6.LocalizedText("done", "en")

    acts = {space.ADD.id: add, space.EMIT.id: emit}
    for one in space.METHODS:
        server.addMethod(
            _name(one.id),
            _node_id(one.parent, one.namespace),
            acts.get(one.id, done),
            inputArgs=_arguments(one.inputs),
            outputArgs=_arguments(one.outputs),
            nodeId=_node_id(one.id, one.namespace),
            ns=one.namespace,
        )


def _historize(server: Any, one: space.History) -> None:
    where = _node_id(one.variable.id, one.variable.namespace)
    server._history_add(where, len(one.samples) + 1, "manual")
    for place, (value, code) in enumerate(one.samples):
        sample = o6.DataValue(
            value=_native(one.variable.type, value),
            status=getattr(o6.StatusCode, code.upper()),
            sourceTimestamp=o6.DateTime(one.at(place)),
        )
        server._history_insert(where, sample)


def main(port: int) -> None:
    server = o6.Server(port=port)
    server.config.setHistoryDatabase()
    build(server)
    server.start()
    for one in space.HISTORIES:
        _historize(server, one)
    print(f"port {port}", flush=True)
    while True:
        time.sleep(1)


if __name__ == "__main__":
    main(int(sys.argv[1]))
