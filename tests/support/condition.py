"""A plant's points, set by hand, and what is judged of them."""

from __future__ import annotations

import json
from typing import Any

from bridge.condition.own_faults import with_faults
from bridge.condition.plant_layout import layout_of
from bridge.condition.told import recent_json, troubles_json
from bridge.condition.troubles import Troubles
from bridge.image import Image, Quality, Value
from bridge.text import Text
from tests.support import sites

LOOK_EVERY_MS = 500.0


class Watched:
    """All is in order at first. Times of the two clocks are the same."""

    def __init__(self, site: str, mapping: str = sites.FAMILY) -> None:
        self.plant = sites.plant_of(site, mapping)
        self.image: Image = self.plant.image
        self.now_ms = 1_000_000.0
        catalogue = self.plant.catalogue
        self.layout = with_faults(layout_of(self.image.points, catalogue), catalogue)
        self.begin()
        for bus in self.layout.buses:
            self.set(f"bus/{bus}/state", 0)
            self.set(f"bus/{bus}/intruders", 0)
        for node in self.layout.nodes:
            self.set(f"{node}/node/state", 2)
        for drive in self.layout.drives:
            self.set(f"{drive}/status/state", 4)
        self.set("bridge/audit_lost", 0)
        self.set("bridge/hangs", 0)
        self.beat()

    def begin(self) -> None:
        """Begin as a bridge that has just been started."""
        self.troubles = Troubles(self.image, self.layout, self.now_ms)

    def set(self, name: str, value: Value, quality: Quality = Quality.GOOD, reason: str = "") -> None:
        self.image.set(self.image.index[name], value, self.now_ms / 1000, quality, reason)

    def say(self, name: str, said: Text) -> None:
        self.image.say(self.image.index[name], said, self.now_ms / 1000)

    def beat(self) -> list[dict[str, Any]]:
        """Troubles, as the point tells them."""
        self.troubles.beat(self.now_ms, self.now_ms)
        return json.loads(troubles_json(self.troubles.shown))

    def later(self, ms: float = 10_000.0) -> list[dict[str, Any]]:
        at_ms = self.now_ms + ms
        if ms > LOOK_EVERY_MS:
            self.now_ms += LOOK_EVERY_MS
            self.beat()
        self.now_ms = at_ms
        return self.beat()

    def kinds(self) -> list[tuple[str, str]]:
        return [(one["kind"], one["place"]) for one in self.later()]

    @property
    def recent(self) -> list[dict[str, Any]]:
        return json.loads(recent_json(self.troubles.recent))
