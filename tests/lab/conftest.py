"""Rules of the lab: it needs real SocketCAN, and nothing in it is ever skipped.

``make lab`` runs these tests through ``vcan-run``, which provides the buses. A lab test that skips
itself would look like a proof that was never made, so here a skip is a failure.

``--share FOLDER`` is for several runs at once, each on buses of its own: a run takes the next module that
no other has taken, and its fixtures with it, until none is left.

``--cold`` starts each process of the product with its imports (``tests/support/warm.py``).
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import nullcontext
from functools import cache
from pathlib import Path
from typing import Any

import pytest

from tests.support.warm import warm_interpreter

NEEDS_VCAN = "The lab needs the CAN interface vcan0: run `make lab`, or tests/lab/vcan-run -- COMMAND."


def vcan_is_missing() -> bool:
    return not Path("/sys/class/net/vcan0").exists()


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--share", type=Path, metavar="FOLDER", help="run what no other run takes from FOLDER")
    parser.addoption("--cold", action="store_true", help="start each process as a user does")


def pytest_sessionstart() -> None:
    """End a run of the lab alone with one sentence. (A run that came here from elsewhere is past this.)"""
    if vcan_is_missing():
        pytest.exit(NEEDS_VCAN, returncode=1)


@pytest.fixture(scope="session", autouse=True)
def _vcan() -> None:
    if vcan_is_missing():
        pytest.fail(NEEDS_VCAN, pytrace=False)


@pytest.fixture(scope="session", autouse=True)
def _warm(request: pytest.FixtureRequest) -> Iterator[None]:
    with nullcontext() if request.config.getoption("--cold") else warm_interpreter():
        yield


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest module first: of several runs none waits for it at the end."""
    items.sort(key=lambda item: item.path.stem != "test_proof")


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> bool | None:
    """Leave out, without a report, what another run has taken."""
    folder = item.config.getoption("--share", None)
    return None if folder is None or take(folder / item.path.stem) else True


@cache
def take(claim: Path) -> bool:
    """Whether ``claim`` is ours. Making a folder is atomic, also across user-mode kernels."""
    try:
        claim.mkdir()
    except FileExistsError:
        return False
    return True


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport() -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Skipped and expected-to-fail tests fail."""
    report = yield
    if report.skipped:
        fail(report)
    return report


@pytest.hookimpl(wrapper=True)
def pytest_make_collect_report() -> Generator[None, pytest.CollectReport, pytest.CollectReport]:
    """So does a module that skips itself while it is being collected."""
    report = yield
    if report.skipped:
        fail(report)
    return report


def fail(report: Any) -> None:
    reason = report.longrepr[2] if isinstance(report.longrepr, tuple) else report.longrepr
    report.outcome = "failed"
    report.longrepr = f"A lab test must not be skipped. {reason}"
