"""Objects 1000h…1018h and 1200h… of a node (BU 2500 §6.7.2, CiA 301 §7.5.2)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, Final

from bridge.sim.core.communication_settings import COB_ID_MASK, CommunicationSettings
from bridge.sim.core.dictionary import Dictionary, IntegerType, Number, VisibleString, constant, variable
from bridge.sim.core.emcy_producer import EmcyProducer
from bridge.sim.core.sdo_abort import AbortCode, SdoAbort
from bridge.sim.core.store import Store

SAVE: Final = int.from_bytes(b"save", "little")
_LOAD: Final = int.from_bytes(b"load", "little")


@dataclass(frozen=True, slots=True)
class DeviceIdentity:
    """The node's identity, as it reports it."""

    device_type: int
    vendor_id: int
    product_code: int
    revision: int
    serial: int
    device_name: str
    hardware_version: str
    software_version: str


def add_communication(
    dictionary: Dictionary,
    identity: DeviceIdentity,
    status: Callable[[], int],
    emcy: EmcyProducer,
    store: Store[CommunicationSettings],
    *others: Store[Any],
) -> None:
    """All of them. "Save" and "load" are for ``others`` too."""

    def save() -> None:
        for one in (store, *others):
            one.save()

    def load() -> None:
        for one in (store, *others):
            one.forget()

    add_identity(dictionary, identity, status)
    add_errors(dictionary, emcy)
    dictionary.add_array(0x1010, [by_signature(SAVE, save)])
    dictionary.add_array(0x1011, [by_signature(_LOAD, load)])
    add_protocols(dictionary, store)
    add_sdo_servers(dictionary, store)


def add_identity(dictionary: Dictionary, identity: DeviceIdentity, status: Callable[[], int]) -> None:
    """1000h, 1002h, 1008h…100Ah and 1018h."""
    dictionary.add(0x1000, 0, constant(IntegerType.UNSIGNED32, identity.device_type))
    dictionary.add(0x1002, 0, Number(IntegerType.UNSIGNED32, status))
    dictionary.add(0x1008, 0, VisibleString(identity.device_name))
    dictionary.add(0x1009, 0, VisibleString(identity.hardware_version))
    dictionary.add(0x100A, 0, VisibleString(identity.software_version))
    numbers = (identity.vendor_id, identity.product_code, identity.revision, identity.serial)
    dictionary.add_array(0x1018, [constant(IntegerType.UNSIGNED32, number) for number in numbers])


def add_errors(dictionary: Dictionary, emcy: EmcyProducer) -> None:
    """1001h and 1003h. An entry beyond the number of errors does not exist."""

    def clear(value: int) -> None:
        if value:
            raise SdoAbort(AbortCode.VALUE_RANGE)
        emcy.clear_history()

    def error(place: int) -> Number:
        def read() -> int:
            history = emcy.history
            if place >= len(history):
                raise SdoAbort(AbortCode.SUBINDEX_MISSING)
            return history[place]

        return Number(IntegerType.UNSIGNED32, read)

    dictionary.add(0x1001, 0, Number(IntegerType.UNSIGNED8, lambda: emcy.error_register, in_tpdo=True))
    dictionary.add(0x1003, 0, Number(IntegerType.UNSIGNED8, lambda: len(emcy.history), clear))
    for place in range(emcy.history_size):
        dictionary.add(0x1003, place + 1, error(place))


def by_signature(signature: int, action: Callable[[], None]) -> Number:
    """An element of 1010h or 1011h: it acts on command, not by itself."""

    def write(value: int) -> None:
        if value != signature:
            raise SdoAbort(AbortCode.CANNOT_STORE)
        action()

    return Number(IntegerType.UNSIGNED32, lambda: 1, write)


def add_protocols(dictionary: Dictionary, store: Store[CommunicationSettings]) -> None:
    """SYNC, EMCY, guarding and heartbeat: 1005h, 100Ch, 100Dh, 1014h, 1015h, 1017h."""

    def settings() -> CommunicationSettings:
        return store.current

    def set_sync(value: int) -> None:
        store.current.sync_cob_id = value & COB_ID_MASK

    u8, u16, u32 = IntegerType.UNSIGNED8, IntegerType.UNSIGNED16, IntegerType.UNSIGNED32
    dictionary.add(0x1005, 0, Number(u32, lambda: store.current.sync_cob_id, set_sync))
    dictionary.add(0x100C, 0, variable(u16, settings, "guard_time_ms"))
    dictionary.add(0x100D, 0, variable(u8, settings, "life_time_factor"))
    dictionary.add(0x1014, 0, variable(u32, lambda: store.current.emcy, "word"))
    dictionary.add(0x1015, 0, variable(u16, settings, "emcy_inhibit"))
    dictionary.add(0x1017, 0, variable(u16, settings, "heartbeat_ms"))


def add_sdo_servers(dictionary: Dictionary, store: Store[CommunicationSettings]) -> None:
    """1200h is fixed; the further channels can be moved and switched on by clearing bit 31 in both halves."""

    def half(number: int, name: str) -> Number:
        def cob_id() -> object:
            return getattr(store.current.sdo[number], name)

        entry = variable(IntegerType.UNSIGNED32, cob_id, "word")
        return entry if number else replace(entry, write=None)

    for number in range(len(store.current.sdo)):
        dictionary.add_array(0x1200 + number, [half(number, "receive"), half(number, "send")])
