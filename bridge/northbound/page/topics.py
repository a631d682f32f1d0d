"""Points by topic for the viewers, as a state and then as changes. Sans-IO.

A topic is a group of points that a page shows together: ``plant``, ``drive <node>/<drive>``, ``node <node>``,
``bus <bus>``. The message of each beat is encoded once for all viewers of a topic. A viewer that is slower
than the beat gets the whole state anew instead of a backlog.

Messages are JSON: ``{"topic": t, "state": {point: [value, quality, reason, time]}}`` and
``{"topic": t, "changes": {…}}``. ``quality`` is its label, ``time`` is in ms since 1970. Of words that are
those of a text, its code and facts follow: ``{"value": {"code": …, "facts": …}, "reason": …}``.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import Any, Final

import msgspec

from bridge.condition.plant_layout import PlantLayout
from bridge.image import Image, Point, Quality
from bridge.northbound.view import View
from bridge.text import Said, Text, as_json, in_english

_MOST_AT_ONCE: Final = 1 << 20
_encode = msgspec.json.Encoder().encode
_IN_TILES: Final = (
    "status/state",
    "status/fault_text",
    "supervision/owner",
    "supervision/watchdog_state",
    "supervision/watchdog_left_ms",
    "supervision/fieldbus_timeout_ms",
    "supervision/restart_interlock",
)
"""Points of each drive on the plant's page, beside its setpoints and actual values."""


def topics_of(points: Sequence[Point], layout: PlantLayout) -> dict[str, list[int]]:
    """The points of each topic, by their places in the image."""
    topics: dict[str, list[int]] = {"plant": []}
    for index, point in enumerate(points):
        for topic in _topics_of(point, layout):
            topics.setdefault(topic, []).append(index)
    return topics


def _topics_of(point: Point, layout: PlantLayout) -> Iterator[str]:
    top, *rest = point.path
    if top == "bridge":
        yield "plant"
    elif top == "bus":
        yield "plant"
        yield f"bus {rest[0]}"
    elif (drive := f"{top}/{rest[0]}") in layout.drives:
        yield f"drive {drive}"
        leaf = "/".join(rest[1:])
        if leaf in _IN_TILES or (rest[1] in ("actual", "command") and point.unit):
            yield "plant"
    else:
        yield f"node {top}"
        yield f"bus {layout.nodes[top]}"
        if rest[0] in ("node", "input", "output"):
            yield "plant"


class Topics:
    """Turns the image into messages. ``beat`` is called at a steady rate."""

    def __init__(self, view: View, layout: PlantLayout) -> None:
        self._view = view
        self._image: Image = view.image
        self.places = topics_of(self._image.points, layout)
        self._of_point: dict[int, list[str]] = {}
        for topic, indices in self.places.items():
            for index in indices:
                self._of_point.setdefault(index, []).append(topic)
        self._feed = self._image.feed()
        self._feed.take(_MOST_AT_ONCE)

    def close(self) -> None:
        self._image.drop_feed(self._feed)

    def state(self, topic: str) -> bytes:
        """Everything that the topic shows. Raises KeyError where there is no such topic."""
        return _encode({"topic": topic, "state": self._shown(self.places[topic])})

    def beat(self, topics: Iterable[str]) -> dict[str, bytes]:
        """JSON message of the changes since the last beat, for each of ``topics`` that has any."""
        changed: dict[str, list[int]] = {}
        wanted = set(topics)
        for index in self._feed.take(_MOST_AT_ONCE):
            for topic in self._of_point.get(index, ()):
                if topic in wanted:
                    changed.setdefault(topic, []).append(index)
        return {
            topic: _encode({"topic": topic, "changes": self._shown(indices)})
            for topic, indices in changed.items()
        }

    def _shown(self, indices: Sequence[int]) -> dict[str, list[Any]]:
        points, image = self._image.points, self._image
        shown: dict[str, list[Any]] = {}
        for index in indices:
            value, quality, time, why = image[index]
            if isinstance(value, float) and not math.isfinite(value):
                value = None
            held = value if quality.has_value or quality is Quality.DEAD else None
            at_ms = self._view.epoch_ns(time) // 1_000_000 if time else 0
            row = shown[points[index].name] = [held, quality.label, in_english(why), at_ms]
            if texts := _texts(image.said(index), why):
                row.append(texts)
        return shown


def _texts(value: Text | None, reason: Said) -> dict[str, Any]:
    found = {"value": value and as_json(value), "reason": as_json(reason)}
    return {name: text for name, text in found.items() if text}
