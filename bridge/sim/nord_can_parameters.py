"""P160…P167: the communication objects as NORD parameters (BU 2500 §7.1.2)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from bridge.sim.abort import AbortCode, SdoAbort
from bridge.sim.dictionary import DataType, Dictionary, Number
from bridge.sim.nord_image import add_parameter
from bridge.sim.nord_settings import DRIVES, PDO_WORDS
from bridge.sim.pdo_objects import PdoObjects, check_cob_id, check_length
from bridge.sim.settings import CommunicationSettings, PdoSettings, SdoSettings
from bridge.sim.store import Store

_RECEIVE: Final = 1
_SEND: Final = 2
_PDOS: Final = DRIVES + 1


class CanParameters:
    """Adds P160…P167. They have no values of their own."""

    def __init__(self, store: Store[CommunicationSettings], pdos: PdoObjects) -> None:
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
                self._sync_cob_id(),
                *(self._sdo_cob_id(number, sends) for number in range(DRIVES) for sends in (True, False)),
                *(self._pdo_cob_id(number, receives) for number, receives in both),
            ],
        )
        add_parameter(dictionary, 162, [self._transmission_type(*one) for one in both])
        add_parameter(dictionary, 163, [self._inhibit(number) for number in numbers])
        add_parameter(dictionary, 164, [self._event_timer(number) for number in numbers])
        add_parameter(dictionary, 165, self._mapping())
        add_parameter(dictionary, 166, [self._guard_time(), self._heartbeat()])
        add_parameter(dictionary, 167, [self._life_time_factor()])

    # P160 and P161.

    def _sync_switch(self) -> Number:
        def write(value: int) -> None:
            self._store.current.sync_on = value != 0

        return _word(lambda: 3 if self._store.current.sync_on else 0, write, high=3)

    def _sdo_switch(self, number: int) -> Number:
        def read() -> int:
            return _SEND * self._sdo(number).send_on | _RECEIVE * self._sdo(number).receive_on

        def write(value: int) -> None:
            if number == 0:
                raise SdoAbort(AbortCode.READ_ONLY)  # P160 [-02] is read only
            channel = self._sdo(number)
            channel.send_on, channel.receive_on = bool(value & _SEND), bool(value & _RECEIVE)

        return _word(read, write, high=3)

    def _pdo_switch(self, number: int) -> Number:
        def read() -> int:
            return _SEND * self._tpdo(number).enabled | _RECEIVE * self._rpdo(number).enabled

        def write(value: int) -> None:
            check_cob_id(self._rpdo(number).cob_id, bool(value & _RECEIVE))  # both halves or none
            self._pdos.set_enabled(self._tpdo(number), bool(value & _SEND))
            self._pdos.set_enabled(self._rpdo(number), bool(value & _RECEIVE))

        return _word(read, write, high=3)

    def _sync_cob_id(self) -> Number:
        def write(value: int) -> None:
            self._store.current.sync_cob_id = value

        return _word(lambda: self._store.current.sync_cob_id, write, high=0x7FF)

    def _sdo_cob_id(self, number: int, sends: bool) -> Number:
        def read() -> int:
            channel = self._sdo(number)
            return channel.send_cob_id if sends else channel.receive_cob_id

        def write(value: int) -> None:
            if number == 0:
                raise SdoAbort(AbortCode.READ_ONLY)  # P161 [-02] and [-03] are read only
            if sends:
                self._sdo(number).send_cob_id = value
            else:
                self._sdo(number).receive_cob_id = value

        return _word(read, write, high=0x7FF)

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

    def _inhibit(self, number: int) -> Number:
        def write(value: int) -> None:
            self._tpdo(number).inhibit_100us = value

        return _word(lambda: self._tpdo(number).inhibit_100us, write, high=32767)

    def _event_timer(self, number: int) -> Number:
        def write(value: int) -> None:
            self._tpdo(number).event_timer_ms = value

        return _word(lambda: self._tpdo(number).event_timer_ms, write, high=32767)

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
            DataType.UNSIGNED32, lambda: self._pdos.pdo(number, receives=receives).entries[place], write
        )

    # P166 and P167.

    def _guard_time(self) -> Number:
        def write(value: int) -> None:
            self._store.current.guard_time_ms = value

        return _word(lambda: self._store.current.guard_time_ms, write, high=32767)

    def _heartbeat(self) -> Number:
        def write(value: int) -> None:
            self._store.current.heartbeat_ms = value

        return _word(lambda: self._store.current.heartbeat_ms, write, high=32767)

    def _life_time_factor(self) -> Number:
        def write(value: int) -> None:
            self._store.current.life_time_factor = value

        return _word(lambda: self._store.current.life_time_factor, write, high=255)

    def _sdo(self, number: int) -> SdoSettings:
        return self._store.current.sdo[number]

    def _tpdo(self, number: int) -> PdoSettings:
        return self._pdos.pdo(number, receives=False)

    def _rpdo(self, number: int) -> PdoSettings:
        return self._pdos.pdo(number, receives=True)


def _word(read: Callable[[], int], write: Callable[[int], None], *, high: int) -> Number:
    return Number(DataType.UNSIGNED16, read, write, low=0, high=high)
