"""The file of EEPROM counts: added up by several, replaced whole, put aside where it cannot be read."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from bridge.parameter.ledger import Ledger, WriteRecord
from bridge.parameter.ledger_file import NAME, LedgerFile

KEY = ("conveyor/fu1", "2066:01")


def test_what_two_have_written_is_added_up(tmp_path: Path) -> None:
    one, other = LedgerFile(tmp_path), LedgerFile(tmp_path)
    one.merge({KEY: [100.0, 101.0]})
    totals = other.merge({KEY: [102.0], ("n", "1010:01"): [103.0]})
    assert totals[KEY] == WriteRecord(3, (100.0, 101.0, 102.0))
    assert one.totals() == {KEY: 3, ("n", "1010:01"): 1}


def test_nothing_to_add_writes_nothing(tmp_path: Path) -> None:
    file = LedgerFile(tmp_path / "state")
    assert file.merge({}) == {}
    assert not file.path.exists()
    assert file.totals() == {}


def test_the_file_is_for_people_too_and_nothing_is_left_beside_it(tmp_path: Path) -> None:
    file = LedgerFile(tmp_path)
    file.merge({KEY: [100.0]})
    assert file.path == tmp_path / NAME
    assert json.loads(file.path.read_text()) == {
        "version": 1,
        "writes": {"conveyor/fu1": {"2066:01": {"writes": 1, "last": [100.0]}}},
    }
    assert [one.name for one in tmp_path.iterdir()] == [NAME]


@pytest.mark.parametrize("content", ["", "{", '{"version": 1}', '{"version": 1, "writes": 5}', "\udcff"])
def test_one_that_cannot_be_read_is_put_aside_and_named(tmp_path: Path, content: str) -> None:
    file = LedgerFile(tmp_path)
    file.path.write_bytes(content.encode("utf-8", "surrogateescape"))
    assert file.totals() == {}
    assert file.merge({KEY: [100.0]})[KEY].writes == 1
    assert file.damaged == str(tmp_path / "eeprom.damaged")
    assert Path(file.damaged).read_bytes() == content.encode("utf-8", "surrogateescape")


def test_a_ledger_gives_what_it_has_counted_and_gets_what_others_have(tmp_path: Path) -> None:
    LedgerFile(tmp_path).merge({KEY: [1000.0]})
    ledger = Ledger()
    ledger.count(KEY, "P102", None, 5.0)
    LedgerFile(tmp_path).add(ledger, 1000.0, 6.0)
    assert ledger.writes(KEY) == 2
    assert LedgerFile(tmp_path).merge({})[KEY] == WriteRecord(2, (1000.0, 1005.0))
    assert ledger.take_unsaved() == {}


def test_where_the_folder_cannot_be_used_nothing_that_was_counted_is_lost(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("a file where a folder is due")
    ledger = Ledger()
    ledger.count(KEY, "P102", None, 5.0)
    with pytest.raises(OSError):
        LedgerFile(tmp_path / "state").add(ledger, 1000.0, 6.0)
    assert ledger.take_unsaved() == {KEY: [5.0]}
