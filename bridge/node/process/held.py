"""Time before its owner's deadline at which the bridge may fail and the kernel still stops the drive.
Pure."""

from __future__ import annotations

import math
from typing import Final

from bridge.can.burstend import MOST_FRAMES, SHORTEST
from bridge.canopen.sync import LAST_SYNCHRONOUS, burst_length
from bridge.config import BusTable

_ROUNDING: Final = 1e-9


def held_s(bus: BusTable, transmission_type: int) -> float:
    """Longest time in seconds before the owner's deadline at which the bridge may fail so that the drive
    still stops in time; 0 if it never does. ``transmission_type`` is that of the RPDO with the control word.

    No burst outlasts the dead-man time, SYNC's neither: a drive may supervise SYNC, too. From the deadline on
    the stop takes up to two RPDO periods (``burstend.sequence``), then a synchronous RPDO waits for its SYNC;
    one more SYNC allows for the different timers of the two bursts.
    """
    stop_s = _reach_s(bus.rpdo_period_s, bus.deadman_ms, MOST_FRAMES)
    if transmission_type > LAST_SYNCHRONOUS or not bus.sync_period_ms:
        return stop_s
    sync_s = bus.sync_period_ms / 1000
    taken_s = _reach_s(sync_s, bus.deadman_ms) - 2 * bus.rpdo_period_s - _syncs(transmission_type) * sync_s
    return min(stop_s, taken_s) if taken_s > _ROUNDING else 0.0


def least_deadman_ms(bus: BusTable, transmission_type: int) -> int:
    """Shortest dead-man time in ms with which the stop of a synchronous RPDO takes effect without the
    bridge."""
    period_ms = 1000 * bus.rpdo_period_s
    stop_in_syncs = math.floor(2 * period_ms / bus.sync_period_ms + _ROUNDING) + 2
    syncs = max(SHORTEST, stop_in_syncs + _syncs(transmission_type))
    return max(syncs * bus.sync_period_ms, math.ceil(SHORTEST * period_ms - _ROUNDING))


def _syncs(transmission_type: int) -> int:
    return max(1, transmission_type) + 1


def _reach_s(period_s: float, deadman_ms: int, most: int | None = None) -> float:
    """Shortest time in seconds to the last frame of a burst; 0 if the kernel does not send it."""
    count = burst_length(period_s, deadman_ms)
    if count < SHORTEST:
        return 0.0
    return ((min(count, most) if most else count) - 1) * period_s
