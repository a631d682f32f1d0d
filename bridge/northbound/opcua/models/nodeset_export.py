"""The address space of a site as a UANodeSet file, for SCADA engineers who plan before the bridge runs."""

from __future__ import annotations

from typing import Final

from asyncua.server.address_space import AddressSpace, NodeManagementService
from asyncua.server.standard_address_space import standard_address_space

from bridge.catalogue import Catalogue
from bridge.config import OpcUaTable
from bridge.image import Image
from bridge.northbound.opcua.history.value_rings import ValueRings
from bridge.northbound.opcua.models.asset_rows import DI
from bridge.northbound.opcua.models.assets import read_models
from bridge.northbound.opcua.models.nameplates import nameplates_of
from bridge.northbound.opcua.models.nodeset_file import NodesetWriter
from bridge.northbound.opcua.models.site_space import NAMESPACE, fill
from bridge.northbound.opcua.space.nodes import layout
from bridge.text import LANGUAGES
from bridge.uaserver.library import ObjectIds, get, node_id

_STANDARD: Final = ("http://opcfoundation.org/UA/", "1.05.03", "2023-12-15T00:00:00Z")
"""The standard's own model that all others are content with."""
_DEVICE_SET: Final = 5001


def nodeset_of(catalogue: Catalogue, version: str) -> str:
    """The file; the same for the same site and ``version``. Raises ``Unavailable`` without the models."""
    space = AddressSpace()
    get(standard_address_space, "fill_address_space")(NodeManagementService(space))
    models = read_models()
    indexes = {uri: index for index, uri in enumerate([NAMESPACE, *models.namespaces], 2)}
    settings = catalogue.site.opcua or OpcUaTable.model_validate({})
    image, kept = Image(catalogue.points), settings.history
    fill(
        space,
        models,
        indexes,
        image,
        round,
        layout(image.points, ValueRings(image, round, kept).rings, kept.black_boxes),
        nameplates_of(catalogue),
        keeps_events=kept.event_hours > 0,
        with_draft=settings.powertrain_draft,
    )
    writer = NodesetWriter(space, {index: uri for uri, index in indexes.items()}, LANGUAGES)
    starts = [
        node_id(ObjectIds.BaseEventType),
        node_id(ObjectIds.BaseObjectType),
        node_id(ObjectIds.ObjectsFolder),
        node_id(_DEVICE_SET, indexes[DI]),
    ]
    return writer.write(version, starts, [_STANDARD, *models.models])
