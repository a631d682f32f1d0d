"""Objects 1000h…1018h and 1200h… of a node (BU 2500 §6.7.2, CiA 301 §7.5.2)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from bridge.sim.abort import AbortCode, SdoAbort
from bridge.sim.dictionary import DataType, Dictionary, Number, Text, constant
from bridge.sim.emcy_producer import EmcyProducer
from bridge.sim.settings import COB_ID_MASK, DISABLED, CommunicationSettings, SdoSettings
from bridge.sim.store import Store

_SAVE: Final = int.from_bytes(b"save", "little")
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


@dataclass(frozen=True, slots=True)
class Memory:
    """How "save" and "load" work on this node."""

    save: Callable[[], None]
    load: Callable[[], None]


def add_identity(dictionary: Dictionary, identity: DeviceIdentity, status: Callable[[], int]) -> None:
    """1000h, 1002h, 1008h…100Ah and 1018h."""
    dictionary.add(0x1000, 0, constant(DataType.UNSIGNED32, identity.device_type))
    dictionary.add(0x1002, 0, Number(DataType.UNSIGNED32, status))
    dictionary.add(0x1008, 0, Text(identity.device_name))
    dictionary.add(0x1009, 0, Text(identity.hardware_version))
    dictionary.add(0x100A, 0, Text(identity.software_version))
    numbers = (identity.vendor_id, identity.product_code, identity.revision, identity.serial)
    dictionary.add_array(0x1018, [constant(DataType.UNSIGNED32, number) for number in numbers])


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

        return Number(DataType.UNSIGNED32, read)

    dictionary.add(0x1001, 0, Number(DataType.UNSIGNED8, lambda: emcy.error_register, in_tpdo=True))
    dictionary.add(0x1003, 0, Number(DataType.UNSIGNED8, lambda: len(emcy.history), clear))
    for place in range(emcy.history_size):
        dictionary.add(0x1003, place + 1, error(place))


def add_memory(dictionary: Dictionary, memory: Memory) -> None:
    """1010h and 1011h: a command in the form of a signature."""

    def command(signature: int, action: Callable[[], None]) -> Number:
        def write(value: int) -> None:
            if value != signature:
                raise SdoAbort(AbortCode.CANNOT_STORE)
            action()

        return Number(DataType.UNSIGNED32, lambda: 1, write)  # 1: on command, not by itself

    dictionary.add_array(0x1010, [command(_SAVE, memory.save)])
    dictionary.add_array(0x1011, [command(_LOAD, memory.load)])


def add_protocols(dictionary: Dictionary, store: Store[CommunicationSettings]) -> None:
    """SYNC, EMCY, guarding and heartbeat: 1005h, 100Ch, 100Dh, 1014h, 1015h, 1017h."""

    def set_sync(value: int) -> None:
        store.current.sync_cob_id = value & COB_ID_MASK

    def set_emcy(value: int) -> None:
        store.current.emcy_cob_id = value & COB_ID_MASK
        store.current.emcy_on = not value & DISABLED

    def set_emcy_inhibit(value: int) -> None:
        store.current.emcy_inhibit = value

    def emcy() -> int:
        return store.current.emcy_cob_id | (0 if store.current.emcy_on else DISABLED)

    u16, u32 = DataType.UNSIGNED16, DataType.UNSIGNED32
    dictionary.add(0x1005, 0, Number(u32, lambda: store.current.sync_cob_id, set_sync))
    dictionary.add(0x1014, 0, Number(u32, emcy, set_emcy))
    dictionary.add(0x1015, 0, Number(u16, lambda: store.current.emcy_inhibit, set_emcy_inhibit))
    _add_error_control(dictionary, store)


def _add_error_control(dictionary: Dictionary, store: Store[CommunicationSettings]) -> None:
    def set_guard_time(value: int) -> None:
        store.current.guard_time_ms = value

    def set_life_time_factor(value: int) -> None:
        store.current.life_time_factor = value

    def set_heartbeat(value: int) -> None:
        store.current.heartbeat_ms = value

    u8, u16 = DataType.UNSIGNED8, DataType.UNSIGNED16
    dictionary.add(0x100C, 0, Number(u16, lambda: store.current.guard_time_ms, set_guard_time))
    dictionary.add(0x100D, 0, Number(u8, lambda: store.current.life_time_factor, set_life_time_factor))
    dictionary.add(0x1017, 0, Number(u16, lambda: store.current.heartbeat_ms, set_heartbeat))


def add_sdo_servers(dictionary: Dictionary, store: Store[CommunicationSettings]) -> None:
    """1200h is fixed; the further channels can be moved and switched on by clearing bit 31 in both halves."""
    for number in range(len(store.current.sdo)):
        _add_sdo_server(dictionary, store, number)


def _add_sdo_server(dictionary: Dictionary, store: Store[CommunicationSettings], number: int) -> None:
    def channel() -> SdoSettings:
        return store.current.sdo[number]

    def receive() -> int:
        return channel().receive_cob_id | (0 if channel().receive_on else DISABLED)

    def send() -> int:
        return channel().send_cob_id | (0 if channel().send_on else DISABLED)

    def set_receive(value: int) -> None:
        channel().receive_cob_id, channel().receive_on = value & COB_ID_MASK, not value & DISABLED

    def set_send(value: int) -> None:
        channel().send_cob_id, channel().send_on = value & COB_ID_MASK, not value & DISABLED

    fixed = number == 0
    dictionary.add_array(
        0x1200 + number,
        [
            Number(DataType.UNSIGNED32, receive, None if fixed else set_receive),
            Number(DataType.UNSIGNED32, send, None if fixed else set_send),
        ],
    )
