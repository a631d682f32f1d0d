"""P160…P167: the communication objects as NORD parameters (BU 2500 §7.1.2)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final

from bridge.sim.core.communication_settings import CobId, CommunicationSettings, PdoSettings, SdoSettings
from bridge.sim.core.dictionary import Dictionary, IntegerType, Number, variable
from bridge.sim.core.pdo_objects import PdoConfigurator, check_cob_id, check_length
from bridge.sim.core.store import Store
from bridge.sim.nord.nord_image import add_parameter
from bridge.sim.nord.nord_settings import DRIVES, PDO_WORDS

_RECEIVE: Final = 1
_SEND: Final = 2
_PDOS: Final = DRIVES + 1


class CanParameters:
    """Adds P160…P167. They have no values of their own."""

    def __init__(self, store: Store[CommunicationSettings], pdos: PdoConfigurator) -> None:
        self._store = store
        self._pdos = pdos

    def add_to(self, dictionary: Dictionary) -> None:
        numbers = range(_PDOS)
        both = [(number, receives) for number in numbers for receives in (False, True)]
        add_parameter(
            dictionary,
            160,
            [
                self._sync_switch(),
                *(self._sdo_switch(number) for number in range(DRIVES)),
                *(self._pdo_switch(number) for number in numbers),
            ],
        )
        add_parameter(
            dictionary,
            161,
            [
                self._setting("sync_cob_id", 0x7FF),
                *(self._sdo_cob_id(number, sends) for number in range(DRIVES) for sends in (True, False)),
                *(self._pdo_cob_id(number, receives) for number, receives in both),
            ],
        )
        add_parameter(dictionary, 162, [self._transmission_type(*one) for one in both])
        add_parameter(dictionary, 163, [self._time(number, "inhibit_100us") for number in numbers])
        add_parameter(dictionary, 164, [self._time(number, "event_timer_ms") for number in numbers])
        add_parameter(dictionary, 165, self._mapping())
        times = [self._setting(name, 32767) for name in ("guard_time_ms", "heartbeat_ms")]
        add_parameter(dictionary, 166, times)
        add_parameter(dictionary, 167, [self._setting("life_time_factor", 255)])

    # P160 and P161.

    def _sync_switch(self) -> Number:
        def write(value: int) -> None:
            self._store.current.sync_on = value != 0

        return _word(lambda: 3 if self._store.current.sync_on else 0, write, high=3)

    def _sdo_switch(self, number: int) -> Number:
        def read() -> int:
            return _SEND * self._sdo(number).send.enabled | _RECEIVE * self._sdo(number).receive.enabled

        def write(value: int) -> None:
            channel = self._sdo(number)
            channel.send.enabled, channel.receive.enabled = bool(value & _SEND), bool(value & _RECEIVE)

        return _word(read, write if number else None, high=3)  # P160 [-02] is read only

    def _pdo_switch(self, number: int) -> Number:
        def read() -> int:
            return _SEND * self._tpdo(number).enabled | _RECEIVE * self._rpdo(number).enabled

        def write(value: int) -> None:
            check_cob_id(self._rpdo(number).cob_id, bool(value & _RECEIVE))  # both halves or none
            self._pdos.set_enabled(self._tpdo(number), bool(value & _SEND))
            self._pdos.set_enabled(self._rpdo(number), bool(value & _RECEIVE))

        return _word(read, write, high=3)

    def _sdo_cob_id(self, number: int, sends: bool) -> Number:
        def half() -> CobId:
            return self._sdo(number).send if sends else self._sdo(number).receive

        entry = variable(IntegerType.UNSIGNED16, half, "cob_id", high=0x7FF)
        return entry if number else replace(entry, write=None)  # P161 [-02] and [-03] are read only

    def _pdo_cob_id(self, number: int, receives: bool) -> Number:
        return _word(
            lambda: self._pdos.pdo(number, receives=receives).cob_id,
            lambda value: self._pdos.set_cob_id(self._pdos.pdo(number, receives=receives), value),
            high=0x7FF,
        )

    # P162…P165.

    def _transmission_type(self, number: int, receives: bool) -> Number:
        def pdo() -> PdoSettings:
            return self._pdos.pdo(number, receives=receives)

        return _word(
            lambda: pdo().transmission_type,
            lambda value: self._pdos.set_transmission_type(pdo(), value),
            high=255,
        )

    def _mapping(self) -> list[Number]:
        # P165 calls the PDO with the control word "Tx": the master's view. By CiA 301 that is the drive's
        # RPDO (1600h). PDO 5 is labelled the other way round: §6.7.4 ties [-33] to 1A04h, [-34] to 1604h.
        entries = [
            self._mapping_entry(number, place, receives)
            for number in range(DRIVES)
            for receives in (True, False)
            for place in range(PDO_WORDS)
        ]
        return [*entries, self._mapping_entry(DRIVES, 0, False), self._mapping_entry(DRIVES, 0, True)]

    def _mapping_entry(self, number: int, place: int, receives: bool) -> Number:
        def write(word: int) -> None:
            # P165 has no count to be set to 0 first: only the entry changes, if that is allowed.
            self._pdos.require_pre_operational()
            self._pdos.check_mappable(word, receives=receives)
            pdo = self._pdos.pdo(number, receives=receives)
            entries = [*pdo.entries[:place], word, *pdo.entries[place + 1 :]]
            check_length(entries)
            pdo.entries = entries
            pdo.count = next((n for n, entry in enumerate(entries) if not entry), len(entries))

        return Number(
            IntegerType.UNSIGNED32, lambda: self._pdos.pdo(number, receives=receives).entries[place], write
        )

    def _setting(self, name: str, high: int) -> Number:
        return variable(IntegerType.UNSIGNED16, lambda: self._store.current, name, high=high)

    def _time(self, number: int, name: str) -> Number:
        return variable(IntegerType.UNSIGNED16, lambda: self._tpdo(number), name, high=32767)

    def _sdo(self, number: int) -> SdoSettings:
        return self._store.current.sdo[number]

    def _tpdo(self, number: int) -> PdoSettings:
        return self._pdos.pdo(number, receives=False)

    def _rpdo(self, number: int) -> PdoSettings:
        return self._pdos.pdo(number, receives=True)


def _word(read: Callable[[], int], write: Callable[[int], None] | None, *, high: int) -> Number:
    return Number(IntegerType.UNSIGNED16, read, write, low=0, high=high)
