"""Objects 1000h…1A01h of an 8400 motec (EDS84DMOTCAN 3.0, §13).

Each of them is also a code and survives an NMT reset: a write changes both the running CAN stack and the
codes from which that is initialised.
"""

from __future__ import annotations

from typing import Final

from bridge.sim.core.communication_objects import add_errors
from bridge.sim.core.communication_settings import (
    COB_ID_MASK,
    DISABLED,
    CobId,
    CommunicationSettings,
    PdoSettings,
    SdoSettings,
)
from bridge.sim.core.dictionary import Cell, Dictionary, IntegerType, Number, constant
from bridge.sim.core.emcy_producer import EmcyProducer
from bridge.sim.core.pdo_objects import PdoConfigurator
from bridge.sim.core.sdo_abort import AbortCode, SdoAbort
from bridge.sim.core.store import Store
from bridge.sim.lenze.lenze_settings import CYCLE_PLACES, PDOS, PORT_WORDS, RULES, LenzeCodes, heartbeat_step

VENDOR_ID: Final = 0x3B
_EXTENDED: Final = 0x3FFF_F800
"""Bits 29…11 of a COB-ID: only 0. The extended identifier is not supported."""
_PRODUCER: Final = 0x4000_0000
_NO_REMOTE: Final = 0x4000_0000
_PDO_IDS: Final = range(385, 1408)
"""§8.3."""
_CYCLE_STEP_US: Final = 1000
_INHIBIT_STEP: Final = 10
"""1800h:3 counts in 0.1 ms, and whole milliseconds are used (§13)."""
_EVENT: Final = 254
_CYCLIC_MAX: Final = 240

U8, U16, U32 = IntegerType.UNSIGNED8, IntegerType.UNSIGNED16, IntegerType.UNSIGNED32


class LenzeObjects:
    """Changes the CAN stack by the rules of §13, for the objects and the equivalent codes."""

    def __init__(self, codes: Store[LenzeCodes], stack: Store[CommunicationSettings]) -> None:
        self._codes = codes
        self._stack = stack
        # The manual requires no NMT state: an object may be changed whenever its PDO or SDO is off.
        self._rules = PdoConfigurator(Dictionary(), stack, RULES, lambda: True)

    def add_to(self, dictionary: Dictionary, emcy: EmcyProducer) -> None:
        dictionary.add(0x1000, 0, constant(U32, 0))
        add_errors(dictionary, emcy)
        # Product code, revision and serial number are not printed, and an invented one would be believed.
        dictionary.add_array(0x1018, [constant(U32, number) for number in (VENDOR_ID, 0, 0, 0)])
        self._add_protocols(dictionary)
        self._add_sdo_servers(dictionary)
        for number in range(PDOS):
            self._add_pdo(dictionary, number, receives=True)
            self._add_pdo(dictionary, number, receives=False)

    # What the objects and their codes do.

    def pdo(self, place: int) -> PdoSettings:
        """PDO by the place in C00354: RPDO1, TPDO1, RPDO2, TPDO2."""
        return self._rules.pdo(place // 2, receives=not place % 2)

    def set_pdo_cob_id(self, place: int, value: int) -> None:
        if value & _EXTENDED or value & COB_ID_MASK not in _PDO_IDS:
            raise SdoAbort(AbortCode.VALUE_RANGE)
        self._rules.set_cob_id_object(self.pdo(place), value)
        self._codes.current.cob_ids[place] = value & COB_ID_MASK
        self._codes.current.pdo_off[place] = value >> 31

    def set_pdo_off(self, place: int, off: int) -> None:
        self._rules.set_enabled(self.pdo(place), not off)
        self._codes.current.pdo_off[place] = off

    def set_transmission_type(self, place: int, value: int) -> None:
        # §8.4 and §12.2 contradict each other on 252, 253 and 255; §8.4 says "not allowed" of each.
        if _CYCLIC_MAX < value != _EVENT:
            raise SdoAbort(AbortCode.VALUE_RANGE)
        self._rules.set_transmission_type(self.pdo(place), value)
        types = self._codes.current.tx_types if place % 2 else self._codes.current.rx_types
        types[place // 2] = value

    def set_inhibit_ms(self, number: int, value_ms: int) -> None:
        """Set the inhibit time of a TPDO, only while it is off."""
        pdo = self.pdo(2 * number + 1)
        if pdo.enabled:
            raise SdoAbort(AbortCode.WRONG_STATE)
        pdo.inhibit_100us = _INHIBIT_STEP * value_ms
        self._codes.current.inhibit_ms[1 + number] = value_ms

    def set_cycle_ms(self, number: int, value_ms: int) -> None:
        self.pdo(2 * number + 1).event_timer_ms = value_ms
        self._codes.current.times_ms[CYCLE_PLACES[number]] = value_ms

    def set_emcy_inhibit_ms(self, value_ms: int) -> None:
        self._codes.current.inhibit_ms[0] = self._stack.current.emcy_inhibit = value_ms

    def set_heartbeat_ms(self, value_ms: int) -> None:
        self._codes.current.heartbeat_ms = value_ms
        self._stack.current.heartbeat_ms = heartbeat_step(value_ms)

    def set_sync_rx(self, cob_id: int) -> None:
        self._codes.current.sync_rx = self._stack.current.sync_cob_id = cob_id

    def use_both_sdo_channels(self, both: int) -> None:
        codes = self._codes.current
        codes.use_both_sdo_channels(bool(both))
        for place in range(2):
            self._show_sdo(place, codes.sdo_cob_ids[place])

    # The objects.

    def _add_protocols(self, dictionary: Dictionary) -> None:
        codes = self._codes

        def sync() -> int:
            return codes.current.sync_rx | (_PRODUCER if codes.current.sync_producer else 0)

        def set_sync(value: int) -> None:
            cob_id, produces = value & COB_ID_MASK, bool(value & _PRODUCER)
            moves = cob_id != codes.current.sync_rx
            if value & _EXTENDED or (moves and codes.current.sync_producer and produces):
                raise SdoAbort(AbortCode.VALUE_RANGE)
            codes.current.sync_producer, codes.current.sync_tx = produces, cob_id
            self.set_sync_rx(cob_id)

        def set_cycle(value_us: int) -> None:
            if value_us % _CYCLE_STEP_US:
                raise SdoAbort(AbortCode.VALUE_RANGE)
            codes.current.sync_ms = value_us // _CYCLE_STEP_US

        def set_emcy(value: int) -> None:
            have = codes.current.emcy_cob_id
            moves = (value ^ have) & COB_ID_MASK
            if value & (_EXTENDED | _PRODUCER) or (moves and not (value | have) & DISABLED):
                raise SdoAbort(AbortCode.VALUE_RANGE)
            codes.current.emcy_cob_id = value
            self._stack.current.emcy = CobId.of(value)

        def watched() -> int:
            return codes.current.watched_node << 16 | codes.current.watched_ms

        def set_watched(value: int) -> None:
            if value >> 16 > 127:
                raise SdoAbort(AbortCode.VALUE_RANGE)
            codes.current.watched_node, codes.current.watched_ms = value >> 16, value & 0xFFFF

        dictionary.add(0x1005, 0, Number(U32, sync, set_sync))
        cycle = Number(U32, lambda: _CYCLE_STEP_US * codes.current.sync_ms, set_cycle, 0, 65_535_000)
        dictionary.add(0x1006, 0, cycle)
        dictionary.add(0x1014, 0, Number(U32, lambda: codes.current.emcy_cob_id, set_emcy))
        # Printed as U16, but laid out as 00 NN TTTT (§13, figure 13-4).
        dictionary.add_array(0x1016, [Number(U32, watched, set_watched)])
        dictionary.add(0x1017, 0, Number(U16, lambda: codes.current.heartbeat_ms, self.set_heartbeat_ms))

    def _add_sdo_servers(self, dictionary: Dictionary) -> None:
        def first() -> SdoSettings:
            return self._stack.current.sdo[0]

        def second(place: int) -> Number:
            def set_cob_id(value: int) -> None:
                have = self._codes.current.sdo_cob_ids[place]
                moves = (value ^ have) & COB_ID_MASK
                if value & (_EXTENDED | 0x4000_0000) or (moves and not have & DISABLED):
                    raise SdoAbort(AbortCode.VALUE_RANGE)
                self._codes.current.sdo_cob_ids[place] = value
                self._show_sdo(place, value)

            return Number(U32, lambda: self._codes.current.sdo_cob_ids[place], set_cob_id)

        dictionary.add_array(
            0x1200,
            [
                Number(U32, lambda: first().receive.cob_id),
                Number(U32, lambda: first().send.cob_id),
            ],
        )
        # Sub-index 0 is printed as 3, with two sub-indices described (§13): it counts those that there are.
        dictionary.add_array(0x1201, [second(0), second(1)])

    def _show_sdo(self, place: int, cob_id: int) -> None:
        channel = self._stack.current.sdo[1]
        (channel.send if place else channel.receive).word = cob_id

    def _add_pdo(self, dictionary: Dictionary, number: int, *, receives: bool) -> None:
        place = 2 * number + (not receives)
        # Bit 30 is fixed: no remote frame for an RPDO, and for a TPDO one is allowed (§13, I-1400, I-1800).
        fixed = _NO_REMOTE if receives else 0

        def cob_id() -> int:
            return self.pdo(place).word | fixed

        def kind() -> int:
            return self.pdo(place).transmission_type

        def set_inhibit(value: int) -> None:
            self.set_inhibit_ms(number, value // _INHIBIT_STEP)

        index = (0x1400 if receives else 0x1800) + number
        dictionary.add(index, 0, constant(U8, 5))
        dictionary.add(index, 1, Number(U32, cob_id, lambda value: self.set_pdo_cob_id(place, value)))
        dictionary.add(index, 2, Number(U8, kind, lambda value: self.set_transmission_type(place, value)))
        if receives:  # "not used with RPDOs", though they can be written
            for sub in (3, 5):
                cell = Cell()
                dictionary.add(index, sub, Number(U16, cell.get, cell.set))
        else:
            dictionary.add(index, 3, Number(U16, lambda: self.pdo(place).inhibit_100us, set_inhibit))
            cycle = Number(
                U16, lambda: self.pdo(place).event_timer_ms, lambda value: self.set_cycle_ms(number, value)
            )
            dictionary.add(index, 5, cycle)
        self._add_mapping(dictionary, (0x1600 if receives else 0x1A00) + number)

    @staticmethod
    def _add_mapping(dictionary: Dictionary, index: int) -> None:
        """The mapping is static and has no visible entries: the manual names no object that could be
        mapped."""

        def refuse(value: int) -> None:
            if value:
                raise SdoAbort(AbortCode.NOT_MAPPABLE)

        dictionary.add(index, 0, Number(U8, lambda: 0, refuse, 0, 8))
        for sub in range(1, PORT_WORDS + 1):
            dictionary.add(index, sub, Number(U32, lambda: 0, refuse))
