"""What a tab does in Debian's Chromium: as a controller, without a connection, with what it draws."""

from __future__ import annotations

import os
import re
import signal
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

import pytest
from playwright.sync_api import expect

from tests.bench.processes import children
from tests.browser.hands import owner, start, state, take, to, to_drive
from tests.support.desk import Desk
from tests.support.process import Process
from tests.wire.test_page import DRIVE

SLOW_ANSWER = """
    // Outcomes come a second late.
    const Socket = WebSocket;
    window.WebSocket = class extends Socket {
        set onmessage(act) {
            const late_ms = (event) => (event.data.includes("outcome") ? 1000 : 0);
            super.onmessage = (event) => setTimeout(() => act(event), late_ms(event));
        }
    };
"""
DRAWN = "document.querySelector('.trend canvas').toDataURL()"


def front_of(bridge: Process) -> int:
    """The process that serves the page."""
    commands = {pid: Path(f"/proc/{pid}/cmdline").read_text() for pid in children(bridge.pid)}
    (front,) = [pid for pid, command in commands.items() if "page" in command.split("\0")]
    return front


@contextmanager
def stopped(pid: int) -> Iterator[None]:
    os.kill(pid, signal.SIGSTOP)
    try:
        yield
    finally:
        with suppress(ProcessLookupError):  # hung for too long: the bridge has ended it
            os.kill(pid, signal.SIGCONT)


def test_a_drive_whose_page_was_left_while_it_was_taken_is_given_back(desk: Desk) -> None:
    with desk.sits("operator") as watcher, desk.sits("operator", script=SLOW_ANSWER) as page:
        to_drive(watcher)
        to_drive(page)
        page.get_by_role("button", name="Take control").click()
        to(page, "system")
        owner(watcher).to_contain_text("operator (web page)")
        owner(watcher).to_contain_text("nobody")


def test_another_page_gives_the_drive_back_and_the_skip_link_does_not(desk: Desk) -> None:
    with desk.sits("operator") as page:
        to_drive(page)
        take(page)
        page.locator(".skip").focus()
        page.keyboard.press("Enter")
        expect(page.locator("#main")).to_be_focused()
        owner(page).to_contain_text("you, in this tab")
        page.get_by_role("link", name="Plant", exact=True).click()
        expect(page.locator("#main")).to_be_focused()
        to_drive(page)
        owner(page).to_contain_text("nobody")


@pytest.mark.landing
def test_a_front_that_hangs_is_seen_and_its_tab_is_a_silent_controller(
    desk: Desk, bridge: tuple[Process, int]
) -> None:
    with desk.sits("operator") as page:
        to_drive(page)
        take(page)
        start(page, "20")
        with stopped(front_of(bridge[0])):
            expect(page.locator(".sentence")).to_contain_text("No connection")
            expect(page.get_by_role("button", name="Start", exact=True)).to_be_disabled()
        expect(page.locator(".sentence")).not_to_contain_text("No connection")
        state(page).not_to_have_text(re.compile("running"))
        page.get_by_role("button", name="Take control").click()
        page.get_by_role("button", name=re.compile("(Reset|Acknowledge) fault")).click()
        expect(page.locator(".sentence")).to_contain_text("Everything is in order")


@pytest.mark.landing
def test_whoever_comes_back_after_the_session_is_over_logs_in_again(desk: Desk) -> None:
    with desk.sits("operator") as page:
        expect(page.locator(".sentence")).to_contain_text(re.compile("in order|since"))
        page.context.clear_cookies()
        # As after a laptop's sleep: the connection is gone, and the session as well.
        page.context.set_offline(True)
        expect(page.locator(".sentence")).to_contain_text("No connection")
        page.context.set_offline(False)
        expect(page.locator('input[name="user"]')).to_be_visible()
    desk.complaints.clear()  # the browser's own, on what did not answer


@pytest.mark.landing
def test_a_trend_is_paused_zoomed_and_kept_as_a_file(desk: Desk, tmp_path: Path) -> None:
    with desk.sits("operator") as page:
        to_drive(page)
        pause = page.locator(".trend header button").first
        page.wait_for_timeout(1000)
        pause.click()
        expect(page.locator(".trend header")).to_contain_text("paused")
        before = page.evaluate(DRAWN)
        page.wait_for_timeout(500)
        assert page.evaluate(DRAWN) == before, "paused, it stays as it is"
        with page.expect_download() as download:
            page.get_by_role("button", name="CSV").click()
        assert re.search(
            rf"-{DRIVE.replace('/', '-')}-\d{{4}}-\d\d-\d\d-\d{{6}}\.csv$", download.value.suggested_filename
        )
        head, first, *_ = download.value.path().read_text(encoding="utf-8").splitlines()
        assert head.startswith(f'"time","{DRIVE}/command/frequency [Hz]","{DRIVE}/actual/frequency [Hz]"')
        assert re.match(r"\d{4}-\d\d-\d\dT[\d:.]+Z,", first)
        pause.click()
        plot = page.locator(".trend .u-over")
        box = plot.bounding_box()
        assert box
        page.mouse.move(box["x"] + box["width"] * 0.9, box["y"] + 50)
        page.mouse.down()
        page.mouse.move(box["x"] + box["width"] * 0.95, box["y"] + 50, steps=5)
        page.mouse.up()
        page.mouse.move(0, 0)
        axis = page.evaluate(DRAWN)
        page.wait_for_timeout(500)
        assert page.evaluate(DRAWN) == axis, "what is zoomed to does not move on"
        expect(page.get_by_role("button", name="Back to live")).to_be_visible()
        plot.dblclick()
        page.mouse.move(0, 0)
        page.wait_for_timeout(500)
        assert page.evaluate(DRAWN) != axis, "and on it goes"
