"""A drive is moved from the page, and stops when its tab goes."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import WebSocketRoute, expect

from tests.browser.hands import (
    PAIRED,
    asked,
    hanging,
    owner,
    put_in_order,
    start,
    state,
    take,
    to,
    to_drive,
)
from tests.support.desk import Desk
from tests.wire.test_page import DRIVE

HIDDEN = """is => {
    Object.defineProperty(document, "hidden", { value: is, configurable: true });
    document.dispatchEvent(new Event("visibilitychange"));
}"""


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
        chain = watcher.locator(".chain")
        expect(chain).to_contain_text("the bridge stops the drive: disable voltage. At most")
        published = re.search(r"At most ([\d,]+)", chain.inner_text())
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
        # The bridge may have been told of the end, or found out by the silence: then the drive has tripped.
        put_in_order(watcher, DRIVE)


def test_a_tab_that_hangs_is_a_controller_that_fell_silent(desk: Desk) -> None:
    with desk.sits("operator") as page, desk.sits("operator") as watcher:
        to_drive(page)
        take(page)
        start(page, "20")
        with hanging(page):
            expect(watcher.locator(".sentence")).to_contain_text("its controller fell silent")
        expect(watcher.locator(".trouble")).to_contain_text("(web page)")
        to_drive(watcher)
        expect(watcher.locator(".faults")).to_contain_text("tripped by the bridge, not by the drive")
        expect(watcher.locator(".faults")).not_to_contain_text("What to do")
        expect(watcher.locator(".trouble .remedy")).to_contain_text("a tab of this page")
        expect(watcher.locator(".trouble .remedy")).to_contain_text("Acknowledge the fault")
        page.get_by_role("button", name="Acknowledge fault").click()
        expect(watcher.locator(".sentence")).to_contain_text("Everything is in order")
        state(page).not_to_have_text(re.compile("running"))


@pytest.mark.landing
def test_a_second_browser_takes_no_drive_from_an_operator_and_an_engineer_does(desk: Desk) -> None:
    with desk.sits("operator") as owner, desk.sits("operator") as other, desk.sits("engineer") as engineer:
        for page in (owner, other, engineer):
            to_drive(page)
        take(owner)
        other.get_by_role("button", name="Take control").click()
        expect(other.get_by_role("alert")).to_contain_text("is controlled by")
        take(engineer)
        expect(owner.locator(".ownership")).to_contain_text("engineer (web page)")


def test_setpoints_are_sent_together_and_empty_ones_are_not(bench: Desk) -> None:
    with bench.sits("operator") as page:
        written = asked(page, "write")
        to(page, "drive/winder/drive")
        take(page)
        labels = page.locator("form.setpoint label")
        expect(labels).to_have_count(4)
        expect(labels.first).to_contain_text("velocity")
        page.get_by_role("button", name="Send").click()
        expect(page.locator("form.setpoint")).to_contain_text("nothing to send")
        page.locator("#setpoint").fill("120")
        page.locator("#setpoint-acceleration").fill("300")
        page.get_by_role("button", name="Send").click()
        expect(page.locator("form.setpoint .field").first).to_contain_text("sent 120")
        expect(page.locator("#setpoint")).to_have_value("")
        assert written == [{"values": {"velocity": 120, "acceleration": 300}}]


def test_nobody_is_said_to_watch_or_to_stop_who_does_not(bench: Desk) -> None:
    with bench.sits("operator") as page:
        to(page, "drive/a/fu1")
        chain = page.locator(".chain")
        expect(chain).to_contain_text("the bridge leaves the drive as it is: it may run on")
        expect(chain).to_contain_text("nobody watches")
        expect(chain).not_to_contain_text("nothing heard yet")
        to(page, "drive/a/fu2")
        expect(page.locator(".controls")).to_contain_text("Only who controls it can stop it")
        expect(page.get_by_role("button", name="Stop", exact=True)).to_be_disabled()


@pytest.mark.landing
def test_a_hold_is_told_as_what_it_is(bench: Desk) -> None:
    with bench.sits("operator") as page, bench.sits("operator") as watcher:
        for one in (page, watcher):
            to(one, "drive/a/fu1")
        take(page)
        page.get_by_role("button", name="Start", exact=True).click()
        state(page).to_have_text(re.compile("running"))
        with hanging(page):
            state(watcher).to_have_text(re.compile("its controller is silent"))
            expect(watcher.locator(".trouble")).to_contain_text("it may run on")
            expect(watcher.locator(".trouble")).to_contain_text("until the lease ended, and then stopped it")
        take(page)
        page.get_by_role("button", name="Acknowledge fault").click()
        expect(watcher.locator(".sentence")).to_contain_text("in order")


@pytest.mark.landing
def test_what_a_failed_test_leaves_is_put_in_order(bench: Desk) -> None:
    """Else nothing that failed once could pass when it is tried again."""
    with bench.sits("operator") as watcher:
        with bench.sits("operator") as page:
            for one in (page, watcher):
                to(one, "drive/a/fu1")
            take(page)
            page.get_by_role("button", name="Start", exact=True).click()
            state(watcher).to_have_text(re.compile("running"))
            with hanging(page):
                state(watcher).to_have_text(re.compile("its controller is silent"))
        put_in_order(watcher, *PAIRED)
        to(watcher, "drive/a/fu1")
        state(watcher).not_to_have_text(re.compile("silent|running"))
        owner(watcher).to_contain_text("nobody")


@pytest.mark.landing
def test_a_refusal_is_not_told_again_on_return(bench: Desk) -> None:
    with bench.sits("operator") as owner, bench.sits("operator") as other:
        for page in (owner, other):
            to(page, "drive/b/fu2")
        take(owner)
        other.get_by_role("button", name="Take control").click()
        expect(other.get_by_role("alert")).to_contain_text("is controlled by")
        other.get_by_role("link", name="Plant", exact=True).click()
        expect(other.locator(".tile").first).to_be_visible()
        to(other, "drive/b/fu2")
        expect(other.locator(".ownership")).to_be_visible()
        expect(other.get_by_role("alert")).to_have_text("")


@pytest.mark.landing
def test_a_refusal_is_forgotten_when_its_reason_has_gone(bench: Desk) -> None:
    with bench.sits("operator") as owner, bench.sits("operator") as other:
        for page in (owner, other):
            to(page, "drive/b/fu2")
        take(owner)
        other.get_by_role("button", name="Take control").click()
        expect(other.get_by_role("alert")).to_contain_text("is controlled by")
        owner.get_by_role("button", name="Give back").click()
        expect(other.get_by_role("alert")).to_have_text("")


@pytest.mark.landing
def test_who_hid_a_tab_is_told_on_return_what_became_of_its_drive(bench: Desk) -> None:
    with bench.sits("operator") as page:
        to(page, "drive/b/fu2")
        take(page)
        page.evaluate(HIDDEN, True)
        expect(page.locator(".ownership")).to_contain_text("nobody")
        page.evaluate(HIDDEN, False)
        expect(page.get_by_role("alert")).to_contain_text("This tab was hidden at")
        take(page)
        expect(page.get_by_role("alert")).to_have_text("")


def test_an_observer_is_told_that_it_may_read(desk: Desk) -> None:
    with desk.sits("observer") as page:
        to_drive(page)
        expect(page.locator(".controls")).to_contain_text("As an observer")
        expect(page.get_by_role("button", name="Stop", exact=True)).to_have_count(0)


def test_log_out(desk: Desk) -> None:
    with desk.sits("operator") as page:
        page.get_by_role("button", name="Log out").click()
        expect(page.locator('input[name="user"]')).to_be_visible()
        expect(page.get_by_role("button", name="Back")).to_have_count(0)
        page.reload()
        expect(page.locator('input[name="user"]')).to_be_visible()


def test_who_leaves_a_running_drive_is_told_first_that_it_stops(desk: Desk) -> None:
    with desk.sits("operator") as page:
        to_drive(page)
        expect(page.locator(".controls")).to_be_visible()
        take(page)
        expect(page.locator(".controls")).to_contain_text("It stops when you leave the page")
        start(page, "20")
        asks = page.get_by_role("alertdialog")
        for leave in (
            lambda: page.get_by_role("link", name="Plant", exact=True).click(),
            lambda: to(page, "system"),
            lambda: page.get_by_role("button", name="Log out").click(),
        ):
            leave()
            expect(asks).to_contain_text("the drive is given back and stops")
            expect(page.get_by_role("button", name="Stay here")).to_be_focused()
            page.get_by_role("button", name="Stay here").click()
            expect(asks).to_have_count(0)
            assert page.url.endswith(f"#/drive/{DRIVE}")
            state(page).to_have_text(re.compile("running"))
        page.get_by_role("link", name="Plant", exact=True).click()
        page.get_by_role("button", name="Leave and stop the drive").click()
        expect(page.locator(".tile").first).to_be_visible()
        to_drive(page)
        owner(page).to_contain_text("nobody")
        state(page).not_to_have_text(re.compile("running"))


def test_who_leaves_a_drive_that_stands_is_asked_nothing(desk: Desk) -> None:
    with desk.sits("operator") as page:
        to_drive(page)
        take(page)
        page.get_by_role("link", name="Plant", exact=True).click()
        expect(page.locator(".tile").first).to_be_visible()


@pytest.mark.landing
def test_a_tab_that_was_cut_off_says_so_itself(desk: Desk) -> None:
    with desk.sits("operator") as page:
        sockets: list[WebSocketRoute] = []

        def on_socket(socket: WebSocketRoute) -> None:
            sockets.append(socket.connect_to_server())

        page.route_web_socket(re.compile("/live$"), on_socket)
        page.reload()
        to_drive(page)
        take(page)
        start(page, "20")
        sockets[-1].close()
        expect(page.get_by_role("alert").first).to_contain_text("This tab lost its connection at")
        expect(page.locator(".trouble, .sentence.is-none").first).to_be_visible()
        take(page)
        reset = page.get_by_role("button", name="Acknowledge fault")
        if page.locator(".trouble").count():
            expect(page.locator(".trouble .remedy").first).to_contain_text("This tab lost its connection")
            reset.click()
        expect(page.locator(".sentence")).to_contain_text("in order")
        desk.complaints.clear()  # the browser's own line on a socket that is closed under it


@pytest.mark.landing
def test_a_screen_reader_is_told_each_state_that_a_drive_comes_to(desk: Desk) -> None:
    with desk.sits("operator") as page:
        to_drive(page)
        take(page)
        told = page.get_by_role("status").filter(has_text=f"{DRIVE}: ")
        start(page, "20")
        expect(told).to_have_text(f"{DRIVE}: running")
        page.get_by_role("button", name="Stop", exact=True).click()
        expect(told).not_to_have_text(f"{DRIVE}: running")
        expect(told).to_have_text(re.compile(f"{DRIVE}: [a-z]"))
        expect(page.get_by_role("img", name=re.compile("^Course of .*frequency"))).to_have_count(1)
        page.get_by_role("button", name="Give back").click()
