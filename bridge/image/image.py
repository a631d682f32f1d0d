"""The process image: the present value of every point, and who has not yet seen which change."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from bridge.image.point import Point, Value
from bridge.image.quality import Quality
from bridge.text import Said, Text, render


class Reading(NamedTuple):
    """One point's present state. ``time`` is in seconds of the monotonic clock of the image's owner; ``why``
    tells of a quality that is not good."""

    value: Value
    quality: Quality
    time: float
    why: Said

    @property
    def reason(self) -> str:
        """The reason for the quality in English."""
        return render(self.why)


class Columns(NamedTuple):
    """The present states of several points, as those of ``Reading``: cheaper than one of these for each."""

    values: list[Value]
    qualities: list[Quality]
    times: list[float]
    whys: list[Said]


class Feed:
    """One consumer's set of changed points. Newest value wins: a slow consumer costs only itself.

    ``wake`` is called for the first change after all others have been taken.
    """

    def __init__(self, count: int, wake: Callable[[], None]) -> None:
        self._dirty: dict[int, None] = dict.fromkeys(range(count))
        self._wake = wake

    def mark(self, index: int) -> None:
        if not self._dirty:
            self._wake()
        self._dirty[index] = None

    def mark_all(self, indices: dict[int, None]) -> None:
        """Mark the keys of ``indices``, at least one; one that is waiting already keeps its place."""
        if not self._dirty:
            self._wake()
        self._dirty.update(indices)

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

    def take_of(self, indices: Iterable[int]) -> list[int]:
        """Changed points among ``indices``; they count as seen from now on."""
        taken = [index for index in indices if index in self._dirty]
        for index in taken:
            del self._dirty[index]
        return taken

    def __len__(self) -> int:
        return len(self._dirty)


class Image:
    """Values by point index. Writers ``set``, readers read or follow a ``Feed``.

    The list of points never changes while the image lives: a drive that is lost keeps its points.
    Kept as columns, because a PDO changes many values and few qualities.
    """

    def __init__(self, points: Iterable[Point]) -> None:
        self.points: tuple[Point, ...] = tuple(points)
        self.index: dict[str, int] = {point.name: i for i, point in enumerate(self.points)}
        if len(self.index) != len(self.points):
            raise ValueError("two points have the same name")
        count = len(self.points)
        self._values: list[Value] = [point.data_type.zero for point in self.points]
        self._qualities = [Quality.WAITING] * count
        self._times = [0.0] * count
        self._whys: list[Said] = [""] * count
        self._said: dict[int, tuple[Value, Text]] = {}
        """Latest texts of points, with their words."""
        self._feeds: list[Feed] = []
        self._untold: dict[int, None] = {}

    def feed(self, wake: Callable[[], None] = lambda: None) -> Feed:
        """A new consumer; it is shown every point once, then each change. ``wake`` tells it that there are
        changes, once until it has taken all of them; there are some from the beginning."""
        feed = Feed(len(self.points), wake)
        self._feeds.append(feed)
        return feed

    def drop_feed(self, feed: Feed) -> None:
        """Show ``feed`` nothing any more. May be called again."""
        if feed in self._feeds:
            self._feeds.remove(feed)

    def __getitem__(self, index: int) -> Reading:
        return Reading(self._values[index], self._qualities[index], self._times[index], self._whys[index])

    def columns(self, indices: Sequence[int]) -> Columns:
        """The present states of these points."""
        return Columns(
            [self._values[index] for index in indices],
            [self._qualities[index] for index in indices],
            [self._times[index] for index in indices],
            [self._whys[index] for index in indices],
        )

    def qualities(self, indices: Iterable[int]) -> list[Quality]:
        """The present qualities of these points."""
        return [self._qualities[index] for index in indices]

    def values(self, indices: Iterable[int]) -> list[Value]:
        """The present values of these points, whatever their quality."""
        return [self._values[index] for index in indices]

    def read(self, name: str) -> Reading:
        """The present state of the named point. Raises KeyError where there is none."""
        return self[self.index[name]]

    def put(
        self, name: str, value: Value, now: float, quality: Quality = Quality.GOOD, why: Said = ""
    ) -> None:
        """Store a value of the named point, as ``set``. Raises KeyError where there is none."""
        self.set(self.index[name], value, now, quality, why)

    def set(
        self, index: int, value: Value, now: float, quality: Quality = Quality.GOOD, why: Said = ""
    ) -> None:
        """Store a value with its source time. Storing what is there already changes nothing."""
        if (
            self._values[index] == value
            and self._qualities[index] is quality
            and (self._whys[index] is why or self._whys[index] == why)
        ):
            return
        self._values[index] = value
        self._qualities[index] = quality
        self._times[index] = now
        self._whys[index] = why
        for feed in self._feeds:
            feed.mark(index)

    def say(
        self,
        index: int,
        said: Text | Value,
        now: float,
        quality: Quality = Quality.GOOD,
        why: Said = "",
    ) -> None:
        """Store a value, or the words of a text; ``said`` tells what they are the words of."""
        if isinstance(said, Text):
            words = render(said)
            self._said[index] = words, said
            said = words
        self.set(index, said, now, quality, why)

    def said(self, index: int) -> Text | None:
        """The text whose words are the value of this point; None where nobody has told one."""
        words, said = self._said.get(index, (None, None))
        return said if words == self._values[index] else None

    def renew(self, index: int, value: Value, now: float) -> None:
        """Store a good value with its source time, even if the value is the same: it has been read again, and
        readers want to know its age."""
        self._times[index] = now
        self.set(index, value, now)
        for feed in self._feeds:
            feed.mark(index)

    def date(self, index: int, now: float) -> None:
        """Store a later source time of what is there: it has been read again. Feeds hear nothing of it."""
        self._times[index] = max(self._times[index], now)

    def keep(self, index: int, value: Value, now: float) -> None:
        """Store a good value that changes by itself, such as an age. Feeds hear of it with ``tell_kept``,
        however often it is looked at before."""
        if self._values[index] != value or self._qualities[index] is not Quality.GOOD:
            self._values[index] = value
            self._qualities[index] = Quality.GOOD
            self._times[index] = now
            self._untold[index] = None

    def tell_kept(self) -> None:
        """Mark what ``keep`` has changed."""
        if self._untold:
            for feed in self._feeds:
                feed.mark_all(self._untold)
            self._untold.clear()

    def tell_kept_of(self, indices: Iterable[int]) -> None:
        """Like ``tell_kept``, for these points alone: those kept by others can wait."""
        told = {index: None for index in indices if index in self._untold}
        if told:
            for feed in self._feeds:
                feed.mark_all(told)
            for index in told:
                del self._untold[index]

    def set_values(self, indices: Sequence[int], values: Sequence[Value], now: float) -> None:
        """Store values of points whose quality stays as it is; ``indices`` and ``values`` go together."""
        held, times = self._values, self._times
        changed: dict[int, None] = {}
        for index, value in zip(indices, values, strict=True):
            if held[index] != value:
                held[index] = value
                times[index] = now
                changed[index] = None
        if changed:
            for feed in self._feeds:
                feed.mark_all(changed)

    def judge(self, indices: Sequence[int], quality: Quality, now: float, why: Said = "") -> None:
        """Give these points another quality and keep their values."""
        for index in indices:
            self.set(index, self._values[index], now, quality, why)
