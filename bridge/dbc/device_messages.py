"""The PDOs of a node that is no drive, as its device description has them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

from bridge.dbc.model import BRIDGE, Message, MessageSignal
from bridge.dbc.object_format import kind_of
from bridge.eds import Description
from bridge.eds.pdos import MappedEntry, pdos
from bridge.lint.checked_bus import CheckedBus, CheckedNode
from bridge.mapping.device_signals import Signal as DeviceSignal
from bridge.mapping.model import ObjectRef

_LAST_DUMMY = 0x1F


def device_messages(bus: CheckedBus, node: CheckedNode, *, words: bool) -> Iterator[Message]:
    """One for each of its PDOs that are on at factory; with ``words`` the numbers as they are on the wire."""
    if node.dictionary is None:
        return
    views = {(view.receives, view.number): view for view in node.pdos}
    family, dictionary = node.family, node.dictionary
    signals = {True: family.output, False: family.input}
    known = {receives: {one.object: one for one in listed} for receives, listed in signals.items()}
    name = node.table.name
    for pdo in pdos(node.dictionary, node.table.id):
        view = views.get((pdo.receives, pdo.number))
        if view is None or not view.enabled or not pdo.mapped:
            continue
        sender, receiver = (BRIDGE, name) if pdo.receives else (name, BRIDGE)
        yield Message(
            view.cob_id,
            f"{name}_{pdo.name}",
            (sum(one.bits for one in pdo.mapped) + 7) // 8,
            sender,
            (receiver,),
            tuple(_signals(pdo.mapped, known[pdo.receives], dictionary, words=words)),
            f"{pdo.name} of {name}: mapping as the factory has it; the node's own counts",
            0 if pdo.receives else round(1000 * (view.period_s(bus.sync_s) or 0)),
        )


def _signals(
    mapped: Sequence[MappedEntry],
    known: Mapping[ObjectRef, DeviceSignal],
    dictionary: Description,
    *,
    words: bool,
) -> Iterator[MessageSignal]:
    begin = 0
    for one in mapped:
        start, begin = begin, begin + one.bits
        if one.index <= _LAST_DUMMY:
            continue
        signal = known.get(ObjectRef(one.index, one.sub))
        where = f"{one.index:04X}h:{one.sub:02X}"
        if signal is None:
            label = f"object_{one.index:04x}_{one.sub:02x}"
            kind = kind_of(dictionary, one.index, one.sub, one.bits)
            comment = f"{where} {one.name}".rstrip()
            yield MessageSignal(
                label, start, one.bits, kind.is_signed, is_float=kind.is_float, comment=comment
            )
        elif signal.bits and not words:
            for bit, text in enumerate(signal.bits[: one.bits]):
                bit_name = f"{signal.name}_{text or f'bit_{bit}'}"
                yield MessageSignal(bit_name, start + bit, 1, low=0, high=1, comment=f"bit {bit} of {where}")
        else:
            scaled = signal.is_scaled and not words
            yield MessageSignal(
                signal.name,
                start,
                one.bits,
                signal.is_signed,
                signal.factor if scaled else 1.0,
                signal.offset if scaled else 0.0,
                signal.low if not words else None,
                signal.high if not words else None,
                signal.unit if not words else "",
                signal.is_real,
                signal.states,
                f"{where} {signal.description}".rstrip(),
            )
