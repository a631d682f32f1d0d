"""A bus of a site: what the site file sets, else what the mapping files say."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Final

from bridge.base.errors import OperationFailed
from bridge.config import NodeTable, PdoTable
from bridge.config.model import pdo_table
from bridge.dbc.device_messages import device_messages
from bridge.dbc.model import BRIDGE, BusDescription, Message
from bridge.dbc.pdo_fields import lay_out
from bridge.dbc.protocol_messages import bus_messages, node_messages
from bridge.dbc.signals import PdoSignals
from bridge.drive import default_codecs
from bridge.lint.checked_bus import CheckedBus, CheckedDrive, CheckedNode, CheckedPdo
from bridge.mapping.model import Pdo, Slot
from bridge.node.boot import factory_entries, layouts, match_words
from bridge.text import Text

_WARNING: Final = (
    "Made by drivebridge from the site file and the mapping files, not from the nodes. A node whose own "
    "PDOs (14xxh, 16xxh, 18xxh, 1Axxh) or scaling parameters are set otherwise is followed by the bridge, "
    "which tells the differences in <node>/node/boot_status, and not by this file."
)


def describe(bus: CheckedBus, *, words: bool = False) -> BusDescription:
    """Everything on ``bus``. With ``words`` the process data are raw words, else values and bits.

    Raises ``OperationFailed`` where two messages have one identifier.
    """
    nodes = {BRIDGE: "the CANopen master: drivebridge"}
    messages = list(bus_messages(bus.table))
    for node in bus.nodes:
        facts = node.family.family
        nodes[node.table.name] = f"node {node.table.id}: {facts.vendor} {facts.name} ({node.table.mapping})"
        messages += node_messages(node.table, node.family, node.emcy_id)
    optional: list[Message] = []
    for node in bus.nodes:
        for drive in node.drives:
            slot = node.family.slot_named(drive.table.slot)
            for view, pdo in _pdos(drive, slot):
                one = _message(bus, node, drive, slot, view, pdo, words=words)
                # What is off at factory gives way to what is on.
                (messages if view.enabled else optional).append(one)
        if node.family.is_device:
            messages += device_messages(bus, node, words=words)
    _refuse_doubles(messages)
    taken = {message.cob_id for message in messages}
    messages += [message for message in optional if message.cob_id not in taken]
    comment = f"Site bus {bus.table.name}. {_WARNING}"
    return BusDescription(bus.table.name, bus.table.bitrate, comment, nodes, tuple(_named(messages)))


def _pdos(drive: CheckedDrive, slot: Slot) -> Iterator[tuple[CheckedPdo, Pdo]]:
    """The PDOs of a drive, without those that the site file switches off."""
    for views, pdos in ((drive.rpdos, slot.rpdo), (drive.tpdos, slot.tpdo)):
        by_number = {view.number: view for view in views}
        for pdo in pdos:
            view = by_number[pdo.number]
            asked = _asked(drive, view, pdos[0].number)
            if view.enabled or (pdo.optional and asked is None):
                yield view, pdo


def _asked(drive: CheckedDrive, view: CheckedPdo, first: int) -> PdoTable | None:
    """Table of this PDO in the site file; a table without a number is for the drive's first."""
    tables = drive.table.rpdo if view.receives else drive.table.tpdo
    return pdo_table(tables, view.number, first)


def _message(
    bus: CheckedBus,
    node: CheckedNode,
    drive: CheckedDrive,
    slot: Slot,
    view: CheckedPdo,
    pdo: Pdo,
    *,
    words: bool,
) -> Message:
    family = node.family
    pdos = slot.rpdo if view.receives else slot.tpdo
    process = family.process.rpdo if view.receives else family.process.tpdo
    group = "command" if view.receives else "actual"
    asked = _asked(drive, view, pdos[0].number)
    entries = factory_entries(pdo)
    if asked is not None and asked.mapping:
        entries = tuple(asked.mapping)
    names = [(family.rpdo_words if view.receives else family.tpdo_words)(one) for one in pdos]
    places = match_words(entries, layouts(pdos, names, process))
    signed = frozenset((ref.index, ref.sub) for one in pdos for ref in one.signed)
    found = PdoSignals(
        lay_out(entries, places, signed),
        process,
        family.control_word.bits if view.receives else family.status_word.bits,
        default_codecs(family, slot, group, process, drive.table.parameters),
        drive.table.parameters,
        node.dictionary,
    )
    signals = tuple(found.words() if words else found.values())
    period_s = bus.table.rpdo_period_s if view.receives else view.period_s(bus.sync_s)
    sender, receiver = (BRIDGE, node.table.name) if view.receives else (node.table.name, BRIDGE)
    return Message(
        view.cob_id,
        f"{drive.name.replace('/', '_')}_{view.name}",
        (sum(entry.bits for entry in entries) + 7) // 8,
        sender,
        (receiver,),
        signals,
        _comment(node.table, drive, view, pdo, asked),
        round(1000 * (period_s or 0)),
        {} if words else found.groups,
    )


def _comment(node: NodeTable, drive: CheckedDrive, view: CheckedPdo, pdo: Pdo, asked: PdoTable | None) -> str:
    if pdo.static:
        source = "what it carries is fixed in the device, and the node does not show it"
    elif asked is not None and asked.mapping:
        source = "mapping written into the node by the site file"
    elif pdo.write:
        source = "mapping written into the node by the mapping file"
    else:
        source = "mapping as the factory has it; the node's own counts"
    off = "" if view.enabled else "; off at factory"
    return f"{view.name} of {drive.name} ({node.mapping}): {source}{off}"


def _refuse_doubles(messages: Sequence[Message]) -> None:
    seen: dict[int, Message] = {}
    for message in messages:
        other = seen.setdefault(message.cob_id, message)
        if other is not message:
            raise OperationFailed(
                Text.of("export.cob_id_twice", one=other.name, other=message.name, cob_id=message.cob_id)
            )


def _named(messages: Sequence[Message]) -> Iterator[Message]:
    """The messages by their identifier, each with a name of its own."""
    seen: set[str] = set()
    for message in sorted(messages, key=lambda message: message.cob_id):
        name = message.name if message.name not in seen else f"{message.name}_{message.cob_id:03X}"
        seen.add(name)
        yield replace(message, name=name)
