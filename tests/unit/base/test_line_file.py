"""The file of the audit log: whole lines, rotated by size, and lines that a bad disk costs are counted."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.line_file import LineFile


def written(folder: Path, *lines: bytes, max_bytes: int = 20, keep: int = 2) -> LineFile:
    file = LineFile(folder / "log" / "audit.log", max_bytes, keep)
    file.start()
    for line in lines:
        file.put(line)
    file.close()
    return file


def contents(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted((folder / "log").iterdir())}


def test_lines_stand_one_after_the_other_in_a_file_for_us_and_our_group(tmp_path: Path) -> None:
    file = written(tmp_path, b"one\n", b"two\n")
    assert contents(tmp_path) == {"audit.log": b"one\ntwo\n"}
    assert file.path.stat().st_mode & 0o777 & ~0o640 == 0
    assert (file.all_lost, file.fault) == (0, "")


def test_a_file_that_would_be_too_long_becomes_an_older_one(tmp_path: Path) -> None:
    written(tmp_path, *(b"%07d\n" % number for number in range(9)), max_bytes=16)
    assert contents(tmp_path) == {
        "audit.log": b"0000008\n",
        "audit.log.1": b"0000006\n0000007\n",
        "audit.log.2": b"0000004\n0000005\n",
    }


def test_what_is_there_already_counts(tmp_path: Path) -> None:
    written(tmp_path, b"1234567890\n", max_bytes=16)
    written(tmp_path, b"abcdefg\n", max_bytes=16)
    assert contents(tmp_path) == {"audit.log": b"abcdefg\n", "audit.log.1": b"1234567890\n"}


def test_without_older_ones_it_begins_anew(tmp_path: Path) -> None:
    written(tmp_path, b"1234567890\n", b"abcdefg\n", max_bytes=16, keep=0)
    assert contents(tmp_path) == {"audit.log": b"abcdefg\n"}


def test_a_line_that_is_longer_than_a_file_is_written_whole(tmp_path: Path) -> None:
    written(tmp_path, b"x" * 100 + b"\n", max_bytes=16)
    assert contents(tmp_path) == {"audit.log": b"x" * 100 + b"\n"}


def test_what_cannot_be_written_is_counted_with_the_reason(tmp_path: Path) -> None:
    (tmp_path / "log").write_text("a file where a folder is due")
    file = written(tmp_path, b"one\n", b"two\n")
    assert file.all_lost == 2
    assert file.fault


def test_after_a_pause_it_is_tried_again(tmp_path: Path) -> None:
    now = 100.0
    file = LineFile(tmp_path / "log" / "audit.log", 100, 1, lambda: now)
    (tmp_path / "log").write_text("a file")
    file._write(b"one\n")
    (tmp_path / "log").unlink()
    file._write(b"two\n")
    assert file.lost == 2, "not tried yet"
    now += 1.0
    file._write(b"three\n")
    assert (file.lost, file.fault) == (2, "")
    assert contents(tmp_path) == {"audit.log": b"three\n"}
    file._drop_file()


def test_half_a_line_is_taken_back(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from bridge.base import line_file

    file = LineFile(tmp_path / "log" / "audit.log", 100, 1, lambda: 0.0)
    file._write(b"one\n")
    write = line_file.os.write
    monkeypatch.setattr(line_file.os, "write", lambda number, data: write(number, data[:2]))
    file._write(b"two\n")
    monkeypatch.undo()
    assert (file.lost, file.fault) == (1, "the disk is full")
    assert contents(tmp_path) == {"audit.log": b"one\n"}
