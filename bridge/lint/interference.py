"""Frames that may go before one of ours, at the predicted load."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Final

from bridge.command.worst_case import Wire
from bridge.lint.bus_load import longest_bits, streams
from bridge.lint.checked_bus import CheckedBus, CheckedPdo

_LONGEST_BYTES: Final = 8
_LONGEST_S: Final = 10.0
"""Time in seconds after which a bus that is busy without a pause counts as full."""


def wire_of(bus: CheckedBus, rpdos: Sequence[CheckedPdo], busy_bits: int | None) -> Wire:
    """Waiting times of ``rpdos``; ``busy_bits`` is that of the bus."""
    rate = bus.table.bitrate
    own_bits = sum(longest_bits(pdo.length) for pdo in rpdos if pdo.sent)
    # These RPDOs are among them.
    before_ms = None if busy_bits is None else 1000 * max(0, busy_bits - own_bits) / rate
    return Wire(1000 * own_bits / rate, before_ms)


def busy_bits(bus: CheckedBus) -> int | None:
    """Largest number of bits that can follow each other without a pause; None where the bus never comes to
    rest.

    The queue of a CAN interface is first in, first out: a frame of ours with a low identifier may wait
    behind one that loses every arbitration (an SDO request, say). So all regular traffic may go first, and
    the longest frame, already under way. Frames that become due meanwhile count, too: hence a fixed point.
    """
    under_way = longest_bits(_LONGEST_BYTES)
    rate = bus.table.bitrate
    loads = [(longest_bits(one.length), one.period_s or one.shortest_s) for one in streams(bus)]
    busy = under_way + sum(bits for bits, _ in loads)
    while busy < _LONGEST_S * rate:
        frames = (
            bits * max(1, math.ceil(busy / rate / every_s - 1e-9)) if every_s else bits
            for bits, every_s in loads
        )
        longer = under_way + sum(frames)
        if longer == busy:
            return busy
        busy = longer
    return None
