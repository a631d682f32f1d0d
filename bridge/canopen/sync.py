"""SYNC and the time-outs that follow from it (CiA 301 §7.2.5, §7.5.2.37)."""

from __future__ import annotations

from typing import Final

from bridge.canopen import cobid
from bridge.canopen.frame import Frame

LAST_SYNCHRONOUS: Final = 240
"""Transmission types up to this one are synchronous (CiA 301 §7.5.2.37)."""
REMOTE_SYNCHRONOUS: Final = 252
"""Sampled with SYNC, sent on a remote frame."""
REMOTE_TYPES: Final = (REMOTE_SYNCHRONOUS, 253)
_LATE: Final = 1.5
_SLACK_S: Final = 0.02


def sync_frames(counter: int) -> tuple[Frame, ...]:
    """The SYNC messages of one turn: one without data, or ``counter`` of them numbered from 1
    (1019h, CiA 301 §7.5.2.22)."""
    if not counter:
        return (Frame(cobid.SYNC),)
    return tuple(Frame(cobid.SYNC, bytes((number,))) for number in range(1, counter + 1))


class SyncWindow:
    """Judges whether synchronous TPDOs come within the window after SYNC (1007h, CiA 301 §7.5.2.7).

    Times are those of the frames, SYNC's included: the bus returns the frames of our bursts to us.
    """

    def __init__(self, window_s: float) -> None:
        self.window_s = window_s
        self.misses = 0
        self._sync_at: float | None = None

    def on_sync(self, frame: Frame) -> None:
        self._sync_at = frame.time

    def on_tpdo(self, frame: Frame) -> None:
        if self._sync_at is not None and frame.time - self._sync_at > self.window_s:
            self.misses += 1

    def reset(self) -> None:
        """The bus is gone: the next TPDO belongs to no SYNC that we know."""
        self._sync_at = None


def tpdo_deadline_s(
    transmission_type: int, event_timer_ms: int, sync_period_ms: int, rtr_poll_ms: int = 0
) -> float | None:
    """The values of this TPDO are stale after this time without it; None if it is not sent regularly.

    That is half a period and a little after it was due: later than any jitter, sooner than the next one.
    """
    if 1 <= transmission_type <= LAST_SYNCHRONOUS and sync_period_ms:
        period_s = transmission_type * sync_period_ms / 1000
    elif transmission_type in REMOTE_TYPES and rtr_poll_ms:
        period_s = rtr_poll_ms / 1000
    elif transmission_type >= 254 and event_timer_ms:
        period_s = event_timer_ms / 1000
    else:
        return None
    return _LATE * period_s + _SLACK_S


def burst_length(period_s: float, deadman_ms: int) -> int:
    """Number of frames with this period that the kernel may send without us: never for longer than the
    dead-man time."""
    return max(1, int(deadman_ms / 1000 / period_s + 1e-9))
