"""Topics of the page: each point is in those of its place."""

from __future__ import annotations

from bridge.northbound.page.topics import topics_of
from tests.support import sites
from tests.support.condition import Watched

DRIVE = "conveyor/fu1"
_SITE = sites.site(
    sites.bus(sites.node(sites.drive("fu1", "lease", 1000), sites.drive("fu2", "lease", 1000)))
)


def test_each_point_is_in_the_topics_of_its_place() -> None:
    case = Watched(_SITE)
    points = case.image.points
    topics = topics_of(points, case.layout)
    shown = {index for indices in topics.values() for index in indices}
    assert shown == set(range(len(points)))
    assert {points[index].name for index in topics[f"drive {DRIVE}"]} == {
        point.name for point in points if point.name.startswith(f"{DRIVE}/")
    }
    assert set(topics) == {"plant", "bus can0", "node conveyor", f"drive {DRIVE}", "drive conveyor/fu2"}
