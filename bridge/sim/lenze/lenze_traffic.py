"""Frames that an 8400 motec sends by itself, and its counters (EDS84DMOTCAN 3.0, §7.2.3, §8.5, C00360)."""

from __future__ import annotations

from collections.abc import Callable

from bridge.sim.core.communication_settings import CommunicationSettings
from bridge.sim.lenze.lenze_settings import LenzeCodes


class QuasiMaster:
    """C00352 = 1: starts every node, C00356/1 after power-on or a reset."""

    def __init__(self, codes: Callable[[], LenzeCodes]) -> None:
        self._codes = codes
        self._at: float | None = None

    def start(self, now: float) -> None:
        codes = self._codes()
        self._at = now + codes.times_ms[0] / 1000 if codes.master else None

    def due(self, now: float) -> bool:
        """True once."""
        if self._at is None or now < self._at:
            return False
        self._at = None
        return True

    def next_deadline(self) -> float | None:
        return self._at


def counters_of(cob_id: int, settings: CommunicationSettings, *, sent: bool) -> tuple[int, ...]:
    """The sub-codes of C00360 that count this frame: its direction's and its channel's."""
    if sent:
        channels = [pdo.cob_id for pdo in settings.tpdo] + [0] + [sdo.send.cob_id for sdo in settings.sdo]
    else:
        channels = [pdo.cob_id for pdo in settings.rpdo] + [0] + [sdo.receive.cob_id for sdo in settings.sdo]
    if not cob_id or cob_id not in channels:
        return ()
    return (1 if sent else 2), (3 if sent else 8) + channels.index(cob_id)
