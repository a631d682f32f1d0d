"""Communication objects of CAN 5000 and their STÖBER coordinates (ID 441684.06 §11.1)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from bridge.sim.core.communication_objects import (
    SAVE,
    DeviceIdentity,
    add_identity,
    add_protocols,
    add_sdo_servers,
    by_signature,
)
from bridge.sim.core.communication_settings import COB_ID_MASK, DISABLED, CobId, CommunicationSettings
from bridge.sim.core.dictionary import (
    Dictionary,
    IntegerType,
    Number,
    VisibleString,
    constant,
    item,
    variable,
)
from bridge.sim.core.store import Store
from bridge.sim.stoeber.stoeber_pdo_objects import StoeberPdoObjects, resolved
from bridge.sim.stoeber.stoeber_settings import CHANNELS, MAP_ENTRIES, SDO_BASES, StoeberSettings, coordinate

_SYNC_MOST_US: Final = 32_000_000
_SYNC_MOST: Final = 0x7FF


def identity(rated_power_kw: float, name: str) -> DeviceIdentity:
    """§11.1: the product code is the rated power in 0.1 kW."""
    return DeviceIdentity(
        device_type=0x0002_0192,
        vendor_id=0xB9,
        product_code=round(rated_power_kw * 10),
        revision=1,
        serial=8_000_000,
        device_name=name,
        hardware_version="SIM",
        software_version="V 5.6-H",
    )


def alias(dictionary: Dictionary, name: str, index: int, subs: tuple[int, ...] = (0,)) -> None:
    """Show sub-indices of a communication object as the elements of a parameter, from 0."""
    for element, sub in enumerate(subs):
        dictionary.add(coordinate(name), element, dictionary.find(index, sub))


class CommunicationObjects:
    """Fills the dictionary with 1000h…1A03h, A00, A83 and A200…A244."""

    def __init__(
        self,
        node_id: int,
        communication: Store[CommunicationSettings],
        settings: Store[StoeberSettings],
        pdos: StoeberPdoObjects,
        *,
        bit_31_opens: bool,
    ) -> None:
        self._node_id = node_id
        self._communication = communication
        self._settings = settings
        self._pdos = pdos
        self._bit_31_opens = bit_31_opens
        self.saves = 0

    def add_to(
        self,
        dictionary: Dictionary,
        who: DeviceIdentity,
        register: Callable[[], int],
        state: Callable[[], int],
    ) -> None:
        """``register`` is 1001h, ``state`` 1002h."""
        add_identity(dictionary, who, state)
        dictionary.add(0x1001, 0, Number(IntegerType.UNSIGNED8, register))
        dictionary.add(0x100B, 0, constant(IntegerType.UNSIGNED32, self._node_id))
        add_protocols(dictionary, self._communication)
        self._add_ranges(dictionary)
        self._add_memory(dictionary)
        self._add_configuration(dictionary)
        add_sdo_servers(dictionary, self._communication)
        for number in range(1, CHANNELS):
            self._add_sdo_server(dictionary, number)
        self._pdos.add()
        self._add_coordinates(dictionary)
        named = {"E50": who.device_name, "E51": who.software_version, "E149": who.hardware_version}
        for name, text in named.items():
            dictionary.add(coordinate(name), 0, VisibleString(text))
        dictionary.add(coordinate("E52"), 0, constant(IntegerType.UNSIGNED32, who.serial))

    def _save(self) -> None:
        self._communication.save()
        self._settings.save()
        self.saves += 1

    def _add_ranges(self, dictionary: Dictionary) -> None:
        """Add the ranges of §11.1 that are narrower than CiA 301: SYNC 1…2047, 1015h as U32, 1006h."""
        communication, u32 = self._communication, IntegerType.UNSIGNED32

        def set_emcy(value: int) -> None:
            cob_id = resolved(value & COB_ID_MASK, 0x80, self._node_id)
            communication.current.emcy = CobId(cob_id, not value & DISABLED and self._node_id != 0)

        sync = variable(u32, lambda: communication.current, "sync_cob_id", 1, _SYNC_MOST)
        dictionary.add(0x1005, 0, sync)
        timeout = variable(u32, lambda: self._settings.current, "sync_timeout_us", 0, _SYNC_MOST_US)
        dictionary.add(0x1006, 0, timeout)
        dictionary.add(0x1014, 0, Number(u32, lambda: communication.current.emcy.word, set_emcy))
        dictionary.add(0x1015, 0, variable(u32, lambda: communication.current, "emcy_inhibit"))

    def _add_memory(self, dictionary: Dictionary) -> None:
        """1010h and the action A00: start, progress, result."""

        def by_action(value: int) -> None:
            if value:
                self._save()

        dictionary.add_array(0x1010, [by_signature(SAVE, self._save)])
        dictionary.add(
            coordinate("A00"), 0, Number(IntegerType.UNSIGNED8, lambda: 0, by_action, low=0, high=1)
        )
        progress = Number(IntegerType.UNSIGNED8, lambda: 100 if self.saves else 0)
        dictionary.add(coordinate("A00"), 1, progress)
        dictionary.add(coordinate("A00"), 2, constant(IntegerType.UNSIGNED8, 0))

    def _add_configuration(self, dictionary: Dictionary) -> None:
        names = ("configuration_date", "configuration_time")
        numbers = [variable(IntegerType.UNSIGNED32, lambda: self._settings.current, name) for name in names]
        dictionary.add_array(0x1020, numbers)

    def _add_sdo_server(self, dictionary: Dictionary, number: int) -> None:
        """Bit 31 closes a channel, as in CiA 301. The example of §7.3.2 opens one with bit 31 set: that is
        ``bit_31_opens``."""

        flip = DISABLED if self._bit_31_opens else 0

        def half(name: str, function_code: int) -> Number:
            def cob_id() -> CobId:
                found: CobId = getattr(self._communication.current.sdo[number], name)
                return found

            def write(value: int) -> None:
                cob_id().word = value ^ flip
                cob_id().cob_id = resolved(cob_id().cob_id, function_code, self._node_id)

            return Number(IntegerType.UNSIGNED32, lambda: cob_id().word ^ flip, write)

        receive, send = SDO_BASES[number]
        client = item(IntegerType.UNSIGNED32, lambda: self._settings.current.sdo_client, number)
        dictionary.add_array(0x1200 + number, [half("receive", receive), half("send", send), client])

    def _add_coordinates(self, dictionary: Dictionary) -> None:
        """The same objects by the names POSITool has for them."""
        single = {"A200": 0x1005, "A201": 0x1006, "A203": 0x100C, "A204": 0x100D}
        single |= {"A207": 0x1014, "A208": 0x1015, "A210": 0x1017}
        for name, index in single.items():
            alias(dictionary, name, index)
        alias(dictionary, "A211", 0x1020, (1,))
        alias(dictionary, "A212", 0x1020, (2,))
        dictionary.add(coordinate("A83"), 0, constant(IntegerType.UNSIGNED8, self._node_id))
        entries = tuple(range(1, MAP_ENTRIES + 1))
        for number in range(CHANNELS):
            if number:
                alias(dictionary, f"A{217 + number}", 0x1200 + number, (1, 2, 3))
            alias(dictionary, f"A{221 + number}", 0x1400 + number, (1, 2))
            alias(dictionary, f"A{225 + number}", 0x1600 + number, entries)
            alias(dictionary, f"A{229 + number}", 0x1800 + number, (1, 2, 3, 5))
            alias(dictionary, f"A{233 + number}", 0x1A00 + number, entries)
            for name, receives in ((f"A{237 + number}", True), (f"A{241 + number}", False)):
                dictionary.add(coordinate(name), 0, self._length(number, receives))

    def _length(self, number: int, receives: bool) -> Number:
        """A237…A244: bytes that the mapping makes."""
        return Number(
            IntegerType.UNSIGNED8, lambda: self._pdos.pdo(number, receives=receives).mapped_bits // 8
        )
