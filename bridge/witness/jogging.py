"""Stops of a drive that its owner jogs, too short to be judged one by one. Sans-IO.

A drive that brakes is slower at the end of a stop than it was before it. How much slower is averaged over
stops: one whose ramp would be ``_RAMPS`` times the longest that is expected does not brake.
"""

from __future__ import annotations

from typing import Final

_LATE_S: Final = 0.1
"""Longest time in seconds from an RPDO to a TPDO that shows its effect."""
_RAMPS: Final = 4.0


class Jogs:
    """Jogging of one drive. ``ramp_s`` is the longest ramp expected, ``judged_s`` the time of stops after
    which it is judged. Speeds are signed, in any unit."""

    def __init__(self, ramp_s: float, judged_s: float) -> None:
        self._ramp_s, self._judged_s = ramp_s, judged_s
        self._turned_at = 0.0
        self._is_stop = False
        self._stop_s = 0.0
        """Length in seconds of the stop before this run: for as long the drive may still speed up."""
        self._run = (0, 0.0)
        """Number and sum of the speeds of a steady run."""
        self._reset()

    def _reset(self) -> None:
        self._stops = 0
        self._time_s = self._braked_s = self._slower = 0.0
        self._last_at: float | None = None

    def on_turn(self, at: float, *, stops: bool) -> None:
        """Take a change of the RPDOs between run and stop."""
        if stops is self._is_stop:
            return
        self._stop_s = 0.0 if stops else at - self._turned_at
        if not stops:
            self._run = (0, 0.0)
        self._is_stop, self._turned_at, self._last_at = stops, at, None

    def on_obeyed(self) -> None:
        """Take a report that the drive is not enabled: the rest of this stop tells nothing."""
        self._reset()
        self._run = (0, 0.0)

    def on_speed(self, speed: int, at: float) -> str:
        """Take the speed in a TPDO that says "enabled". Returns a sentence where the drive does not brake,
        else ""."""
        since_s = at - self._turned_at
        if not self._is_stop:
            if since_s > self._stop_s + _LATE_S:
                self._run = (self._run[0] + 1, self._run[1] + speed)
            return ""
        count, total = self._run
        if not total:
            return ""
        self._stops += self._last_at is None
        self._time_s += at - (self._turned_at if self._last_at is None else self._last_at)
        self._last_at = at
        self._braked_s += since_s - _LATE_S
        self._slower += 1.0 - speed * count / total
        if self._time_s < self._judged_s:
            return ""
        brakes = self._slower * self._ramp_s * _RAMPS >= self._braked_s
        text = f"enabled and no slower in {self._time_s:.1f} s of {self._stops} stops"
        self._reset()
        # What is left of this stop counts from here.
        self._stops, self._last_at = 1, at
        return "" if brakes else text
