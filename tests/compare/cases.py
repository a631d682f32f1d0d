"""Cases of each service set: lists of requests as hypothesis draws them, and makes them shorter in the end.

What is at the edge of what may be asked, and beyond it, is drawn as often as what is usual.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any, Final

from asyncua import ua
from hypothesis import strategies as st

from tests.compare import space
from tests.compare.alarms import alarm
from tests.compare.asked import NO_SESSION, UNKNOWN, Ask, Made
from tests.compare.cases_items import monitored_item, subscription
from tests.compare.drawn import (
    METHODS,
    NOWHERE,
    OBJECTS,
    VARIABLES,
    Attributes,
    Cases,
    Ids,
    attributes,
    cases,
    encodings,
    lists,
    maybe_range,
    node,
    nodes,
    standard,
    times,
)
from tests.compare.histories import history
from tests.compare.sessions import Activate, Close, Create, Use

# Discovery and sessions

_uris = st.sampled_from(
    [None, [], ["http://opcfoundation.org/UA-Profile/Transport/uatcp-uasc-uabinary"], ["urn:nobody"]]
)
_urls = st.sampled_from(["opc.tcp://127.0.0.1:4840", "", None, "opc.tcp://elsewhere:1/x", "nonsense"])
_locales = st.sampled_from([None, [], ["de"], ["xx-yy", "en"]])


def _discovery() -> Cases:
    common: dict[str, Any] = {"EndpointUrl": _urls, "LocaleIds": _locales}
    return cases(
        st.one_of(
            st.fixed_dictionaries(common | {"ProfileUris": _uris}).map(
                lambda asked: Ask("GetEndpoints", asked, session=NO_SESSION)
            ),
            st.fixed_dictionaries(common | {"ServerUris": _uris}).map(
                lambda asked: Ask("FindServers", asked, session=NO_SESSION)
            ),
        )
    )


def _session() -> Cases:
    channels = st.integers(0, 1)
    places = st.sampled_from([0, 0, 1, "no", "unknown"])
    tokens = st.sampled_from(["anonymous", "anonymous", "none", "another policy", "a name"])
    return cases(
        st.one_of(
            st.builds(Create, channels),
            st.sampled_from([0.0, -1.0, math.nan, math.inf]).map(lambda odd: Create(2, odd)),
            st.builds(Activate, places, channels, tokens),
            st.builds(Activate, st.just(0), st.just(0), st.just("anonymous")),
            st.builds(Use, places, channels),
            st.builds(Close, places, channels),
        ),
        Create(0),
    )


# View

_classes = st.sampled_from([0, 0, 1, 2, 4, 255, 1 << 20])
_reference_types = st.sampled_from(
    [
        *standard(Ids.Null, Ids.References, Ids.HierarchicalReferences, Ids.Organizes),
        *standard(Ids.HasComponent, Ids.HasProperty, Ids.HasTypeDefinition, Ids.BaseObjectType, UNKNOWN),
    ]
)
_directions = st.sampled_from([ua.BrowseDirection.Forward] * 2 + list(ua.BrowseDirection))


def _description() -> st.SearchStrategy[Any]:
    return st.builds(
        ua.BrowseDescription,
        NodeId=st.one_of(st.sampled_from(OBJECTS), nodes),
        BrowseDirection=_directions,
        ReferenceTypeId=_reference_types,
        IncludeSubtypes=st.booleans(),
        NodeClassMask=_classes,
        ResultMask=st.sampled_from([63, 63, 63, 0, 1 << 3]),
    )


_names = st.sampled_from(
    [
        *(ua.QualifiedName(one.id.rpartition("/")[2], 1) for one in (*space.OBJECTS[:3], space.ANALOG)),
        *(ua.QualifiedName("EURange", 0), ua.QualifiedName("InputArguments", 0), ua.QualifiedName("add", 1)),
        *(ua.QualifiedName("", 0), ua.QualifiedName(None, 1), ua.QualifiedName("area", 0)),
    ]
)
_element = st.builds(
    ua.RelativePathElement,
    ReferenceTypeId=_reference_types,
    IsInverse=st.sampled_from([False, False, False, True]),
    IncludeSubtypes=st.sampled_from([True, True, False]),
    TargetName=_names,
)
_starts = st.sampled_from([*standard(Ids.ObjectsFolder, Ids.ObjectsFolder), *OBJECTS, *NOWHERE])
_path = st.builds(
    ua.BrowsePath,
    StartingNode=_starts,
    RelativePath=st.builds(ua.RelativePath, Elements=lists(_element)),
)


def _view() -> Cases:
    views = st.sampled_from([ua.NodeId()] * 5 + [node("area"), ua.NodeId(UNKNOWN)])
    browse = st.fixed_dictionaries(
        {
            "View": st.builds(ua.ViewDescription, ViewId=views),
            "RequestedMaxReferencesPerNode": st.sampled_from([0, 0, 1, 2, 100]),
            "NodesToBrowse": lists(_description()),
        }
    )
    points = st.integers(0, 2).map(lambda place: Made("point", place))
    on = st.fixed_dictionaries(
        {
            "ReleaseContinuationPoints": st.booleans(),
            "ContinuationPoints": lists(st.one_of(points, st.sampled_from([b"", b"nothing"])), 2),
        }
    )
    some = lists(nodes)
    return cases(
        st.one_of(
            browse.map(lambda asked: Ask("Browse", asked, makes="point")),
            on.map(lambda asked: Ask("BrowseNext", asked, makes="point")),
            lists(_path).map(lambda paths: Ask("TranslateBrowsePathsToNodeIds", {"BrowsePaths": paths})),
            some.map(lambda ids: Ask("RegisterNodes", {"NodesToRegister": ids})),
            some.map(lambda ids: Ask("UnregisterNodes", {"NodesToUnregister": ids})),
        )
    )


# Attribute


def _read() -> st.SearchStrategy[Ask]:
    wanted = st.builds(
        ua.ReadValueId,
        NodeId=nodes,
        AttributeId=attributes,
        IndexRange=maybe_range,
        DataEncoding=encodings,
    )
    asked = st.fixed_dictionaries(
        {
            "MaxAge": st.sampled_from([0.0, 0.0, 1e9, -1.0, math.nan]),
            "TimestampsToReturn": times,
            "NodesToRead": lists(wanted),
        }
    )
    return asked.map(lambda one: Ask("Read", one))


_CONTENTS: Final = [
    *(
        ua.Variant(7, getattr(ua.VariantType, name))
        for name in ("UInt16", "UInt32", "Int16", "Byte", "Int64")
    ),
    *(ua.Variant(value, ua.VariantType.Float) for value in (1.5, 99.0, 1e6, math.nan, math.inf)),
    ua.Variant(1.5, ua.VariantType.Double),
    ua.Variant(True, ua.VariantType.Boolean),
    ua.Variant("words", ua.VariantType.String),
    ua.Variant([1, 2], ua.VariantType.UInt16),
    ua.Variant(None, ua.VariantType.Null),
]
_STATUSES: Final = [ua.StatusCodes.Good] * 3 + [ua.StatusCodes.Uncertain, ua.StatusCodes.BadNoData]


def _write() -> st.SearchStrategy[Ask]:
    points = [node(one.id, one.namespace) for one in space.POINTS]
    where = st.sampled_from([*points, *points, *OBJECTS, *METHODS, *NOWHERE])
    value = st.builds(
        lambda content, code: ua.DataValue(content, ua.StatusCode(code)),
        st.sampled_from(_CONTENTS),
        st.sampled_from(_STATUSES),
    )
    wanted = st.builds(
        ua.WriteValue,
        NodeId=where,
        AttributeId=st.one_of(st.just(int(Attributes.Value)), attributes),
        IndexRange=st.one_of(st.none(), maybe_range),
        Value=value,
    )
    return lists(wanted, 2).map(lambda one: Ask("Write", {"NodesToWrite": one}))


def _attribute() -> Cases:
    return cases(st.one_of(_read(), _write()))


# Method


def _method() -> Cases:
    fu1 = node("conveyor/fu1", 2)
    methods = [node(f"conveyor/fu1/{name}", 2) for name in ("Stop", "Start")]
    other = [node(space.ADD.id), *VARIABLES[:2], *NOWHERE]
    objects = [one for one in OBJECTS if one.Identifier != space.ADD.parent]
    argument = st.sampled_from([ua.Variant(0, ua.VariantType.Int32), *_CONTENTS])
    call = st.builds(
        ua.CallMethodRequest,
        ObjectId=st.one_of(st.just(fu1), st.sampled_from([fu1, *objects, *NOWHERE])),
        MethodId=st.one_of(st.sampled_from(methods), st.sampled_from([*methods, *other])),
        InputArguments=st.lists(argument, max_size=2),
    )
    return cases(lists(call, 2).map(lambda one: Ask("Call", {"MethodsToCall": one})))


SETS: Final[Mapping[str, Callable[[], Cases]]] = {
    "Discovery": _discovery,
    "Session": _session,
    "View": _view,
    "Attribute": _attribute,
    "History": history,
    "Method": _method,
    "Alarm": alarm,
    "MonitoredItem": monitored_item,
    "Subscription": subscription,
}
"""Cases by service set."""
