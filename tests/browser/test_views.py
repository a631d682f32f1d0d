"""What the page shows, what it says where that cannot be had, and what can be taken along."""

from __future__ import annotations

import re
from contextlib import ExitStack
from pathlib import Path

import pytest
from playwright.sync_api import Browser, expect

from tests.browser.hands import (
    SHOTS,
    pair,
    serious,
    serving,
    take,
    to,
    to_drive,
)
from tests.support import sites
from tests.support.desk import Desk
from tests.support.process import Process
from tests.wire.test_page import Browser as Client
from tests.wire.test_page import Tab


@pytest.mark.landing
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


def test_an_address_to_copy_is_one_that_can_be_reached(bench: Desk) -> None:
    with bench.sits("observer") as page:
        facts = {
            "modbus": {"listen": "[::]:502", "word_order": "big"},
            "opcua": {"url": "opc.tcp://0.0.0.0:4840", "no_security": False, "anonymous": "none", "users": 1},
            "zenoh": {"mode": "peer", "listen": ["tcp/0.0.0.0:7447"], "prefix": "x"},
            "exports": [],
        }
        page.route("**/api/integration", lambda route: route.fulfill(json=facts))
        page.route("**/api/export/*", lambda route: route.fulfill(json=[]))
        for name, shown in {
            "modbus": "-c 4 -1 127.0.0.1",
            "opcua": "opc.tcp://127.0.0.1:4840",
            "zenoh": "tcp/127.0.0.1:7447",
        }.items():
            to(page, f"integration/{name}")
            expect(page.locator(".facts")).to_contain_text(shown)


def test_what_is_not_there_is_told(desk: Desk) -> None:
    with desk.sits("observer") as page:
        to(page, "bus/can9")
        expect(page.locator("#main")).to_have_text("There is no bus can9. Plant")
        to(page, "integration/modbus")
        page.get_by_role("searchbox").fill("xyzzy")
        expect(page.locator(".search")).to_contain_text("No row matches “xyzzy”.")


@pytest.mark.landing
def test_a_bus_is_listened_to_filtered_counted_and_captured(desk: Desk) -> None:
    with desk.sits("observer") as page:
        to(page, "bus/can0")
        expect(page.locator(".stage.done")).to_have_count(6)
        expect(page.locator(".pdo").first).to_contain_text("control_word")
        page.get_by_role("button", name="Listen").click()
        expect(page.locator(".log")).to_contain_text("TPDO1 conveyor/fu1")
        page.get_by_label("SYNC").check()
        expect(page.locator(".log tbody tr").first).to_contain_text("SYNC")
        expect(page.locator(".log")).not_to_contain_text("TPDO1 conveyor/fu1")
        page.get_by_label("SYNC").uncheck()
        page.get_by_label("Show").select_option("identifiers")
        expect(page.locator(".log")).to_contain_text("080")
        page.get_by_role("button", name="Pause").click()
        page.get_by_label("Seconds").fill("1")
        with page.expect_download() as download:
            page.get_by_role("button", name="Capture and download").click()
        assert download.value.suggested_filename == "hall-can0.log"
        assert "can0 080#" in download.value.path().read_text(encoding="ascii")


INJECTED = "<img src=x onerror=\"document.title='owned'\">"


def test_texts_of_others_are_shown_as_texts(desk: Desk, bridge: tuple[Process, int]) -> None:
    stranger = Client(bridge[1])
    stranger.login("engineer")
    tab = Tab(stranger)
    refused = tab.ask("write_parameter", parameter=INJECTED, value=1)
    assert INJECTED in refused["message"] or refused["code"] == "unknown_parameter"
    tab.socket.close()
    with desk.sits("engineer") as page:
        to(page, "system")
        expect(page.get_by_role("region", name="Audit log")).to_contain_text(INJECTED)
        expect(page.locator('img[src="x"]')).to_have_count(0)
        assert "owned" not in page.title()


@pytest.mark.landing
def test_what_the_bridge_says_of_a_drive_that_may_run_on_is_german_on_the_german_page(
    tmp_path: Path, chromium: Browser
) -> None:
    as_delivered = sites.node(sites.drive("fu1", "lease", 1000), name="a")
    english, german = "the drive runs on: P151 is 0 (off)", "der Antrieb läuft weiter: P151 ist 0 (aus)"
    with ExitStack() as site:
        desk = Desk(chromium, site.enter_context(serving(tmp_path, as_delivered)))
        with desk.sits("operator") as page:
            expect(page.locator(".sentence")).to_contain_text("a/fu1: may run on if the bridge falls silent")
            expect(page.locator(".trouble")).to_contain_text(english)
            to(page, "drive/a/fu1")
            expect(page.locator(".chain")).to_contain_text(english)
            page.get_by_role("button", name="Deutsch").click()
            expect(page.locator(".chain")).to_contain_text(german)
            expect(page.locator(".sentence")).to_contain_text(
                "a/fu1: läuft vielleicht weiter, wenn die Bridge schweigt"
            )
            to(page, "plant")
            expect(page.locator(".trouble")).to_contain_text(german)
            assert not serious(page)
            page.get_by_role("button", name="English").click()
            expect(page.locator(".trouble")).to_contain_text(english)
        assert not desk.complaints


@pytest.mark.landing
def test_a_drive_that_may_run_on_by_agreement_is_said_to_in_both_languages(desk: Desk) -> None:
    with desk.sits("operator") as page:
        to_drive(page)
        expect(page.locator(".chain")).to_contain_text("It runs on.")
        page.get_by_role("button", name="Deutsch").click()
        expect(page.locator(".chain")).to_contain_text("Er läuft weiter.")
        page.get_by_role("button", name="English").click()
        expect(page.locator(".chain")).to_contain_text("It runs on.")


@pytest.mark.landing
def test_a_tile_draws_no_share_of_a_range_that_nobody_knows(tmp_path: Path, chromium: Browser) -> None:
    fan = sites.node(
        sites.drive("drive", "lease", 1000, sites.ACCEPTED), name="fan", node_id=8, mapping="cia402/velocity"
    )
    with ExitStack() as site:
        desk = Desk(chromium, site.enter_context(serving(tmp_path, pair("a", 5), fan)))
        with desk.sits("operator") as page:
            tiles = {
                name: page.locator(".tile", has=page.get_by_role("link", name=name, exact=True))
                for name in ("a/fu1", "fan/drive")
            }
            for tile in tiles.values():
                expect(tile.locator(".big")).to_have_text(re.compile("0"))
            expect(tiles["a/fu1"].locator(".course")).to_have_count(1)
            expect(tiles["fan/drive"].locator(".course")).to_have_count(0)
        assert not desk.complaints


def test_the_system_shows_the_file_without_its_secrets(desk: Desk) -> None:
    with desk.sits("engineer") as page:
        to(page, "system")
        expect(page.get_by_text("OPC UA server")).to_be_visible()
        expect(page.get_by_text("days left")).to_be_visible()
        page.get_by_text("Text, without its secrets").click()
        expect(page.locator("pre.file")).to_contain_text("password_hash")
        expect(page.locator("pre.file")).not_to_contain_text("argon2")
        expect(page.get_by_role("heading", name="Audit log")).to_be_visible()


@pytest.mark.landing(3)
@pytest.mark.parametrize(
    ("place", "api"),
    [
        ("bus/can0", "bus/can0"),
        ("integration/opcua", "integration"),
        ("integration/opcua", "export/opcua.json"),
        ("parameters/a/fu1", "parameters/a/fu1"),
        ("system", "system"),
        ("system", "system/site"),
        ("system", "system/audit"),
    ],
)
def test_what_fails_to_load_is_told_and_tried_again(bench: Desk, place: str, api: str) -> None:
    with bench.sits("engineer") as page:
        address = f"{bench.address}api/{api}"
        page.route(address, lambda route: route.fulfill(status=503, json={"error": "out of order"}))
        to(page, place)
        failure = page.locator(".failure", has_text="out of order")
        expect(failure).to_be_visible()
        page.unroute(address)
        failure.get_by_role("button", name="Try again").click()
        expect(failure).to_have_count(0)
        bench.complaints[:] = [one for one in bench.complaints if "503" not in one]


@pytest.mark.landing
def test_without_its_bridge_a_page_knows_nothing(tmp_path: Path, chromium: Browser) -> None:
    with ExitStack() as site:
        desk = Desk(chromium, site.enter_context(serving(tmp_path, pair("a", 5))))
        with desk.sits("operator") as page:
            to(page, "drive/a/fu2")
            take(page)
            expect(page.locator(".chain .left")).to_have_count(2)
            expect(page.locator(".diagram .present")).to_have_count(1)
            site.close()
            expect(page.locator(".sentence")).to_contain_text("No connection")
            expect(page.locator(".drivehead .state")).to_have_text(re.compile("unknown"))
            expect(page.locator(".diagram .present")).to_have_count(0)
            expect(page.locator(".chain .left")).to_have_count(0)
            expect(page.locator(".chain .unsure")).to_have_count(3)
            expect(page.locator(".bits .set")).to_have_count(0)
            page.screenshot(path=SHOTS / "drive-without-bridge.png", full_page=True)
            to(page, "plant")
            expect(page.locator(".busstate")).to_have_text(re.compile("unknown"))
            page.screenshot(path=SHOTS / "plant-without-bridge.png", full_page=True)
