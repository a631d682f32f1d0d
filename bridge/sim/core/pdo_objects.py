"""Objects 14xxh, 16xxh, 18xxh, 1Axxh and the rules for changing them (BU 2500 §6.5.5 to §6.5.8, §6.7.4)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from bridge.sim.core.communication_settings import (
    COB_ID_MASK,
    DISABLED,
    CommunicationSettings,
    PdoSettings,
    SlaveRules,
)
from bridge.sim.core.dictionary import DUMMY_BITS, Dictionary, IntegerType, Number, constant, variable
from bridge.sim.core.pdo_timing import CYCLIC_MAX, EVENT_MIN
from bridge.sim.core.sdo_abort import AbortCode, SdoAbort
from bridge.sim.core.store import Store

_UNCHANGEABLE: Final = 0x3FFF_F800
"""Bits 29…11 of a COB-ID object: only 0 (BU 2500 §6.5.5)."""
_RESTRICTED: Final = (
    range(0x080),
    range(0x101, 0x181),
    range(0x581, 0x600),
    range(0x601, 0x680),
    range(0x6E0, 0x800),
)
"""Identifiers no PDO may have (CiA 301 §7.3.5); NORD's own ones all lie outside."""
_PDO_BITS_MAX: Final = 64


def check_length(entries: list[int]) -> None:
    """Abort if these mapping words are more than eight bytes."""
    if sum(entry & 0xFF for entry in entries) > _PDO_BITS_MAX:
        raise SdoAbort(AbortCode.PDO_TOO_LONG)


def check_cob_id(cob_id: int, enabled: bool) -> None:
    """Abort if an enabled PDO may not have this identifier."""
    if enabled and any(cob_id in restricted for restricted in _RESTRICTED):
        raise SdoAbort(AbortCode.VALUE_RANGE)


class PdoConfigurator:
    """Changes PDO settings by the rules, for 14xxh…1Axxh and any equivalent parameter."""

    def __init__(
        self,
        dictionary: Dictionary,
        store: Store[CommunicationSettings],
        rules: SlaveRules,
        in_pre_operational: Callable[[], bool],
    ) -> None:
        self._dictionary = dictionary
        self._store = store
        self._rules = rules
        self._in_pre_operational = in_pre_operational

    def add(self) -> None:
        """Put the objects of every PDO into the dictionary."""
        for number in range(len(self._store.current.rpdo)):
            self._add_one(number, receives=True)
        for number in range(len(self._store.current.tpdo)):
            self._add_one(number, receives=False)

    def pdo(self, number: int, *, receives: bool) -> PdoSettings:
        """Settings of PDO ``number`` (from 0), as they are now."""
        settings = self._store.current
        return (settings.rpdo if receives else settings.tpdo)[number]

    def require_pre_operational(self) -> None:
        if not self._in_pre_operational():
            raise SdoAbort(self._rules.wrong_state)

    def cob_id_object(self, pdo: PdoSettings) -> int:
        return pdo.word | self._rules.cob_id_fixed_bits

    def set_cob_id_object(self, pdo: PdoSettings, value: int) -> None:
        self.require_pre_operational()
        if value & _UNCHANGEABLE:
            raise SdoAbort(AbortCode.VALUE_RANGE)
        cob_id, enabled = value & COB_ID_MASK, not value & DISABLED
        moves = cob_id != pdo.cob_id
        if self._rules.cob_id_change_needs_disabled and pdo.enabled and enabled and moves:
            raise SdoAbort(AbortCode.VALUE_RANGE)
        self._set_cob_id(pdo, cob_id, enabled)

    def set_cob_id(self, pdo: PdoSettings, cob_id: int) -> None:
        """Set another COB-ID, also while the PDO is on."""
        self.require_pre_operational()
        self._set_cob_id(pdo, cob_id, pdo.enabled)

    def set_enabled(self, pdo: PdoSettings, enabled: bool) -> None:
        self.require_pre_operational()
        self._set_cob_id(pdo, pdo.cob_id, enabled)

    def set_transmission_type(self, pdo: PdoSettings, value: int) -> None:
        # BU 2500 §6.5.6 reserves 252 and 253 (RTR), CiA 301 those below.
        if CYCLIC_MAX < value < EVENT_MIN:
            raise SdoAbort(AbortCode.VALUE_RANGE)
        pdo.transmission_type = value

    def set_count(self, pdo: PdoSettings, count: int) -> None:
        """Sub 0 of a mapping object: 0 disables the mapping, n enables its first n entries."""
        self._require_mapping_open(pdo)
        if count > len(pdo.entries):
            raise SdoAbort(AbortCode.VALUE_RANGE)
        entries = pdo.entries[:count]
        if not all(entries):
            raise SdoAbort(AbortCode.NOT_MAPPABLE)
        check_length(entries)
        pdo.count = count

    def set_entry(self, pdo: PdoSettings, place: int, word: int, *, receives: bool) -> None:
        """Sub ``place`` + 1 of a mapping object, only while sub 0 is 0."""
        self._require_mapping_open(pdo)
        if pdo.count:
            raise SdoAbort(AbortCode.UNSUPPORTED_ACCESS)
        self.check_mappable(word, receives=receives)
        pdo.entries[place] = word

    def check_mappable(self, word: int, *, receives: bool) -> None:
        """Abort unless the object exists, has this length and can be mapped in this direction. 0 means an
        empty place."""
        index, sub, bits = word >> 16, word >> 8 & 0xFF, word & 0xFF
        if word == 0 or (receives and sub == 0 and DUMMY_BITS.get(index) == bits):
            return
        try:
            entry = self._dictionary.find(index, sub)
        except SdoAbort:
            raise SdoAbort(AbortCode.NOT_MAPPABLE) from None
        allowed = entry.in_rpdo if receives else entry.in_tpdo
        if not allowed or entry.max_size * 8 != bits:
            raise SdoAbort(AbortCode.NOT_MAPPABLE)

    def _require_mapping_open(self, pdo: PdoSettings) -> None:
        self.require_pre_operational()
        if self._rules.remap_needs_disabled and pdo.enabled:
            raise SdoAbort(AbortCode.UNSUPPORTED_ACCESS)

    @staticmethod
    def _set_cob_id(pdo: PdoSettings, cob_id: int, enabled: bool) -> None:
        check_cob_id(cob_id, enabled)
        pdo.cob_id, pdo.enabled = cob_id, enabled

    def _add_one(self, number: int, *, receives: bool) -> None:
        def pdo() -> PdoSettings:
            return self.pdo(number, receives=receives)

        add = self._dictionary.add
        index = (0x1400 if receives else 0x1800) + number
        # An RPDO has no inhibit time and no event timer (BU 2500 §6.7.4: "not used").
        add(index, 0, constant(IntegerType.UNSIGNED8, 2 if receives else 5))
        add(
            index,
            1,
            Number(
                IntegerType.UNSIGNED32,
                lambda: self.cob_id_object(pdo()),
                lambda value: self.set_cob_id_object(pdo(), value),
            ),
        )
        add(
            index,
            2,
            Number(
                IntegerType.UNSIGNED8,
                lambda: pdo().transmission_type,
                lambda value: self.set_transmission_type(pdo(), value),
            ),
        )
        if not receives:
            add(index, 3, variable(IntegerType.UNSIGNED16, pdo, "inhibit_100us"))
            add(index, 5, variable(IntegerType.UNSIGNED16, pdo, "event_timer_ms"))
        self._add_mapping((0x1600 if receives else 0x1A00) + number, pdo, receives=receives)

    def _add_mapping(self, index: int, pdo: Callable[[], PdoSettings], *, receives: bool) -> None:
        def entry(place: int) -> Number:
            return Number(
                IntegerType.UNSIGNED32,
                lambda: pdo().entries[place],
                lambda word: self.set_entry(pdo(), place, word, receives=receives),
            )

        self._dictionary.add(
            index,
            0,
            Number(IntegerType.UNSIGNED8, lambda: pdo().count, lambda count: self.set_count(pdo(), count)),
        )
        for place in range(len(pdo().entries)):
            self._dictionary.add(index, place + 1, entry(place))
