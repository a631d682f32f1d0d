"""The configuration in a DCF or XDC as a list of SDO downloads."""

from __future__ import annotations

from typing import Final, TypeGuard

from bridge.canopen.sdo import COMMANDS
from bridge.config.download import Download
from bridge.eds.model import Description, Entry, Plain, Report
from bridge.eds.value_text import BadValue, encode
from bridge.text import Text

_COMMUNICATION: Final = range(0x1000, 0x2000)
_MAPPINGS: Final = (range(0x1600, 0x1800), range(0x1A00, 0x1C00))
_EMCY_ID: Final = (0x1014, 0)
_COB_IDS: Final = (
    (range(0x1200, 0x1300), (1, 2)),
    (range(0x1400, 0x1600), (1,)),
    (range(0x1800, 0x1A00), (1,)),
)
"""Objects with identifiers that may be made of the node id: those of SDO and PDOs (CiA 301 §7.5.2.33 …
37)."""
_NODE_BITS: Final = 0x7F


def configuration(
    description: Description, node_id: int | None = None, report: Report | None = None
) -> tuple[Download, ...]:
    """Downloads to a node with factory settings, in this order: application objects, then communication
    objects; sub 0 of a mapping last. Only entries that can be written, have a ParameterValue and differ from
    their default. The boot-up switches PDOs off before and on after it (CiA 301 §7.5.2.36).

    ``node_id`` replaces $NODEID; by default it is that of the file. What cannot be encoded is reported, and
    so is an identifier of another node that the file was made for. What is its default stays the default.
    """
    own = description.commissioning.node_id
    if node_id is None:
        node_id = own
    other = None if own == node_id else own
    found: list[Download] = []
    for one in description.objects:
        for entry in one.entries:
            data = _data(entry, node_id, report or Report(), other)
            if data is not None:
                found.append(Download(entry.index, entry.sub, data, entry.access.readable))
    return tuple(sorted(found, key=_order))


def _order(download: Download) -> tuple[bool, int, int]:
    is_mapping = any(download.index in indices for indices in _MAPPINGS)
    last = is_mapping and download.sub == 0
    return (download.index in _COMMUNICATION, download.index, 0x100 if last else download.sub)


def _data(entry: Entry, node_id: int | None, report: Report, other: int | None) -> bytes | None:
    """``other`` is the node that the file was made for, where that is not the one it is for now."""
    value = entry.parameter_value
    if value is None or value == entry.default or not entry.access.writable:
        return None
    if entry.refuses_download or entry.index in COMMANDS:
        return None
    where = f"{entry.index:04X}h:{entry.sub:02X}"
    plain = value.at(node_id)
    if plain is None:
        report.error(entry.line, Text.of("eds.needs_node_id", object=where))
        return None
    if entry.data_type is None:
        report.error(entry.line, Text.of("eds.type_not_known", object=where))
        return None
    if entry.default and entry.default.at(node_id) == plain:
        return None
    if other is not None and not value.plus_node_id:
        if entry.default and entry.default.plus_node_id and entry.default.at(other) == plain:
            return None
        if _is_identifier_of(plain, entry, other):
            said = Text.of("eds.id_of_other_node", object=where, id=plain, other=other, node=str(node_id))
            report.error(entry.line, said)
            return None
    try:
        return encode(plain, entry.data_type)
    except BadValue as error:
        report.error(entry.line, Text.of("eds.not_encoded", object=where, why=error.said))
        return None


def _is_identifier_of(plain: Plain, entry: Entry, node_id: int) -> TypeGuard[int]:
    """True where the entry holds a COB-ID that ends with the number of the node."""
    holds_one = (entry.index, entry.sub) == _EMCY_ID or any(
        entry.index in indices and entry.sub in subs for indices, subs in _COB_IDS
    )
    return holds_one and isinstance(plain, int) and plain & _NODE_BITS == node_id
