"""Times at which a PDO is sent and at which a received one takes effect (BU 2500 §6.5.6, CiA 301
§7.5.2.37)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

from bridge.sim.core.communication_settings import PdoSettings
from bridge.sim.core.dictionary import Dictionary, Entry, Number
from bridge.sim.core.sdo_abort import SdoAbort

CYCLIC_MAX: Final = 240
EVENT_MIN: Final = 254


class Tpdo:
    """Transmission of one TPDO while the node is operational."""

    def __init__(self) -> None:
        self._last: bytes | None = None
        self._sent_at: float | None = None
        self._syncs = 0
        self._waiting = False

    def start(self) -> None:
        """The node has become operational: the PDO's data count as changed."""
        self._last = None
        self._sent_at = None
        self._syncs = 0
        self._waiting = False

    def on_sync(self, settings: PdoSettings, payload: bytes) -> bool:
        """Whether this SYNC sends the PDO: type 0 if its data has changed, n every n-th time."""
        if settings.transmission_type == 0:
            return payload != self._last
        self._syncs += 1
        if self._syncs < settings.transmission_type:
            return False
        self._syncs = 0
        return True

    def due(self, settings: PdoSettings, sample: Callable[[], bytes], now: float) -> bytes | None:
        """The data if an event-driven PDO is to be sent now: changed or timer out, and not inhibited."""
        if settings.transmission_type < EVENT_MIN:
            return None
        payload = sample()
        self._waiting = payload != self._last
        if self._sent_at is None:
            return payload
        if now < self._inhibited_until(settings, self._sent_at):
            return None
        return payload if self._waiting or now >= self._event_at(settings, self._sent_at) else None

    def sent(self, payload: bytes, now: float) -> None:
        self._last = payload
        self._sent_at = now
        self._waiting = False

    def next_deadline(self, settings: PdoSettings) -> float | None:
        """Time at which an event-driven PDO is due if nothing changes until then."""
        if settings.transmission_type < EVENT_MIN or self._sent_at is None:
            return None
        free_at = self._inhibited_until(settings, self._sent_at)
        if self._waiting:
            return free_at
        if not settings.event_timer_ms:
            return None
        return max(free_at, self._event_at(settings, self._sent_at))

    @staticmethod
    def _inhibited_until(settings: PdoSettings, sent_at: float) -> float:
        return sent_at + settings.inhibit_100us / 10_000

    @staticmethod
    def _event_at(settings: PdoSettings, sent_at: float) -> float:
        return sent_at + settings.event_timer_ms / 1000 if settings.event_timer_ms else float("inf")


class Rpdo:
    """Reception of one RPDO: at once, or kept for the next SYNC."""

    def __init__(self) -> None:
        self._latched: bytes | None = None

    def reset(self) -> None:
        self._latched = None

    def on_data(self, settings: PdoSettings, data: bytes) -> bytes | None:
        """The data if it takes effect at once (254, 255); types 0…240 wait for the next SYNC."""
        if settings.transmission_type >= EVENT_MIN:
            return data
        self._latched = data
        return None

    def on_sync(self) -> bytes | None:
        data, self._latched = self._latched, None
        return data


@dataclass(frozen=True, slots=True)
class ActiveTpdo:
    """A TPDO that is on, with the objects that it carries."""

    tpdo: Tpdo
    settings: PdoSettings
    entries: tuple[Entry, ...]

    def payload(self) -> bytes:
        """Data of the PDO at this moment."""
        return b"".join([entry.upload() for entry in self.entries])


@dataclass(frozen=True, slots=True)
class ValuePlace:
    """Place of an object's value in an RPDO: bytes ``start`` … ``end``. The object may be missing."""

    start: int
    end: int
    entry: Entry | None


@dataclass(frozen=True, slots=True)
class MappedRpdo:
    """An RPDO, numbered from 0, with the objects that it writes."""

    number: int
    settings: PdoSettings
    mapped_bits: int
    places: tuple[ValuePlace, ...]


def entries_of(dictionary: Dictionary, settings: PdoSettings) -> tuple[Entry, ...]:
    """The objects that a TPDO carries. Raises ``SdoAbort`` for one that does not exist."""
    return tuple(dictionary.find(word >> 16, word >> 8 & 0xFF) for word in settings.mapping)


def places_of(dictionary: Dictionary, settings: PdoSettings) -> tuple[ValuePlace, ...]:
    """The objects that an RPDO writes."""
    places: list[ValuePlace] = []
    start = 0
    for word in settings.mapping:
        end = start + (word & 0xFF) // 8
        if word >> 16 >= 0x20:  # below are dummy entries, which fill a gap (CiA 301 §7.4.7)
            places.append(ValuePlace(start, end, _found(dictionary, word)))
        start = end
    return tuple(places)


def _found(dictionary: Dictionary, word: int) -> Entry | None:
    try:
        return dictionary.find(word >> 16, word >> 8 & 0xFF)
    except SdoAbort:
        return None


def unpack(places: Sequence[ValuePlace], data: bytes) -> int:
    """Write the objects from an RPDO. Returns how many values were refused."""
    refused = 0
    for place in places:
        try:
            if isinstance(place.entry, Number):
                place.entry.download(data[place.start : place.end])
            else:
                refused += place.entry is None
        except SdoAbort:
            refused += 1
    return refused
