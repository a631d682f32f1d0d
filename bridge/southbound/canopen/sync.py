"""SYNC and the time-outs that follow from it (CiA 301 §7.2.5, §7.5.2.38)."""

from __future__ import annotations

from typing import Final

from bridge.southbound.bus.frame import Frame
from bridge.southbound.canopen import cobid

SYNC_FRAME: Final = Frame(cobid.SYNC)
_LATE: Final = 1.5
_SLACK_S: Final = 0.02


def tpdo_deadline_s(transmission_type: int, event_timer_ms: int, sync_period_ms: int) -> float | None:
    """After how long without this TPDO its values are stale, or None where it need not come.

    That is half a period and a little more than when it was due: later than any jitter, sooner than
    the next one.
    """
    if 1 <= transmission_type <= 240 and sync_period_ms:
        period_s = transmission_type * sync_period_ms / 1000
    elif transmission_type >= 254 and event_timer_ms:
        period_s = event_timer_ms / 1000
    else:
        return None
    return _LATE * period_s + _SLACK_S


def burst_length(period_s: float, deadman_ms: int) -> int:
    """How many frames of this period may be left to run without us: never longer than the dead-man time."""
    return max(1, int(deadman_ms / 1000 / period_s + 1e-9))
