"""Predicted load of a bus: all regular frames of the site file, each at its longest."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from bridge.can.wirebits import longest_bits
from bridge.lint.checked_bus import CheckedBus, CheckedNode, CheckedPdo
from bridge.lint.report import LintReport
from bridge.node.boot.error_control_setup import heartbeat_period_ms
from bridge.text import Text

_SDO_BYTES: Final = 8
_TIME_BYTES: Final = 6
_WORTH_A_WARNING: Final = 60.0
_FULL: Final = 100.0


@dataclass(frozen=True, slots=True)
class Stream:
    """Frames of one kind: ``length`` bytes every ``period_s``, in bursts at most every ``shortest_s``.
    ``cyclic``: sent in every SYNC cycle, or in one of several."""

    length: int
    period_s: float | None
    shortest_s: float | None = None
    cyclic: bool = False

    @property
    def bits_per_s(self) -> float:
        return longest_bits(self.length) / self.period_s if self.period_s else 0.0

    @property
    def most_bits_per_s(self) -> float:
        return longest_bits(self.length) / self.shortest_s if self.shortest_s else self.bits_per_s


@dataclass(frozen=True, slots=True)
class BusLoad:
    """Predicted load of one bus. ``most_percent`` is with every event-driven TPDO at its inhibit time;
    ``cycle_ms`` is the time that SYNC and all frames of one cycle take on the wire."""

    bus: str
    bitrate: int
    load_percent: float
    most_percent: float
    sync_period_ms: int
    cycle_ms: float

    def __str__(self) -> str:
        most = f", at most {self.most_percent:.0f} %" if self.most_percent > self.load_percent + 0.5 else ""
        cycle = f"SYNC budget: {self.cycle_ms:.1f} of {self.sync_period_ms} ms"
        budget = cycle if self.sync_period_ms else "no SYNC"
        rate = f"{self.bitrate // 1000} kbit/s"
        return f"{self.bus}: predicted load {self.load_percent:.0f} %{most} of {rate} ({budget})"


def predict(bus: CheckedBus) -> BusLoad:
    found = list(streams(bus))
    cycle_bits = sum(longest_bits(one.length) * _in_cycle(one, bus.sync_s) for one in found if one.cyclic)
    bitrate = bus.table.bitrate
    regular = sum(one.bits_per_s for one in found)
    most = sum(max(one.bits_per_s, one.most_bits_per_s) for one in found)
    return BusLoad(
        bus.table.name,
        bitrate,
        round(100 * regular / bitrate, 1),
        round(100 * most / bitrate, 1),
        bus.table.sync_period_ms,
        round(1000 * cycle_bits / bitrate, 3),
    )


def _in_cycle(stream: Stream, sync_s: float) -> int:
    """Largest number of its frames that can fall into one SYNC cycle."""
    if not sync_s or not stream.period_s:
        return 1
    return max(1, math.ceil(sync_s / stream.period_s - 1e-9))


def streams(bus: CheckedBus) -> Iterator[Stream]:
    """All regular frames of the bus."""
    table = bus.table
    if table.sync_period_ms:
        yield Stream(1 if table.sync_counter else 0, bus.sync_s, cyclic=True)
    if table.heartbeat_ms:
        yield Stream(1, table.heartbeat_ms / 1000)
    if table.time_period_s:
        yield Stream(_TIME_BYTES, table.time_period_s)
    for node in bus.nodes:
        if node.table.enabled:
            yield from _node_streams(node, bus)


def _node_streams(node: CheckedNode, bus: CheckedBus) -> Iterator[Stream]:
    supervision_s = node.table.supervision_ms / 1000
    if node.table.supervision == "heartbeat":
        yield Stream(1, heartbeat_period_ms(node.table.supervision_ms) / 1000)
    elif node.table.supervision == "guarding":
        yield Stream(0, supervision_s)
        yield Stream(1, supervision_s)
    polls_per_s = sum(1000 / poll.every_ms for poll in node.family.poll)
    if polls_per_s:
        # They take turns: one request of a node is on its way at a time.
        for _ in ("request", "reply"):
            yield Stream(_SDO_BYTES, 1 / polls_per_s)
    for pdo in node.pdos:
        if pdo.receives and pdo.sent:
            yield Stream(pdo.length, bus.table.rpdo_period_s, cyclic=bool(bus.sync_s))
        elif not pdo.receives and pdo.enabled:
            yield _tpdo_stream(pdo, bus.sync_s)
            if pdo.is_polled:
                yield Stream(0, pdo.rtr_poll_ms / 1000)


def _tpdo_stream(pdo: CheckedPdo, sync_s: float) -> Stream:
    cyclic = pdo.is_synchronous and bool(sync_s)
    return Stream(pdo.length, pdo.period_s(sync_s), pdo.shortest_s(sync_s), cyclic=cyclic)


def check_load(bus: CheckedBus, report: LintReport) -> BusLoad:
    """Predict the load and judge it."""
    load = predict(bus)
    key = (*bus.key, "bitrate")
    advice = Text.of("check.load_advice")
    if load.load_percent > _FULL:
        report.error(key, Text.of("check.load_full", load=load.load_percent), advice)
    elif load.load_percent > _WORTH_A_WARNING:
        report.warning(key, Text.of("check.load_high", load=load.load_percent), advice)
    elif load.most_percent > _FULL:
        said = Text.of("check.load_most", load=load.most_percent)
        report.warning(key, said, Text.of("check.load_most_advice"))
    if bus.sync_s and load.cycle_ms > load.sync_period_ms:
        report.error(
            (*bus.key, "sync_period_ms"),
            Text.of("check.cycle_long", time=load.cycle_ms),
            Text.of("check.at_least", least=math.ceil(load.cycle_ms)),
        )
    _check_window(bus, load, report)
    return load


def _check_window(bus: CheckedBus, load: BusLoad, report: LintReport) -> None:
    """Check that all synchronous TPDOs are sent within the window (1007h); one other frame may delay them."""
    window_us = bus.table.sync_window_us
    synchronous = any(
        not pdo.receives and pdo.enabled and pdo.is_synchronous for node in bus.nodes for pdo in node.pdos
    )
    if not window_us:
        return
    key = (*bus.key, "sync_window_us")
    if not synchronous:
        report.warning(key, Text.of("check.window_no_effect"))
        return
    needed_us = 1000 * load.cycle_ms + 1e6 * longest_bits(8) / bus.table.bitrate
    if needed_us > window_us:
        report.warning(
            key,
            Text.of("check.window_short", window=window_us, cycle=needed_us),
            Text.of("check.window_advice", least=math.ceil(needed_us / 100) * 100),
        )
