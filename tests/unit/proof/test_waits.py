"""The account of waiting: what lies between two moments, also over a restart."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.proof.waits import (
    Account,
    follow,
    longest_wait_ms,
    most_paused_ms,
    most_waited_ms,
    paused_ms,
    waited_ms,
)
from tests.support.process import REPOSITORY


def put(path: Path, *lines: str) -> None:
    path.write_text("".join(f"{line}\n" for line in lines), encoding="ascii")


def test_what_was_waited_between_two_moments(tmp_path: Path) -> None:
    put(tmp_path / "bridge.waits", "1.00 1.05 0.02", "1.05 1.10 0.01", "1.10 1.15 0.03", "1.15 1.20 0.01")
    assert waited_ms(tmp_path, "bridge", 1.05, 1.15) == pytest.approx(40)
    assert waited_ms(tmp_path, "bridge", 1.21, 2.0) == 0.0
    # Of a look that lies outside in part, no more than can have been inside.
    assert waited_ms(tmp_path, "bridge", 1.05, 1.11) == pytest.approx(20)
    assert waited_ms(tmp_path, "bridge", 1.145, 1.149) == pytest.approx(4)


def test_the_longest_wait_is_none_of_many_short_ones(tmp_path: Path) -> None:
    put(tmp_path / "bridge.waits", "0.50 0.90 0.40", "1.00 1.05 0.02", "1.05 1.50 0.30", "1.50 1.55 0.01")
    assert longest_wait_ms(tmp_path, "bridge", 1.0, 2.0) == pytest.approx(300)
    assert longest_wait_ms(tmp_path, "bridge", 1.5, 2.0) == pytest.approx(10)
    assert longest_wait_ms(tmp_path, "bridge", 2.0, 3.0) == 0.0


def test_many_short_waits_in_a_row_hold_a_process_up_as_a_long_one_does(tmp_path: Path) -> None:
    put(
        tmp_path / "bridge.waits",
        "0.5 0.9 0.4",
        "1.0 1.1 0.05",
        "1.1 1.2 0.1",
        "1.2 1.3 0.06",
        "1.9 2.0 0.07",
    )
    assert most_waited_ms(tmp_path, "bridge", 1.0, 2.0, 0.35) == pytest.approx(210)
    assert most_waited_ms(tmp_path, "bridge", 1.0, 2.0, 0.15) == pytest.approx(160)
    assert most_waited_ms(tmp_path, "bridge", 3.0, 4.0, 1.0) == 0.0


def test_pauses_count_where_they_lie_between_two_moments(tmp_path: Path) -> None:
    put(tmp_path / "pauses", "0.500 0.600", "1.000 1.040", "1.100 1.150")
    assert paused_ms(tmp_path, 1.02, 1.11) == pytest.approx(30)
    assert paused_ms(tmp_path, 1.2, 1.3) == 0.0


def test_little_pauses_of_a_long_time_do_not_add_up(tmp_path: Path) -> None:
    put(tmp_path / "pauses", *(f"{n}.000 {n}.050" for n in range(1, 10)), "10.000 10.300", "10.400 10.500")
    assert paused_ms(tmp_path, 0.0, 11.0) == pytest.approx(850)
    assert most_paused_ms(tmp_path, 0.0, 10.0, 0.8) == pytest.approx(50)
    assert most_paused_ms(tmp_path, 0.0, 11.0, 0.8) == pytest.approx(400)
    assert most_paused_ms(tmp_path, 11.0, 12.0, 0.8) == 0.0


def test_a_line_that_is_being_written_does_not_count(tmp_path: Path) -> None:
    (tmp_path / "pauses").write_text("1.000 1.040\n1.100 1.1", encoding="ascii")
    assert paused_ms(tmp_path, 0.0, 2.0) == pytest.approx(40)


def test_the_account_of_one_process_after_the_other(tmp_path: Path) -> None:
    account = Account(tmp_path, "bridge")
    for now, pid, waited_s in ((1.0, 1, 5), (1.1, 1, 5), (1.2, 2, 1), (1.3, 2, 3)):
        process = tmp_path / str(pid)
        process.mkdir(exist_ok=True)
        (process / "schedstat").write_text(f"7 {waited_s}000000000 9\n", encoding="ascii")
        (tmp_path / "bridge.pid").unlink(missing_ok=True)
        (tmp_path / "bridge.pid").symlink_to(process)
        account.look(now)
    lines = [line.split() for line in (tmp_path / "bridge.waits").read_text().splitlines()]
    assert [float(grown) for _, _, grown in lines] == [5, 0, 2]
    # One that ended between two looks may have begun before them.
    assert [float(begin) for begin, _, _ in lines[1:]] == pytest.approx([1.1, -0.7])


def test_the_kernel_tells_it_of_a_process(tmp_path: Path) -> None:
    follow(tmp_path, "bridge", 2**22 + 1)  # is not there
    follow(tmp_path, "bridge", os.getpid())
    watch = subprocess.Popen(
        [sys.executable, "-m", "tests.proof.waits", str(tmp_path), "bridge"], cwd=REPOSITORY
    )
    try:
        end = time.monotonic() + 20
        while not (tmp_path / "bridge.waits").exists() or not waited_ms(tmp_path, "bridge", 0.0, 1e9):
            assert time.monotonic() < end
            assert watch.poll() is None
            time.sleep(0.01)
    finally:
        watch.kill()
        watch.wait()
