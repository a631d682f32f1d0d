"""What people do on the page, and what of it can be expected."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from playwright.sync_api import Page, expect

from tests.support import sites
from tests.support.process import drivebridge, free_port, until
from tests.wire.test_page import DRIVE, users

SHOTS: Final = Path("build/page")
AXE: Final = Path("tests/wire/node/node_modules/axe-core/axe.min.js")
PATIENT_MS: Final = 2000
"""A tab beside other browsers may be silent for longer than a controller would be. Its lease is longer."""


@contextmanager
def serving(folder: Path, *nodes: str, more_users: str = "") -> Iterator[int]:
    """The page of a site with these nodes on a simulated bus; its port. ``more_users`` are further users."""
    port = free_port()
    opcua = f'[opcua]\nlisten = "127.0.0.1:{free_port()}"\n{users()}\n{more_users}'
    page = f'[page]\nlisten = "127.0.0.1:{port}"\n'
    site = sites.write(folder, sites.bus(*nodes, more=sites.BESIDE_A_BROWSER), opcua, page)
    with drivebridge(folder, "run", "run", str(site), notify=True) as process:
        process.wait_ready()
        process.prefer()
        until(lambda: "is served on" in process.output(), 30.0, "the page is served")
        yield port


PAIRED: Final = ("a/fu1", "a/fu2", "b/fu1", "b/fu2")
"""The drives of two pairs: ``a`` and ``b``."""


def pair(name: str, node_id: int) -> str:
    """Of two drives one is left as it is when its controller falls silent, and one is its owner's alone."""
    drives = (
        sites.drive(
            "fu1",
            "lease",
            PATIENT_MS,
            f'on_expiry = "hold"\ntelegram_downtime_s = 0\n{sites.ACCEPTED}\n{sites.SCALED}',
        ),
        sites.drive("fu2", "lease", PATIENT_MS, f"stop_by_anyone = false\n{sites.ACCEPTED}\n{sites.SCALED}"),
    )
    return sites.node(*drives, name=name, node_id=node_id)


def to(page: Page, place: str) -> None:
    page.goto(f"{page.url.partition('#')[0]}#/{place}")


def to_drive(page: Page) -> None:
    page.goto(f"{page.url.partition('#')[0]}#/drive/{DRIVE}")
    expect(page.get_by_role("heading", name=DRIVE)).to_be_visible()


def take(page: Page) -> None:
    page.get_by_role("button", name="Take control").click()
    expect(page.locator(".ownership")).to_contain_text("you, in this tab")


def start(page: Page, frequency: str) -> None:
    page.locator("#setpoint").fill(frequency)
    page.get_by_role("button", name="Start", exact=True).click()
    expect(page.locator(".drivehead .state")).to_have_text(re.compile("running"))
    expect(page.locator("form.setpoint")).to_contain_text(f"sent {frequency}.0")


@contextmanager
def hanging(page: Page) -> Iterator[None]:
    """None of its scripts goes on, and it stays in the foreground."""
    debugger = page.context.new_cdp_session(page)
    debugger.send("Debugger.enable")
    debugger.send("Debugger.pause")
    try:
        yield
    finally:
        debugger.send("Debugger.resume")
        debugger.detach()


def put_in_order(page: Page, *drives: str) -> None:
    """What a test has left that failed within: drives that are tripped, and that nobody lets go."""
    for drive in drives:
        to(page, f"drive/{drive}")
        take(page)
        acknowledge = page.get_by_role("button", name="Acknowledge fault")
        if acknowledge.is_enabled():
            acknowledge.click()
        state(page).not_to_have_text(re.compile("silent|running"))
        page.get_by_role("button", name="Give back").click()
        owner(page).to_contain_text("nobody")


def state(page: Page) -> Any:
    return expect(page.locator(".drivehead .state"))


def asked(page: Page, action: str) -> list[Any]:
    """The fields of each request for ``action`` that the page makes from now on."""
    found: list[Any] = []

    def on_frame(text: str | bytes) -> None:
        if f'"action":"{action}"' in str(text):
            found.append(json.loads(text)["fields"])

    page.on("websocket", lambda socket: socket.on("framesent", on_frame))
    page.reload()
    expect(page.locator(".sentence")).to_contain_text(re.compile("in order|in Ordnung"))
    return found


def parameter(page: Page, name: str) -> Any:
    return page.locator("table.parameters tr", has=page.get_by_text(name, exact=True))


def owner(page: Page) -> Any:
    return expect(page.locator(".ownership"))


def serious(page: Page) -> list[Any]:
    """What axe finds that keeps people from using the page, each with where."""
    page.evaluate(AXE.read_text(encoding="utf-8") + "; 0")
    found = page.evaluate("axe.run().then((one) => one.violations)")
    return [
        (one["id"], [node["target"] for node in one["nodes"]])
        for one in found
        if one["impact"] in ("serious", "critical")
    ]
