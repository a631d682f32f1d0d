"""Topics of the page: each point is in those of its place."""

from __future__ import annotations

import json

from bridge.command.plant import PlantView
from bridge.image import Quality
from bridge.northbound.page.topics import Topics, topics_of
from bridge.text import Text
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


def test_words_of_a_text_are_shown_with_it() -> None:
    case = Watched(_SITE)
    image, topics = (
        case.image,
        Topics(PlantView(case.plant, lambda: 1.0, lambda time: round(time * 1e9)), case.layout),
    )
    image.say(image.index["conveyor/node/boot_status"], Text.of("node.lost"), 1.0)
    image.set(image.index[f"{DRIVE}/status/state"], 3, 1.0, Quality.LOST, Text.of("node.lost"))
    text = {"code": "node.lost", "facts": {}}
    state = json.loads(topics.state("node conveyor"))["state"]
    assert state["conveyor/node/boot_status"][0::4] == ["node lost", {"value": text}]
    state = json.loads(topics.state(f"drive {DRIVE}"))["state"]
    assert state[f"{DRIVE}/status/state"][2::2] == ["node lost", {"reason": text}]
    assert len(state[f"{DRIVE}/status/fault_text"]) == 4
