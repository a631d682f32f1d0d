"""Address space of a site: its points, its drives as assets of the published models, its types of events.
The server serves it, and ``export opcua --nodeset2`` writes it down."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from asyncua.server.address_space import AddressSpace, NodeManagementService

from bridge.command import EventKind
from bridge.image import Image
from bridge.northbound.opcua.events.event_types import (
    BASE_TYPE,
    DRIVE_EVENT_FIELDS,
    EventTypeMaker,
    type_name,
)
from bridge.northbound.opcua.models.assets import Assets
from bridge.northbound.opcua.models.nameplates import Nameplate
from bridge.northbound.opcua.space.data_values import EpochNs
from bridge.northbound.opcua.space.nodes import ObjectNode
from bridge.northbound.opcua.space.tree import Tree
from bridge.uaserver.library import ObjectIds, node_id, ua
from bridge.uaserver.nodesets import Models

NAMESPACE: Final = "urn:drivebridge:points"


@dataclass(frozen=True, slots=True)
class SiteSpace:
    """``event_types`` are by the kind of event."""

    tree: Tree
    event_types: Mapping[EventKind, ua.NodeId]


def fill(
    space: AddressSpace,
    models: Models,
    indexes: Mapping[str, int],
    image: Image,
    epoch_ns: EpochNs,
    trees: Sequence[ObjectNode],
    nameplates: Mapping[str, Nameplate],
    *,
    keeps_events: bool,
    with_draft: bool,
) -> SiteSpace:
    """Put a site into ``space``. ``indexes`` are those of the namespaces by URI, ``trees`` the layout of the
    image's points, the drives first."""
    own = indexes[NAMESPACE]
    assets = Assets(models, trees[0], nameplates, with_draft=with_draft)
    tree = Tree(space, own, image, epoch_ns, trees, stands_for=assets.point, keeps_events=keeps_events)
    namespaces = [*(indexes[uri] for uri in models.namespaces), own]
    assets.open(space, namespaces, image, epoch_ns, tree.watched)
    return SiteSpace(tree, _event_types(NodeManagementService(space), own))


def _event_types(management: NodeManagementService, namespace: int) -> dict[EventKind, ua.NodeId]:
    types = EventTypeMaker(management, namespace)
    base = types.make(BASE_TYPE, node_id(ObjectIds.BaseEventType), DRIVE_EVENT_FIELDS)
    types.generates(base)
    return {kind: types.make(type_name(kind), base) for kind in EventKind}
