"""Requests of SCADA clients and of the tools of an authority, each with what it is.

Markers stand in them for what only a running connection knows; the server of the recorder refuses most of
what has one.
"""

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Any, Final, NamedTuple

from asyncua import ua

from bridge.northbound.opcua.certificates.trust_list_files import TrustListContents, encoded
from bridge.trust.files import thumbprint
from tests.fuzz.rig import APPLICATION_URI
from tests.fuzz.targets.opcua_channel import ALARM, EVENT, FILE, HANDLE, ITEM, OTHER_HANDLE, SUBSCRIPTION
from tests.support.certificates import AUTHORITY, CLIENT, crl_of, make
from tests.support.opcua_filters import at, chosen, element

Ids, Type, Op = ua.ObjectIds, ua.VariantType, ua.FilterOperator
_FU4: Final = "conveyor/fu4"
_SPARE: Final = "spare/fu1"
"""Its parameters can be read; fu4 has no channel of its own for them."""
_BEGIN: Final = datetime(2026, 1, 1, tzinfo=UTC)
_END: Final = datetime(2099, 1, 1, tzinfo=UTC)
_ROOT: Final = make(AUTHORITY.but(begins=_BEGIN, ends=_END))
_MADE: Final = make(CLIENT.but(uri=APPLICATION_URI, begins=_BEGIN, ends=_END), _ROOT)
"""A certificate for the bridge, and the authority that has made it; good for as long as the corpus is."""
_GROUP: Final = "ServerConfiguration_CertificateGroups_DefaultApplicationGroup"
_LIST: Final = f"{_GROUP}_TrustList"


class Request(NamedTuple):
    """``kind`` says to the thrower in which session it is sent."""

    what: str
    request: Any
    kind: str = "service"


def number(marker: bytes) -> int:
    return int.from_bytes(marker, "little")


def requests(space: int) -> Iterator[Request]:
    """All of them; ``space`` is the index of the namespace of the points."""
    yield from _reads(space)
    yield from _writes(space)
    yield from _items(space)
    yield from _subscriptions()
    yield from _history(space)
    yield from _alarms(space)
    yield from _files(space)
    yield from _server_methods()
    yield from _assets(space)
    yield from _identities()
    yield from _push()


def _ask(service: str, **params: object) -> Any:
    request = getattr(ua, f"{service}Request")()
    where = getattr(request, "Parameters", request)
    for name, value in params.items():
        setattr(where, name, value)
    return request


def _value(node: ua.NodeId, **more: object) -> ua.ReadValueId:
    return ua.ReadValueId(node, ua.AttributeIds.Value, **more)


def _call(where: ua.NodeId, method: ua.NodeId, *given: tuple[object, ua.VariantType]) -> Any:
    arguments = [ua.Variant(*one) for one in given]
    return _ask("Call", MethodsToCall=[ua.CallMethodRequest(where, method, arguments)])


def _reads(space: int) -> Iterator[Request]:
    parameters = [_value(ua.NodeId(f"{_SPARE}/parameter/{name}", space)) for name in ("p102", "p105")]
    yield Request("Read from the drive", _ask("Read", MaxAge=0.0, NodesToRead=parameters))
    method = ua.NodeId(f"{_SPARE}/ReadParameter", space)
    refused = _call(ua.NodeId(_SPARE, space), method, ("P999", Type.String))
    refused.RequestHeader.ReturnDiagnostics = 0x3FF
    yield Request("Call, with diagnostics", refused)
    summary = "Server_ServerDiagnostics"
    names = (
        f"{summary}_ServerDiagnosticsSummary",
        f"{summary}_ServerDiagnosticsSummary_CurrentSessionCount",
        f"{summary}_SubscriptionDiagnosticsArray",
        f"{summary}_SessionsDiagnosticsSummary_SessionDiagnosticsArray",
        f"{summary}_SessionsDiagnosticsSummary_SessionSecurityDiagnosticsArray",
        f"{summary}_EnabledFlag",
        "Server_ServerStatus",
        "Server_ServiceLevel",
    )
    nodes = [_value(ua.NodeId(getattr(Ids, name))) for name in names]
    yield Request("Read of diagnostics", _ask("Read", MaxAge=500.0, NodesToRead=nodes))
    ranged = [_value(ua.NodeId(getattr(Ids, names[2])), IndexRange="0:3"), _value(_bit(space))]
    yield Request("Read of parts", _ask("Read", NodesToRead=ranged))


def _bit(space: int, name: str = "fault") -> ua.NodeId:
    return ua.NodeId(f"{_FU4}/status/status_word/{name}", space)


def _writes(space: int) -> Iterator[Request]:
    drive, take = ua.NodeId(_FU4, space), ua.NodeId(f"{_FU4}/TakeControl", space)
    yield Request("TakeControl", _call(drive, take, (10_000, Type.UInt32)))
    bits = [
        ua.WriteValue(
            ua.NodeId(f"{_FU4}/command/control_word/{name}", space),
            ua.AttributeIds.Value,
            Value=ua.DataValue(ua.Variant(value, Type.Boolean)),
        )
        for name, value in (("enable_operation", False), ("voltage_enabled", True), ("direction_right", True))
    ]
    yield Request("Write of bits", _ask("Write", NodesToWrite=bits))
    yield Request("Write of a bit", _ask("Write", NodesToWrite=bits[1:2]))


def _filter() -> ua.EventFilter:
    """Fields of several names, and each operator once."""
    fields = [
        ua.SimpleAttributeOperand(ua.NodeId(Ids.ConditionType), [], ua.AttributeIds.NodeId),
        chosen("EventId"),
        chosen("Message", index_range="0:9"),
        chosen("AckedState", "Id"),
        chosen("ShelvingState", "CurrentState", "Id"),
        chosen("EnabledState", type_id=Ids.AlarmConditionType),
    ]
    severity, source = chosen("Severity"), chosen("SourceName")
    where = [
        element(Op.Or, at(1), at(9)),
        element(Op.And, at(2), at(4)),
        element(Op.Not, at(3)),
        element(Op.IsNull, source),
        element(Op.And, at(5), at(6)),
        element(Op.Between, severity, 1, 1000),
        element(Op.And, at(7), at(8)),
        element(Op.GreaterThanOrEqual, severity, 100),
        element(Op.LessThanOrEqual, severity, 1000),
        element(Op.Or, at(10), at(11)),
        element(Op.OfType, ua.NodeId(Ids.AlarmConditionType)),
        element(Op.And, at(12), at(13)),
        element(Op.InList, source, "conveyor/fu1", "spare"),
        element(Op.And, at(14), at(15)),
        element(Op.Equals, chosen("Message"), ua.LocalizedText("lost", "en")),
        element(Op.And, at(16), at(17)),
        element(Op.GreaterThan, severity, 1),
        element(Op.LessThan, severity, 999.5),
    ]
    return ua.EventFilter(fields, ua.ContentFilter(where))


def _item(target: ua.ReadValueId, **asked: object) -> ua.MonitoredItemCreateRequest:
    settings = ua.MonitoringParameters(**({"ClientHandle": 7, "QueueSize": 10} | asked))
    return ua.MonitoredItemCreateRequest(target, ua.MonitoringMode.Reporting, settings)


def _items(space: int) -> Iterator[Request]:
    told = ua.ReadValueId(ua.NodeId(Ids.Server), ua.AttributeIds.EventNotifier)
    where = {"SubscriptionId": number(SUBSCRIPTION), "TimestampsToReturn": ua.TimestampsToReturn.Both}
    events = [_item(told, Filter=_filter(), QueueSize=100)]
    yield Request("Items for events", _ask("CreateMonitoredItems", ItemsToCreate=events, **where))
    deadband = ua.DataChangeFilter(ua.DataChangeTrigger.StatusValueTimestamp, 2, 5.0)
    words = [
        _item(_value(_bit(space)), SamplingInterval=50.0),
        _item(_value(ua.NodeId(f"{_FU4}/actual/frequency", space)), Filter=deadband),
        _item(_value(ua.NodeId(Ids.Server_ServerArray), IndexRange="0:1")),
        _item(ua.ReadValueId(ua.NodeId(f"{_FU4}/status/state", space), ua.AttributeIds.DisplayName)),
    ]
    yield Request("Items of bits and parts", _ask("CreateMonitoredItems", ItemsToCreate=words, **where))
    changed = ua.MonitoredItemModifyRequest(
        number(ITEM), ua.MonitoringParameters(3, 100.0, Filter=_filter(), QueueSize=2, DiscardOldest=False)
    )
    yield Request("An item is changed", _ask("ModifyMonitoredItems", ItemsToModify=[changed], **where))
    linked = {"SubscriptionId": number(SUBSCRIPTION), "TriggeringItemId": number(ITEM)}
    numbers = [number(ITEM), number(ITEM) + 1]
    yield Request("Links are added", _ask("SetTriggering", LinksToAdd=numbers, LinksToRemove=[], **linked))
    yield Request("Links are removed", _ask("SetTriggering", LinksToAdd=[], LinksToRemove=numbers, **linked))
    mode = {"SubscriptionId": number(SUBSCRIPTION), "MonitoringMode": ua.MonitoringMode.Sampling}
    yield Request("The mode of an item", _ask("SetMonitoringMode", MonitoredItemIds=[number(ITEM)], **mode))
    gone = {"SubscriptionId": number(SUBSCRIPTION), "MonitoredItemIds": [number(ITEM)]}
    yield Request("An item is deleted", _ask("DeleteMonitoredItems", **gone))


def _subscriptions() -> Iterator[Request]:
    mine = number(SUBSCRIPTION)
    acknowledged = [ua.SubscriptionAcknowledgement(mine, 1), ua.SubscriptionAcknowledgement(mine, 2)]
    yield Request("Publish, with what has come", _ask("Publish", SubscriptionAcknowledgements=acknowledged))
    yield Request("Republish", _ask("Republish", SubscriptionId=mine, RetransmitSequenceNumber=1))
    yield Request("Transfer", _ask("TransferSubscriptions", SubscriptionIds=[mine], SendInitialValues=True))
    yield Request("Cancel", _ask("Cancel", RequestHandle=1))
    settings = ua.ModifySubscriptionParameters(mine, 50.0, 100, 10, 5, 3)
    changed = _ask("ModifySubscription")
    changed.Parameters = settings
    yield Request("A subscription is changed", changed)


def _history(space: int) -> Iterator[Request]:
    state = ua.HistoryReadValueId(ua.NodeId("conveyor/fu1/status/state", space))
    frequency = ua.HistoryReadValueId(ua.NodeId(f"{_FU4}/actual/frequency", space), IndexRange="0")
    server = ua.HistoryReadValueId(ua.NodeId(Ids.Server))
    drive = ua.HistoryReadValueId(ua.NodeId(_FU4, space), ContinuationPoint=b"\0" * 8)

    def read(details: Any, *nodes: ua.HistoryReadValueId, release: bool = False) -> Any:
        return _ask(
            "HistoryRead",
            HistoryReadDetails=details,
            TimestampsToReturn=ua.TimestampsToReturn.Source,
            ReleaseContinuationPoints=release,
            NodesToRead=list(nodes),
        )

    forwards = ua.ReadRawModifiedDetails(False, _BEGIN, _END, 1, True)
    yield Request("History, raw", read(forwards, state, frequency))
    yield Request(
        "History, raw and backwards", read(ua.ReadRawModifiedDetails(False, _END, _BEGIN, 3), state)
    )
    yield Request("History, released", read(forwards, drive, release=True))
    yield Request("History, at times", read(ua.ReadAtTimeDetails([_BEGIN, _END], True), state, frequency))
    events = ua.ReadEventDetails(5, _BEGIN, _END, _filter())
    yield Request("History, events", read(events, server, drive))
    yield Request("History, processed", read(ua.ReadProcessedDetails(_BEGIN, _END, 1.0), state))


def _alarms(space: int) -> Iterator[Request]:
    alarm = ua.NodeId(ALARM, space)
    event = (EVENT, Type.ByteString)
    comment = (ua.LocalizedText("seen, Störung", "de"), Type.LocalizedText)
    for name, where, given in (
        ("Acknowledge", Ids.AcknowledgeableConditionType_Acknowledge, (event, comment)),
        ("Confirm", Ids.AcknowledgeableConditionType_Confirm, (event, comment)),
        ("AddComment", Ids.ConditionType_AddComment, (event, comment)),
        ("TimedShelve", Ids.ShelvedStateMachineType_TimedShelve, ((1000.0, Type.Double),)),
        ("TimedShelve2", Ids.ShelvedStateMachineType_TimedShelve2, ((1000.0, Type.Double), comment)),
        ("OneShotShelve", Ids.ShelvedStateMachineType_OneShotShelve, ()),
        ("Unshelve", Ids.ShelvedStateMachineType_Unshelve, ()),
        ("Enable", Ids.ConditionType_Enable, ()),
        ("Disable", Ids.ConditionType_Disable, ()),
    ):
        yield Request(name, _call(alarm, ua.NodeId(where), *given))
    shelving = ua.NodeId(f"{ALARM}/ShelvingState", space)
    state = _call(shelving, ua.NodeId(Ids.ShelvedStateMachineType_Unshelve))
    yield Request("Unshelve on the state", state)
    kind, mine = ua.NodeId(Ids.ConditionType), (number(SUBSCRIPTION), Type.UInt32)
    refresh = _call(kind, ua.NodeId(Ids.ConditionType_ConditionRefresh), mine)
    yield Request("ConditionRefresh", refresh)
    second = ua.NodeId(Ids.ConditionType_ConditionRefresh2)
    yield Request("ConditionRefresh2", _call(kind, second, mine, (number(ITEM), Type.UInt32)))


def _files(space: int) -> Iterator[Request]:
    file, handle = ua.NodeId(FILE, space), (number(HANDLE), Type.UInt32)
    for name, given in (
        ("Open", ((1, Type.Byte),)),
        ("Read", (handle, (100, Type.Int32))),
        ("GetPosition", (handle,)),
        ("SetPosition", (handle, (10, Type.UInt64))),
        ("Write", (handle, (b"x", Type.ByteString))),
        ("Close", (handle,)),
    ):
        method = ua.NodeId(getattr(Ids, f"FileType_{name}"))
        yield Request(f"{name} of a black box", _call(file, method, *given))
    names = ("Size", "OpenCount", "Writable", "TripTime", "MimeType")
    nodes = [_value(ua.NodeId(f"{FILE}/{name}", space)) for name in names]
    yield Request("Read of a black box's properties", _ask("Read", NodesToRead=nodes))


def _server_methods() -> Iterator[Request]:
    server, mine = ua.NodeId(Ids.Server), (number(SUBSCRIPTION), Type.UInt32)
    yield Request("GetMonitoredItems", _call(server, ua.NodeId(Ids.Server_GetMonitoredItems), mine))
    yield Request("ResendData", _call(server, ua.NodeId(Ids.Server_ResendData), mine))


def _assets(space: int) -> Iterator[Request]:
    asset = ua.NodeId(f"{_FU4}/Asset", space)
    everything = ua.BrowseDescription(asset, ua.BrowseDirection.Both, ua.NodeId(Ids.References), True)
    everything.ResultMask = ua.BrowseResultMask.All
    browse = _ask("Browse", RequestedMaxReferencesPerNode=2, NodesToBrowse=[everything])
    yield Request("Browse of an asset", browse)
    health = ua.QualifiedName("DeviceHealth", space + 1)
    elements = [ua.RelativePathElement(ua.NodeId(Ids.HierarchicalReferences), False, True, health)]
    path = ua.BrowsePath(asset, ua.RelativePath(elements))
    yield Request("Path from an asset", _ask("TranslateBrowsePathsToNodeIds", BrowsePaths=[path]))


def _identities() -> Iterator[Request]:
    """The signature is of another connection: so far a stranger comes."""
    with_certificate = _ask("ActivateSession", LocaleIds=["de-DE", "en"])
    with_certificate.Parameters.UserIdentityToken = ua.X509IdentityToken(CertificateData=_MADE.der)
    signature = ua.SignatureData("http://www.w3.org/2001/04/xmldsig-more#rsa-sha256", bytes(256))
    with_certificate.Parameters.UserTokenSignature = signature
    yield Request("A user with a certificate", with_certificate)
    with_password = _ask("ActivateSession", LocaleIds=["xx", "de"])
    with_password.Parameters.UserIdentityToken = ua.UserNameIdentityToken(
        UserName="good",
        Password=bytes(256),
        EncryptionAlgorithm="http://www.w3.org/2001/04/xmlenc#rsa-oaep",
    )
    yield Request("A user with a password", with_password)


def _push() -> Iterator[Request]:
    """What an authority does to certificate and trust."""
    revoked = crl_of(_ROOT, ends=_END)
    lists = TrustListContents((_MADE.certificate,), (), (_ROOT.certificate,), (revoked,))
    group, kind = (ua.NodeId(), Type.NodeId), (ua.NodeId(), Type.NodeId)
    handle, other = (number(HANDLE), Type.UInt32), (number(OTHER_HANDLE), Type.UInt32)
    yes = (True, Type.Boolean)
    for name, given in (
        (
            "ServerConfiguration_CreateSigningRequest",
            (group, kind, ("CN=bridge", Type.String), (False, Type.Boolean), (bytes(32), Type.ByteString)),
        ),
        (
            "ServerConfiguration_UpdateCertificate",
            (
                group,
                kind,
                (_MADE.der, Type.ByteString),
                ([_ROOT.der], Type.ByteString),
                ("PEM", Type.String),
                (_MADE.pem_key, Type.ByteString),
            ),
        ),
        ("ServerConfiguration_ApplyChanges", ()),
        ("ServerConfiguration_GetRejectedList", ()),
        (f"{_LIST}_Open", ((1, Type.Byte),)),
        (f"{_LIST}_Open", ((6, Type.Byte),)),
        (f"{_LIST}_OpenWithMasks", ((15, Type.UInt32),)),
        (f"{_LIST}_Read", (handle, (1000, Type.Int32))),
        (f"{_LIST}_GetPosition", (handle,)),
        (f"{_LIST}_SetPosition", (handle, (10, Type.UInt64))),
        (f"{_LIST}_Close", (handle,)),
        (f"{_LIST}_Write", (other, (encoded(lists, 15), Type.ByteString))),
        (f"{_LIST}_CloseAndUpdate", (other,)),
        (f"{_LIST}_AddCertificate", ((_MADE.der, Type.ByteString), yes)),
        (f"{_LIST}_RemoveCertificate", ((thumbprint(_MADE.certificate), Type.String), yes)),
    ):
        where = ua.NodeId(getattr(Ids, name.rpartition("_")[0]))
        call = _call(where, ua.NodeId(getattr(Ids, name)), *given)
        yield Request(name.replace(_LIST, "TrustList"), call, "admin")
