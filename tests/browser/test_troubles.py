"""Six faults, as somebody sees them who has never seen the plant: the first screen says which drive, what,
since when, and what to do."""

from __future__ import annotations

import re
import socket
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from tests.browser.hands import SHOTS, start, take
from tests.support import sites
from tests.support.desk import Desk
from tests.support.process import Process, free_port, peer, until
from tests.wire.test_page import DRIVE, users

SINCE = re.compile(r"since \d\d:\d\d:\d\d (or earlier )?\(\d+ s\)")


class BrokenPlant:
    """A bridge whose plant breaks as it is told to, and somebody who looks at the page."""

    def __init__(self, process: Process, port: int, page: Page, modbus: int) -> None:
        self._process, self._port = process, port
        self.page, self.modbus = page, modbus

    def tell(self, what: str) -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as teller:
            teller.sendto(what.encode(), ("127.0.0.1", self._port))
        self._process.wait_output(f"done: {what}")

    def says(self, place: str, *texts: str) -> Locator:
        """The trouble of ``place`` on the first screen, which says all of this."""
        trouble = self.page.locator(".trouble", has=self.page.get_by_role("link", name=place, exact=True))
        for text in texts:
            expect(trouble.first).to_contain_text(text)
        expect(trouble.first).to_contain_text(SINCE)
        expect(trouble.first.locator(".remedy")).not_to_have_text("What to do")
        expect(trouble.first).to_be_in_viewport()
        expect(self.page.locator(".sentence")).to_contain_text(place)
        return trouble.first

    def shot(self, name: str) -> None:
        SHOTS.mkdir(parents=True, exist_ok=True)
        self.page.screenshot(path=SHOTS / f"trouble-{name}.png")


@contextmanager
def broken(
    folder: Path,
    chromium: Browser,
    more: str = "",
    control: str = "lease",
    at_first: str = "Everything is in order",
) -> Iterator[BrokenPlant]:
    """The page's first screen of a plant that is in order as yet, or where ``at_first`` is wrong."""
    port, modbus, commands = free_port(), free_port(), free_port()
    drives = (
        sites.drive("fu2", "none", 0, f"{sites.ACCEPTED}\n{sites.SCALED}"),
        sites.drive("fu1", control, 1000, f"unit_id = 1\n{sites.ACCEPTED}\n{sites.SCALED}"),
    )
    site = sites.write(
        folder,
        sites.bus(sites.node(*drives), more=sites.BESIDE_A_BROWSER),
        sites.modbus(modbus),
        f'[opcua]\nlisten = "127.0.0.1:{free_port()}"\n{users()}',
        f'[page]\nlisten = "127.0.0.1:{port}"\n{more}\n',
    )
    with peer(folder, "broken_plant", str(site), str(commands)) as process:
        process.wait_output("is served on")
        process.prefer()
        until(lambda: "node operational" in process.output(), 30.0, "the node is operational")
        desk = Desk(chromium, port)
        with desk.sits("operator", viewport={"width": 1280, "height": 720}) as page:
            expect(page.locator(".sentence")).to_contain_text(at_first)
            yield BrokenPlant(process, commands, page, modbus)
        assert not desk.complaints


@pytest.mark.landing
def test_a_cable_is_pulled(tmp_path: Path, chromium: Browser) -> None:
    with broken(tmp_path, chromium) as plant:
        plant.tell("cut_cable")
        trouble = plant.says("conveyor", "not heard any more", "look at its CAN cable and connectors")
        expect(plant.page.locator(".tile", has_text=DRIVE)).to_contain_text("not heard")
        plant.shot("cable")
        trouble.get_by_role("link", name="conveyor").click()
        expect(plant.page.locator(".busnode")).to_contain_text("not heard")
        plant.tell("mend_cable")
        expect(plant.page.locator(".sentence")).to_contain_text("Everything is in order")


@pytest.mark.landing
def test_a_bus_is_pulled_while_a_drive_runs_on_it(tmp_path: Path, chromium: Browser) -> None:
    with broken(tmp_path, chromium) as plant:
        page = plant.page
        page.get_by_role("link", name=DRIVE).first.click()
        take(page)
        start(page, "20")
        plant.tell("pull_adapter")
        expect(page.locator(".drivehead .state")).to_contain_text("not heard")
        page.get_by_role("link", name="Plant", exact=True).click()
        plant.says("can0", "the bus is down", "the interface has vanished", "CAN interface is connected")
        expect(page.locator(".trouble")).to_have_count(1)
        expect(page.locator(".busstate")).to_contain_text("down")
        plant.shot("bus")
        plant.tell("plug_adapter")
        expect(page.locator(".sentence")).to_contain_text("Everything is in order")
        expect(page.locator(".tile", has_text=DRIVE)).not_to_contain_text("running")


@pytest.mark.landing
def test_a_drive_has_a_fault_and_is_acknowledged(tmp_path: Path, chromium: Browser) -> None:
    with broken(tmp_path, chromium) as plant:
        page = plant.page
        expect(page.locator(".tile").first).to_contain_text("conveyor/fu2")
        page.clock.install()
        plant.tell("fail_drive")
        trouble = plant.says(DRIVE, "fault E003/3.0", "Overcurrent of the inverter.")
        expect(page.locator(".tile").first).to_contain_text(DRIVE)
        expect(page.locator(".tile").first).to_contain_text("E003/3.0 overcurrent of the inverter")
        expect(page.locator(".tile").get_by_role("link", name=DRIVE, exact=True)).to_have_count(1)
        page.get_by_role("button", name="Deutsch").click()
        expect(page.locator(".tile").first).to_contain_text("Überstrom")
        page.get_by_role("button", name="English").click()
        page.clock.fast_forward(60_000)
        expect(trouble).to_contain_text("(1 min ")
        plant.shot("fault")
        trouble.get_by_role("link", name=DRIVE).click()
        expect(page.locator(".drivehead .state")).to_contain_text("fault")
        faults = page.get_by_role("region", name="Faults")
        expect(faults).to_contain_text("E003/3.0 overcurrent of the inverter")
        expect(faults.locator("tbody tr").first).to_contain_text("2310h")
        faults.get_by_role("button", name="Read the faults").click()
        expect(faults.locator("dl").last).to_contain_text("P701[1] last fault")
        expect(faults.locator("dl").last).to_contain_text("3.0")
        page.get_by_role("button", name="Take control").click()
        page.get_by_role("button", name="Acknowledge fault").click()
        expect(page.locator(".sentence")).to_contain_text("Everything is in order")
        expect(page.locator(".drivehead .state")).not_to_contain_text("fault")


def test_a_plc_falls_silent(tmp_path: Path, chromium: Browser) -> None:
    with broken(tmp_path, chromium, control="modbus") as plant:
        words = (str(plant.modbus), "1", "0.1", str(tmp_path / "stamps"), "0x047F", "0x1000")
        with peer(tmp_path, "modbus_owner", *words) as plc:
            plc.wait_output("it runs")
        plant.says(
            DRIVE,
            "its controller fell silent",
            "127.0.0.1 (Modbus)",
            "1000 ms",
            "See that the controller runs",
        )
        expect(plant.page.locator(".tile", has_text=DRIVE)).to_contain_text("stopped by the watchdog")
        plant.shot("silent-plc")


@pytest.mark.landing
def test_somebody_else_commands_a_drive(tmp_path: Path, chromium: Browser) -> None:
    with broken(tmp_path, chromium) as plant:
        plant.tell("intrude")
        plant.says("can0", "somebody else commands drives", "205", DRIVE, "take it off the bus")
        plant.shot("intruder")


@pytest.mark.landing
def test_a_drive_has_another_parameter_set(tmp_path: Path, chromium: Browser) -> None:
    with broken(tmp_path, chromium) as plant:
        plant.tell("set_otherwise")
        plant.says(
            DRIVE,
            "the frequency setpoint does not reach the drive",
            "P546[1]",
            "Set the drive's parameter back",
        )
        plant.shot("parameter-set")


@pytest.mark.landing
def test_the_disk_is_full(tmp_path: Path, chromium: Browser) -> None:
    what = "the audit log cannot be written"
    with broken(tmp_path, chromium, '[audit]\nfile = "/dev/full"', at_first=what) as plant:
        plant.says("Bridge", what, "Make room on the disk")
        plant.shot("full-disk")
