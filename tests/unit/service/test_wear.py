"""The keeper of EEPROM counts: what is kept across restarts, and a folder that cannot be written."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.parameter.ledger import Ledger
from bridge.parameter.ledger_file import LedgerFile
from bridge.service.wear import WearKeeper

KEY = ("conveyor/fu1", "2066:01")


def test_what_was_counted_is_kept_and_what_others_have_is_taken_over(tmp_path: Path) -> None:
    LedgerFile(tmp_path).merge({KEY: [1000.0, 1001.0]})
    ledger = Ledger()
    ledger.count(KEY, "P102", None, 5.0)
    WearKeeper(ledger, tmp_path).keep()
    assert ledger.writes(KEY) == 3
    assert LedgerFile(tmp_path).totals() == {KEY: 3}
    WearKeeper(ledger, tmp_path).keep()
    assert LedgerFile(tmp_path).totals() == {KEY: 3}, "nothing is kept twice"


def test_a_folder_that_cannot_be_written_stops_nothing_and_is_told_once(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "state").write_text("a file")
    ledger = Ledger()
    keeper = WearKeeper(ledger, tmp_path / "state")
    for number in range(3):
        ledger.count(KEY, "P102", None, float(number))
        keeper.keep()
    assert ledger.writes(KEY) == 3
    assert len(caplog.messages) == 1
    assert caplog.messages[0].startswith("EEPROM writes are not kept in ")


def test_a_file_that_cannot_be_read_is_named_once(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "eeprom.json").write_text("nonsense")
    keeper = WearKeeper(Ledger(), tmp_path)
    keeper.keep()
    keeper.keep()
    assert caplog.messages == [
        f"{tmp_path / 'eeprom.json'} could not be read: put aside as {tmp_path / 'eeprom.damaged'}"
    ]
