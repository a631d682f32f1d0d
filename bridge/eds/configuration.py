"""The configuration in a DCF or XDC as a list of SDO downloads."""

from __future__ import annotations

from typing import Final

from bridge.canopen.sdo import COMMANDS
from bridge.config.download import Download
from bridge.eds.model import Description, Entry, Report
from bridge.eds.values import BadValue, encode

_COMMUNICATION: Final = range(0x1000, 0x2000)
_MAPPINGS: Final = (range(0x1600, 0x1800), range(0x1A00, 0x1C00))


def configuration(
    description: Description, node_id: int | None = None, report: Report | None = None
) -> tuple[Download, ...]:
    """What has to be written to a node with factory settings, in this order: application objects, then
    communication objects; sub 0 of a mapping last. Only entries that can be written, have a ParameterValue
    and differ from their default. The boot-up switches PDOs off before and on after it (CiA 301 §7.5.2.36).

    ``node_id`` replaces $NODEID; by default it is that of the file. What cannot be encoded is reported.
    """
    if node_id is None:
        node_id = description.commissioning.node_id
    found: list[Download] = []
    for one in description.objects:
        for entry in one.entries:
            data = _data(entry, node_id, report or Report())
            if data is not None:
                found.append(Download(entry.index, entry.sub, data, entry.access.readable))
    return tuple(sorted(found, key=_order))


def _order(download: Download) -> tuple[bool, int, int]:
    is_mapping = any(download.index in indices for indices in _MAPPINGS)
    last = is_mapping and download.sub == 0
    return (download.index in _COMMUNICATION, download.index, 0x100 if last else download.sub)


def _data(entry: Entry, node_id: int | None, report: Report) -> bytes | None:
    value = entry.parameter_value
    if value is None or value == entry.default or not entry.access.writable:
        return None
    if entry.refuses_download or entry.index in COMMANDS:
        return None
    where = f"{entry.index:04X}h:{entry.sub:02X}"
    plain = value.at(node_id)
    if plain is None:
        report.error(entry.line, f"{where} needs the node id, and none is given: not configured")
        return None
    if entry.data_type is None:
        report.error(entry.line, f"{where} has no known data type: not configured")
        return None
    if entry.default and entry.default.at(node_id) == plain:
        return None
    try:
        return encode(plain, entry.data_type)
    except BadValue as error:
        report.error(entry.line, f"{where}: {error}: not configured")
        return None
