"""Drives as assets of Powertrain, DI and Machinery: their types are kept, and nothing is invented."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from asyncua import ua
from asyncua.server.address_space import AddressSpace

from bridge.base.errors import Unavailable
from bridge.catalogue import Catalogue
from bridge.image import Image, Quality
from bridge.northbound.opcua.models.assets import Assets, read_models
from bridge.northbound.opcua.models.nameplates import nameplates_of
from bridge.northbound.opcua.space.nodes import layout
from bridge.northbound.opcua.space.tree import Tree
from bridge.project import load_project
from bridge.uaserver.hierarchy import related, supertypes
from bridge.uaserver.library import node_id
from tests.support.standard_space import standard_space

Ids, Attribute = ua.ObjectIds, ua.AttributeIds
DEMO = Path(__file__).parents[5] / "bridge/demo/site.toml"
OWN = 2
DI_URI = "http://opcfoundation.org/UA/DI/"
PARTS = (Ids.HasComponent, Ids.HasProperty, Ids.HasAddIn, Ids.HasOrderedComponent)


class Served:
    """The demo's drives in an address space, and the image that they show."""

    def __init__(self, *, with_draft: bool = False) -> None:
        project = load_project(DEMO)
        catalogue = Catalogue.of(project.site, project.families)
        models = read_models()
        self.image = Image(catalogue.points)
        self.space = standard_space()
        trees = layout(self.image.points)
        assets = Assets(models, trees[0], nameplates_of(catalogue), with_draft=with_draft)
        self.tree = Tree(
            self.space, OWN, self.image, lambda at: round(at * 1e9), trees, stands_for=assets.point
        )
        indexes = list(range(3, 3 + len(models.namespaces)))
        self.di = indexes[models.namespaces.index(DI_URI)]
        assets.open(self.space, [*indexes, OWN], self.image, lambda at: 0, self.tree.watched)

    def read(self, name: str, attribute: Attribute = Attribute.Value) -> ua.DataValue:
        return self.space.read_attribute_value(node_id(name, OWN), attribute)

    def set(self, name: str, value: object, quality: Quality = Quality.GOOD) -> None:
        index = next(place for place, point in enumerate(self.image.points) if point.name == name)
        self.image.set(index, value, 1.0)
        self.image.judge([index], quality, 1.0)

    def assets(self) -> list[ua.NodeId]:
        found = related(self.space, node_id(5001, self.di), Ids.HasComponent)
        return [one.NodeId for one in found if one.NodeId.NamespaceIndex == OWN]


@pytest.fixture(scope="module")
def served() -> Served:
    return Served()


def parts(space: AddressSpace, where: ua.NodeId) -> dict[str, ua.NodeId]:
    return {one.BrowseName.to_string(): one.NodeId for kind in PARTS for one in related(space, where, kind)}


def mandatory(space: AddressSpace, kind: ua.NodeId) -> Iterator[tuple[str, ua.NodeId]]:
    for above in supertypes(space, kind):
        for name, declared in parts(space, above).items():
            rules = [one.NodeId for one in related(space, declared, Ids.HasModellingRule)]
            if node_id(Ids.ModellingRule_Mandatory) in rules:
                yield name, declared


def type_of(space: AddressSpace, where: ua.NodeId) -> ua.NodeId | None:
    return next((one.NodeId for one in related(space, where, Ids.HasTypeDefinition)), None)


def all_below(space: AddressSpace, where: ua.NodeId) -> Iterator[ua.NodeId]:
    yield where
    for below in parts(space, where).values():
        if "/Asset" in str(below.Identifier):
            yield from all_below(space, below)


def declared_in(space: AddressSpace, kind: ua.NodeId) -> dict[str, ua.NodeId]:
    found: dict[str, ua.NodeId] = {}
    for above in supertypes(space, kind):
        found = parts(space, above) | found
    return found


def test_every_drive_is_an_asset_with_all_that_its_types_demand(served: Served) -> None:
    space = served.space
    names = [str(one.Identifier) for one in served.assets()]
    assert names == [f"{drive}/Asset" for drive in ("conveyor/fu1", "conveyor/fu2", "conveyor/fu3",
                     "conveyor/fu4", "pump/drive", "lift/drive", "fan/drive")]  # fmt: skip
    for asset in served.assets():
        for where in all_below(space, asset):
            kind = type_of(space, where)
            assert kind in space, where
            has = parts(space, where)
            for name, _ in mandatory(space, kind):
                assert name in has, (where, name)
            for name, declared in declared_in(space, kind).items():
                if name not in has:
                    continue
                of_type, wanted = type_of(space, has[name]), type_of(space, declared)
                assert wanted in supertypes(space, of_type), (where, name)
                data_type = space.read_attribute_value(declared, Attribute.DataType).Value
                if data_type is not None:
                    assert space.read_attribute_value(has[name], Attribute.DataType).Value == data_type


def test_every_reference_of_an_asset_leads_to_a_node(served: Served) -> None:
    for asset in served.assets():
        for where in all_below(served.space, asset):
            for reference in served.space[where].references:
                assert reference.NodeId in served.space, (where, reference)


def test_todays_nodes_are_referred_to_and_stay_as_they_are(served: Served) -> None:
    asset = node_id("conveyor/fu1/Asset", OWN)
    has = {name.partition(":")[2]: where for name, where in parts(served.space, asset).items()}
    methods = {one.NodeId.Identifier for one in related(served.space, has["MethodSet"], Ids.HasComponent)}
    assert "conveyor/fu1/TakeControl" in methods
    status = {one.NodeId.Identifier for one in related(served.space, has["Status"], Ids.Organizes)}
    assert {"conveyor/fu1/status/state", "conveyor/fu1/actual/current"} <= status
    drive = served.space[node_id("conveyor/fu1", OWN)]
    assert not [one for one in drive.references if "Asset" in str(one.NodeId.Identifier)]


def test_the_nameplate_is_what_is_known_and_no_more(served: Served) -> None:
    def plate(drive: str, name: str) -> ua.DataValue:
        return served.read(f"{drive}/Asset/Identification/{name}")

    assert plate("conveyor/fu1", "Manufacturer").Value.Value.Text == "Getriebebau NORD"
    assert plate("fan/drive", "Manufacturer").StatusCode.value == ua.StatusCodes.BadNotSupported
    assert node_id("fan/drive/Asset/Model", OWN) not in served.space
    assert plate("lift/drive", "SerialNumber").StatusCode.value == ua.StatusCodes.BadWaitingForInitialData
    served.set("lift/drive/identity/serial", 4711)
    assert plate("lift/drive", "SerialNumber").Value.Value == "4711"
    served.set("lift/drive/identity/serial", 0)
    assert plate("lift/drive", "SerialNumber").StatusCode.value == ua.StatusCodes.BadNotSupported


@pytest.mark.parametrize(
    ("values", "health"),
    [
        ({}, 0),
        ({"status/state": 7}, 1),
        ({"status/state": 6}, 1),
        ({"supervision/follows": False}, 1),
        ({"supervision/watchdog_state": 3, "status/state": 7}, 2),
        ({"status/status_word": 0x0080}, 3),
    ],
)
def test_the_health_is_the_drives(served: Served, values: dict[str, object], health: int) -> None:
    sound = {
        "status/state": 2,
        "status/status_word": 0x0031,
        "supervision/watchdog_state": 1,
        "supervision/follows": True,
    }
    for leaf, value in (sound | values).items():
        served.set(f"conveyor/fu1/{leaf}", value)
    told = served.read("conveyor/fu1/Asset/DeviceHealth")
    assert (told.Value.Value, told.Value.VariantType) == (health, ua.VariantType.Int32)


def test_the_health_is_as_good_as_what_the_drive_says(served: Served) -> None:
    served.set("conveyor/fu2/status/state", 2, Quality.DEAD)
    told = served.read("conveyor/fu2/Asset/DeviceHealth")
    assert told.StatusCode.value == ua.StatusCodes.BadNoCommunication


def test_a_main_setpoint_is_the_point_that_leads_the_drive(served: Served) -> None:
    for drive, leaf in (("conveyor/fu1", "frequency"), ("fan/drive", "velocity")):
        name = f"{drive}/Asset/Operational/MainSetpoint"
        point = served.tree.writable(node_id(name, OWN))
        assert point and point.id == f"{drive}/command/{leaf}"
        assert served.tree.writable(node_id(f"{drive}/Asset/Operational/MainActualValue", OWN)) is None
    units = served.read("fan/drive/Asset/Operational/MainSetpoint/EngineeringUnits").Value.Value
    assert units.DisplayName.Text == "1/min"


def test_who_watches_a_health_is_told_by_each_of_its_points(served: Served) -> None:
    node = served.space[node_id("pump/drive/Asset/DeviceHealth", OWN)]
    node.attributes[Attribute.Value].datachange_callbacks[7] = print
    again = served.space[node_id("pump/drive/Asset/DeviceHealth", OWN)]
    assert again.attributes[Attribute.Value].datachange_callbacks == {7: print}
    told = {
        served.image.points[index].leaf
        for index, places in served.tree.watched.items()
        if any(7 in one.watchers for one in places.values())
    }
    assert told == {"state", "status_word", "watchdog_state", "follows"}


class TestDraft:
    """What we make of OPC 40400-2 before it is published."""

    def test_without_the_key_there_is_none(self, served: Served) -> None:
        asset = node_id("conveyor/fu1/Asset", OWN)
        assert not [name for name in parts(served.space, asset) if "Draft" in name]
        assert node_id("DraftLockType", OWN) not in served.space

    def test_it_says_that_it_is_a_draft_and_has_types_of_our_own_alone(self) -> None:
        served = Served(with_draft=True)
        model = "conveyor/fu1/Asset/FunctionalModelDraft"
        assert served.read(f"{model}/Edition").Value.Value.endswith("announced for 2027-01-01")
        for name in ("", "/Axis", "/Lock", "/Logbook"):
            kind = type_of(served.space, node_id(model + name, OWN))
            assert kind.NamespaceIndex == OWN
            assert supertypes(served.space, kind)[1:] == [node_id(Ids.BaseObjectType)]
        lock = parts(served.space, node_id(f"{model}/Lock", OWN)).values()
        names = ("TakeControl", "ReleaseControl", "KeepAlive", "supervision/owner")
        assert {one.Identifier for one in lock} == {f"conveyor/fu1/{name}" for name in names}
        below = [one.NodeId for one in related(served.space, node_id(Ids.BaseObjectType), Ids.HasSubtype)]
        assert node_id("DraftLogbookType", OWN) in below


def test_without_the_models_it_says_what_to_run(tmp_path: Path) -> None:
    with pytest.raises(Unavailable, match=r"python -m tools\.nodesets"):
        read_models(tmp_path / "models.json")
