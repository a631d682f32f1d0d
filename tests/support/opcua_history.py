"""Histories of tests: samples at given times, and what is read of them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from asyncua import ua

from bridge.uaserver.filters.eventfilter import Occurrence
from bridge.uaserver.history.history import Kept, date_time

Codes = ua.StatusCodes


def sample(at_us: int, value: float | str | None, code: int = Codes.Good) -> ua.DataValue:
    held = ua.Variant(value) if value is not None else ua.Variant(None, ua.VariantType.Null)
    return ua.DataValue(held, ua.StatusCode(code), date_time(at_us))


@dataclass
class Samples:
    """Samples in order, the first of them with the number ``first``."""

    held: list[ua.DataValue]
    first: int = 0
    stepped: bool = True

    @property
    def end(self) -> int:
        return self.first + len(self.held)

    def sample(self, number: int) -> ua.DataValue:
        assert self.first <= number < self.end
        return self.held[number - self.first]

    def time_us(self, number: int) -> int:
        stamp = self.sample(number).SourceTimestamp
        return (stamp - date_time(0)) // (date_time(1) - date_time(0))

    def forget(self, count: int) -> None:
        self.held = self.held[count:]
        self.first += count


@dataclass
class Happened:
    """Events with their times; those of None were told by another object."""

    held: list[tuple[int, Mapping[str, ua.Variant] | None]] = field(default_factory=list)
    first: int = 0

    @property
    def end(self) -> int:
        return self.first + len(self.held)

    def time_us(self, number: int) -> int:
        return self.held[number - self.first][0]

    def event(self, number: int) -> Occurrence | None:
        fields = self.held[number - self.first][1]
        return None if fields is None else Occurrence(ua.NodeId(ua.ObjectIds.Server), fields)


def times_of(kept: Kept) -> list[int]:
    return [kept.time_us(number) for number in range(kept.first, kept.end)]


def told(times: Sequence[int], severity: int = 500) -> Happened:
    """Events at these times, each with its time as its message."""
    kinds = ua.VariantType
    return Happened(
        [
            (
                at,
                {
                    "EventType": ua.Variant(ua.NodeId(ua.ObjectIds.BaseEventType), kinds.NodeId),
                    "Message": ua.Variant(ua.LocalizedText(str(at), "en"), kinds.LocalizedText),
                    "Severity": ua.Variant(severity, kinds.UInt16),
                },
            )
            for at in times
        ]
    )
