"""Traffic on a bus as a tab sees it: frame by frame as the tab filters them, or counted by identifier.
Sans-IO.

Each frame is decoded once for all tabs. A tab that asks for all of a busy bus gets the first of each beat,
and how many were left out. Messages are JSON: ``{"heard": bus, "lost": n, "frames": [[time in ms since 1970,
identifier, data, kind, node, label, text], …], "more": n}``, or ``"identifiers"`` in place of the frames, or
``"failure"`` with the reason why nothing is heard, and ``"text"``, its code with facts.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Annotated, Any, Final, Protocol

import msgspec

from bridge.base.errors import OperationFailed
from bridge.text import Words, as_json, render

MOST_ROWS: Final = 100
"""Frames in one message."""
_WINDOW_S: Final = 5.0
"""Time over which rates and loads are smoothed, about, seconds."""
_MOST_IDENTIFIERS: Final = 2048
_MOST_KINDS: Final = 16
_MOST_NODES: Final = 127
_RETRY_S: Final = 1.0
"""Pause before a bus that could not be heard is tried again, seconds."""
_encode = msgspec.json.Encoder().encode


class ShownFrame(msgspec.Struct, frozen=True, array_like=True):
    """One frame and its decoded text. ``at_ms`` is in ms since 1970; ``bits`` is what it took of the bus."""

    at_ms: float
    identifier: str
    data: str
    kind: str
    node: int
    label: str
    text: str
    bits: int = 0


class BusTap(Protocol):
    """Source of the frames of one bus, while it is open."""

    def open(self) -> None:
        """Begin to listen. Raises ``OperationFailed``."""
        ...

    def take(self) -> list[ShownFrame]:
        """Frames since the last call. Raises ``OperationFailed`` where the bus cannot be heard any more."""
        ...

    @property
    def lost(self) -> int: ...

    def close(self) -> None: ...


class TrafficFilter(msgspec.Struct, forbid_unknown_fields=True, frozen=True):
    """Filter of a tab; no kinds or no nodes are all of them."""

    bus: str
    view: str = "frames"
    kinds: Annotated[frozenset[str], msgspec.Meta(max_length=_MOST_KINDS)] = frozenset()
    nodes: Annotated[frozenset[int], msgspec.Meta(max_length=_MOST_NODES)] = frozenset()

    def takes(self, frame: ShownFrame) -> bool:
        return (not self.kinds or frame.kind in self.kinds) and (not self.nodes or frame.node in self.nodes)


@dataclass(slots=True)
class _TrafficCount:
    last: ShownFrame
    frames: int = 0
    frames_before: int = 0
    bits: int = 0
    shortest_ms: float = 0.0
    longest_ms: float = 0.0
    rate_hz: float = 0.0
    load: float = 0.0


class TrafficView:
    """Traffic of one bus of ``bitrate`` bit/s, for every tab that shows it."""

    def __init__(self, bus: str, bitrate: int, tap: BusTap) -> None:
        self._bus = bus
        self._bitrate = bitrate
        self._tap = tap
        self._is_open = False
        self._failure: Words = ""
        self._retry_at = float("-inf")
        self._counts: dict[str, _TrafficCount] = {}
        self._measured = 0.0
        self._new: list[ShownFrame] = []

    def listen(self, now: float, *, is_wanted: bool) -> None:
        """Take the frames received since the last call. ``now`` is monotonic; while no tab wants any, the tap
        is closed."""
        self._new = []
        if not is_wanted:
            self.close()
            return
        try:
            if not self._is_open:
                if now < self._retry_at:
                    return
                self._open(now)
            self._new = self._tap.take()
            self._failure = ""
        except OperationFailed as error:
            self.close()
            self._failure = error.said
            self._retry_at = now + _RETRY_S
        for frame in self._new:
            self._count(frame)
        if now - self._measured >= 1.0:
            self._measure(now)

    def close(self) -> None:
        if self._is_open:
            self._is_open = False
            self._tap.close()

    def _open(self, now: float) -> None:
        self._tap.open()
        self._is_open = True
        self._counts.clear()
        self._measured = now

    def frames_for(self, filter_: TrafficFilter) -> bytes | None:
        """JSON message with the new frames for this tab; None where there are none."""
        if self._failure:
            return self._told({"failure": render(self._failure), "text": as_json(self._failure)})
        wanted = [frame for frame in self._new if filter_.takes(frame)]
        if not wanted:
            return None
        rows = [_row(frame) for frame in wanted[:MOST_ROWS]]
        return self._told({"frames": rows, "more": len(wanted) - len(rows)})

    def identifiers_for(self, filter_: TrafficFilter) -> bytes:
        """JSON message with a row for each identifier so far: identifier, label, frames, frames a second,
        load in percent, shortest and longest gap in ms, newest data and its text."""
        if self._failure:
            return self._told({"failure": render(self._failure), "text": as_json(self._failure)})
        rows = [
            [
                key,
                one.last.label,
                one.frames,
                round(one.rate_hz, 1),
                round(one.load, 2),
                round(one.shortest_ms, 1),
                round(one.longest_ms, 1),
                one.last.data,
                one.last.text,
            ]
            for key, one in sorted(self._counts.items(), key=lambda pair: (len(pair[0]), pair[0]))
            if filter_.takes(one.last)
        ]
        return self._told({"identifiers": rows})

    def _told(self, facts: dict[str, Any]) -> bytes:
        return _encode({"heard": self._bus, "lost": self._tap.lost, **facts})

    def _count(self, frame: ShownFrame) -> None:
        one = self._counts.get(frame.identifier)
        if one is None:
            if len(self._counts) >= _MOST_IDENTIFIERS:
                return
            one = self._counts[frame.identifier] = _TrafficCount(frame)
        else:
            gap_ms = frame.at_ms - one.last.at_ms
            one.shortest_ms = min(one.shortest_ms, gap_ms) if one.frames > 1 else gap_ms
            one.longest_ms = max(one.longest_ms, gap_ms)
            one.last = frame
        one.frames += 1
        one.bits += frame.bits

    def _measure(self, now: float) -> None:
        """Once a second: rates, smoothed over some seconds."""
        elapsed_s, self._measured = now - self._measured, now
        share = min(1.0, elapsed_s / _WINDOW_S)
        for one in self._counts.values():
            rate_hz = (one.frames - one.frames_before) / elapsed_s
            load = 100 * one.bits / (self._bitrate * elapsed_s)
            is_first = not one.frames_before
            one.rate_hz = rate_hz if is_first else one.rate_hz + share * (rate_hz - one.rate_hz)
            one.load = load if is_first else one.load + share * (load - one.load)
            one.frames_before, one.bits = one.frames, 0


def _row(frame: ShownFrame) -> list[Any]:
    return [frame.at_ms, frame.identifier, frame.data, frame.kind, frame.node, frame.label, frame.text]


class TrafficViews:
    """All buses of a site, by name."""

    def __init__(self, buses: Iterable[tuple[str, int, BusTap]]) -> None:
        self._views = {name: TrafficView(name, bitrate, tap) for name, bitrate, tap in buses}

    def __contains__(self, bus: object) -> bool:
        return bus in self._views

    def beat(
        self,
        filters: Iterable[tuple[TrafficFilter, Callable[[bytes], None]]],
        now: float,
        *,
        counts: bool,
    ) -> None:
        """Send each tab the frames that its filter lets through, and with ``counts`` those that show
        identifiers theirs."""
        wanted = list(filters)
        for name, view in self._views.items():
            own = [(filter_, show) for filter_, show in wanted if filter_.bus == name]
            view.listen(now, is_wanted=bool(own))
            for filter_, show in own:
                if filter_.view == "identifiers":
                    message = view.identifiers_for(filter_) if counts else None
                else:
                    message = view.frames_for(filter_)
                if message is not None:
                    show(message)

    def close(self) -> None:
        for view in self._views.values():
            view.close()
