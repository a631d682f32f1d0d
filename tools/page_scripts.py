"""The third-party scripts of the web page, fetched when the wheel is built or installed for editing.

None of them is in the repository: ``package-lock.json`` beside the page pins each by version and SHA-512. A
tarball is taken from the cache (``~/.cache/drivebridge/npm``, or below ``XDG_CACHE_HOME``) or from the npm
registry (``NPM_CONFIG_REGISTRY``); npm itself is not needed. What the page uses of it is placed in
``static/vendor``, with its licence.

A browser resolves no bare module names without an import map, and an import map would be an inline script,
which the page's content security policy forbids. So ``from "preact"`` becomes ``from "./preact.mjs"`` here.

``python -m tools.page_scripts`` does it by hand.
"""

from __future__ import annotations

import base64
import hashlib
import io
import json
import os
import re
import sys
import tarfile
import urllib.error
import urllib.request
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Final

from tools.fetched import cache, write

PAGE: Final = Path("bridge/northbound/page")
VENDOR: Final = PAGE / "static/vendor"
REGISTRY: Final = "https://registry.npmjs.org"
WANTED: Final[Mapping[str, Mapping[str, str]]] = {
    "preact": {"dist/preact.mjs": "preact.mjs", "hooks/dist/hooks.mjs": "hooks.mjs"},
    "@preact/signals-core": {"dist/signals-core.mjs": "signals-core.mjs"},
    "@preact/signals": {"dist/signals.mjs": "signals.mjs"},
    "htm": {"dist/htm.mjs": "htm.mjs"},
    "uplot": {"dist/uPlot.esm.js": "uplot.mjs", "dist/uPlot.min.css": "uplot.css"},
}
"""What is taken of each package, and what it is called here."""
_NAMES: Final = {
    "preact": "./preact.mjs",
    "preact/hooks": "./hooks.mjs",
    "@preact/signals-core": "./signals-core.mjs",
}
_IMPORT: Final = re.compile(r"""(\b(?:from|import)\s*)(["'])([^"'./\s][^"'\s]*)\2""")
_SOURCE_MAP: Final = re.compile(r"^//# sourceMappingURL=.*\n?", re.MULTILINE)
_NOT_OURS: Final = b"// @ts-nocheck\n"
"""`make check` has the page's own scripts checked by tsc, which reads these as well."""
_MARK: Final = "made.json"
_TIMEOUT_S: Final = 30
_LARGEST: Final = 20_000_000


class ScriptsMissing(Exception):
    """They can be had neither from the cache nor from the registry, or are not what the lock says."""


def place(root: Path) -> None:
    """Have ``static/vendor`` below ``root`` hold what the lock says. Raises ``ScriptsMissing``."""
    lock = (root / PAGE / "package-lock.json").read_bytes()
    made_of = hashlib.sha256(lock + Path(__file__).read_bytes()).hexdigest()
    mark = root / VENDOR / _MARK
    if mark.exists() and json.loads(mark.read_bytes()).get("made_of") == made_of:
        return
    for package, pinned in _pinned(lock):
        for name, content in _files(package, _tarball(package, pinned["version"], pinned["integrity"])):
            write(root / VENDOR / name, content)
    write(mark, json.dumps({"made_of": made_of}).encode())


def _pinned(lock: bytes) -> Iterator[tuple[str, dict[str, str]]]:
    packages = json.loads(lock)["packages"]
    for package in WANTED:
        if (pinned := packages.get(f"node_modules/{package}")) is None:
            raise ScriptsMissing(f"{PAGE}/package-lock.json does not pin {package}")
        yield package, pinned


def _tarball(package: str, version: str, integrity: str) -> bytes:
    file_name = f"{package.rpartition('/')[2]}-{version}.tgz"
    cached = cache("npm") / f"{package.replace('/', '+')}-{version}.tgz"
    if cached.exists() and is_intact(content := cached.read_bytes(), integrity):
        return content
    registry = os.environ.get("NPM_CONFIG_REGISTRY", REGISTRY).rstrip("/")
    content = _fetch(f"{registry}/{package}/-/{file_name}")
    if not is_intact(content, integrity):
        raise ScriptsMissing(f"{file_name} from {registry} is not the one that package-lock.json pins")
    write(cached, content)
    return content


def _fetch(url: str) -> bytes:
    if not url.startswith(("https://", "http://")):
        raise ScriptsMissing(f"{url}: only http and https are fetched")
    try:
        with urllib.request.urlopen(url, timeout=_TIMEOUT_S) as answer:
            return answer.read(_LARGEST)
    except (urllib.error.URLError, OSError) as error:
        raise ScriptsMissing(
            f"{url}: {error}. The scripts of the web page come from there once; without a network, copy "
            f"{cache('npm')} from a machine that has built this version"
        ) from error


def is_intact(content: bytes, integrity: str) -> bool:
    """Whether it has the hash, as package-lock.json writes it: ``sha512-<base64>``."""
    kind, _, digest = integrity.partition("-")
    return kind == "sha512" and base64.b64encode(hashlib.sha512(content).digest()).decode() == digest


def _files(package: str, tarball: bytes) -> Iterator[tuple[str, bytes]]:
    with tarfile.open(fileobj=io.BytesIO(tarball), mode="r:gz") as archive:
        for path, name in WANTED[package].items():
            content = _member(package, archive, path)
            is_script = name.endswith(".mjs")
            yield name, _NOT_OURS + with_own_names(content.decode()).encode() if is_script else content
        yield f"licenses/{package.replace('/', '+')}.txt", _member(package, archive, "LICENSE")


def _member(package: str, archive: tarfile.TarFile, path: str) -> bytes:
    try:
        file = archive.extractfile(f"package/{path}")
    except KeyError:
        file = None
    if file is None:
        raise ScriptsMissing(f"{package} has no {path} any more")
    return file.read()


def with_own_names(script: str) -> str:
    """The module with the names that its neighbours have here. Raises ``ScriptsMissing`` for one that has
    none."""

    def own(found: re.Match[str]) -> str:
        if (name := _NAMES.get(found[3])) is None:
            raise ScriptsMissing(f"a script imports {found[3]}, which the page does not have")
        return f"{found[1]}{found[2]}{name}{found[2]}"

    return _SOURCE_MAP.sub("", _IMPORT.sub(own, script))


if __name__ == "__main__":
    try:
        place(Path(__file__).resolve().parent.parent)
    except ScriptsMissing as missing:
        sys.exit(str(missing))
