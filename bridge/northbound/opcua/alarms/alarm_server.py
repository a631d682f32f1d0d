"""The alarms of a server, put together: types, nodes, conditions, and who follows the troubles."""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding

from bridge.base import clock
from bridge.northbound.opcua.alarms.alarm_contents import AlarmContents
from bridge.northbound.opcua.alarms.alarm_file import AlarmFile
from bridge.northbound.opcua.alarms.alarm_nodes import Alarm, AlarmNodes, condition_of
from bridge.northbound.opcua.alarms.alarm_places import CERTIFICATE, alarm_places
from bridge.northbound.opcua.alarms.alarm_rights import AlarmRights
from bridge.northbound.opcua.alarms.alarms import EXPIRATION_LIMIT_MS, Alarms, AlarmTask
from bridge.northbound.opcua.events.event_types import (
    ALARM_FIELDS,
    ALARM_TYPES,
    BASE_ALARM_TYPE,
    CERTIFICATE_ALARM_TYPE,
    EventTypeMaker,
)
from bridge.northbound.opcua.events.events import in_all_languages
from bridge.northbound.opcua.space.notifiers import Notifiers
from bridge.northbound.opcua.space.tree import Tree
from bridge.northbound.trouble_reader import TroubleReader
from bridge.northbound.trouble_words import PlantWords
from bridge.northbound.view import View
from bridge.text import Text
from bridge.uaserver.conditions.condition_fields import ConditionPlace, ConditionWords, common_fields
from bridge.uaserver.conditions.conditions import Condition, Conditions, EventSink
from bridge.uaserver.filters.where import Fields
from bridge.uaserver.inner_server import InnerServer
from bridge.uaserver.library import ObjectIds, node_id, ua, variant

Kind = ua.VariantType
_CLASSES: Final = {
    "drive": (ObjectIds.ProcessConditionClassType, Text.of("alarm.class_process")),
    "other": (ObjectIds.SystemConditionClassType, Text.of("alarm.class_system")),
}
"""Condition classes (OPC 10000-9 §5.9)."""


@dataclass(frozen=True, slots=True)
class AlarmSite:
    """Facts of a site for its alarms. ``fronts`` are the names of its fronts."""

    words: PlantWords = field(default_factory=PlantWords)
    fronts: tuple[str, ...] = ()


def serve_alarms(
    inner: InnerServer,
    tree: Tree,
    view: View,
    site: AlarmSite,
    certificate: x509.Certificate,
    folder: Path,
    sink: EventSink | None,
    *,
    resets: bool,
) -> AlarmTask:
    """Give the server its alarms, as they were left; ``sink`` keeps what they tell from then on. Before the
    first client is let in."""
    rights = AlarmRights(view, resets=resets)
    words = ConditionWords(lambda state: in_all_languages(Text.word("alarm_state", state)))
    conditions = inner.conditions = Conditions(inner.subscriptions, rights, words, _now_ms)
    contents = AlarmContents(view.image, site.words, tree.namespace)
    types = _types(EventTypeMaker(inner.node_mgt_service, tree.namespace))
    alarms = list(_alarms(types, tree, site, contents, certificate))
    nodes = AlarmNodes(inner.aspace, tree.namespace, tree.kinds, conditions, alarms)
    for alarm in alarms:
        conditions.add(alarm.condition)
    conditions.condition_of = condition_of
    tree.beside = nodes
    rights.alarms = {one.condition.place.node: one for one in alarms}
    reader = TroubleReader(view.image, _now_ms)
    expires = certificate.not_valid_after_utc
    followed = Alarms(reader, conditions, contents, alarms, expires, clock.now, _now_ms)
    file = AlarmFile(folder)
    followed.restore(file)
    conditions.sink = sink
    return AlarmTask(followed, conditions, file)


def _now_ms() -> float:
    return time.time() * 1000


def _types(types: EventTypeMaker) -> Mapping[str, ua.NodeId]:
    """Event types by what an alarm is about."""
    base = types.make(BASE_ALARM_TYPE, node_id(ObjectIds.AlarmConditionType), ALARM_FIELDS)
    expiration = node_id(ObjectIds.CertificateExpirationAlarmType)
    of_certificate = types.make(CERTIFICATE_ALARM_TYPE, expiration, ALARM_FIELDS)
    types.generates(base)
    types.generates(of_certificate)
    return {kind: types.make(name, base) for kind, name in ALARM_TYPES.items()} | {
        CERTIFICATE: of_certificate
    }


def _alarms(
    types: Mapping[str, ua.NodeId],
    tree: Tree,
    site: AlarmSite,
    contents: AlarmContents,
    certificate: x509.Certificate,
) -> Iterator[Alarm]:
    common: dict[tuple[str, str], Fields] = {}
    notifiers = Notifiers(tree.notifiers)
    for place in alarm_places(tree.notifiers, site.fronts):
        kind, key = types[place.kind], (place.kind, place.name)
        if key not in common:
            class_id, name = _CLASSES["drive" if place.kind == "drive" else "other"]
            more: Fields = of_certificate(certificate) if place.kind == CERTIFICATE else {}
            common[key] = common_fields(kind, place.name, class_id, in_all_languages(name), more)
        described = ConditionPlace(
            node_id(place.id, tree.namespace),
            tree.notifiers[place.owner],
            place.source_name,
            tuple(notifiers.emitters(place.owner)),
            common[key],
        )
        yield Alarm(place, Condition(described, content=contents.nothing), kind)


def of_certificate(certificate: x509.Certificate) -> Fields:
    """Fields of CertificateExpirationAlarmType (§5.8.14.8)."""
    return {
        "NormalState": variant(ua.NodeId(), Kind.NodeId),
        "ExpirationDate": variant(certificate.not_valid_after_utc, Kind.DateTime),
        "ExpirationLimit": variant(EXPIRATION_LIMIT_MS, Kind.Double),
        "CertificateType": variant(node_id(ObjectIds.RsaSha256ApplicationCertificateType), Kind.NodeId),
        "Certificate": variant(certificate.public_bytes(Encoding.DER), Kind.ByteString),
    }
