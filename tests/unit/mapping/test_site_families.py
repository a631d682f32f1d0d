"""A site file beside the families that it names: its PDOs are those that the drive has."""

from __future__ import annotations

import pytest

from bridge.base.errors import FileFaults
from bridge.mapping.site_families import load_site_and_families
from tests.support.invented import NAME, SITE, SPIN
from tests.support.mapping_folder import Folder


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
