"""``make test`` runs lanes of make targets side by side; they end together."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import partial
from pathlib import Path

import pytest

from tests.support.process import REPOSITORY, until

MAKEFILE = """
quick:
	@echo quick
fails:
	@until [ -s long.pid ]; do sleep 0.05; done; exit 3
left long:
	@echo $$$$ >$@.pid; exec sleep 600
"""

Lanes = Callable[[str, str], AbstractContextManager[subprocess.Popen[str]]]


@pytest.fixture
def lanes(tmp_path: Path) -> Lanes:
    (tmp_path / "Makefile").write_text(MAKEFILE, encoding="ascii")
    command = [sys.executable, str(REPOSITORY / "tools" / "side_by_side.py"), "make"]

    @contextmanager
    def running(*targets: str) -> Iterator[subprocess.Popen[str]]:
        # As a shell starts what is to run in the background.
        ignored = partial(signal.signal, signal.SIGINT, signal.SIG_IGN)
        with subprocess.Popen(
            [*command, *targets], cwd=tmp_path, stdout=subprocess.PIPE, text=True, preexec_fn=ignored
        ) as lanes:
            try:
                yield lanes
            finally:
                lanes.terminate()

    return running


def is_gone(pid_file: Path) -> bool:
    try:
        return ") Z " in Path("/proc", pid_file.read_text().strip(), "stat").read_text()
    except OSError:  # it is gone
        return True


def wait_gone(*pid_files: Path) -> None:
    """A process that gives way does so at its end, too."""
    until(lambda: all(map(is_gone, pid_files)), 60.0, "they are gone")


def test_all_pass(lanes: Lanes) -> None:
    with lanes("quick", "quick") as them:
        assert them.communicate(timeout=60)[0] == 2 * "quick\n"
    assert them.returncode == 0


@pytest.mark.parametrize("order", [("quick fails", "long"), ("long", "quick fails")])
def test_one_that_fails_ends_the_other(lanes: Lanes, order: tuple[str, str], tmp_path: Path) -> None:
    with lanes(*order) as them:
        assert "quick" in them.communicate(timeout=60)[0]
    assert them.returncode == 1
    wait_gone(tmp_path / "long.pid")


@pytest.mark.landing(2)
@pytest.mark.parametrize(("told", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_whoever_ends_it_ends_all(lanes: Lanes, told: signal.Signals, status: int, tmp_path: Path) -> None:
    pids = tmp_path / "long.pid", tmp_path / "left.pid"
    with lanes("long quick", "left quick") as them:
        until(lambda: all(pid.exists() and pid.read_text() for pid in pids), 60.0, "both run")
        them.send_signal(told)
        assert "quick" not in them.communicate(timeout=60)[0], "nothing begins any more"
    assert them.returncode == status
    wait_gone(*pids)
