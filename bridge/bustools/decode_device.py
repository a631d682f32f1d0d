"""Process data of a site's nodes that are no drives, for a listener: objects by their names."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from bridge.canopen.decode_sdo import Value
from bridge.canopen.pdo import MappingError, PdoCodec, PdoEntry
from bridge.config import NodeTable
from bridge.eds import Description
from bridge.eds.pdos import PdoSummary, pdos
from bridge.mapping.device_signals import Signal
from bridge.mapping.model import Family, ObjectRef

_DIGITS: Final = 6


@dataclass(frozen=True, slots=True)
class DevicePdoView:
    """One PDO of a node, as its device description has it. ``signals`` are its entries, None for one that the
    mapping does not know."""

    node_id: int
    label: str
    codec: PdoCodec
    signals: tuple[Signal | None, ...]

    def said(self, data: bytes) -> tuple[str, tuple[tuple[str, Value | float], ...]]:
        """Sentence and values by name for the data of a frame. Data of any length is taken as far as it
        goes."""
        length = self.codec.length
        parts: list[str] = []
        values: list[tuple[str, Value | float]] = []
        end = 0
        numbers = self.codec.unpack(data[:length].ljust(length, b"\0"))
        for entry, signal, number in zip(self.codec.entries, self.signals, numbers, strict=True):
            end += entry.bits
            if end > 8 * len(data) or entry.is_dummy:
                continue
            if signal is None:
                parts.append(f"{entry.index:04X}:{entry.sub:02X} {number:X}h")
                continue
            value = signal.decode(number)
            value = round(value, _DIGITS) if isinstance(value, float) else value
            parts.append(f"{signal.name} {_shown(signal, value)}")
            values.append((signal.name, value))
        if len(data) != length:
            parts.append(f"{len(data)} bytes instead of {length}")
        return ", ".join(parts), tuple(values)


def _shown(signal: Signal, value: Value | float) -> str:
    if isinstance(value, bool):
        return str(value).lower()
    text = signal.states.get(int(value), "") if signal.states else signal.unit
    return f"{value:g} {text}".rstrip() if isinstance(value, float) else f"{value} {text}".rstrip()


def device_views(
    node: NodeTable, family: Family, description: Description | None
) -> Mapping[int, DevicePdoView]:
    """The PDOs of a node that is no drive by COB-ID; none where nothing describes them."""
    found: dict[int, DevicePdoView] = {}
    for pdo in pdos(description, node.id) if description else ():
        if pdo.cob_id is not None and pdo.enabled and pdo.mapped:
            view = _view(node, family, pdo)
            if view is not None:
                found[pdo.cob_id] = view
    return found


def _view(node: NodeTable, family: Family, pdo: PdoSummary) -> DevicePdoView | None:
    known = {signal.object: signal for signal in family.input}
    entries = tuple(PdoEntry(one.index, one.sub, one.bits) for one in pdo.mapped)
    signals = tuple(known.get(ObjectRef(one.index, one.sub)) for one in entries)
    signed = {(one.object.index, one.object.sub) for one in signals if one and one.is_signed}
    try:
        codec = PdoCodec(entries, signed)
    except MappingError:
        return None
    return DevicePdoView(node.id, f"{pdo.name} {node.name}", codec, signals)
