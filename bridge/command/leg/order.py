"""The new set-point handshake of a positioning drive (CiA 402-2, profile position: bit 4, status bit 12).

The bridge does it for clients that write the position as a value: the bit rises with the new words, stays
until the drive reports that it has taken them, falls, and may rise again when the drive has seen that. A
drive that does not report within a second has not taken them.

An order with words that the drive has already taken does nothing: a controller that writes cyclically must
not start a movement twice. What the drive has taken counts as long as it is enabled.
"""

from __future__ import annotations

from typing import Final

from bridge.command.leg.state import Order

_LIMIT_S: Final = 1.0
"""Time within which the drive has to report that it has a position; the profile names no time."""
_LOW_S: Final = 0.1
"""Time for which the bit stays down then: longer than any cycle we send with, so that an edge is seen."""


def dropped(order: Order) -> Order:
    """Order of a stopped drive: what is pending is dropped."""
    return order._replace(is_waiting=False, is_raised=False, taken=None, deadline=None)


def ordered(order: Order, words: tuple[int, ...]) -> Order:
    """Order after a position was written; one that was written in between does not count any more."""
    return order._replace(is_waiting=words != order.taken)


def went_on(
    order: Order, words: tuple[int, ...], now: float, *, is_acknowledged: bool, commanded: bool
) -> tuple[Order, bool]:
    """Order after a report of the drive, and whether the drive has failed to take it."""
    if order.rises_at is not None and now >= order.rises_at:
        order = order._replace(rises_at=None)
    if not commanded:
        order = dropped(order) if order.was_commanded else order
    elif order.is_raised:
        if is_acknowledged:
            order = order._replace(is_raised=False, deadline=None)
        elif order.deadline is not None and now >= order.deadline:
            order = order._replace(is_raised=False, deadline=None, taken=None, rises_at=now + _LOW_S)
            return order._replace(was_commanded=True), True
    elif order.is_waiting and not is_acknowledged and order.rises_at is None:
        order = order._replace(is_waiting=False, is_raised=True, taken=words, deadline=now + _LIMIT_S)
    return (order if order.was_commanded is commanded else order._replace(was_commanded=commanded)), False
