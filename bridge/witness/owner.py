"""Owner of a drive, or of a node's outputs, as far as the witness knows it, and the promise about it.
Sans-IO.

Its telegrams are known only by their number, which is read now and then, with the time-out in force. A
telegram is assumed to be as young as possible, so a stop may have come up to one reading later than it seems,
and never earlier.
"""

from __future__ import annotations

from collections import deque
from typing import Final

from bridge.witness.plan import promised_ms
from bridge.witness.rate import WINDOW_S

_READING_MS: Final = 150
"""Most by which a telegram may seem younger than it is, ms."""
_COUNTED: Final = 1 << 16
"""Modulus of the telegrams' numbers."""


class WatchedOwner:
    """One owner. ``timeout_ms`` and ``beside_ms`` are those of ``WatchedDrive``."""

    def __init__(self, name: str, timeout_ms: int, beside_ms: int | None) -> None:
        self.name = name
        self.timeout_ms = self._given_ms = timeout_ms
        """Time-out in force, at first that of the site file."""
        self._beside_ms = beside_ms
        self._timeout_at = float("-inf")
        """Time of the first reading with that time-out."""
        self.answered_at: float | None = None
        """Time of the last reading of its number, or from which the first is waited for."""
        self._number: int | None = None
        self._telegram_at: float | None = None
        """Latest possible time of the owner's last telegram."""
        self._read_at: float | None = None
        """Time at which the last reading of its number was asked for."""
        self._late_at: float | None = None
        """Time of the first RPDO that enables later than promised after that telegram."""
        self._is_told = False
        """True once the lateness was reported."""
        self._readings: deque[tuple[float, float, int]] = deque()
        """Readings: time of asking, time of the answer, number."""

    @property
    def is_promised(self) -> bool:
        """True if a stop is promised for it, whatever time-out it sets."""
        return self._beside_ms is not None

    def on_number(
        self, number: int, asked_at: float, answered_at: float, timeout_ms: int | None = None
    ) -> None:
        """Take the number of the owner's last telegram, as it was between these times, and the time-out in
        force; None where that was not read."""
        self.answered_at = answered_at
        timeout_ms = self._given_ms if timeout_ms is None else timeout_ms
        if timeout_ms != self.timeout_ms:
            self.timeout_ms, self._timeout_at = timeout_ms, answered_at
        if number != self._number:
            # The first reading says only that there may have been one just now.
            self._telegram_at = answered_at
            self._number = number
            self._is_told = False
        self._read_at = asked_at
        self._readings.append((asked_at, answered_at, number))
        while self._readings[0][0] < asked_at - WINDOW_S:
            self._readings.popleft()

    def on_numbers_lost(self) -> None:
        """Note that its numbers cannot be read (any more)."""
        self._number = self._telegram_at = self._read_at = self._late_at = None
        self._readings.clear()

    def on_enabling(self, at: float) -> None:
        """Take an RPDO that enables."""
        if self._late_at is None and self._is_late(at):
            self._late_at = at

    def lateness(self) -> str:
        """A sentence, once, where an RPDO enabled later than promised, of an owner that had sent nothing when
        it was asked again; else nothing."""
        telegram, late, read = self._telegram_at, self._late_at, self._read_at
        if self._is_told or telegram is None or late is None or read is None or read < late:
            return ""
        if not self._is_late(late):
            # The time-out had been changed meanwhile, or a telegram was there.
            self._late_at = None
            return ""
        self._is_told = True
        return f"{_ms(late - telegram)} ms after its owner's last telegram; promised: {self.bound_ms}"

    def silence_ms(self, stopped_at: float) -> int | None:
        """Silence of the owner in ms at a stop; None where the silence is not what stopped."""
        if self._telegram_at is None or not self.timeout_ms:
            return None
        silence_ms = _ms(stopped_at - self._telegram_at)
        return silence_ms if silence_ms + _READING_MS >= self.timeout_ms else None

    @property
    def bound_ms(self) -> int | None:
        """Promised longest time in ms after the owner's last telegram; None for no promise."""
        until = self._may_run_until()
        return None if until is None or self._telegram_at is None else _ms(until - self._telegram_at)

    def telegrams(self) -> tuple[int, float, float] | None:
        """Largest number of telegrams between two times of the last seconds, and these times; None without
        readings."""
        if not self._readings:
            return None
        (_, first_at, first), (last_at, _, last) = self._readings[0], self._readings[-1]
        return (last - first) % _COUNTED, first_at, last_at

    def _is_late(self, at: float) -> bool:
        """True if an RPDO at this time must not enable any more."""
        until = self._may_run_until()
        return until is not None and _ms(at - until) > 0

    def _may_run_until(self) -> float | None:
        """Latest time for an RPDO that enables; None where nothing is promised. A time-out that has been made
        shorter holds from when that is known."""
        stop_ms = promised_ms(self.timeout_ms, self._beside_ms)
        if not stop_ms or self._telegram_at is None:
            return None
        beside_s = (stop_ms - self.timeout_ms) / 1000
        return max(self._telegram_at + stop_ms / 1000, self._timeout_at + beside_s)


def _ms(seconds: float) -> int:
    return round(seconds * 1000)
