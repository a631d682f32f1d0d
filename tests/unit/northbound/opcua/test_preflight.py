"""Check of what the server needs of the disk, before a bus is opened."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults
from bridge.config import OpcUaTable
from bridge.northbound.opcua.preflight import check_opcua

LOCAL = "127.0.0.1:4840"


def check(folder: Path, **settings: object) -> None:
    site = folder / "site.toml"
    site.write_text("".join(f"{key} = {value!r}\n" for key, value in settings.items()))
    check_opcua(OpcUaTable.model_validate({"listen": LOCAL, **settings}), folder / "state", site)


def test_without_settings_a_certificate_is_made_once(tmp_path: Path) -> None:
    check(tmp_path)
    (made,) = (tmp_path / "state").rglob("*.der")
    content = made.read_bytes()
    check(tmp_path)
    assert made.read_bytes() == content


def test_a_folder_that_is_not_there_is_named_with_its_key(tmp_path: Path) -> None:
    with pytest.raises(FileFaults) as raised:
        check(tmp_path, trusted_dir=str(tmp_path / "nowhere"))
    (fault,) = raised.value.faults
    assert fault.key == "opcua.trusted_dir"


def test_both_files_of_a_pair_are_named(tmp_path: Path) -> None:
    with pytest.raises(FileFaults) as raised:
        check(tmp_path, certificate=str(tmp_path / "c.pem"), private_key=str(tmp_path / "k.pem"))
    assert [fault.key for fault in raised.value.faults] == ["opcua.certificate", "opcua.private_key"]
