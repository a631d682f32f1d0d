"""The EEPROM guard counts, remembers, warns, and ends cyclic writing."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.parameter import Ledger, ParameterError, Why
from bridge.parameter.ledger import DAY_S, MOST_A_DAY, MOST_WRITES, WINDOW_S, WriteRecord
from bridge.parameter.ledger_file import LedgerFile
from bridge.text import Text

KEY = ("conveyor/fu1", "2066:01")
EPOCH_S = 1_795_000_000.0


def write(ledger: Ledger, now: float, cycles: int | None = 100_000) -> Text | str:
    ledger.check(KEY, "P102", now)
    return ledger.count(KEY, "P102", cycles, now)


def test_writing_in_a_cycle_is_refused_and_goes_on_when_it_is_no_cycle_any_more() -> None:
    ledger = Ledger()
    for second in range(MOST_WRITES):
        write(ledger, float(second))
    with pytest.raises(ParameterError, match=f"P102 was written {MOST_WRITES} times within 10 min") as told:
        write(ledger, WINDOW_S - 0.1)
    assert told.value.why is Why.TOO_OFTEN
    assert ledger.writes(KEY) == MOST_WRITES
    write(ledger, WINDOW_S + 0.1)


def test_other_parameters_are_not_held_up() -> None:
    ledger = Ledger()
    for _ in range(MOST_WRITES):
        write(ledger, 0.0)
    ledger.check(("conveyor/fu2", "2066:01"), "P102", 0.0)
    ledger.check(("conveyor/fu1", "2067:01"), "P103", 0.0)


def test_each_tenth_of_what_the_eeprom_stands_is_told_once() -> None:
    ledger = Ledger()
    told = [ledger.count(KEY, "P102", 100, float(one)) for one in range(1, 101)]
    warned = [number for number, warning in enumerate(told, 1) if warning]
    assert warned == [10, 20, 30, 40, 50, 60, 70, 80, 90, 100]
    assert str(told[9]) == "P102 of conveyor/fu1 was written 10 times: its EEPROM endures 100 writes"


def test_where_no_limit_is_known_nothing_is_told() -> None:
    ledger = Ledger()
    assert not any(ledger.count(KEY, "P102", None, float(one)) for one in range(100))


def test_counts_and_the_last_writes_outlive_a_restart(tmp_path: Path) -> None:
    ledger, file = Ledger(), LedgerFile(tmp_path / "state")
    for second in range(MOST_WRITES):
        write(ledger, 100.0 + second)
    file.add(ledger, EPOCH_S, 120.0)
    # another process, started at another time, whose clock began anew
    again = Ledger()
    LedgerFile(tmp_path / "state").add(again, EPOCH_S + 118.0, 3.0)
    assert again.writes(KEY) == MOST_WRITES
    with pytest.raises(ParameterError, match="P102 was written"):
        write(again, 5.0)
    write(again, WINDOW_S)


def test_two_processes_count_in_one_file(tmp_path: Path) -> None:
    service, command = Ledger(), Ledger()
    file = LedgerFile(tmp_path)
    for now in (1.0, 2.0):
        write(service, now)
        file.add(service, EPOCH_S, now)
        write(command, now)
        file.add(command, EPOCH_S, now)
    file.add(service, EPOCH_S, 3.0)
    assert service.writes(KEY) == command.writes(KEY) == 4
    file.add(service, EPOCH_S, 4.0)
    assert service.writes(KEY) == 4


def test_a_damaged_file_is_put_aside(tmp_path: Path) -> None:
    (tmp_path / "eeprom.json").write_bytes(b'{"version": 1, "wri')
    ledger, file = Ledger(), LedgerFile(tmp_path)
    write(ledger, 1.0)
    file.add(ledger, EPOCH_S, 1.0)
    assert file.damaged == str(tmp_path / "eeprom.damaged")
    assert (tmp_path / "eeprom.damaged").read_bytes() == b'{"version": 1, "wri'
    assert LedgerFile(tmp_path).merge({})[KEY].writes == 1


def test_a_folder_that_cannot_be_written_loses_no_count(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("not a folder")
    ledger, file = Ledger(), LedgerFile(tmp_path / "state")
    write(ledger, 1.0)
    with pytest.raises(OSError):
        file.add(ledger, EPOCH_S, 1.0)
    assert ledger.writes(KEY) == 1
    (tmp_path / "state").unlink()
    file.add(ledger, EPOCH_S, 2.0)
    assert LedgerFile(tmp_path / "state").merge({})[KEY].writes == 1


def test_a_clock_that_was_set_back_holds_nobody_up() -> None:
    ledger = Ledger()
    ledger.restore({KEY: WriteRecord(MOST_WRITES, (EPOCH_S + 1e6,) * MOST_WRITES)}, EPOCH_S, 5.0)
    ledger.check(KEY, "P102", 5.0)
    assert ledger.writes(KEY) == MOST_WRITES


def test_a_parameter_that_is_written_all_day_is_refused_in_the_long_window() -> None:
    ledger = Ledger()
    for one in range(MOST_A_DAY):
        write(ledger, one * 70.0)
    with pytest.raises(ParameterError, match=f"{MOST_A_DAY} times within 24 h"):
        write(ledger, 7100.0)
    write(ledger, DAY_S + 1.0)


def test_the_long_window_outlives_a_restart(tmp_path: Path) -> None:
    ledger, file, again = Ledger(), LedgerFile(tmp_path), Ledger()
    for one in range(MOST_A_DAY):
        write(ledger, one * 70.0)
    file.add(ledger, EPOCH_S, 7000.0)
    file.add(again, EPOCH_S, 7000.0)
    with pytest.raises(ParameterError, match="within 24 h"):
        again.check(KEY, "P102", 7700.0)


def test_nothing_is_written_beyond_what_the_eeprom_stands() -> None:
    ledger = Ledger()
    ledger.restore({KEY: WriteRecord(100_000)}, EPOCH_S, 5.0)
    with pytest.raises(ParameterError, match=r"exchange the drive, then remove 2066:01 of conveyor/fu1"):
        ledger.check(KEY, "P102", 5.0, 100_000)
