"""Requests for TPDOs of types 252 and 253, which come on a remote frame only (CiA 301 §7.5.2.37)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from bridge.canopen.frame import REMOTE, Frame
from bridge.canopen.sync import REMOTE_TYPES
from bridge.node.process.process_data import DrivePdos


@dataclass(slots=True)
class _Polled:
    request: Frame
    period_s: float
    due: float


class RemotePolling:
    """TPDOs of one node that come on request only, each requested every ``rtr_poll_ms`` of its drive."""

    def __init__(self) -> None:
        self._asked: list[_Polled] = []
        self._frames: list[Frame] = []

    def start(self, drives: Iterable[DrivePdos], now: float) -> None:
        self._asked = [
            # As long as the answer: a remote frame must have the DLC of the data frame (ISO 11898-1).
            _Polled(Frame(tpdo.cob_id | REMOTE, bytes(tpdo.plan.codec.length)), tpdo.rtr_poll_s, now)
            for pdos in drives
            for tpdo in pdos.tpdos
            if tpdo.plan.transmission_type in REMOTE_TYPES and tpdo.plan.remote_allowed
        ]

    def stop(self) -> None:
        self._asked.clear()
        self._frames.clear()

    def next_deadline(self) -> float | None:
        return min((asked.due for asked in self._asked), default=None)

    def on_time(self, now: float) -> None:
        for asked in self._asked:
            if asked.due <= now:
                self._frames.append(asked.request)
                asked.due += asked.period_s
                if asked.due <= now:
                    # A late round asks once: what was missed is missed.
                    asked.due = now + asked.period_s

    def take_frames(self) -> list[Frame]:
        frames, self._frames = self._frames, []
        return frames
