"""The page in Debian's Chromium, as people use it."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, ViewportSize, expect

from tests.support import sites
from tests.support.desk import Desk, browser
from tests.support.process import Process, drivebridge, free_port, until
from tests.wire.test_page import DRIVE, Tab, users, write_site
from tests.wire.test_page import Browser as Client

AXE = Path("tests/wire/node/node_modules/axe-core/axe.min.js")
SHOTS = Path("build/page")
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
EDS = """[FileInfo]
FileName=factory.eds
[DeviceInfo]
VendorName=somebody
[ManufacturerObjects]
SupportedObjects=1
1=0x2066
[2066]
ParameterName=acceleration time
ObjectType=0x8
SubNumber=2
[2066sub0]
ParameterName=entries
ObjectType=0x7
DataType=0x0005
AccessType=ro
DefaultValue=1
[2066sub1]
ParameterName=set 1
ObjectType=0x7
DataType=0x0003
AccessType=rw
DefaultValue=350
"""
"""Of P102.1 the factory setting 3.5 s."""


@pytest.fixture(scope="module")
def bridge(tmp_path_factory: pytest.TempPathFactory) -> Iterator[tuple[Process, int]]:
    folder, port = tmp_path_factory.mktemp("page"), free_port()
    with drivebridge(folder, "run", "run", str(write_site(folder, port)), notify=True) as process:
        process.wait_ready()
        until(lambda: "is served on" in process.output(), 30.0, "the page is served")
        yield process, port


@contextmanager
def serving(folder: Path, *nodes: str) -> Iterator[int]:
    """The page of a site with these nodes on a simulated bus; its port."""
    port = free_port()
    opcua = f'[opcua]\nlisten = "127.0.0.1:{free_port()}"\n{users()}'
    page = f'[page]\nlisten = "127.0.0.1:{port}"\n'
    site = sites.write(folder, sites.bus(*nodes), opcua, page)
    with drivebridge(folder, "run", "run", str(site), notify=True) as process:
        process.wait_ready()
        until(lambda: "is served on" in process.output(), 30.0, "the page is served")
        yield port


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    with browser() as started:
        yield started


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
    page.get_by_role("button", name="Start", exact=True).click()
    expect(page.locator(".drivehead .state")).to_have_text(re.compile("running"))
    page.locator("#setpoint").fill(frequency)
    page.get_by_role("button", name="Send").click()
    expect(page.locator("form.setpoint")).to_contain_text(f"now {frequency}.0")


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
        with hanging(page):
            expect(watcher.locator(".sentence")).to_contain_text("its controller fell silent")
        expect(watcher.locator(".trouble")).to_contain_text("(web page)")
        expect(watcher.locator(".trouble .remedy")).to_contain_text("acknowledge")
        page.get_by_role("button", name="Acknowledge fault").click()
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


def positioner() -> str:
    """A drive that is told where to go, how fast and how hard."""
    drive = sites.drive("axis1", "lease", 1000, "telegram_downtime_s = 0")
    more = 'supervision = "guarding"\nsupervision_ms = 2000'
    return sites.node(drive, name="winder", node_id=7, mapping="stoeber/5000-posi", more=more)


def pair(name: str, node_id: int) -> str:
    """Of two drives one is left as it is when its controller falls silent, and one is its owner's alone."""
    drives = (
        sites.drive("fu1", "lease", 1000, f'on_expiry = "hold"\ntelegram_downtime_s = 0\n{sites.SCALED}'),
        sites.drive("fu2", "lease", 1000, f"stop_by_anyone = false\n{sites.SCALED}"),
    )
    return sites.node(*drives, name=name, node_id=node_id)


@pytest.fixture(scope="module")
def workshop(tmp_path_factory: pytest.TempPathFactory) -> Iterator[int]:
    with serving(tmp_path_factory.mktemp("workshop"), pair("a", 5), pair("b", 6), positioner()) as port:
        yield port


@pytest.fixture
def bench(chromium: Browser, workshop: int) -> Iterator[Desk]:
    desk = Desk(chromium, workshop)
    yield desk
    assert not desk.complaints


def asked(page: Page, action: str) -> list[Any]:
    """The fields of each request for ``action`` that the page makes from now on."""
    found: list[Any] = []

    def on_frame(text: str | bytes) -> None:
        if f'"action":"{action}"' in str(text):
            found.append(json.loads(text)["fields"])

    page.on("websocket", lambda socket: socket.on("framesent", on_frame))
    page.reload()
    expect(page.locator(".sentence")).to_contain_text("in order")
    return found


def test_setpoints_are_sent_together_and_empty_ones_are_not(bench: Desk) -> None:
    with bench.sits("operator") as page:
        written = asked(page, "write")
        to(page, "drive/winder/drive")
        take(page)
        labels = page.locator("form.setpoint label")
        expect(labels).to_have_count(4)
        expect(labels.first).to_contain_text("velocity")
        page.get_by_role("button", name="Send").click()
        page.locator("#setpoint").fill("120")
        page.locator("#setpoint-acceleration").fill("300")
        page.get_by_role("button", name="Send").click()
        expect(page.locator("form.setpoint .field").first).to_contain_text("now 120")
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


def test_a_drive_is_compared_with_its_like_until_that_is_stopped_or_left(bench: Desk) -> None:
    with bench.sits("engineer") as page:
        read = asked(page, "read_parameter")
        to(page, "parameters/a/fu1")
        options = page.locator("#source option")
        files = ["factory settings", "a backup, EDS or XDD file"]
        expect(options).to_have_text([*files, "a/fu2", "b/fu1", "b/fu2"])
        expect(page.locator("td.value", has_text="…")).to_have_count(0)
        page.get_by_label("Compare with").select_option("drive b/fu1")
        compare = page.get_by_role("button", name="Compare", exact=True)
        compare.click()
        page.get_by_role("button", name="Stop reading").click()
        expect(page.get_by_role("status").filter(has_text="Ended before")).to_have_count(1)
        assert is_quiet(page, read)
        compare.click()
        expect(page.get_by_text("Reading b/fu1: 1")).to_be_visible()
        page.get_by_role("link", name="Plant", exact=True).click()
        assert is_quiet(page, read)
        to(page, "parameters/a/fu1")
        page.get_by_label("Compare with").select_option("drive b/fu1")
        compare.click()
        expect(page.get_by_text("0 parameters differ from b/fu1")).to_be_visible()


def is_quiet(page: Page, found: list[Any]) -> bool:
    """Whether nothing more is asked once what is on its way has been answered."""
    page.wait_for_timeout(150)
    count = len(found)
    page.wait_for_timeout(400)
    return len(found) == count


def test_a_double_click_writes_once(bench: Desk) -> None:
    with bench.sits("engineer") as page:
        written = asked(page, "write_parameter")
        to(page, "parameters/a/fu1")
        expect(parameter(page, "P102.1")).to_contain_text("2\u202fs")
        page.get_by_role("button", name="Change P102.1", exact=True).click()
        page.get_by_label("New value of P102.1").fill("2.01")
        page.get_by_role("button", name="Write", exact=True).dblclick()
        expect(page.locator(".editor")).to_contain_text("read back: 2.01")
        page.wait_for_timeout(300)
        assert written == [{"parameter": "P102.1", "value": 2.01}]
        page.get_by_role("button", name="Deutsch").click()
        expect(parameter(page, "P102.1")).to_contain_text("2,01\u202fs")
        expect(parameter(page, "P105.1")).to_contain_text("0,1 … 400 Hz")


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


def to(page: Page, place: str) -> None:
    page.goto(f"{page.url.partition('#')[0]}#/{place}")


def parameter(page: Page, name: str) -> Any:
    return page.locator("table.parameters tr", has=page.get_by_text(name, exact=True))


def change(page: Page, name: str, value: str) -> None:
    page.get_by_role("button", name=f"Change {name}", exact=True).click()
    page.get_by_label(f"New value of {name}").fill(value)
    page.get_by_role("button", name="Write", exact=True).click()


def test_a_parameter_is_found_changed_and_put_back_from_a_backup(desk: Desk, tmp_path: Path) -> None:
    with desk.sits("engineer") as page:
        to(page, f"parameters/{DRIVE}")
        expect(parameter(page, "P102.1")).to_contain_text("2\u202fs")
        with page.expect_download() as download:
            page.get_by_role("button", name="Back up to a file").click()
        file = tmp_path / download.value.suggested_filename
        download.value.save_as(file)
        assert '"P102.1" = 2.0' in file.read_text(encoding="utf-8")
        page.get_by_role("searchbox").fill("acceleration")
        change(page, "P102.1", "7.5")
        expect(page.locator(".editor")).to_contain_text("read back: 7.5")
        expect(page.locator(".editor")).to_contain_text("of 100,000")
        page.get_by_label("New value of P102.1").fill("321")
        page.get_by_role("button", name="Write", exact=True).click()
        assert not page.evaluate("document.querySelector('#value').validity.valid")
        page.get_by_label("Compare with").select_option("file")
        page.locator('input[type="file"]').set_input_files(file)
        page.get_by_role("button", name="Compare", exact=True).click()
        expect(page.locator(".differences tbody tr")).to_have_count(1)
        expect(page.locator(".differences")).to_contain_text("7.5")
        page.get_by_role("button", name="Write this one to the drive").click()
        expect(page.get_by_text("1 parameter written and read back.")).to_be_visible()
        expect(parameter(page, "P102.1")).to_contain_text("2\u202fs")


def test_a_drive_is_compared_with_a_makers_file_and_a_wrong_file_is_told_by_line(
    desk: Desk, tmp_path: Path
) -> None:
    with desk.sits("operator") as page:
        to(page, f"parameters/{DRIVE}")
        page.get_by_label("Compare with").select_option("file")
        (tmp_path / "factory.eds").write_text(EDS, encoding="ascii")
        page.locator('input[type="file"]').set_input_files(tmp_path / "factory.eds")
        page.get_by_role("button", name="Compare", exact=True).click()
        expect(page.locator(".differences tbody tr")).to_have_count(1)
        expect(page.locator(".differences")).to_contain_text("3.5")
        expect(page.get_by_role("button", name="Write this one to the drive")).to_have_count(0)
        (tmp_path / "wrong.toml").write_text("format = 9\n", encoding="ascii")
        page.locator('input[type="file"]').set_input_files(tmp_path / "wrong.toml")
        page.get_by_role("button", name="Compare", exact=True).click()
        expect(page.get_by_role("alert")).to_contain_text("wrong.toml:1: format: must be 3")
        desk.complaints.remove(desk.complaints[-1])  # the browser's own line on the answer 422


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


def test_the_system_shows_the_file_without_its_secrets(desk: Desk) -> None:
    with desk.sits("engineer") as page:
        to(page, "system")
        expect(page.get_by_text("OPC UA server")).to_be_visible()
        expect(page.get_by_text("days left")).to_be_visible()
        page.get_by_text("Text, without its secrets").click()
        expect(page.locator("pre.file")).to_contain_text("password_hash")
        expect(page.locator("pre.file")).not_to_contain_text("argon2")
        expect(page.get_by_role("heading", name="Audit log")).to_be_visible()


def test_log_out(desk: Desk) -> None:
    with desk.sits("operator") as page:
        page.get_by_role("button", name="Log out").click()
        expect(page.locator('input[name="user"]')).to_be_visible()
        expect(page.get_by_role("button", name="Back")).to_have_count(0)
        page.reload()
        expect(page.locator('input[name="user"]')).to_be_visible()


PHONE: ViewportSize = {"width": 360, "height": 740}
DESKTOP: ViewportSize = {"width": 1280, "height": 900}


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


def serious(page: Page) -> list[Any]:
    """What axe finds that keeps people from using the page, each with where."""
    page.evaluate(AXE.read_text(encoding="utf-8") + "; 0")
    found = page.evaluate("axe.run().then((one) => one.violations)")
    return [
        (one["id"], [node["target"] for node in one["nodes"]])
        for one in found
        if one["impact"] in ("serious", "critical")
    ]


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
