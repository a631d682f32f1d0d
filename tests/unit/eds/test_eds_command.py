"""``drivebridge eds --json``: values as the node has them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from bridge.cli.app import make_app
from bridge.mapping.loader import mappings_dir

EDS = """[DeviceInfo]
VendorName=Acme
[OptionalObjects]
SupportedObjects=3
1=0x1014
2=0x1800
3=0x1A00
[1014]
ParameterName=EMCY
DataType=0x7
AccessType=rw
DefaultValue={node_id}+0x80
LowLimit=$NODEID
HighLimit=0x100+$NODEID
[1800]
ParameterName=TPDO
ObjectType=0x9
SubNumber=3
[1800sub0]
ParameterName=count
DataType=0x5
AccessType=ro
DefaultValue=2
[1800sub1]
ParameterName=COB-ID
DataType=0x7
AccessType=rw
DefaultValue=$NODEID+0x40000180
ParameterValue=$NODEID+0x1C0
[1800sub2]
ParameterName=type
DataType=0x5
AccessType=rw
DefaultValue=$NODEID
[1A00]
ParameterName=mapping
ObjectType=0x9
SubNumber=2
[1A00sub0]
ParameterName=count
DataType=0x5
AccessType=rw
DefaultValue=1
[1A00sub1]
ParameterName=first
DataType=0x7
AccessType=rw
DefaultValue=$NODEID+0x20000010
"""


def shown(file: Path, *options: str) -> dict[str, Any]:
    result = CliRunner().invoke(make_app("eds"), ["eds", str(file), "--json", *options])
    assert result.exit_code == 0, result.output
    return json.loads(result.output)


def entry(content: dict[str, Any], index: int, sub: int = 0) -> dict[str, Any]:
    return next(one for one in content["objects"] if (one["index"], one["sub"]) == (index, sub))


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "test.dcf"
    path.write_text(EDS.format(node_id="$nodeid"), encoding="utf-8")
    return path


def test_every_value_is_the_nodes(file: Path) -> None:
    content = shown(file, "--node-id", "5")
    emcy, cob_id = entry(content, 0x1014), entry(content, 0x1800, 1)
    assert (emcy["default"], emcy["low"], emcy["high"]) == (0x85, 5, 0x105)
    assert (cob_id["default"], cob_id["value"]) == (0x4000_0185, 0x1C5)
    [pdo] = content["pdos"]
    assert (pdo["cob_id"], pdo["transmission_type"]) == (0x1C5, 5)
    assert pdo["mapped"][0]["bits"] == 0x15
    assert "NODEID" not in json.dumps(content["objects"])
    assert content["downloads"] == [{"index": 0x1800, "sub": 1, "data": "c5010000"}]


def test_without_a_node_id_they_are_as_the_file_has_them(file: Path) -> None:
    content = shown(file)
    assert entry(content, 0x1014)["default"] == "$NODEID+0x80"
    assert content["pdos"][0]["cob_id"] is None


@pytest.mark.landing(9)
@pytest.mark.parametrize("path", sorted(mappings_dir().rglob("*.eds")), ids=lambda path: path.stem)
def test_nothing_of_our_own_files_is_left_unresolved(path: Path) -> None:
    assert "NODEID" not in json.dumps(shown(path, "--node-id", "9"))
