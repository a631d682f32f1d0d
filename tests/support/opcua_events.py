"""Events as they are kept, with all types of fields that they have."""

from __future__ import annotations

from asyncua import ua

from bridge.northbound.opcua.events.event_file import EventLog
from bridge.northbound.opcua.events.event_records import EventCodec, EventRecord, Fields
from bridge.northbound.opcua.space.notifiers import Notifiers
from bridge.uaserver.history.history import date_time
from bridge.uaserver.languages import Spoken

URIS = ("http://opcfoundation.org/UA/", "urn:host:drivebridge", "urn:drivebridge:points")
Kind = ua.VariantType


def fields(number: int = 0, words: str = "lost") -> Fields:
    return {
        "EventId": ua.Variant(bytes([number % 256]), Kind.ByteString),
        "EventType": ua.Variant(ua.NodeId("NodeLostEventType", 2), Kind.NodeId),
        "SourceName": ua.Variant("conveyor/fu1", Kind.String),
        "Time": ua.Variant(date_time(number), Kind.DateTime),
        "Message": ua.Variant(Spoken({"en": words, "de": f"{words} auf Deutsch"}), Kind.LocalizedText),
        "Severity": ua.Variant(800, Kind.UInt16),
        "Retain": ua.Variant(True, Kind.Boolean),
        "Quality": ua.Variant(ua.StatusCode(0), Kind.StatusCode),
        "2:Code": ua.Variant("node.lost", Kind.String),
        "EnabledState/Id": ua.Variant(False, Kind.Boolean),
        "ClientUserId": ua.Variant(None, Kind.Null),
    }


def record(number: int, source: str = "conveyor/fu1", words: str = "lost") -> EventRecord:
    return EventCodec(URIS).record(number, source, fields(number, words))


def event_log(hours: int = 24, most_bytes: int = 1_000_000) -> EventLog:
    names = ("bridge", "bus/can0", "conveyor", "conveyor/fu1", "pump")
    notifiers = Notifiers({name: ua.NodeId(name, 2) for name in names})
    return EventLog(EventCodec(URIS), notifiers, hours, most_bytes)
