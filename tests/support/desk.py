"""Debian's Chromium, as people use the page with it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Final

from playwright.sync_api import (
    Browser,
    BrowserContext,
    ConsoleMessage,
    Page,
    Request,
    expect,
    sync_playwright,
)

WAIT_MS: Final = 10_000.0
expect.set_options(timeout=WAIT_MS)


@contextmanager
def browser() -> Iterator[Browser]:
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path="/usr/bin/chromium", args=["--no-sandbox"])
        yield started
        started.close()


class Desk:
    """Opens the page; whatever a browser complains about, and whatever leaves the box, fails the test."""

    def __init__(self, chromium: Browser, port: int) -> None:
        self._chromium, self.address = chromium, f"http://127.0.0.1:{port}/"
        self.complaints: list[str] = []

    @contextmanager
    def sits(self, user: str, script: str = "", **options: Any) -> Iterator[Page]:
        """Logged in; ``script`` runs before those of the page."""
        context = self._chromium.new_context(bypass_csp=False, **options)
        context.set_default_timeout(WAIT_MS)
        context.add_init_script(script)
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
