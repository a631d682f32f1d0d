"""Contradictions in a device description: each value is readable, and they cannot all be right."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from bridge.canopen import cobid
from bridge.eds.model import Description, Entry, Finding, FindingSeverity, Object, StaticDataType, Value
from bridge.eds.value_text import BadValue, bits_of_type, encode
from bridge.text import Said, Text

_MAPPINGS: Final = {True: range(0x1600, 0x1800), False: range(0x1A00, 0x1C00)}
"""Mapping parameters of RPDOs (True) and TPDOs (CiA 301 §7.5.2.36, §7.5.2.38)."""
_COMMUNICATION: Final = (range(0x1400, 0x1600), range(0x1800, 0x1A00))
_MPDO: Final = (0xFE, 0xFF)
"""Values of sub-index 0 that are no counts (CiA 301 §7.5.2.36)."""
_MOST_BITS: Final = 64
_LAST_TYPE: Final = 0x1F
"""Up to here a mapped index is a data type: a dummy (CiA 301 §7.4.7.3)."""
_NODE_IDS: Final = (1, 127)


def contradictions(description: Description) -> list[Finding]:
    """Contradictions, each with the line of the value that names the other."""
    found: list[Finding] = []
    for one in description.objects:
        for entry in one.entries:
            found += (_told(entry.line, said) for said in (*_limits(entry), *_node_ids(entry)))
        for receives, mappings in _MAPPINGS.items():
            if one.index in mappings:
                found += _mapping(description, one, receives)
    return found


def _told(line: int, said: Text) -> Finding:
    return Finding(line, FindingSeverity.WARNING, said)


def _place(entry: Entry) -> str:
    return f"{entry.index:04X}h:{entry.sub:02X}"


def _limits(entry: Entry) -> Iterator[Text]:
    low, high, default = (_number(value) for value in (entry.low, entry.high, entry.default))
    if low is not None and high is not None and low > high:
        yield Text.of("eds.low_above_high", object=_place(entry), low=str(low), high=str(high))
    elif default is not None and low is not None and default < low:
        yield Text.of("eds.default_below_low", object=_place(entry), default=str(default), low=str(low))
    elif default is not None and high is not None and default > high:
        yield Text.of("eds.default_above_high", object=_place(entry), default=str(default), high=str(high))


def _number(value: Value | None) -> int | float | None:
    """Number of a value; None where it depends on the node id, of which nothing is known here."""
    if value is None or value.plus_node_id or not isinstance(value.plain, int | float):
        return None
    return value.plain


def _node_ids(entry: Entry) -> Iterator[Text]:
    """A value with $NODEID has to fit on every node; that of a PDO has to be an identifier, too."""
    value = entry.current
    if value is None or not value.plus_node_id or entry.data_type is None:
        return
    for node_id in _NODE_IDS:
        plain = value.at(node_id)
        if not isinstance(plain, int):
            return
        try:
            encode(plain, entry.data_type)
        except BadValue as error:
            yield Text.of(
                "eds.not_on_node", object=_place(entry), value=str(value), node=node_id, why=error.said
            )
            return
        is_identifier = entry.sub == 1 and any(entry.index in each for each in _COMMUNICATION)
        number = plain & ~(cobid.PDO_DISABLED | cobid.NO_REMOTE)
        if is_identifier and number > cobid.COB_ID_MASK and not plain & cobid.PDO_EXTENDED:
            yield Text.of(
                "eds.no_identifier", object=_place(entry), value=str(value), node=node_id, number=number
            )
            return


def _mapping(description: Description, one: Object, receives: bool) -> Iterator[Finding]:
    """Findings on the default mapping of a PDO: whether its objects are there and fit."""
    count = description.number(one.index, 0)
    if not count or count in _MPDO:
        return
    head = one.entries[0]
    described = max(entry.sub for entry in one.entries)
    if count > described:
        said = Text.of("eds.maps_more", object=_place(head), count=count, described=described)
        yield _told(head.line, said)
    length = 0
    for entry in one.entries[1:]:
        word = description.number(one.index, entry.sub)
        if not word or entry.sub > count:
            continue
        length += word & 0xFF
        why = _mapped(description, word, receives)
        if why:
            yield _told(entry.line, Text.of("eds.maps", object=_place(entry), word=word, why=why))
    if length > _MOST_BITS:
        said = Text.of("eds.maps_too_much", object=_place(head), bits=length, most=_MOST_BITS)
        yield _told(head.line, said)


def _mapped(description: Description, word: int, receives: bool) -> Said:
    """Reason why an object cannot be mapped like this; empty where it can."""
    index, sub, bits = word >> 16, word >> 8 & 0xFF, word & 0xFF
    if index <= _LAST_TYPE:
        return ""
    entry = description.entry(index, sub)
    if entry is None:
        return Text.of("eds.mapped_not_described", object=f"{index:04X}h:{sub:02X}")
    place, kind = _place(entry), entry.data_type
    length = bits_of_type(kind) if kind else None
    if kind and length and bits != length and not (kind is StaticDataType.BOOLEAN and bits == 1):
        return Text.of("eds.mapped_length", object=place, has=length, type=kind.name, bits=bits)
    if receives and not entry.access.writable:
        return Text.of("eds.mapped_received", object=place, access=entry.access.value)
    if not receives and not entry.access.readable:
        return Text.of("eds.mapped_sent", object=place, access=entry.access.value)
    return ""
