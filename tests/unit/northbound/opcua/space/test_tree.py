"""The nodes of the points: as if asyncua had made and held each of them, and yet almost nothing is held."""

from __future__ import annotations

import gc
import random
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from asyncua import ua
from asyncua.server.address_space import AddressSpace

from bridge.catalogue import Catalogue
from bridge.command import Plant
from bridge.image import DataType, Image, Point
from bridge.mapping import family_names
from bridge.northbound.opcua.space.nodes import ObjectNode, layout
from bridge.northbound.opcua.space.tree import Tree
from bridge.project import load_project
from tests.support import sites
from tests.support.families import FamilySite
from tests.support.opcua_held import HeldTree, copy_of
from tests.support.opcua_site import make_plant
from tests.support.standard_space import standard_space

NAMESPACE = 2
DEMO = Path(__file__).parents[5] / "bridge/demo/site.toml"
VALUE = ua.AttributeIds.Value


def epoch(time: float) -> int:
    return round(time * 1e9)


def tree_in(space: AddressSpace, image: Image) -> Tree:
    return Tree(space, NAMESPACE, image, epoch, layout(image.points))


def of_all_families(folder: Path) -> Plant:
    return of_project(FamilySite(folder, family_names(), "opcua").path)


def of_project(path: Path) -> Plant:
    project = load_project(path)
    return Plant(Catalogue.of(project.site, project.families), "1.2.3")


PLANTS: dict[str, Callable[[Path], Plant]] = {
    "four drives": lambda _: make_plant(),
    "all families": of_all_families,
    "demo": lambda _: of_project(DEMO),
}


@pytest.fixture(scope="module")
def standard() -> AddressSpace:
    return standard_space()


@pytest.fixture
def image() -> Image:
    return make_plant().image


@pytest.fixture
def space(standard: AddressSpace) -> AddressSpace:
    return copy_of(standard)


@pytest.fixture
def tree(space: AddressSpace, image: Image) -> Tree:
    return tree_in(space, image)


@pytest.mark.landing
@pytest.mark.parametrize("name", PLANTS)
def test_clients_see_what_asyncua_would_have_held(name: str, standard: AddressSpace, tmp_path: Path) -> None:
    image = PLANTS[name](tmp_path).image
    check_against_asyncua(standard, image, layout(image.points))


@pytest.mark.landing
def test_clients_see_of_history_what_asyncua_would_have_held(standard: AddressSpace) -> None:
    image = make_plant().image
    check_against_asyncua(standard, image, layout(image.points, range(0, 500, 3), 2), keeps_events=True)


def check_against_asyncua(
    standard: AddressSpace, image: Image, trees: Sequence[ObjectNode], *, keeps_events: bool = False
) -> None:
    held = HeldTree(copy_of(standard), NAMESPACE, trees, 5 if keeps_events else 1)
    space = copy_of(standard)
    Tree(space, NAMESPACE, image, epoch, trees, keeps_events=keeps_events)
    ids = [ua.NodeId(ua.ObjectIds.ObjectsFolder), ua.NodeId(ua.ObjectIds.Server), *held.ids]
    random.Random(1).shuffle(ids)
    for where in ids:
        assert where in space
        assert held.seen(where, space) == held.seen(where), where


def test_a_property_has_the_time_at_which_the_server_started(tree: Tree, space: AddressSpace) -> None:
    units = [ua.NodeId(f"conveyor/fu{n}/actual/frequency/EngineeringUnits", NAMESPACE) for n in (1, 2)]
    first, second = (space.read_attribute_value(where, VALUE) for where in units)
    assert first.SourceTimestamp == first.ServerTimestamp == second.SourceTimestamp is not None


@pytest.mark.landing(6)
@pytest.mark.parametrize(
    "where",
    [
        ua.NodeId("", NAMESPACE),
        ua.NodeId("conveyor/fu9", NAMESPACE),
        ua.NodeId("conveyor/fu1/actual/frequency/EUInformation", NAMESPACE),
        ua.NodeId("conveyor/fu1", NAMESPACE + 1),
        ua.NodeId(b"conveyor/fu1", NAMESPACE),
        ua.NodeId(7, NAMESPACE),
    ],
)
def test_what_is_not_there_is_not_found(tree: Tree, space: AddressSpace, where: ua.NodeId) -> None:
    assert where not in space
    assert space.get(where) is None
    with pytest.raises(KeyError):
        space[where]


def test_two_nodes_of_one_id_are_an_error(space: AddressSpace) -> None:
    word = Point(name="bridge/word", data_type=DataType.UINT16, bits=("low",))
    with pytest.raises(ValueError, match="two nodes have the id 'bridge/word'"):
        tree_in(space, Image([word, Point(name="bridge/word/low", data_type=DataType.BOOL)]))


@pytest.mark.parametrize(("code", "words"), [(-1, "not set"), (1000, "fast"), (7, None)])
def test_codes_that_make_no_list_are_numbers_with_their_texts(code: int, words: str | None) -> None:
    """MultiStateValueDiscreteType (Part 8 §5.3.3.4)."""
    states = ((-1, "not set"), (1000, "fast"))
    point = Point(name="bridge/speed", data_type=DataType.INT32, states=states)
    image = Image([point])
    made = copy_of(standard_space())
    tree_in(made, image)
    image.set(0, code, 1.0)
    where = ua.NodeId("bridge/speed", NAMESPACE)
    kinds = [one.NodeId for one in made[where].references if one.ReferenceTypeId.Identifier == 40]
    assert kinds == [ua.NodeId(ua.ObjectIds.MultiStateValueDiscreteType)]
    values = made.read_attribute_value(ua.NodeId("bridge/speed/EnumValues", NAMESPACE), VALUE).Value.Value
    assert [(one.Value, one.DisplayName.Text) for one in values] == list(states)
    told = made.read_attribute_value(ua.NodeId("bridge/speed/ValueAsText", NAMESPACE), VALUE)
    assert (told.Value.Value.Text, told.Value.VariantType) == (words, ua.VariantType.LocalizedText)


class TestHistory:
    KEPT, OTHER = "conveyor/fu1/actual/frequency", "conveyor/fu1/actual/current"

    @pytest.fixture
    def tree(self, space: AddressSpace, image: Image) -> Tree:
        trees = layout(image.points, [image.index[self.KEPT]], 1)
        return Tree(space, NAMESPACE, image, epoch, trees, keeps_events=True)

    @staticmethod
    def read(space: AddressSpace, name: str, *attributes: ua.AttributeIds) -> list[Any]:
        where = ua.NodeId(name, NAMESPACE)
        return [space.read_attribute_value(where, one).Value.Value for one in attributes]

    def test_a_variable_says_whether_its_past_is_kept(self, tree: Tree, space: AddressSpace) -> None:
        asked = (
            ua.AttributeIds.AccessLevel,
            ua.AttributeIds.UserAccessLevel,
            ua.AttributeIds.Historizing,
        )
        assert self.read(space, self.KEPT, *asked) == [5, 5, True]
        assert self.read(space, self.OTHER, *asked) == [1, 1, False]

    def test_a_variable_whose_past_is_kept_says_how(self, tree: Tree, space: AddressSpace) -> None:
        def configured(name: str) -> list[ua.NodeId]:
            wanted = ua.NodeId(ua.ObjectIds.HasHistoricalConfiguration)
            references = space[ua.NodeId(name, NAMESPACE)].references
            return [one.NodeId for one in references if one.ReferenceTypeId == wanted]

        assert configured(self.KEPT) == [ua.NodeId(ua.ObjectIds.HAConfiguration)]
        assert configured(self.OTHER) == []
        stepped = ua.NodeId(ua.ObjectIds.HAConfiguration_Stepped)
        assert space.read_attribute_value(stepped, VALUE).Value.Value is True

    def test_an_object_says_whether_its_events_are_kept(
        self, tree: Tree, space: AddressSpace, standard: AddressSpace, image: Image
    ) -> None:
        notifies = ua.AttributeIds.EventNotifier
        assert self.read(space, "conveyor/fu1", notifies) == [5]
        server = ua.NodeId(ua.ObjectIds.Server)
        assert space.read_attribute_value(server, notifies).Value.Value == 5
        without = copy_of(standard)
        tree_in(without, image)
        assert self.read(without, "conveyor/fu1", notifies) == [1]

    def test_points_and_files_are_found_by_their_node_ids(self, tree: Tree, image: Image) -> None:
        found = {name: tree.point(ua.NodeId(name, NAMESPACE)) for name in (self.KEPT, "conveyor/fu1")}
        assert found == {self.KEPT: image.index[self.KEPT], "conveyor/fu1": None}
        bit = ua.NodeId("conveyor/fu1/status/status_word/fault", NAMESPACE)
        assert tree.point(bit) is None
        file = tree.file(ua.NodeId("conveyor/fu1/BlackBox/1", NAMESPACE))
        assert file is not None
        assert (file.drive, file.number) == ("conveyor/fu1", 1)
        assert tree.file(ua.NodeId("conveyor/fu1/BlackBox", NAMESPACE)) is None
        assert tree.drives == [f"conveyor/fu{number}" for number in range(1, 5)]

    def test_a_file_has_the_methods_of_its_type(self, tree: Tree, space: AddressSpace) -> None:
        file = space[ua.NodeId("conveyor/fu1/BlackBox/1", NAMESPACE)]
        shared = [one.NodeId.Identifier for one in file.references if one.NodeClass == ua.NodeClass.Method]
        assert shared[:3] == [
            ua.ObjectIds.FileType_Open,
            ua.ObjectIds.FileType_Close,
            ua.ObjectIds.FileType_Read,
        ]
        trip = space[ua.NodeId("conveyor/fu1/BlackBox/1/TripTime", NAMESPACE)]
        size = space[ua.NodeId("conveyor/fu1/BlackBox/1/Size", NAMESPACE)]
        names = [one.attributes[ua.AttributeIds.BrowseName].value.Value.Value for one in (trip, size)]
        assert names == [ua.QualifiedName("TripTime", NAMESPACE), ua.QualifiedName("Size", 0)]


class TestWatching:
    @pytest.mark.landing(6)
    @pytest.mark.parametrize(
        ("name", "attribute"),
        [
            ("bus/can0/load", VALUE),
            ("bus/can0/load", ua.AttributeIds.NodeId),
            ("bus/can0/load", ua.AttributeIds.DisplayName),
            ("bus/can0/load", ua.AttributeIds.DataType),
            ("bus/can0/load/EngineeringUnits", VALUE),
            ("conveyor/fu1", ua.AttributeIds.EventNotifier),
        ],
    )
    def test_any_attribute_can_be_watched_twice_and_no_more(
        self, tree: Tree, space: AddressSpace, name: str, attribute: ua.AttributeIds
    ) -> None:
        def callbacks() -> dict[int, Any]:
            return dict(space[where].attributes[attribute].datachange_callbacks)

        where = ua.NodeId(name, NAMESPACE)
        handles = [space.add_datachange_callback(where, attribute, print)[1] for _ in range(2)]
        assert list(callbacks()) == handles
        for handle in handles:
            space.delete_datachange_callback(handle)
        assert not callbacks()

    def test_reading_watches_nothing(self, tree: Tree, space: AddressSpace) -> None:
        space.read_attribute_value(ua.NodeId("bus/can0/load", NAMESPACE), VALUE)
        assert not tree.watched

    def test_a_word_and_its_bits_are_found_by_their_point(
        self, tree: Tree, space: AddressSpace, image: Image
    ) -> None:
        word = "conveyor/fu1/status/status_word"
        for name in (f"{word}/fault", word):
            space.add_datachange_callback(ua.NodeId(name, NAMESPACE), VALUE, print)
        image.set(image.index[word], 0b1000, 1.0)
        watched = tree.watched[image.index[word]]
        assert [watched[place].read().Value for place in sorted(watched)] == [
            ua.Variant(0b1000, ua.VariantType.UInt16),
            ua.Variant(True, ua.VariantType.Boolean),
        ]


class TestWhatIsHeld:
    """Objects for one drive, counted; all drives are of the same kind."""

    @staticmethod
    def image_of(*slots: str) -> Image:
        drives = [sites.drive(slot, "opcua", 0) for slot in slots]
        return sites.plant_of(sites.site(sites.bus(sites.node(*drives)), sites.opcua())).image

    @staticmethod
    def left_by(act: Callable[[], object]) -> Counter[str]:
        """The objects that are there since, by their types."""
        before = objects()
        kept = act()
        after = objects()
        del kept
        return after - before

    @staticmethod
    def browse(space: AddressSpace, name: str) -> list[ua.NodeId]:
        return list(below(space, ua.NodeId(name, NAMESPACE)))

    @pytest.mark.landing
    def test_before_anybody_looks_it_is_one_small_object_for_each_node_that_is_no_property(
        self, standard: AddressSpace
    ) -> None:
        one, two = self.image_of("fu1"), self.image_of("fu1", "fu2")
        spaces = [copy_of(standard) for _ in range(3)]
        tree_in(spaces[0], two)
        of_one = self.left_by(lambda: tree_in(spaces[1], one))
        of_two = self.left_by(lambda: tree_in(spaces[2], two))
        drive = of_two - of_one
        points = [point for point in two.points if point.name.startswith("conveyor/fu2/")]
        bits = [bit for point in points for bit in point.bits if bit]
        methods = 12
        assert drive["VariableNode"] == len(points) + len(bits)
        assert drive["_TreeNode"] == len(points) + len(bits) + drive["ObjectNode"] + methods
        # What the server refers to it with, as to all that sends events.
        assert (drive["NodeId"], drive["ReferenceDescription"], drive["Name"]) == (2, 1, 1)
        for kind in ("AttributeValue", "DataValue", "Variant", "NodeData"):
            assert drive[kind] <= 2, "its name"
        assert drive.total() <= 2.5 * drive["_TreeNode"], drive

    @pytest.mark.landing
    def test_who_browses_leaves_the_references_downwards_and_who_reads_leaves_nothing(
        self, space: AddressSpace
    ) -> None:
        def read() -> None:
            for where in nodes:
                for attribute in list(space[where].attributes):
                    space.read_attribute_value(where, attribute)

        def look() -> int:
            return len(self.browse(space, "conveyor/fu2"))

        tree_in(space, self.image_of("fu1", "fu2"))
        nodes = self.browse(space, "conveyor/fu1")
        read()
        browsed = self.left_by(look)
        assert browsed["ReferenceDescription"] == browsed["NodeId"] == look() - 1
        assert not browsed["Name"], (
            "drives have the same, and its own is in what the server refers to it with"
        )
        assert not browsed["AttributeValue"]
        assert not self.left_by(look)
        nodes = self.browse(space, "conveyor/fu2")
        assert not self.left_by(read)


def objects() -> Counter[str]:
    gc.collect()
    return Counter(type(one).__name__ for one in gc.get_objects() if type(one) is not Counter)


def below(space: AddressSpace, where: ua.NodeId) -> Iterator[ua.NodeId]:
    yield where
    hierarchy = [ua.NodeId(ua.ObjectIds.HasComponent), ua.NodeId(ua.ObjectIds.HasProperty)]
    for one in space[where].references:
        if one.IsForward and one.ReferenceTypeId in hierarchy:
            yield from below(space, one.NodeId)
