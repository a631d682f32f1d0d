"""Fetch the device descriptions that other people's packages bring along: ``make foreign``.

    python -m tools.foreign_files FOLDER [--without npm]

None of them is ours to pass on: they are fetched for a test and stay out of the repository. Each package has
a version and a digest, so that everybody gets the same files. They come with the registries' own clients; pip
runs what a source archive needs to tell its version, as it does before it installs one.

canopen-asyncio has the same files as canopen, and Debian 12 no package about CANopen.
"""

from __future__ import annotations

import argparse
import hashlib
import shutil
import subprocess
import sys
import tarfile
import tempfile
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path, PurePosixPath
from typing import Final

SUFFIXES: Final = (".eds", ".dcf", ".xdd", ".xdc")
_MOST_BYTES: Final = 16 << 20
_PATIENCE_S: Final = 1200


@dataclass(frozen=True, slots=True)
class Package:
    """``files`` is how many descriptions the archive has, ``sha256`` the digest of the archive."""

    registry: str
    name: str
    version: str
    files: int
    sha256: str

    def __str__(self) -> str:
        return f"{self.name} {self.version} of {self.registry}"


PACKAGES: Final = (
    Package(
        "PyPI", "canopen", "2.4.1", 3, "20a84bc498b34dadd79cece467d3bbe19591c1c02a8f39331bcc6065c4d8b2eb"
    ),
    Package(
        "PyPI", "canopen-lens", "0.5.1", 1, "5939652e09f0441de7241f7e01c6772fc61e598fc2bd91e3b9c732a61ac5341f"
    ),
    Package(
        "PyPI",
        "hermes-canopen-nodes",
        "1.0.0",
        2,
        "edc54db316bcac6929b7930515a0bba291850877c7df44765dd992dcb65bf982",
    ),
    Package("npm", "canopen", "6.2.1", 1, "e79eca220cbfe6eaaeb3fc80621415249a66b015a2e2f78d5edd48a0f09c8389"),
)


class NotFetched(Exception):
    """A package did not come, or is not what it was; the text says which and why."""


def fetch(folder: Path, packages: Collection[Package]) -> list[Path]:
    """The descriptions of ``packages``, as ``REGISTRY-PACKAGE/PATH``. What ``folder`` held is gone; where
    a package fails, it is left as it was. Raises ``NotFetched``."""
    with tempfile.TemporaryDirectory() as place:
        new = Path(place) / "new"
        for number, package in enumerate(packages):
            archives = Path(place) / str(number)
            archives.mkdir()
            (pypi if package.registry == "PyPI" else npm)(package, archives)
            unpack(package, archives, new)
        shutil.rmtree(folder, ignore_errors=True)
        shutil.copytree(new, folder)
    return sorted(path for path in folder.rglob("*") if path.is_file())


def pypi(package: Package, archives: Path) -> None:
    """The source archive: tests and examples are in no wheel."""
    pinned = archives / "pinned.txt"
    pinned.write_text(f"{package.name}=={package.version} --hash=sha256:{package.sha256}\n", encoding="ascii")
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check", "download", "--quiet", "--no-deps"]
    _run(package, [*pip, "--no-binary", ":all:", "--dest", str(archives), "--requirement", str(pinned)])


def npm(package: Package, archives: Path) -> None:
    name = f"{package.name}@{package.version}"
    _run(package, ["npm", "pack", "--silent", "--pack-destination", str(archives), name])


def _run(package: Package, command: list[str]) -> None:
    try:
        done = subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=_PATIENCE_S,
            check=False,
        )
    except FileNotFoundError:
        raise NotFetched(f"{package}: there is no {command[0]} to fetch it with") from None
    except subprocess.TimeoutExpired:
        raise NotFetched(f"{package}: {command[0]} took more than {_PATIENCE_S} s") from None
    if done.returncode:
        raise NotFetched(f"{package} cannot be fetched:\n{done.stderr.strip() or done.stdout.strip()}")


def unpack(package: Package, archives: Path, folder: Path) -> None:
    """Take the descriptions out of the one archive in ``archives``. Raises ``NotFetched``."""
    found = [path for path in archives.iterdir() if path.suffix in (".gz", ".tgz")]
    if len(found) != 1:
        raise NotFetched(f"{package} came as {len(found)} archives, not as one")
    digest = hashlib.sha256(found[0].read_bytes()).hexdigest()
    if digest != package.sha256:
        raise NotFetched(f"{package} has the digest {digest}, not {package.sha256}")
    count = 0
    for name, content in _descriptions(found[0]):
        path = folder / f"{package.registry}-{package.name}" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
        count += 1
    if count != package.files:
        raise NotFetched(f"{package} has {count} descriptions, not {package.files}")


def _descriptions(archive: Path) -> Iterator[tuple[str, bytes]]:
    """Each by its path in the archive, in one word: no path of theirs becomes one of ours."""
    with tarfile.open(archive) as opened:
        for member in opened:
            path = PurePosixPath(member.name)
            if not member.isfile() or path.suffix.lower() not in SUFFIXES or member.size > _MOST_BYTES:
                continue
            file = opened.extractfile(member)
            if file:
                yield "__".join(part for part in path.parts[1:] if part not in ("/", "..")), file.read()


def main() -> None:
    parser = argparse.ArgumentParser(description="Fetch device descriptions of other people's packages.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--without", default="", help="a registry that is left out")
    arguments = parser.parse_args()
    try:
        fetch(arguments.folder, [one for one in PACKAGES if one.registry != arguments.without])
    except NotFetched as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
