"""Troubles as the page shows them: those that the bus process has judged, and its own silence."""

from __future__ import annotations

from bridge.condition.told import troubles_json
from bridge.image import Quality
from bridge.northbound.trouble_reader import TroubleReader
from tests.support import sites
from tests.support.condition import Watched

BUS = "bus/can0"
_SITE = sites.site(
    sites.bus(sites.node(sites.drive("fu1", "lease", 1000), sites.drive("fu2", "lease", 1000)))
)


class Front:
    """A front beside a bus process that judges."""

    def __init__(self) -> None:
        self.bus = Watched(_SITE)
        self.now_ms = 5000.0
        self.begin()

    def begin(self) -> None:
        self.troubles = TroubleReader(self.bus.image, lambda: self.now_ms)

    def judge(self) -> None:
        self.bus.later(500.0)
        self.bus.set("bridge/troubles", troubles_json(self.bus.troubles.shown))
        self.bus.set("bridge/recent_troubles", "[]")
        self.bus.set("bridge/drives_waiting", self.bus.troubles.waiting)


def test_a_front_shows_what_the_bus_process_has_judged_and_tells_what_is_new() -> None:
    front = Front()
    assert not front.troubles.beat(), "before anything was judged"
    front.bus.set(f"{BUS}/duplicate_ids", "5")
    front.judge()
    assert front.troubles.beat()
    assert [one["kind"] for one in front.troubles.shown] == ["duplicate_ids"]
    assert not front.troubles.beat()


def test_a_front_that_starts_anew_knows_since_when() -> None:
    front = Front()
    front.bus.later(60_000.0)
    front.bus.set(f"{BUS}/duplicate_ids", "5")
    front.judge()
    front.troubles.beat()
    before = front.troubles.shown
    front.now_ms += 3_600_000.0
    front.begin()
    front.judge()
    front.troubles.beat()
    assert front.troubles.shown == before
    assert "or_longer" not in before[0]


def test_a_bus_process_that_does_not_answer_says_nothing_of_the_drives() -> None:
    front = Front()
    front.bus.set("conveyor/fu2/supervision/follows", False)
    front.judge()
    front.troubles.beat()
    front.bus.image.judge(range(len(front.bus.image.points)), Quality.DEAD, 1.0, "bus process not reachable")
    assert front.troubles.beat()
    (trouble,) = front.troubles.shown
    assert (trouble["kind"], trouble["place"], trouble["rank"]) == ("bridge_dead", "bridge", "alarm")
    assert trouble["since"] == front.now_ms
    front.now_ms += 1000.0
    assert not front.troubles.beat(), "it goes on"
    front.judge()
    front.troubles.beat()
    assert [one["kind"] for one in front.troubles.shown] == ["drive_lost", "drive_lost"], "it answers"
