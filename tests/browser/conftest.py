"""Bridges for all of these tests, a browser for each module, and the desks at which people sit."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser

from tests.browser.hands import PAIRED, PATIENT_MS, pair, put_in_order, serving
from tests.support import sites
from tests.support.desk import Desk, browser
from tests.support.process import Process, drivebridge, free_port, until
from tests.wire.test_page import DRIVE, write_site


@pytest.fixture(scope="session")
def bridge(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Process, int]]:
    folder, port = tmp_path_factory.mktemp("page"), free_port()
    site = write_site(folder, port, timeout_ms=PATIENT_MS)
    with drivebridge(folder, "run", "run", str(site), notify=True) as process:
        process.wait_ready()
        process.prefer()
        until(lambda: "is served on" in process.output(), 30.0, "the page is served")
        yield process, port


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    with browser() as started:
        yield started


def _begin_in_order(request: pytest.FixtureRequest, desk: Desk, *drives: str) -> None:
    """Else nothing that failed once could pass when it is tried again: pytest-rerunfailures counts."""
    if getattr(request.node, "execution_count", 1) > 1:
        with desk.sits("operator") as page:
            put_in_order(page, *drives)


@pytest.fixture
def desk(request: pytest.FixtureRequest, chromium: Browser, bridge: tuple[Process, int]) -> Iterator[Desk]:
    desk = Desk(chromium, bridge[1])
    _begin_in_order(request, desk, DRIVE)
    yield desk
    assert not desk.complaints


def positioner() -> str:
    """A drive that is told where to go, how fast and how hard."""
    drive = sites.drive("axis1", "lease", PATIENT_MS, "telegram_downtime_s = 0")
    more = 'supervision = "guarding"\nsupervision_ms = 2000'
    return sites.node(drive, name="winder", node_id=7, mapping="stoeber/5000-posi", more=more)


@pytest.fixture(scope="session")
def workshop(tmp_path_factory: pytest.TempPathFactory) -> Iterator[int]:
    with serving(tmp_path_factory.mktemp("workshop"), pair("a", 5), pair("b", 6), positioner()) as port:
        yield port


@pytest.fixture
def bench(request: pytest.FixtureRequest, chromium: Browser, workshop: int) -> Iterator[Desk]:
    desk = Desk(chromium, workshop)
    _begin_in_order(request, desk, *PAIRED)
    yield desk
    assert not desk.complaints


@pytest.fixture(scope="session", autouse=True)
def started(bridge: tuple[Process, int], workshop: int) -> None:
    """Before the first module: what it leaves behind is what it has begun itself."""
