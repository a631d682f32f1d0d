"""Nothing on the page keeps people from using it: in light and dark, on a phone, in both languages."""

from __future__ import annotations

from typing import Any

import pytest
from playwright.sync_api import ViewportSize, expect

from tests.browser.hands import (
    SHOTS,
    serious,
    to,
)
from tests.support.desk import Desk
from tests.wire.test_page import DRIVE

PAGES = {
    "plant": ".tile .state",
    f"drive/{DRIVE}": ".bits .set",
    f"parameters/{DRIVE}": 'td.value:text-matches("[0-9]")',
    "bus/can0": ".pdo svg",
    "integration/modbus": ".rows td",
    "integration/opcua": ".rows td",
    "system": ".fingerprint",
}
"""With what is there when a page is."""


PHONE: ViewportSize = {"width": 360, "height": 740}


DESKTOP: ViewportSize = {"width": 1280, "height": 900}


@pytest.mark.landing
@pytest.mark.parametrize(
    ("scheme", "language", "user"),
    [
        ("light", "de-DE", "operator"),
        ("dark", "de-DE", "operator"),
        ("light", "en-GB", "engineer"),
    ],
)
def test_axe_finds_nothing_serious_and_nothing_is_wider_than_a_phone(
    desk: Desk, scheme: Any, language: str, user: str
) -> None:
    SHOTS.mkdir(parents=True, exist_ok=True)
    with desk.sits(user, color_scheme=scheme, locale=language, viewport=PHONE) as page:
        for shown, there in PAGES.items():
            page.goto(f"{desk.address}#/{shown}")
            name = f"{shown.replace('/', '-')}-{scheme}"
            expect(page.locator(there).first).to_be_attached()
            assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
            page.screenshot(path=SHOTS / f"{name}-phone-{language}.png", full_page=True)
            assert not serious(page)
            page.set_viewport_size(DESKTOP)
            page.screenshot(path=SHOTS / f"{name}-{language}.png", full_page=True)
            page.set_viewport_size(PHONE)


def test_axe_finds_nothing_serious_in_what_an_engineer_opens(desk: Desk) -> None:
    with desk.sits("engineer") as page:
        to(page, f"drive/{DRIVE}")
        page.locator(".trend summary").click()
        assert not serious(page)
        to(page, f"parameters/{DRIVE}")
        page.get_by_role("button", name="Change P102.1", exact=True).click()
        assert not serious(page)
        to(page, "bus/can0")
        page.locator("details", has_text="NMT commands").locator("summary").click()
        page.get_by_role("button", name="Listen").click()
        expect(page.locator(".log tbody tr").first).to_be_visible()
        page.get_by_role("button", name="Pause").click()
        expect(page.get_by_role("button", name="Continue")).to_be_visible()
        assert not serious(page)
