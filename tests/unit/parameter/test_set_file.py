"""Files as sets of parameters for one drive: backups that fit, and what is said of those that do not."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.image import Value
from bridge.parameter import Names
from bridge.parameter.backup_file import BackupFile
from bridge.parameter.set_file import read_set, why_another
from tests.support import sites
from tests.support.invented_eds import U16, eds, var

NORD = sites.FAMILY


def saved(folder: Path, mapping: str = NORD, **values: Value) -> Path:
    path = folder / "set.toml"
    path.write_text(BackupFile(mapping, "conveyor/fu1", "", values, {}).text(), encoding="utf-8")
    return path


def read(path: Path) -> BackupFile:
    return read_set(path, Names(sites.family(NORD)), NORD, "conveyor/fu1", 5)


def test_a_backup_of_such_a_drive_fits(tmp_path: Path) -> None:
    assert read(saved(tmp_path, P102=2.5)).values == {"P102": 2.5}


def test_one_of_another_family_is_refused_at_its_line(tmp_path: Path) -> None:
    path = saved(tmp_path, "lenze/8400-motec")
    with pytest.raises(FileFaults) as caught:
        read(path)
    assert str(caught.value) == (
        f"{path}:3: mapping: the file is of lenze/8400-motec, and conveyor/fu1 has {NORD} "
        "(a backup of such a drive)"
    )


def test_every_value_that_does_not_fit_is_named_at_its_line(tmp_path: Path) -> None:
    path = saved(tmp_path, P102=2.5, nonsense=1, P103=1e9)
    with pytest.raises(FileFaults) as caught:
        read(path)
    lines = path.read_text().splitlines()
    named = [lines[fault.line - 1].partition(" =")[0] for fault in caught.value.faults]
    assert named == ['"nonsense"', '"P103"']


def test_a_description_without_settings_of_the_drive_is_no_set(tmp_path: Path) -> None:
    path = tmp_path / "x.eds"
    path.write_bytes(eds({"6502": var("supported", U16, "ro", "1")}))
    with pytest.raises(FileFaults, match=r"has no factory settings of conveyor/fu1"):
        read(path)


def test_a_description_gives_the_factory_settings_of_what_it_lists(tmp_path: Path) -> None:
    path = tmp_path / "X.EDS"
    path.write_bytes(eds({"3FF0": var("own", U16, "rw", "7")}))
    found = read(path)
    assert found.objects == {"3FF0:00": 7}
    assert (found.mapping, found.drive) == (NORD, "conveyor/fu1")


def test_a_set_is_of_a_drive_with_the_same_vendor_and_product() -> None:
    of_file = {"vendor": 0x38, "product": 2, "serial": 1}
    assert not why_another(of_file, {"vendor": 0x38, "product": 2, "serial": 9})
    assert not why_another({}, {"vendor": 0x38})
    name, why = why_another(of_file, {"vendor": 0x38, "product": 3}) or ("", "")
    assert (name, "product 00000002h, and this one's is 00000003h" in str(why)) == ("product", True)
    name, why = why_another(of_file, {"vendor": 0x38}) or ("", "")
    assert (name, "not told" in str(why)) == ("product", True)
