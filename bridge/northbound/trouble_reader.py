"""Troubles of the plant, as the bus process publishes them in its points. Sans-IO.

The bus process has judged it, and when each thing began: a front that starts anew knows as much as the one
before. Only that the bus process does not answer is found out here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import msgspec

from bridge.condition.point_troubles import ImageReader, is_bridge_dead
from bridge.image import Image

_TROUBLES: Final = "bridge/troubles"
_RECENT: Final = "bridge/recent_troubles"
_WAITING: Final = "bridge/drives_waiting"
decoded = msgspec.json.Decoder(list[dict[str, Any]]).decode
"""Troubles as their point has them."""


class TroubleReader:
    """Troubles read from the image. ``epoch_ms`` is the time of day in ms since 1970."""

    def __init__(self, image: Image, epoch_ms: Callable[[], float]) -> None:
        self._reader = ImageReader(image)
        self._epoch_ms = epoch_ms
        self._dead: dict[str, Any] | None = None
        self._told: tuple[str, str] = "", ""
        self.shown: list[dict[str, Any]] = []
        """Troubles for JSON, as ``condition.told`` has them; the worst first."""
        self.recent: list[dict[str, Any]] = []
        self.waiting = 0
        """Number of drives that have not reported their state yet though nothing is wrong with them: they
        start up."""

    def beat(self) -> bool:
        """Look again. True if ``shown``, ``waiting`` or ``recent`` has changed."""
        before = self.shown, self.waiting, self.recent
        if is_bridge_dead(self._reader):
            self._dead = self._dead or self._bridge_dead()
            self.shown, self.waiting, self._told = [self._dead], 0, ("", "")
        else:
            self._dead = None
            self._take()
        return (self.shown, self.waiting, self.recent) != before

    def _take(self) -> None:
        told = str(self._reader(_TROUBLES) or "[]"), str(self._reader(_RECENT) or "[]")
        if told != self._told:
            self._told = told
            self.shown, self.recent = decoded(told[0]), decoded(told[1])
        waiting = self._reader(_WAITING)
        self.waiting = waiting if isinstance(waiting, int) else 0

    def _bridge_dead(self) -> dict[str, Any]:
        since = round(self._epoch_ms())
        return {"rank": "alarm", "kind": "bridge_dead", "place": "bridge", "since": since, "facts": {}}
