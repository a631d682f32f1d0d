"""A site file beside the families that it names: its PDOs are those that the drive has."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.mapping import Family, load_family
from bridge.mapping.loader import mapping_folders
from bridge.mapping.site import load_site_and_families
from tests.support.invented import NAME, SITE, SPIN

BASE = SPIN.replace('source = "nobody\'s manual"', 'source = "nobody\'s manual"\ntemplate = true', 1)


class Folder:
    """A site's own folder of mappings."""

    def __init__(self, at: Path) -> None:
        self.top = at
        self.site = at / "site.toml"
        self.site.write_text(SITE.format(drive="", node=""))

    def add(self, name: str, text: str) -> Path:
        path = self.top / "mappings" / f"{name}.toml"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path

    def load(self, name: str) -> Family:
        return load_family(name, mapping_folders(self.site))

    def told(self, name: str) -> list[str]:
        with pytest.raises(FileFaults) as caught:
            self.load(name)
        return [str(fault).removeprefix(f"{self.top}/mappings/") for fault in caught.value.faults]


@pytest.fixture
def folder(tmp_path: Path) -> Folder:
    folder = Folder(tmp_path)
    folder.add("acme/base", BASE)
    return folder


@pytest.mark.parametrize(
    ("drive", "fault"),
    [
        ("rpdo = { number = 7 }", "rpdo.number: axis of Spin 3000 has no RPDO7 (it has 1, 2, 3)"),
        ("tpdo = [{ number = 2 }, { number = 2 }]", "tpdo[1].number: there are two tables for TPDO2"),
        ("tpdo = [{ number = 1 }, { enable = true }]", "tpdo[1].number: there are two tables for TPDO1"),
    ],
)
def test_a_pdo_of_the_site_file_is_one_that_the_drive_has(folder: Folder, drive: str, fault: str) -> None:
    folder.add(NAME, SPIN)
    folder.site.write_text(SITE.format(drive=drive, node=""))
    with pytest.raises(FileFaults, match=r"site\.toml:14: bus\[0\]") as caught:
        load_site_and_families(folder.site)
    assert fault in str(caught.value)
