"""When a PDO is sent and when a received one takes effect (BU 2500 §6.5.6, CiA 301 §7.5.2.37)."""

from __future__ import annotations

from typing import Final

from bridge.sim.abort import SdoAbort
from bridge.sim.dictionary import Dictionary, Number
from bridge.sim.settings import PdoSettings

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

    def is_due(self, settings: PdoSettings, payload: bytes, now: float) -> bool:
        """Whether an event-driven PDO is to be sent now: changed or event timer out, and not inhibited."""
        self._waiting = payload != self._last
        if self._sent_at is None:
            return True
        if now < self._inhibited_until(settings, self._sent_at):
            return False
        return self._waiting or now >= self._event_at(settings, self._sent_at)

    def sent(self, payload: bytes, now: float) -> None:
        self._last = payload
        self._sent_at = now
        self._waiting = False

    def next_deadline(self, settings: PdoSettings) -> float | None:
        """When an event-driven PDO is due if nothing changes until then."""
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


def pack(dictionary: Dictionary, settings: PdoSettings) -> bytes:
    """The data of a TPDO at this moment."""
    parts: list[bytes] = []
    for word in settings.mapping:
        entry = dictionary.find(word >> 16, word >> 8 & 0xFF)
        parts.append(entry.upload())
    return b"".join(parts)


def unpack(dictionary: Dictionary, settings: PdoSettings, data: bytes) -> int:
    """Write the mapped objects from an RPDO. Returns how many values the objects refused."""
    refused = offset = 0
    for word in settings.mapping:
        size = (word & 0xFF) // 8
        part = data[offset : offset + size]
        offset += size
        if word >> 16 < 0x20:
            continue  # dummy entry (CiA 301 §7.4.7): fills a gap
        try:
            entry = dictionary.find(word >> 16, word >> 8 & 0xFF)
            if isinstance(entry, Number):
                entry.download(part)
        except SdoAbort:
            refused += 1
    return refused
