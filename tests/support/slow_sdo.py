"""A simulated node whose SDO answers take their time."""

from __future__ import annotations

from typing import Any, Final

from bridge.canopen.frame import Frame

_SDO: Final = range(0x580, 0x600)


class SlowSdo:
    """``node`` on the bench, with each answer of its first SDO server ``answer_s`` after the request."""

    def __init__(self, node: Any, answer_s: float = 0.0) -> None:
        self.inner = node
        self.answer_s = answer_s
        self._now = 0.0
        self._held: list[tuple[float, Frame]] = []

    def __getattr__(self, name: str) -> Any:
        return getattr(self.inner, name)

    def on_frame(self, frame: Frame, now: float) -> None:
        self._now = now
        self.inner.on_frame(frame, now)

    def on_time(self, now: float) -> None:
        self._now = now
        self.inner.on_time(now)

    def next_deadline(self) -> float | None:
        times = [self.inner.next_deadline(), *(at for at, _ in self._held)]
        return min((at for at in times if at is not None), default=None)

    def take_frames(self) -> list[Frame]:
        frames = self.inner.take_frames()
        self._held += [(self._now + self.answer_s, one) for one in frames if self._is_slow(one)]
        due = [one for at, one in self._held if at <= self._now]
        self._held = [(at, one) for at, one in self._held if at > self._now]
        return [one for one in frames if not self._is_slow(one)] + due

    def _is_slow(self, frame: Frame) -> bool:
        return bool(self.answer_s) and frame.can_id in _SDO
