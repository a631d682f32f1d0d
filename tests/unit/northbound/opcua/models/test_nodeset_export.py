"""The UANodeSet file of a site: each node and each reference once, in both languages, the same each time."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import Counter

import pytest

from bridge.catalogue import Catalogue
from bridge.northbound.opcua.models.nodeset_export import nodeset_of
from tests.support import sites

SET = "{http://opcfoundation.org/UA/2011/03/UANodeSet.xsd}"
TYPES = "{http://opcfoundation.org/UA/2008/02/Types.xsd}"
SITE = sites.site(sites.bus(sites.node(sites.drive("fu1", "opcua", 200))), "[opcua]\n")


@pytest.fixture(scope="module")
def catalogue() -> Catalogue:
    return sites.plant_of(SITE).catalogue


@pytest.fixture(scope="module")
def written(catalogue: Catalogue) -> str:
    return nodeset_of(catalogue, "1.2.3")


@pytest.fixture(scope="module")
def nodes(written: str) -> dict[str, ET.Element]:
    found = [one for one in ET.fromstring(written) if "NodeId" in one.attrib]
    made = {one.attrib["NodeId"]: one for one in found}
    assert len(made) == len(found)
    return made


def test_it_is_the_same_each_time(catalogue: Catalogue, written: str) -> None:
    assert nodeset_of(catalogue, "1.2.3") == written


def test_every_point_is_there(catalogue: Catalogue, nodes: dict[str, ET.Element]) -> None:
    assert {f"ns=1;s={point.name}" for point in catalogue.points} <= nodes.keys()


def test_it_says_what_it_needs(written: str) -> None:
    (model,) = ET.fromstring(written).iter(f"{SET}Model")
    assert model.attrib == {"ModelUri": "urn:drivebridge:points", "Version": "1.2.3"}
    required = {one.attrib["ModelUri"] for one in model}
    uris = {one.text for one in ET.fromstring(written).iter(f"{SET}Uri")}
    assert required == uris - {"urn:drivebridge:points"} | {"http://opcfoundation.org/UA/"}


def test_every_reference_stands_once_and_leads_somewhere(nodes: dict[str, ET.Element]) -> None:
    seen = Counter[tuple[str, str, str]]()
    for name, node in nodes.items():
        parents = 0
        for one in node.iterfind(f"{SET}References/{SET}Reference"):
            other, is_back = str(one.text), one.get("IsForward") == "false"
            assert other in nodes or not other.startswith("ns=1;"), (name, other)
            parents += is_back and other == node.attrib["ParentNodeId"]
            ends = (other, name) if is_back else (name, other)
            seen[one.attrib["ReferenceType"], *ends] += 1
        assert parents, name
    assert set(seen.values()) == {1}


def test_texts_are_in_both_languages_and_values_in_english(nodes: dict[str, ET.Element]) -> None:
    word = nodes["ns=1;s=conveyor/fu1/status/status_word"]
    names = [(one.get("Locale"), one.text) for one in word.iterfind(f"{SET}DisplayName")]
    assert names == [("en", "StatusWord"), ("de", "Statuswort")]
    states = nodes["ns=1;s=conveyor/fu1/status/state/EnumStrings"]
    texts = [one.findtext(f"{TYPES}Text") for one in states.iter(f"{TYPES}LocalizedText")]
    assert texts[4] == "operation_enabled"


def test_what_changes_has_no_value(nodes: dict[str, ET.Element]) -> None:
    for name in ("status/state", "Asset/SerialNumber", "Asset/DeviceHealth", "status/status_word/fault"):
        assert nodes[f"ns=1;s=conveyor/fu1/{name}"].find(f"{SET}Value") is None, name
