"""The process image: the present value of every point, and who has not yet seen which change."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from bridge.image.point import Point, Value
from bridge.image.quality import Quality


class Reading(NamedTuple):
    """One point's present state. ``time`` is in seconds of the monotonic clock of the image's owner."""

    value: Value
    quality: Quality
    time: float
    reason: str


class Feed:
    """One consumer's set of changed points. Newest value wins: a slow consumer costs only itself."""

    __slots__ = ("_dirty",)

    def __init__(self, count: int) -> None:
        self._dirty: dict[int, None] = dict.fromkeys(range(count))

    def mark(self, index: int) -> None:
        self._dirty[index] = None

    def take(self, most: int) -> list[int]:
        """Up to ``most`` changed points, longest waiting first; they count as seen from now on."""
        if len(self._dirty) <= most:
            taken = list(self._dirty)
            self._dirty.clear()
            return taken
        taken = [index for index, _ in zip(self._dirty, range(most), strict=False)]
        for index in taken:
            del self._dirty[index]
        return taken

    def __len__(self) -> int:
        return len(self._dirty)


class Image:
    """Values by point index. Writers ``set``, readers read or follow a ``Feed``.

    The list of points never changes while the image lives: a drive that is lost keeps its points.
    """

    def __init__(self, points: Iterable[Point]) -> None:
        self.points: tuple[Point, ...] = tuple(points)
        self.index: dict[str, int] = {point.name: i for i, point in enumerate(self.points)}
        if len(self.index) != len(self.points):
            raise ValueError("two points have the same name")
        self._readings = [Reading(point.data_type.zero, Quality.WAITING, 0.0, "") for point in self.points]
        self._feeds: list[Feed] = []

    def feed(self) -> Feed:
        """A new consumer; it is shown every point once, then each change."""
        feed = Feed(len(self.points))
        self._feeds.append(feed)
        return feed

    def drop_feed(self, feed: Feed) -> None:
        self._feeds.remove(feed)

    def __getitem__(self, index: int) -> Reading:
        return self._readings[index]

    def read(self, name: str) -> Reading:
        """The present state of the named point. Raises KeyError where there is none."""
        return self._readings[self.index[name]]

    def set(
        self, index: int, value: Value, now: float, quality: Quality = Quality.GOOD, reason: str = ""
    ) -> None:
        """Store a value with its source time. Storing what is there already changes nothing."""
        old = self._readings[index]
        if old.value == value and old.quality is quality and old.reason == reason:
            return
        self._readings[index] = Reading(value, quality, now, reason)
        for feed in self._feeds:
            feed.mark(index)

    def judge(self, indices: Sequence[int], quality: Quality, now: float, reason: str = "") -> None:
        """Give these points another quality and keep their values."""
        for index in indices:
            self.set(index, self._readings[index].value, now, quality, reason)
