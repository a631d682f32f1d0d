"""A number is sent as its writer means it, in the page's language and not in the browser's, or not at all."""

from __future__ import annotations

import re

import pytest
from playwright.sync_api import Page, expect

from tests.browser.hands import asked, parameter, to
from tests.support.desk import Desk
from tests.wire.test_page import DRIVE

GERMAN = 'localStorage.setItem("drivebridge.language", "de")'
ENGLISH = 'localStorage.setItem("drivebridge.language", "en")'


def take_in(page: Page, button: str) -> None:
    to(page, f"drive/{DRIVE}")
    page.get_by_role("button", name=button).click()
    expect(page.locator(".ownership button")).to_have_count(1)
    expect(page.locator("#setpoint")).to_be_enabled()


@pytest.mark.landing(2)
@pytest.mark.parametrize("locale", ["en-US", "de-DE"])
def test_a_german_page_reads_a_comma_whatever_the_browser_speaks(desk: Desk, locale: str) -> None:
    with desk.sits("operator", GERMAN, locale=locale) as page:
        written = asked(page, "write")
        take_in(page, "Steuerung übernehmen")
        page.locator("#setpoint").fill("2,5")
        expect(page.locator("#setpoint-echo")).to_have_text("sendet 2,5\u202fHz")
        page.get_by_role("button", name="Senden").click()
        expect(page.locator("#setpoint")).to_have_value("")
        assert written == [{"values": {"frequency": 2.5}}]
        page.locator(".ownership button").click()


def test_what_may_mean_two_numbers_is_sent_neither_by_send_nor_by_start(desk: Desk) -> None:
    with desk.sits("operator", GERMAN, locale="en-US") as page:
        written, started = asked(page, "write"), asked(page, "start")
        take_in(page, "Steuerung übernehmen")
        page.locator("#setpoint").fill("1.500")
        for button in ("Senden", "Start"):
            page.get_by_role("button", name=button, exact=True).click()
            expect(page.locator("#setpoint-echo")).to_contain_text("1.500 kann 1,5 oder 1500 heißen")
            expect(page.locator("#setpoint")).to_have_attribute("aria-invalid", "true")
        assert written == started == []
        page.locator(".ownership button").click()


@pytest.mark.landing
def test_the_other_languages_notation_is_shown_in_this_one_before_it_is_sent(desk: Desk) -> None:
    with desk.sits("operator", ENGLISH, locale="de-DE") as page:
        written = asked(page, "write")
        take_in(page, "Take control")
        page.locator("#setpoint").fill("2,5")
        page.get_by_role("button", name="Send").click()
        expect(page.locator("#setpoint-echo")).to_contain_text("2,5 was read as 2.5\u202fHz")
        expect(page.locator("#setpoint")).to_have_value("2.5")
        assert written == []
        page.get_by_role("button", name="Send").click()
        expect(page.locator("#setpoint")).to_have_value("")
        assert written == [{"values": {"frequency": 2.5}}]
        page.locator(".ownership button").click()


@pytest.mark.landing
def test_a_german_page_writes_a_parameter_as_it_was_typed(desk: Desk) -> None:
    with desk.sits("engineer", GERMAN, locale="en-US") as page:
        written = asked(page, "write_parameter")
        to(page, f"parameters/{DRIVE}")
        page.get_by_role("searchbox").fill("P102.1")
        page.get_by_role("button", name="P102.1").first.click()
        field = page.locator("#value")
        expect(field).to_have_value(re.compile(r"^[0-9]+(,[0-9]+)?$"))
        field.fill("3.500")
        expect(page.locator("#value-echo")).to_contain_text("3.500 kann 3,5 oder 3500 heißen")
        page.locator(".editor button").click()
        field.fill("3,5")
        expect(page.locator("#value-echo")).to_have_text("schreibt 3,5\u202fs")
        page.locator(".editor button").click()
        expect(page.locator(".editor p[role=status]")).to_contain_text("3,5")
        field.fill("2")
        page.locator(".editor button").click()
        expect(parameter(page, "P102.1")).to_contain_text("2\u202fs")
        assert [one["value"] for one in written] == [3.5, 2]


def test_no_page_has_a_field_that_leaves_a_number_to_the_browser(bench: Desk) -> None:
    with bench.sits("engineer", GERMAN) as page:
        for place in ("plant", "drive/winder/drive", "drive/a/fu1", "parameters/a/fu1", "bus/can0", "system"):
            to(page, place)
            expect(page.locator("main h1, main h2").first).to_be_visible()
            expect(page.locator("input[type=number]")).to_have_count(0)
