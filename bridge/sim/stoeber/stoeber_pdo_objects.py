"""14xxh…1Axxh of CAN 5000: COB-IDs by function code, six places to a mapping (ID 441684.06 §7.3, §8.1)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from bridge.sim.core.communication_settings import (
    COB_ID_MASK,
    RPDO_BASES,
    TPDO_BASES,
    CommunicationSettings,
    PdoSettings,
)
from bridge.sim.core.dictionary import Dictionary, IntegerType, Number, constant
from bridge.sim.core.pdo_objects import PdoConfigurator, check_length
from bridge.sim.core.pdo_timing import CYCLIC_MAX
from bridge.sim.core.sdo_abort import AbortCode, SdoAbort
from bridge.sim.core.store import Store
from bridge.sim.stoeber.stoeber_settings import ANSWERED, MAP_ENTRIES, RULES

_FIRST_OBJECT: Final = 0x1000


def resolved(cob_id: int, function_code: int, node_id: int) -> int:
    """§7.3: the bare function code of this object means that the drive adds its address."""
    return cob_id + node_id if cob_id == function_code else cob_id


class StoeberPdoObjects(PdoConfigurator):
    """PDO objects where CAN 5000 differs from CiA 301."""

    def __init__(
        self,
        node_id: int,
        dictionary: Dictionary,
        store: Store[CommunicationSettings],
        in_pre_operational: Callable[[], bool],
    ) -> None:
        super().__init__(dictionary, store, RULES, in_pre_operational)
        self._node_id = node_id

    def set_cob_id_object(self, pdo: PdoSettings, value: int) -> None:
        current = self._store.current
        receives = next((n for n, one in enumerate(current.rpdo) if one is pdo), None)
        if receives is not None:
            base = RPDO_BASES[receives]
        else:
            base = TPDO_BASES[next(n for n, one in enumerate(current.tpdo) if one is pdo)]
        cob_id = resolved(value & COB_ID_MASK, base, self._node_id)
        super().set_cob_id_object(pdo, value & ~COB_ID_MASK | cob_id)

    def set_transmission_type(self, pdo: PdoSettings, value: int) -> None:
        if value > CYCLIC_MAX and value != ANSWERED:
            raise SdoAbort(AbortCode.VALUE_RANGE)  # §8.1.2: 241…253 and 255 are not to be set
        pdo.transmission_type = value

    def set_entry(self, pdo: PdoSettings, place: int, word: int, *, receives: bool) -> None:
        """The length may be 0; the drive then fills in that of the object (§8.1.1)."""
        self.require_pre_operational()
        if 0 < word >> 16 < _FIRST_OBJECT:  # no dummy entries: the manual has none
            raise SdoAbort(AbortCode.NOT_MAPPABLE)
        if word and not word & 0xFF:
            word |= self._bits(word)
        self.check_mappable(word, receives=receives)
        entries = [*pdo.entries[:place], word, *pdo.entries[place + 1 :]]
        check_length(entries)
        pdo.entries = entries
        pdo.count = sum(1 for entry in entries if entry)

    def _bits(self, word: int) -> int:
        try:
            return 8 * self._dictionary.find(word >> 16, word >> 8 & 0xFF).max_size & 0xFF
        except SdoAbort:
            raise SdoAbort(AbortCode.NOT_MAPPABLE) from None

    def _add_mapping(self, index: int, pdo: Callable[[], PdoSettings], *, receives: bool) -> None:
        def entry(place: int) -> Number:
            return Number(
                IntegerType.UNSIGNED32,
                lambda: pdo().entries[place],
                lambda word: self.set_entry(pdo(), place, word, receives=receives),
            )

        # §11.1: sub-index 0 is read only; unused places read 0.
        self._dictionary.add(index, 0, constant(IntegerType.UNSIGNED8, MAP_ENTRIES))
        for place in range(MAP_ENTRIES):
            self._dictionary.add(index, place + 1, entry(place))
