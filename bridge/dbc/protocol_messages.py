"""Messages of CANopen itself: NMT, SYNC, heartbeats, emergency messages (CiA 301 §7.2)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from bridge.canopen import cobid
from bridge.canopen.nmt import NmtCommand, NmtState
from bridge.config import BusTable, NodeTable
from bridge.dbc.model import BRIDGE, Message, MessageSignal
from bridge.mapping.model import EmcyTable, Family
from bridge.node.boot.error_control_setup import heartbeat_period_ms

_NMT_BYTES: Final = 2
_EMCY_BYTES: Final = 8
_FIRST_VENDOR_BYTE: Final = 3
_HEARTBEAT_STATES: Final = {0: "boot-up"} | {
    state.value: state.label.replace("_", " ")
    for state in NmtState
    if state not in (NmtState.INITIALISING, NmtState.UNKNOWN)
}


def bus_messages(bus: BusTable) -> Iterator[Message]:
    """Messages that the bridge sends to all."""
    receivers = tuple(node.name for node in bus.node)
    commands = {command.value: command.name.lower().replace("_", " ") for command in NmtCommand}
    yield Message(
        cobid.NMT,
        "NMT",
        _NMT_BYTES,
        BRIDGE,
        receivers,
        (
            MessageSignal("nmt_command", 0, 8, choices=commands),
            MessageSignal("nmt_node", 8, 8, low=0, high=127, comment="0: all nodes"),
        ),
    )
    if bus.sync_period_ms:
        counter = MessageSignal("sync_counter", 0, 8, low=1, high=bus.sync_counter)
        signals = (counter,) if bus.sync_counter else ()
        length = len(signals)
        yield Message(cobid.SYNC, "SYNC", length, BRIDGE, receivers, signals, cycle_ms=bus.sync_period_ms)
    if bus.heartbeat_ms:
        cob_id = cobid.ERROR_CONTROL + bus.master_node_id
        signals = _heartbeat_signals(guarded=False)
        yield Message(cob_id, f"{BRIDGE}_heartbeat", 1, BRIDGE, receivers, signals, cycle_ms=bus.heartbeat_ms)


def node_messages(node: NodeTable, family: Family, emcy_id: int | None) -> Iterator[Message]:
    """Messages that a node sends beside its PDOs. ``emcy_id`` is None where it sends no emergency
    messages."""
    guarded = node.supervision == "guarding"
    period_ms = heartbeat_period_ms(node.supervision_ms)
    cycle_ms = {"heartbeat": period_ms, "guarding": node.supervision_ms}.get(node.supervision, 0)
    yield Message(
        cobid.ERROR_CONTROL + node.id,
        f"{node.name}_heartbeat",
        1,
        node.name,
        (BRIDGE,),
        _heartbeat_signals(guarded=guarded),
        "boot-up, and the answers to node guarding" if guarded else "boot-up and heartbeat",
        cycle_ms,
    )
    if emcy_id is not None:
        signals = tuple(_emcy_signals(family.emcy, _drives(node, family)))
        yield Message(emcy_id, f"{node.name}_EMCY", _EMCY_BYTES, node.name, (BRIDGE,), signals)


def _heartbeat_signals(*, guarded: bool) -> tuple[MessageSignal, ...]:
    state = MessageSignal("nmt_state", 0, 7, choices=_HEARTBEAT_STATES)
    return (state, MessageSignal("toggle", 7, 1, low=0, high=1)) if guarded else (state,)


def _drives(node: NodeTable, family: Family) -> dict[int, str]:
    """Names of the drives as the emergency message's drive byte has them."""
    names = {drive.slot: family.leaf_of(drive) for drive in node.drive}
    return {
        slot.emcy_drive: names.get(slot.name, slot.name)
        for slot in family.slot
        if slot.emcy_drive is not None
    }


def _emcy_signals(emcy: EmcyTable, drives: dict[int, str]) -> Iterator[MessageSignal]:
    codes = {int(code, 16): text for code, text in emcy.codes.items() if not code.endswith("xx")}
    events = {int(number): text for number, text in emcy.events.items()}
    yield MessageSignal("error_code", 0, 16, choices=codes)
    yield MessageSignal("error_register", 16, 8)
    own: list[MessageSignal] = []
    if emcy.drive_byte is not None and emcy.drive_byte >= _FIRST_VENDOR_BYTE:
        own.append(_byte("drive", emcy.drive_byte, drives))
    if emcy.event is not None:
        own.append(_byte("event", emcy.event.byte, events))
        if emcy.event.cause_byte is not None:
            own.append(_byte("event_cause", emcy.event.cause_byte, {}))
    if emcy.number is not None:
        number = emcy.number
        listed = ", ".join(f"{code}h" for code in number.codes)
        comment = f"with the codes {listed}"
        own.append(
            MessageSignal("error_number", 8 * number.byte, 8 * number.size, choices=events, comment=comment)
        )
    taken = {bit for signal in own for bit in range(signal.start, signal.start + signal.length)}
    yield from own
    for byte in range(_FIRST_VENDOR_BYTE, _EMCY_BYTES):
        if taken.isdisjoint(range(8 * byte, 8 * byte + 8)):
            yield _byte(f"manufacturer_{byte}", byte, {})


def _byte(name: str, byte: int, choices: dict[int, str]) -> MessageSignal:
    return MessageSignal(name, 8 * byte, 8, choices=choices, comment=f"byte {byte}")
