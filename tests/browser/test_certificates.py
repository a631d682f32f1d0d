"""An administrator trusts and rejects OPC UA clients on the page; others see it and decide nothing."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect

from bridge.trust import TrustStore
from bridge.trust.files import thumbprint
from tests.browser.hands import SHOTS, pair, serious, serving, to
from tests.support.certificates import CLIENT, Made, make
from tests.support.desk import Desk
from tests.wire.test_page import user


@pytest.fixture
def office(tmp_path: Path, chromium: Browser) -> Iterator[tuple[Desk, TrustStore]]:
    """A desk at a site with an administrator, and its folders of certificates."""
    with ExitStack() as site:
        desk = Desk(chromium, site.enter_context(serving(tmp_path, pair("a", 5), more_users=user("admin"))))
        yield desk, TrustStore(tmp_path / "state" / "certificates")
        assert not desk.complaints


def row(page: Page, made: Made) -> Any:
    return page.get_by_role("row").filter(has_text=thumbprint(made.certificate))


def question(page: Page) -> Any:
    return page.get_by_role("alertdialog")


def test_a_refused_client_is_trusted_and_rejected_again_by_its_name(
    office: tuple[Desk, TrustStore],
) -> None:
    desk, store = office
    panel, other = make(CLIENT.but(subject="panel")), make(CLIENT.but(subject="other"))
    store.keep_rejected([panel.certificate], "10.0.0.1", 0.0)
    with desk.sits("admin") as page:
        to(page, "system")
        expect(row(page, panel)).to_contain_text("it is not trusted")
        page.get_by_role("button", name="Trust CN=panel").click()
        # A row that comes meanwhile, on top, changes nothing of what is agreed to.
        store.keep_rejected([other.certificate], "10.0.0.2", 0.0)
        expect(row(page, other)).to_be_visible()
        expect(question(page)).to_contain_text("Trust CN=panel?")
        expect(question(page)).to_contain_text(thumbprint(panel.certificate))
        assert not serious(page)
        page.screenshot(path=SHOTS / "certificates.png", full_page=True)
        question(page).get_by_role("button", name="Cancel").click()
        expect(question(page)).to_have_count(0)
        assert not store.lists().trusts(panel.certificate)
        page.get_by_role("button", name="Trust CN=panel").click()
        question(page).get_by_role("button", name="Trust", exact=True).click()
        expect(page.get_by_text("CN=panel is trusted.")).to_be_visible()
        expect(row(page, panel)).to_contain_text("trusted client")
        assert store.lists().trusts(panel.certificate)
        assert not store.lists().trusts(other.certificate)
        page.get_by_role("button", name="Deutsch").click()
        page.get_by_role("button", name="Abweisen: CN=panel").click()
        question(page).get_by_role("button", name="Abweisen", exact=True).click()
        expect(page.get_by_text("CN=panel wird nicht mehr vertraut.")).to_be_visible()
        expect(row(page, panel)).to_contain_text("ihm wird nicht vertraut")
        assert not store.lists().trusts(panel.certificate)
    with desk.sits("engineer") as page:
        to(page, "system")
        expect(row(page, panel)).to_contain_text(
            f"drivebridge certificates trust SITE {thumbprint(panel.certificate)}"
        )
        expect(page.get_by_role("button", name="Trust CN=panel")).to_have_count(0)
