"""What the web page costs, and how soon it shows what is on the bus, with 500 values that change five times a
second, in Debian's Chromium on the same machine.

Nothing is simulated on the bus: CPU of the front is the front's alone, and Chromium draws without a GPU.
"""

from __future__ import annotations

import json
import statistics
import time
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Page, expect

from tests.bench.figures import record, show
from tests.bench.processes import children, usage
from tests.support import sites
from tests.support.desk import browser
from tests.support.process import free_port, peer

NODES = 60
LOADS = 5
WATCHED_S = 10.0
SETTLED_MS = 1000
VIEWERS = 5
FRAME_EVENTS = ["-*", "disabled-by-default-devtools.timeline.frame", "devtools.timeline.frame"]
TILES = """
    const look = () => {
        if (!document.querySelector(".tile")) return void requestAnimationFrame(look);
        requestAnimationFrame(() => setTimeout(() => { window.painted = performance.now(); }));
    };
    look();
"""
"""Notes when the first frame with tiles has been drawn, in ms since the page was asked for."""
STAMPS = """(wanted) => new Promise((resolve) => {
    const late = [];
    const shown = document.querySelector(".tile .big");
    const look = () => {
        const at = Number(shown.textContent.replace(/[^\\d.]/g, "")) * 10;
        late.push((Date.now() % 100000 - at + 100000) % 100000);
        if (late.length >= wanted) { watch.disconnect(); resolve(late); }
    };
    const watch = new MutationObserver(look);
    watch.observe(shown, { characterData: true, childList: true, subtree: true });
})"""


@dataclass
class Rig:
    address: str
    front: int
    followed: list[str]
    chromium: Browser

    @contextmanager
    def page(self) -> Iterator[Page]:
        context = self.chromium.new_context(viewport={"width": 1280, "height": 900})
        try:
            page = context.new_page()
            page.goto(self.address)
            expect(page.locator(".tile").first).to_be_visible()
            yield page
        finally:
            context.close()


@pytest.fixture(scope="module")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rig]:
    folder, port = tmp_path_factory.mktemp("page"), free_port()
    drives = [sites.drive(f"fu{slot}", "lease", 1000) for slot in range(1, 5)]
    nodes = [sites.node(*drives, name=f"node{n}", node_id=n + 1) for n in range(NODES)]
    site = sites.write(
        folder,
        sites.bus(*nodes, more="bitrate = 1000000\nsync_period_ms = 50\nmaster_node_id = 127"),
        f'[opcua]\nlisten = "127.0.0.1:{free_port()}"\nno_security = true\nanonymous = "observer"\n',
        f'[page]\nlisten = "127.0.0.1:{port}"\n',
    )
    with ExitStack() as stack:
        process = stack.enter_context(peer(folder, "busy_plant", str(site)))
        process.wait_output("is served on")
        [followed] = [one.split() for one in process.output().splitlines() if one.startswith("follow ")]
        (front,) = [pid for pid in children(process.pid) if "page" in _arguments(pid)]
        yield Rig(f"http://127.0.0.1:{port}/", front, followed[1:], stack.enter_context(browser()))


def test_first_paint_and_what_is_loaded(rig: Rig) -> None:
    paints: list[float] = []
    plants: list[float] = []
    sizes: list[float] = []
    for _ in range(LOADS):
        context = rig.chromium.new_context()
        page = context.new_page()
        page.add_init_script(TILES)
        network = context.new_cdp_session(page)
        network.send("Network.enable")
        size = [0.0]
        network.on(
            "Network.loadingFinished", lambda loaded, size=size: _add(size, loaded["encodedDataLength"])
        )
        page.goto(rig.address)
        expect(page.locator(".tile").first).to_be_visible()
        page.wait_for_timeout(SETTLED_MS)
        [painted] = page.evaluate(
            "performance.getEntriesByName('first-contentful-paint').map((one) => one.startTime)"
        )
        paints.append(painted)
        plants.append(page.evaluate("window.painted"))
        sizes.append(size[0])
        context.close()
    kilobytes = max(sizes) / 1000
    show("first contentful paint, loopback", f"median {statistics.median(paints):.0f} ms, {kilobytes:.0f} kB")
    show(f"the plant with {4 * NODES} drives on the screen", f"median {statistics.median(plants):.0f} ms")
    record("page, first paint, s", statistics.median(paints) / 1000)
    record("page, loaded, kB", kilobytes)


def _arguments(pid: int) -> list[str]:
    return Path(f"/proc/{pid}/cmdline").read_text(encoding="utf-8").split("\0")


def _add(total: list[float], more: float) -> None:
    total[0] += more


def test_how_soon_a_value_is_on_the_screen(rig: Rig) -> None:
    with rig.page() as page:
        late_ms = sorted(page.evaluate(STAMPS, 100))
    p95 = late_ms[94]
    show("a value, from the bus process to the screen", f"median {late_ms[49]:.0f} ms, p95 {p95:.0f} ms")
    record("page, value on the screen p95, ms", p95)


def test_dropped_frames(rig: Rig) -> None:
    with rig.page() as page:
        of_plant = frames(rig, page)
        drive = rig.followed[0].partition("/actual")[0]
        page.goto(f"{rig.address}#/drive/{drive}")
        page.locator(".trend summary").click()
        chosen = page.locator(".trend .choice input")
        for place in range(chosen.count()):
            if page.locator(".trend .choice input:checked").count() < len(rig.followed):
                chosen.nth(place).check()
        expect(page.locator(".trend .choice input:checked")).to_have_count(len(rig.followed))
        of_trend = frames(rig, page)
    show("plant with 500 values at 5 Hz", f"{of_plant[0]} frames, {of_plant[1]} dropped")
    show("six trends at 20 Hz", f"{of_trend[0]} frames, {of_trend[1]} dropped")
    record("page, frames dropped with 500 values", of_plant[1])
    record("page, frames dropped with six trends", of_trend[1])


def frames(rig: Rig, page: Page) -> tuple[int, int]:
    """How many Chromium drew and dropped in some seconds, by its own trace."""
    page.wait_for_timeout(1000)
    rig.chromium.start_tracing(page=page, categories=FRAME_EVENTS)
    page.wait_for_timeout(WATCHED_S * 1000)
    events: list[dict[str, Any]] = json.loads(rig.chromium.stop_tracing())["traceEvents"]
    names = [event["name"] for event in events]
    return names.count("DrawFrame"), names.count("DroppedFrame")


def test_cpu_of_the_front(rig: Rig) -> None:
    with ExitStack() as stack:
        for _ in range(VIEWERS):
            stack.enter_context(rig.page())
        time.sleep(1.0)
        before, begun = usage(rig.front).cpu_s, time.monotonic()
        time.sleep(WATCHED_S)
        share = 100 * (usage(rig.front).cpu_s - before) / (time.monotonic() - begun)
        memory = usage(rig.front).memory_mb
    show(f"the page's front with {VIEWERS} viewers", f"{share:.1f} % of a core, {memory:.0f} MB")
    record("page, front with 5 viewers, % of a core", share)
