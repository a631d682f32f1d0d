"""Silences of the bridge and its nodes beside what the site file allows. Sans-IO."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from bridge.canopen import cobid
from bridge.canopen.frame import Frame
from bridge.config import BusTable


@dataclass(frozen=True, slots=True)
class Bound:
    """Longest time between two frames of ``label``, in ms, and the key of the site file that sets it."""

    label: str
    most_ms: int
    key: str


@dataclass(slots=True)
class _Heard:
    """Times of one identifier: of its last frame, of the longest silence and of when that began, in seconds;
    ``times``: how often it was silent for too long; ``place``, ``since_place``: where the last frame stands,
    and the one before the longest silence."""

    last: float
    place: str
    times: int = 0
    longest_s: float = 0.0
    since: float = 0.0
    since_place: str = ""


def bounds(table: BusTable, rpdos: Mapping[int, str]) -> dict[int, Bound]:
    """Bounds by COB-ID; ``rpdos`` are the labels of the bridge's. A frame that is repeated less often than
    twice within the dead-man time may be silent for two of its periods."""
    found: dict[int, Bound] = {}
    if table.sync_period_ms:
        found[cobid.SYNC] = _repeated("SYNC", table.deadman_ms, table.sync_period_ms, "sync_period_ms")
    period_ms = round(1000 * table.rpdo_period_s)
    for can_id, label in rpdos.items():
        found[can_id] = _repeated(label, table.deadman_ms, period_ms, "rpdo_period_ms")
    for node in table.node:
        if node.enabled and node.supervision == "heartbeat":
            label = f"heartbeat {node.name}"
            found[cobid.ERROR_CONTROL + node.id] = Bound(label, node.supervision_ms, "supervision_ms")
    return found


def _repeated(label: str, deadman_ms: int, period_ms: int, key: str) -> Bound:
    if 2 * period_ms > deadman_ms:
        return Bound(label, 2 * period_ms, f"twice {key}")
    return Bound(label, deadman_ms, "deadman_ms")


class SilenceWatch:
    """Judge of frames in the order of the wire. Identifiers that were never heard are not judged."""

    def __init__(self, bounds: Mapping[int, Bound]) -> None:
        self._bounds = bounds
        self._heard: dict[int, _Heard] = {}

    def on_frame(self, frame: Frame, place: str) -> None:
        """Take the next frame; ``place`` says where it was recorded."""
        if frame.can_id not in self._bounds:
            return
        heard = self._heard.get(frame.can_id)
        if heard is None:
            self._heard[frame.can_id] = _Heard(frame.time, place)
            return
        self._judge(frame.can_id, heard, frame.time)
        heard.last, heard.place = frame.time, place

    def said(self, started: float, end: float) -> list[str]:
        """Sentences, one for each identifier that was silent for too long; times are seconds after
        ``started``. A silence that lasts at the ``end`` is counted up to then."""
        sentences: list[str] = []
        for can_id, heard in sorted(self._heard.items()):
            self._judge(can_id, heard, end)
            heard.last = end
            if heard.times:
                bound = self._bounds[can_id]
                often = f", {heard.times} times in all" if heard.times > 1 else ""
                sentences.append(
                    f"{heard.since_place}: {bound.label}: silent for {1000 * heard.longest_s:.0f} ms from "
                    f"{heard.since - started:.3f} s on, {bound.key} allows {bound.most_ms} ms{often}"
                )
        return sentences

    def _judge(self, can_id: int, heard: _Heard, now: float) -> None:
        silent_s = now - heard.last
        if silent_s * 1000 > self._bounds[can_id].most_ms:
            heard.times += 1
            if silent_s > heard.longest_s:
                heard.longest_s, heard.since, heard.since_place = silent_s, heard.last, heard.place
