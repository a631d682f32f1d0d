"""The page in Debian's Chromium, as people use it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import (
    Browser,
    BrowserContext,
    ConsoleMessage,
    Page,
    Request,
    expect,
    sync_playwright,
)

from tests.support.process import Process, drivebridge, free_port, until
from tests.wire.test_page import DRIVE, write_site

AXE = Path("tests/wire/node/node_modules/axe-core/axe.min.js")
SHOTS = Path("build/page")
WAIT_MS = 10_000.0
PAGES = ("plant", f"drive/{DRIVE}", "integration/modbus", "integration/opcua")


@pytest.fixture(scope="module")
def bridge(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Process, int]]:
    folder, port = tmp_path_factory.mktemp("page"), free_port()
    with drivebridge(folder, "run", "run", str(write_site(folder, port)), notify=True) as process:
        process.wait_ready()
        until(lambda: "is served on" in process.output(), 30.0, "the page is served")
        yield process, port


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
        yield browser
        browser.close()


class Desk:
    """Opens the page; whatever a browser complains about, and whatever leaves the box, fails the test."""

    def __init__(self, chromium: Browser, port: int) -> None:
        self._chromium, self.address = chromium, f"http://127.0.0.1:{port}/"
        self.complaints: list[str] = []

    @contextmanager
    def sits(self, user: str, **options: Any) -> Iterator[Page]:
        context = self._chromium.new_context(bypass_csp=False, **options)
        context.set_default_timeout(WAIT_MS)
        try:
            yield self._open(context, user)
        finally:
            context.close()

    def _open(self, context: BrowserContext, user: str) -> Page:
        page = context.new_page()
        page.on("pageerror", lambda error: self._complain(str(error)))
        page.on("console", self._on_console)
        page.on("request", self._on_request)
        page.goto(self.address)
        page.locator('input[name="user"]').fill(user)
        page.locator('input[name="password"]').fill(f"{user}!")
        page.locator("form button.main").click()
        expect(page.locator(".sentence")).to_be_visible()
        return page

    def _on_console(self, line: ConsoleMessage) -> None:
        if line.type in ("error", "warning"):
            self._complain(line.text)

    def _on_request(self, request: Request) -> None:
        if not request.url.startswith((self.address, "blob:")):
            self._complain(request.url)

    def _complain(self, text: str) -> None:
        if "401" not in text:  # the question who one is, before the login
            self.complaints.append(text)


@pytest.fixture
def desk(chromium: Browser, bridge: tuple[Process, int]) -> Iterator[Desk]:
    desk = Desk(chromium, bridge[1])
    yield desk
    assert not desk.complaints


def to_drive(page: Page) -> None:
    page.goto(f"{page.url.partition('#')[0]}#/drive/{DRIVE}")
    expect(page.get_by_role("heading", name=DRIVE)).to_be_visible()


def take(page: Page) -> None:
    page.get_by_role("button", name="Take control").click()
    expect(page.locator(".ownership")).to_contain_text("you, in this tab")


def start(page: Page, frequency: str) -> None:
    page.locator("#setpoint").fill(frequency)
    page.get_by_role("button", name="Send").click()
    page.get_by_role("button", name="Start", exact=True).click()
    expect(page.locator(".drivehead .state")).to_have_text(re.compile("running"))


def state(page: Page) -> Any:
    return expect(page.locator(".drivehead .state"))


def test_a_drive_is_taken_started_stopped_and_given_back(desk: Desk) -> None:
    with desk.sits("operator") as page:
        to_drive(page)
        take(page)
        start(page, "25")
        expect(page.locator(".actuals")).to_contain_text("25.0")
        expect(page.locator(".diagram .present")).to_have_text("running")
        expect(page.locator(".bits").last).to_contain_text("operation enabled")
        page.get_by_role("button", name="Stop", exact=True).click()
        state(page).not_to_have_text(re.compile("running"))
        page.get_by_role("button", name="Give back").click()
        expect(page.locator(".ownership")).to_contain_text("nobody")


def test_a_tab_that_is_closed_stops_its_drive_in_the_published_time(desk: Desk) -> None:
    with desk.sits("operator") as watcher:
        to_drive(watcher)
        expect(watcher.locator(".chain")).to_contain_text("At most")
        published = re.search(r"At most ([\d,]+)", watcher.locator(".chain").inner_text())
        assert published
        with desk.sits("operator") as page:
            to_drive(page)
            take(page)
            start(page, "30")
            state(watcher).to_have_text(re.compile("running"))
        limit_ms = float(published[1].replace(",", ""))
        expect(watcher.locator(".drivehead .state")).not_to_have_text(
            re.compile("running"), timeout=limit_ms + 2000
        )


def test_a_tab_that_hangs_is_a_controller_that_fell_silent(desk: Desk) -> None:
    with desk.sits("operator") as page, desk.sits("operator") as watcher:
        to_drive(page)
        take(page)
        start(page, "20")
        page.evaluate("setTimeout(() => { const end = Date.now() + 2500; while (Date.now() < end); })")
        expect(watcher.locator(".sentence")).to_contain_text("its controller fell silent")
        expect(watcher.locator(".trouble")).to_contain_text("(web page)")
        expect(watcher.locator(".trouble .remedy")).to_contain_text("acknowledge")
        page.get_by_role("button", name="Reset fault").click()
        expect(watcher.locator(".sentence")).to_contain_text("Everything is in order")
        state(page).not_to_have_text(re.compile("running"))


def test_a_second_browser_takes_no_drive_from_an_operator_and_an_engineer_does(desk: Desk) -> None:
    with desk.sits("operator") as owner, desk.sits("operator") as other, desk.sits("engineer") as engineer:
        for page in (owner, other, engineer):
            to_drive(page)
        take(owner)
        other.get_by_role("button", name="Take control").click()
        expect(other.get_by_role("alert")).to_contain_text("is controlled by")
        take(engineer)
        expect(owner.locator(".ownership")).to_contain_text("engineer (web page)")


def test_an_observer_is_told_that_it_may_read(desk: Desk) -> None:
    with desk.sits("observer") as page:
        to_drive(page)
        expect(page.locator(".controls")).to_contain_text("As an observer")
        expect(page.get_by_role("button", name="Stop", exact=True)).to_have_count(0)


def test_the_register_map_is_searched_and_downloaded(desk: Desk) -> None:
    with desk.sits("observer") as page:
        page.get_by_role("link", name="Integration").click()
        page.get_by_role("searchbox").fill("watchdog left")
        expect(page.locator(".rows tbody tr").first).to_contain_text("watchdog_left_ms")
        with page.expect_download() as download:
            page.get_by_role("link", name="modbus.csv").click()
        text = download.value.path().read_text(encoding="utf-8")
        assert text.startswith("unit_id,drive,table,address,reference,name")
        page.get_by_role("link", name="OPC UA").click()
        expect(page.locator(".rows")).to_contain_text("nsu=urn:drivebridge:points;s=conveyor/fu1/")


def test_log_out(desk: Desk) -> None:
    with desk.sits("operator") as page:
        page.get_by_role("button", name="Log out").click()
        expect(page.locator('input[name="user"]')).to_be_visible()
        page.reload()
        expect(page.locator('input[name="user"]')).to_be_visible()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_axe_finds_nothing_serious_and_nothing_is_wider_than_a_phone(desk: Desk, scheme: Any) -> None:
    SHOTS.mkdir(parents=True, exist_ok=True)
    phone = {"width": 360, "height": 740}
    with desk.sits("operator", color_scheme=scheme, locale="de-DE", viewport=phone) as page:
        for shown in PAGES:
            page.goto(f"{desk.address}#/{shown}")
            name = f"{shown.replace('/', '-')}-{scheme}"
            expect(page.locator("h1")).to_be_attached()
            assert page.evaluate("document.documentElement.scrollWidth") <= phone["width"]
            page.screenshot(path=SHOTS / f"{name}-phone-german.png", full_page=True)
            page.evaluate(AXE.read_text(encoding="utf-8") + "; 0")
            found = page.evaluate("axe.run().then((one) => one.violations)")
            serious = [
                (one["id"], [node["target"] for node in one["nodes"]])
                for one in found
                if one["impact"] in ("serious", "critical")
            ]
            assert not serious
            page.set_viewport_size({"width": 1280, "height": 900})
            page.screenshot(path=SHOTS / f"{name}-german.png", full_page=True)
            page.set_viewport_size({"width": 360, "height": 740})
