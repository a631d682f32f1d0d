"""Drives as assets of the published models: OPC 40400-1 (Powertrain), OPC 10000-100 (DI), OPC 40001-1
(Machinery). Rows beside the nodes of the points, most of which only refer to them (ADR 26). Knows nothing of
the server."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Final

from bridge.northbound.opcua.models.nameplates import Nameplate
from bridge.northbound.opcua.space.data_values import VARIANT_TYPE
from bridge.northbound.opcua.space.nodes import ObjectNode, VariableKind, VariableNode
from bridge.northbound.opcua.space.structures import READ, READ_WRITE
from bridge.uaserver.library import ObjectIds, ua
from bridge.uaserver.nodesets import Reference, Row

ASSET: Final = "Asset"
"""Last part of the id of a drive's asset."""

DI: Final = "http://opcfoundation.org/UA/DI/"
MACHINERY: Final = "http://opcfoundation.org/UA/Machinery/"
POWERTRAIN: Final = "http://opcfoundation.org/UA/Powertrain/"

# Numbers of the nodes in the models' own files.
_DEVICE_SET: Final = 5001
_FUNCTIONAL_GROUP: Final = 1005
_DEVICE_HEALTH: Final = 6244
_COMPONENT_IDENTIFICATION: Final = 1005
_DRIVE: Final = 1035
_DRIVE_TYPES: Final[Mapping[str, int]] = {
    "frequency_converter": 1016,
    "servo_drive": 1020,
    "variable_speed_drive": 1028,
}
"""Types of OPC 40400-1 by the ``drive_type`` of mapping files."""

_MAIN: Final = ("velocity", "frequency", "position")
"""Leaves of what a drive is led by, the first that it has."""
_HEALTH: Final = ("status/state", "status/status_word", "supervision/watchdog_state", "supervision/follows")
MAINS: Final = ("MainSetpoint", "MainActualValue")
DRAFT_TYPES: Final = (
    "DraftFunctionalModelType",
    "DraftDriveAxisType",
    "DraftLockType",
    "DraftLogbookType",
)
"""Types of what we make of OPC 40400-2."""
EDITION: Final = "OPC 40400-2: draft, no edition is published; announced for 2027-01-01"
_OF_AXIS: Final = ("Start", "Stop", "QuickStop", "DisableVoltage", "ResetFault")
_OF_LOCK: Final = ("TakeControl", "ReleaseControl", "KeepAlive")
_LOGBOOK: Final = (
    "status/fault_number",
    "status/fault_text",
    "status/fault_cause",
    "status/fault_remedy",
    "status/emcy_code",
    "supervision/last_fault",
    "supervision/last_fault_text",
)
_Class = ua.NodeClass


class Conversion(Enum):
    """Rendering of points as the value of a node of the model."""

    SAME = "the point as it is"
    TEXT = "the point's number as a text, bad where it is 0: then nobody has set it"
    HEALTH = "health of the drive"
    UNITS = "engineering units of the point"
    RANGE = "range of the point"


@dataclass(frozen=True, slots=True)
class DerivedRow:
    """Value of a node that is made of points."""

    conversion: Conversion
    points: tuple[VariableNode, ...]


@dataclass(slots=True)
class AssetRows:
    """The nodes of one drive by their ids. ``derived`` are those whose value is made of points."""

    rows: dict[str, Row] = field(default_factory=dict[str, Row])
    derived: dict[str, DerivedRow] = field(default_factory=dict[str, DerivedRow])


class AssetLayout:
    """Assets of the drives below ``drives``, the folder of the points' layout. ``places`` are those of the
    namespaces by URI, ``own`` is that of the points. ``with_draft``: with what we make of OPC 40400-2."""

    def __init__(
        self,
        drives: ObjectNode,
        nameplates: Mapping[str, Nameplate],
        places: Mapping[str, int],
        own: int,
        *,
        with_draft: bool,
    ) -> None:
        self._drives = {
            drive.id: (node, drive) for node in drives.objects for drive in node.objects if not drive.folder
        }
        self._nameplates = nameplates
        self._places = places
        self._own = own
        self.with_draft = with_draft

    @property
    def drives(self) -> Collection[str]:
        return self._drives.keys()

    @property
    def device_set(self) -> str:
        return self.of(DI, _DEVICE_SET)

    def asset_id(self, drive: str) -> str:
        return f"{self._own};s={drive}/{ASSET}"

    def made(self, drive: str) -> AssetRows:
        """Rows of the drive's asset. Raises KeyError for what is no drive."""
        node, found = self._drives[drive]
        maker = _Maker(self, node, found, self._nameplates.get(drive, Nameplate()))
        maker.make()
        return maker.made

    def draft_types(self) -> AssetRows:
        """Types of the draft, of our own namespace; none without it."""
        made = AssetRows()
        for name in DRAFT_TYPES if self.with_draft else ():
            top = f"0;i={ObjectIds.BaseObjectType}"
            made.rows[name] = Row(
                id=self.point(name),
                node_class=int(_Class.ObjectType),
                browse_name=self.own(name),
                display_name=name,
                references=[_back(ObjectIds.HasSubtype, top)],
            )
        return made

    def of(self, uri: str, number: int) -> str:
        """NodeId of a node of a model."""
        return f"{self._places[uri]};i={number}"

    def name(self, uri: str, name: str) -> str:
        """BrowseName of a model."""
        return f"{self._places[uri]};{name}"

    def own(self, name: str) -> str:
        """BrowseName of ours."""
        return f"{self._own};{name}"

    def point(self, node: str) -> str:
        """NodeId of a node beside the points."""
        return f"{self._own};s={node}"


class _Maker:
    """Maker of the rows of one drive."""

    def __init__(
        self, layout: AssetLayout, node: ObjectNode, drive: ObjectNode, nameplate: Nameplate
    ) -> None:
        self.made = AssetRows()
        self._layout = layout
        self._drive = drive
        self._nameplate = nameplate
        self._points = {
            variable.id.removeprefix(f"{drive.id}/"): variable
            for group in drive.objects
            for variable in _variables(group)
        }
        self._node_points = {
            variable.point.leaf: variable for group in node.objects for variable in group.variables
        }

    def make(self) -> None:
        layout, drive = self._layout, self._drive
        kind = layout.of(POWERTRAIN, _DRIVE_TYPES.get(self._nameplate.drive_type, _DRIVE))
        asset = self._object(ASSET, layout.own(drive.id), kind)
        asset.references.append(_back(ObjectIds.HasComponent, layout.device_set))
        self._nameplate_of(asset)
        identification = self._below(
            asset,
            layout.name(DI, "Identification"),
            layout.of(MACHINERY, _COMPONENT_IDENTIFICATION),
            ObjectIds.HasAddIn,
        )
        self._nameplate_of(identification)
        self._health(asset)
        methods = self._below(asset, layout.name(DI, "MethodSet"), f"0;i={ObjectIds.BaseObjectType}")
        self._refer(methods, ObjectIds.HasComponent, (method.id for method in drive.methods))
        parameters = [one.id for one in self._of_group("parameter")]
        if parameters:
            kept = self._below(asset, layout.name(DI, "ParameterSet"), f"0;i={ObjectIds.BaseObjectType}")
            self._refer(kept, ObjectIds.HasComponent, parameters)
        self._operational(asset)
        self._group(asset, "Status", "status", "actual")
        self._group(asset, "Diagnostics", "supervision")
        if parameters:
            self._group(asset, "Configuration", "parameter")
        if layout.with_draft:
            self._draft(asset)

    def _nameplate_of(self, owner: Row) -> None:
        """Properties of DI's nameplate interfaces (OPC 10000-100 §4.5), as far as they are known."""
        plate = self._nameplate
        self._text(owner, "Manufacturer", plate.manufacturer)
        if plate.model:
            self._text(owner, "Model", plate.model)
        self._text(owner, "ComponentName", self._drive.id)
        points, node_points = self._points, self._node_points
        for name, point in (
            ("SerialNumber", points.get("identity/serial")),
            ("ProductCode", points.get("identity/product")),
            ("DeviceRevision", points.get("identity/revision")),
            ("SoftwareRevision", node_points.get("software_version")),
        ):
            if point:
                row = self._property(owner, name, ObjectIds.String)
                self.made.derived[_id(row)] = DerivedRow(Conversion.TEXT, (point,))

    def _text(self, owner: Row, name: str, words: str) -> None:
        row = self._property(owner, name, ObjectIds.LocalizedText)
        row.value = ("LocalizedText", words) if words else None

    def _health(self, asset: Row) -> None:
        points = tuple(self._points[leaf] for leaf in _HEALTH if leaf in self._points)
        row = self._variable(asset, self._layout.name(DI, "DeviceHealth"), ObjectIds.BaseDataVariableType)
        row.data_type = self._layout.of(DI, _DEVICE_HEALTH)
        self.made.derived[_id(row)] = DerivedRow(Conversion.HEALTH, points)

    def _operational(self, asset: Row) -> None:
        group = self._functional_group(asset, "Operational")
        for leaf_group, name in zip(("command", "actual"), MAINS, strict=True):
            main = next(
                (
                    self._points[f"{leaf_group}/{leaf}"]
                    for leaf in _MAIN
                    if f"{leaf_group}/{leaf}" in self._points
                ),
                None,
            )
            if main:
                self._main(group, name, main)
        self._refer(group, ObjectIds.Organizes, (method.id for method in self._drive.methods))
        self._refer(group, ObjectIds.Organizes, (one.id for one in self._of_group("command")))

    def _main(self, group: Row, name: str, point: VariableNode) -> None:
        is_analog = point.kind is VariableKind.ANALOG
        kind = ObjectIds.AnalogUnitType if is_analog else ObjectIds.BaseDataVariableType
        row = self._variable(group, self._layout.own(name), kind)
        row.data_type = f"0;i={VARIANT_TYPE[point.point.data_type].value}"
        row.access = READ_WRITE if point.writable else READ
        self.made.derived[_id(row)] = DerivedRow(Conversion.SAME, (point,))
        if is_analog:
            self._content(row, "EngineeringUnits", ObjectIds.EUInformation, Conversion.UNITS, point)
            if point.point.low is not None and point.point.high is not None:
                self._content(row, "EURange", ObjectIds.Range, Conversion.RANGE, point)

    def _content(
        self, owner: Row, name: str, data_type: int, conversion: Conversion, point: VariableNode
    ) -> None:
        row = self._property(owner, f"0;{name}", data_type)
        self.made.derived[_id(row)] = DerivedRow(conversion, (point,))

    def _group(self, asset: Row, name: str, *groups: str) -> None:
        row = self._functional_group(asset, name)
        for group in groups:
            self._refer(row, ObjectIds.Organizes, (one.id for one in self._of_group(group)))

    def _functional_group(self, asset: Row, name: str) -> Row:
        layout = self._layout
        return self._below(asset, layout.name(DI, name), layout.of(DI, _FUNCTIONAL_GROUP))

    def _of_group(self, group: str) -> Iterator[VariableNode]:
        return (one for name, one in self._points.items() if name.startswith(f"{group}/"))

    def _draft(self, asset: Row) -> None:
        """Axis, lock and logbook, as OPC 40400-2 has announced them, with types of ours."""
        layout = self._layout
        model = self._below(asset, layout.own("FunctionalModelDraft"), layout.point(DRAFT_TYPES[0]))
        edition = self._property(model, layout.own("Edition"), ObjectIds.String)
        edition.value = ("String", EDITION)
        axis, lock, logbook = (
            self._below(model, layout.own(name), layout.point(kind))
            for name, kind in zip(("Axis", "Lock", "Logbook"), DRAFT_TYPES[1:], strict=True)
        )
        mains = (f"{self._drive.id}/{ASSET}/Operational/{name}" for name in MAINS)
        self._refer(axis, ObjectIds.HasComponent, [one for one in mains if one in self.made.rows])
        self._refer(axis, ObjectIds.HasComponent, (one.id for one in self._of_group("status")))
        self._methods(axis, _OF_AXIS)
        self._methods(lock, _OF_LOCK)
        self._refer(lock, ObjectIds.HasComponent, self._named(("supervision/owner",)))
        self._refer(logbook, ObjectIds.HasComponent, self._named(_LOGBOOK))

    def _methods(self, owner: Row, names: Collection[str]) -> None:
        found = (one.id for one in self._drive.methods if one.browse_name in names)
        self._refer(owner, ObjectIds.HasComponent, found)

    def _named(self, leaves: Sequence[str]) -> Iterator[str]:
        return (self._points[leaf].id for leaf in leaves if leaf in self._points)

    # rows

    def _refer(self, owner: Row, kind: int, nodes: Iterator[str] | Sequence[str]) -> None:
        owner.references += [_forward(kind, self._layout.point(node)) for node in nodes]

    def _below(self, above: Row, name: str, kind: str, reference: int = ObjectIds.HasComponent) -> Row:
        words = name.partition(";")[2]
        made = self._object(f"{_path(above)}/{words}", name, kind)
        _join(above, made, reference)
        return made

    def _object(self, path: str, name: str, kind: str) -> Row:
        return self._keep(path, name, _Class.Object, kind)

    def _variable(self, above: Row, name: str, kind: int) -> Row:
        words = name.partition(";")[2]
        made = self._keep(f"{_path(above)}/{words}", name, _Class.Variable, f"0;i={kind}")
        is_property = kind == ObjectIds.PropertyType
        _join(above, made, ObjectIds.HasProperty if is_property else ObjectIds.HasComponent)
        return made

    def _property(self, above: Row, name: str, data_type: int) -> Row:
        qualified = name if ";" in name else self._layout.name(DI, name)
        made = self._variable(above, qualified, ObjectIds.PropertyType)
        made.data_type = f"0;i={data_type}"
        return made

    def _keep(self, path: str, name: str, node_class: ua.NodeClass, kind: str) -> Row:
        full = f"{self._drive.id}/{path}"
        made = Row(
            id=self._layout.point(full),
            node_class=int(node_class),
            browse_name=name,
            display_name=name.partition(";")[2],
            references=[_forward(ObjectIds.HasTypeDefinition, kind)],
        )
        self.made.rows[full] = made
        return made


def _variables(group: ObjectNode) -> Iterator[VariableNode]:
    yield from group.variables
    for below in group.objects:
        yield from _variables(below)


def _id(row: Row) -> str:
    return row.id.partition(";s=")[2]


def _path(row: Row) -> str:
    """The part of its id from the asset on."""
    return ASSET + _id(row).partition(f"/{ASSET}")[2]


def _join(above: Row, below: Row, kind: int) -> None:
    above.references.append(_forward(kind, below.id))
    below.references.append(_back(kind, above.id))


def _forward(kind: int, target: str) -> Reference:
    return f"0;i={kind}", True, target


def _back(kind: int, target: str) -> Reference:
    return f"0;i={kind}", False, target
