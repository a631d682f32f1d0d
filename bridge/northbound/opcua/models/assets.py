"""The drives as assets of the published models: rows made when somebody looks at them, values of points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from functools import lru_cache, partial
from pathlib import Path
from typing import Final

from asyncua.server.address_space import AddressSpace, AttributeValue

from bridge.base.errors import Unavailable
from bridge.catalogue.codes import WatchdogState
from bridge.drive import FAULTED
from bridge.image import Image, Value
from bridge.northbound.opcua.models.asset_rows import ASSET, AssetLayout, AssetRows, Conversion, DerivedRow
from bridge.northbound.opcua.models.nameplates import Nameplate
from bridge.northbound.opcua.space.data_values import EpochNs, present_value
from bridge.northbound.opcua.space.nodes import ObjectNode, VariableNode
from bridge.northbound.opcua.space.point_values import HEALTH, SAME, TEXT_OF_NUMBER, AllWatched, DerivedValue
from bridge.northbound.opcua.space.structures import range_of, units_of, value_type
from bridge.text import Text
from bridge.uaserver.address_space import put_behind
from bridge.uaserver.library import GOOD, ObjectIds, StatusCodes, data_value, status, ua, variant
from bridge.uaserver.nodesets import Models, NodesetStore, Row, load_models

_FILE: Final = Path(__file__).parents[1] / "nodesets" / "models.json"
_KEPT: Final = 4
"""Drives whose rows are kept once made: clients look at one after the other."""

_PLACES: Final = {
    Conversion.SAME: SAME,
    Conversion.TEXT: TEXT_OF_NUMBER,
    Conversion.HEALTH: HEALTH,
}

# DeviceHealthEnumeration (OPC 10000-100 §4.5.4), after NAMUR NE 107.
_NORMAL, _FAILURE, _CHECK_FUNCTION, _OFF_SPEC = 0, 1, 2, 3
_FAULTS: Final = frozenset(state.value for state in FAULTED)
_NO_VALUE: Final = variant(None, ua.VariantType.Null)
_NOT_KNOWN: Final = status(StatusCodes.BadNotSupported)


def read_models(file: Path = _FILE) -> Models:
    """The published models. Raises ``Unavailable`` where the package was never built or installed."""
    try:
        return load_models(file.read_bytes())
    except FileNotFoundError:
        raise Unavailable(Text.of("opcua.no_models", file=str(file))) from None


class Assets:
    """Assets of a site in ``models``, which are changed. ``with_draft``: with ours of OPC 40400-2."""

    def __init__(
        self,
        models: Models,
        drives: ObjectNode,
        nameplates: Mapping[str, Nameplate],
        *,
        with_draft: bool = False,
    ) -> None:
        places = {uri: place for place, uri in enumerate(models.namespaces, 1)}
        self._models = models
        self.layout = AssetLayout(drives, nameplates, places, len(places) + 1, with_draft=with_draft)
        self._rows = lru_cache(_KEPT)(self.layout.made)
        self._draft = self.layout.draft_types()
        base, below = f"0;i={ObjectIds.BaseObjectType}", f"0;i={ObjectIds.HasSubtype}"
        models.outside += [(base, below, True, row.id) for row in self._draft.rows.values()]
        device_set = next(row for row in models.nodes if row.id == self.layout.device_set)
        below = f"0;i={ObjectIds.HasComponent}"
        device_set.references += [(below, True, self.layout.asset_id(name)) for name in self.layout.drives]

    def open(
        self,
        space: AddressSpace,
        namespaces: Sequence[int],
        image: Image,
        epoch_ns: EpochNs,
        watched: AllWatched,
    ) -> None:
        """Put them into ``space``, behind what it has. ``namespaces`` are the indexes of those of the models,
        in their order, and that of the points."""
        values = _Values(self, image, epoch_ns, watched)
        put_behind(space, NodesetStore(self._models, space, namespaces, values).find)

    def rows(self, name: str) -> AssetRows | None:
        drive, is_asset, _ = name.partition(f"/{ASSET}")
        if is_asset and drive in self.layout.drives:
            return self._rows(drive)
        return self._draft if name in self._draft.rows else None

    def point(self, name: str) -> VariableNode | None:
        """The point that a node stands for as it is."""
        found = self.rows(name)
        derived = found.derived.get(name) if found else None
        is_same = derived and derived.conversion is Conversion.SAME
        return derived.points[0] if derived and is_same else None


class _Values:
    """Rows and values of assets as ``NodesetStore`` asks for them."""

    def __init__(self, assets: Assets, image: Image, epoch_ns: EpochNs, watched: AllWatched) -> None:
        self._assets = assets
        self._image = image
        self._epoch_ns = epoch_ns
        self._watched = watched

    def row(self, name: str) -> Row | None:
        found = self._assets.rows(name)
        return found.rows.get(name) if found else None

    def value(self, name: str) -> AttributeValue | None:
        found = self._assets.rows(name)
        derived = found.derived.get(name) if found else None
        return self._made(derived) if derived else None

    def _made(self, derived: DerivedRow) -> AttributeValue:
        point = derived.points[0]
        match derived.conversion:
            case Conversion.UNITS:
                return AttributeValue(data_value(units_of(point.point.unit)))
            case Conversion.RANGE:
                low, high = point.point.low, point.point.high
                assert low is not None and high is not None
                return AttributeValue(data_value(range_of(low, high)))
            case Conversion.SAME:
                read = partial(self._present, point)
            case Conversion.TEXT:
                read = partial(self._text, point)
            case Conversion.HEALTH:
                read = partial(self._health, derived.points)
        return DerivedValue(derived.points, _PLACES[derived.conversion], read, self._watched)

    def _present(self, point: VariableNode) -> ua.DataValue:
        return present_value(self._image, point.index, value_type(point), self._epoch_ns)

    def _text(self, point: VariableNode) -> ua.DataValue:
        """Text of a number. One that is 0 was never set (1018h, CiA 301 §7.5.2)."""
        told = self._present(point)
        if _is_bad(told):
            return told
        value = self._image[point.index].value
        if not value:
            return data_value(_NO_VALUE, _NOT_KNOWN, told.SourceTimestamp, told.ServerTimestamp)
        text = variant(str(value), ua.VariantType.String)
        return data_value(text, told.StatusCode, told.SourceTimestamp, told.ServerTimestamp)

    def _health(self, points: Sequence[VariableNode]) -> ua.DataValue:
        """Health of a drive, as old and as good as its state."""
        told = self._present(points[0])
        if _is_bad(told):
            return told
        values = {one.point.leaf: self._image[one.index].value for one in points}
        words = next((one.point.bits for one in points if one.point.leaf == "status_word"), ())
        health = variant(_health(values, words), ua.VariantType.Int32)
        return data_value(health, told.StatusCode, told.SourceTimestamp, datetime.now(UTC))


def _health(values: Mapping[str, Value], bits: Sequence[str]) -> int:
    if values.get("watchdog_state") == WatchdogState.TRIPPED:
        # The drive is sound, and held stopped: what it reports is not what its controller wants.
        return _CHECK_FUNCTION
    if values["state"] in _FAULTS or values.get("follows") is False:
        return _FAILURE
    is_warned = "warning" in bits and int(values["status_word"]) >> bits.index("warning") & 1
    return _OFF_SPEC if is_warned else _NORMAL


def _is_bad(told: ua.DataValue) -> bool:
    return (told.StatusCode or GOOD).is_bad()
