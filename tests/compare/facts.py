"""What of an answer is compared: its status codes and values, each by its place in the answer."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from typing import Any, Final

from asyncua import ua
from asyncua.ua.status_codes import get_name_and_doc

Facts = dict[str, Any]

_OVERFLOW: Final = 0x0480
_LEFT_OUT: Final = {
    # The header, but for the ServiceResult; nobody has asked for diagnostics.
    *("TypeId", "ResponseHeader", "DiagnosticInfos", "InputArgumentDiagnosticInfos", "DiagnosticInfo"),
    *("SelectClauseDiagnosticInfos", "OperandDiagnosticInfos", "ElementDiagnosticInfos"),
    # Whatever the server gives as a name.
    *(
        "SubscriptionId",
        "MonitoredItemId",
        "SessionId",
        "AuthenticationToken",
        "ServerNonce",
        "SequenceNumber",
    ),
    *("AvailableSequenceNumbers", "ServerCertificate", "ServerSignature", "ServerSoftwareCertificates"),
    *("ServerEndpoints", "Servers", "Endpoints", "RegisteredNodeIds"),
    # What a server may revise as it likes.
    *("RevisedSessionTimeout", "MaxRequestMessageSize", "RevisedPublishingInterval", "RevisedLifetimeCount"),
    *("RevisedMaxKeepAliveCount", "RevisedSamplingInterval", "RevisedQueueSize"),
    # Its clock, and how much of it a message has.
    *("PublishTime", "SourcePicoseconds", "ServerPicoseconds"),
    "Encoding",
}


def code_name(code: int) -> str:
    """Name of a status code, with the bit that says that others were lost."""
    name = get_name_and_doc(code & 0xFFFF0000)[0]
    return f"{name} with Overflow" if code & _OVERFLOW == _OVERFLOW else name


def facts_of(response: Any, service: str) -> Facts:
    found: Facts = {"result": code_name(response.ResponseHeader.ServiceResult.value)}
    if not isinstance(response, ua.ServiceFault):
        for one in fields(response):
            if one.name not in _LEFT_OUT:
                _walk(getattr(response, one.name), "" if one.name == "Parameters" else one.name, found)
        found |= _OF_SERVICE.get(service, lambda _: {})(response)
    return found


def _walk(held: Any, path: str, found: Facts) -> None:
    if isinstance(held, list):
        for place, one in enumerate(held):
            _walk(one, f"{path}[{place}]", found)
    elif isinstance(held, ua.StatusCode):
        found[path] = code_name(held.value)
    elif isinstance(held, ua.BrowseResult):
        found |= {f"{path}.{name}": one for name, one in _browsed(held).items()}
    elif isinstance(held, ua.HistoryReadResult):
        found |= {f"{path}.{name}": one for name, one in _past(held).items()}
    elif isinstance(held, ua.DataValue):
        found |= {f"{path}.{name}": one for name, one in _data_value(held).items()}
    elif is_dataclass(held) and not isinstance(held, ua.NodeId | ua.Variant | ua.QualifiedName):
        for one in fields(held):
            if one.name not in _LEFT_OUT:
                inner = "" if one.name == "Parameters" else one.name
                _walk(getattr(held, one.name), f"{path}.{inner}".strip("."), found)
    elif held is not None:
        found[path] = plain(held)


def _data_value(held: ua.DataValue) -> Facts:
    code = held.StatusCode.value if held.StatusCode else 0
    if code & 0x80000000:
        return {"StatusCode": code_name(code)}  # a value may come with it or not
    return {
        "StatusCode": code_name(code),
        "Value": plain(held.Value),
        "SourceTimestamp": held.SourceTimestamp is not None,
        "ServerTimestamp": held.ServerTimestamp is not None,
    }


def _past(held: ua.HistoryReadResult) -> Facts:
    if not held.StatusCode.is_good():
        return {"StatusCode": code_name(held.StatusCode.value)}
    values = getattr(held.HistoryData, "DataValues", None) or []
    return {
        "StatusCode": code_name(held.StatusCode.value),
        "goes on": bool(held.ContinuationPoint),
        "values": [_sample(one) for one in values],
    }


def _sample(held: ua.DataValue) -> str:
    code = code_name(held.StatusCode.value if held.StatusCode else 0)
    value = "" if code.startswith("Bad") else plain(held.Value)
    server = " with server time" if held.ServerTimestamp else ""
    return f"{held.SourceTimestamp} {value} {code}{server}"


def _browsed(held: ua.BrowseResult) -> Facts:
    """Part 4 says nothing of the order of references."""
    references = held.References or []
    found: Facts = {"StatusCode": code_name(held.StatusCode.value), "count": len(references)}
    found["goes on"] = bool(held.ContinuationPoint)
    if not held.ContinuationPoint:
        found["references"] = sorted(map(_reference, references))
    return found


def _reference(held: ua.ReferenceDescription) -> str:
    return " ".join(
        str(plain(one))
        for one in (
            held.ReferenceTypeId,
            held.IsForward,
            held.BrowseName,
            held.DisplayName,
            held.NodeClass,
            held.TypeDefinition,
        )
    )


def plain(held: Any) -> Any:
    """A value that can be compared, and read by a person."""
    if isinstance(held, ua.Variant):
        if held.Value is None:
            return None
        return f"{held.VariantType.name} {plain(held.Value)}"
    if isinstance(held, list):
        return [plain(one) for one in held]
    if isinstance(held, ua.LocalizedText):
        return held.Text or ""  # the language is a server's own
    if isinstance(held, ua.NodeId):
        return held.to_string()
    if isinstance(held, ua.QualifiedName):
        return f"{held.NamespaceIndex}:{held.Name}"
    if isinstance(held, Enum):
        return held.name
    if isinstance(held, float):
        return "NaN" if math.isnan(held) else held
    if isinstance(held, ua.StatusCode):
        return code_name(held.value)
    if is_dataclass(held):
        return {one.name: plain(getattr(held, one.name)) for one in fields(held) if one.name not in _LEFT_OUT}
    return held


def _endpoints(response: ua.GetEndpointsResponse) -> Facts:
    """Each server has the policies that it was given: what is asked for may leave some, or none."""
    return {"endpoints": "some" if response.Endpoints else "none"}


def _servers(response: ua.FindServersResponse) -> Facts:
    return {"servers": "some" if response.Servers else "none"}


_OF_SERVICE: Final[Mapping[str, Callable[[Any], Facts]]] = {
    "GetEndpoints": _endpoints,
    "FindServers": _servers,
}
