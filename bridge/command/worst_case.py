"""Longest time that a drive is still enabled after the last telegram of its owner, term by term. Pure.

The terms, and what is in none of them: ``docs/explanation/dead-man-chain.md``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

from bridge.command.messages.freshness import way_ms
from bridge.config import IGNORE_ALL_S, BusTable, DriveTable, OutputsTable
from bridge.text import Said, Text, render

REACTION_BOUND_MS: Final = 20
"""Longest delay in ms of the bridge itself, or of the kernel's timer in its place."""
_THREAD_QUEUE_MS: Final = 50.0
"""Longest time in ms that a frame waits for python-can's thread (``bridge/can/pythoncan.py``)."""
_KERNEL: Final = ("socketcan", "virtual")
_LAST_SYNCHRONOUS: Final = 240
_FOREIGN_SYNC_MS: Final = 100
"""Time in ms for which a SYNC of another producer is waited for: its period is not known here."""
_ROUNDING: Final = 1e-9


@dataclass(frozen=True, slots=True)
class Term:
    """One summand of the stop time, by its name."""

    name: str
    ms: float
    what: str

    def __str__(self) -> str:
        return f"{self.name} {self.ms:.3g}" if self.ms < 1 else f"{self.name} {self.ms:g}"


@dataclass(frozen=True, slots=True)
class StopTime:
    """Sum of the terms. Without ``terms`` nothing stops the drive, or ``unknown`` says why no bound can be
    given."""

    terms: tuple[Term, ...] = ()
    unknown: Said = ""

    @property
    def ms(self) -> int:
        """Sum in ms, rounded up; 0 where there is none."""
        return math.ceil(sum(term.ms for term in self.terms) - _ROUNDING)

    def __str__(self) -> str:
        if self.unknown:
            return f"not known: {render(self.unknown)}"
        return f"{self.ms} ms" if self.terms else "never"

    @property
    def sum(self) -> str:
        """The summands in one line."""
        return " + ".join(str(term) for term in self.terms)


@dataclass(frozen=True, slots=True)
class Wire:
    """Predicted delays of a drive's RPDOs on their bus: ``frames_ms`` of their own, ``before_ms`` of frames
    that may go first, None if nothing bounds them."""

    frames_ms: float = 0.0
    before_ms: float | None = 0.0


def stop_time(
    table: DriveTable,
    bus: BusTable,
    timeout_ms: int,
    transmission_type: int,
    wire: Wire,
    own_ms: float | None = 0.0,
) -> StopTime:
    """Stop time from the owner's last telegram to the last frame that enables the drive, and to the first
    that does not. ``transmission_type`` is that of the RPDO with the control word. With silence the reaction
    is the drive's own, ``own_ms`` after its last RPDO. If it has none (0), it gets disable voltage instead;
    None: the drive has not been asked yet."""
    if not timeout_ms or table.telegram_downtime_s == IGNORE_ALL_S or table.reaction.holds:
        return StopTime()
    if table.reaction.is_silent and own_ms is None:
        return StopTime(unknown=Text.of("stop_time.own_not_read"))
    terms = _to_the_wire(table.control, bus, timeout_ms, transmission_type, wire)
    if isinstance(terms, StopTime):
        return terms
    if table.reaction.is_silent and own_ms:
        terms.append(Term("own_ms", own_ms, "the drive's own time-out, which stops it without RPDOs"))
    return StopTime(tuple(term for term in terms if term.ms))


def output_stop_time(table: OutputsTable, bus: BusTable, transmission_type: int, wire: Wire) -> StopTime:
    """Stop time from the owner's last telegram to the first frame with safe values of a node's outputs."""
    timeout_ms = table.fieldbus_timeout_ms or 0
    if not timeout_ms:
        return StopTime()
    terms = _to_the_wire(table.control, bus, timeout_ms, transmission_type, wire)
    return terms if isinstance(terms, StopTime) else StopTime(tuple(term for term in terms if term.ms))


def _to_the_wire(
    control: str, bus: BusTable, timeout_ms: int, transmission_type: int, wire: Wire
) -> list[Term] | StopTime:
    """Terms until the node has taken over the first frame that stops; or why these are not known."""
    sync_ms = sync_wait_ms(bus, transmission_type)
    is_synchronous = transmission_type <= _LAST_SYNCHRONOUS
    if is_synchronous and not bus.sync_period_ms:
        return StopTime(unknown=Text.of("stop_time.waits_for_sync", type=transmission_type))
    if wire.before_ms is None:
        return StopTime(unknown=Text.of("stop_time.overload"))
    terms = [
        *_before_the_bus(control, bus, timeout_ms),
        Term("before_ms", wire.before_ms, "frames that may go first on the bus at the predicted load"),
        Term("frames_ms", wire.frames_ms, "the drive's own RPDOs on the wire"),
    ]
    if is_synchronous:
        terms.append(Term("sync_ms", sync_ms, "until the SYNC that takes the RPDO over"))
        terms.append(Term("sync_late_ms", wire.before_ms, "frames that may go before SYNC"))
    return terms


def sync_wait_ms(bus: BusTable, transmission_type: int) -> int:
    """Time in ms that an RPDO of this type waits for the SYNC that takes it over (CiA 301 §7.5.2.35)."""
    return max(1, transmission_type) * bus.sync_period_ms if transmission_type <= _LAST_SYNCHRONOUS else 0


def takeover_ms(bus: BusTable, transmission_type: int) -> int:
    """Time in ms after which a word on the bus has been taken over, or is no longer waited for: 0 where that
    takes no SYNC."""
    if transmission_type > _LAST_SYNCHRONOUS:
        return 0
    wait_ms = sync_wait_ms(bus, transmission_type) if bus.sync_period_ms else _FOREIGN_SYNC_MS
    return wait_ms + REACTION_BOUND_MS


def _before_the_bus(control: str, bus: BusTable, timeout_ms: int) -> Iterator[Term]:
    period_ms = 1000 * bus.rpdo_period_s
    way = "how much older the owner's last telegram may be than the bridge assumes"
    yield Term("way_ms", way_ms(control), way)
    yield Term("timeout_ms", timeout_ms, "the owner's time-out, fieldbus_timeout_ms")
    yield Term("reaction_ms", REACTION_BOUND_MS, "the bridge's own lateness, or that of the kernel's timer")
    yield Term("burst_ms", period_ms, "the kernel counts frames: the time-out is rounded up to a whole one")
    yield Term("period_ms", period_ms, "the next frame of the burst, with the stop")
    if bus.interface not in _KERNEL:
        yield Term("queue_ms", _THREAD_QUEUE_MS, "frames that wait for the interface")
