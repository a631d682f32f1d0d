"""A mapping file for a device that is no drive: an encoder, inputs and outputs, anything that sends PDOs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from bridge.canopen.datatypes import INTEGERS, REALS
from bridge.derive.parameter_tables import TYPES, entries_of, parameter_lines
from bridge.derive.titles import name_of, title_of
from bridge.derive.toml import one_line, string, strings, word, wording
from bridge.eds import Description, Entry
from bridge.eds.pdos import pdos
from bridge.text import Said

GENERIC: Final = "generic/device"
_PROFILE_IO: Final = 401
_EIGHT_BITS: Final = (0x6000, 0x6200)
"""CiA 401: eight inputs or outputs to an element."""
_ERROR_OBJECTS: Final = {
    0x6200: (0x6206, 0x6207),
    0x6300: (0x6306, 0x6307),
    0x6320: (0x6326, 0x6327),
    **dict.fromkeys((0x6410, 0x6411, 0x6412), (0x6443, 0x6444)),
}
"""CiA 401: error mode and error value of digital outputs in groups of 8, 16 and 32, and of analogue ones."""
_SAVES_BY_ITSELF: Final = 2
"""Bit of 1010h:01."""
_DUMMIES: Final = range(0x0001, 0x0008)


def device_lines(description: Description, source: str, read_only: Said = "") -> Iterator[str]:
    """The mapping, line by line; ``read_only`` is why nothing is written into the device."""
    info = description.device_info
    inputs = dict(_signals(description, receives=False))
    outputs = {} if read_only else dict(_signals(description, receives=True))
    yield f"# Made of {one_line(source)} by `drivebridge family new`. A key behind a # is what the file does"
    yield "# not say: fill it in from the manual, and compare the rest with the device."
    yield f"extends = {string(GENERIC)}"
    yield ""
    yield "[family]"
    yield f"name = {string(info.product or source)}"
    yield f"vendor = {string(info.vendor or 'unknown')}"
    yield f"source = {string(source)}"
    profile = _profile(description)
    yield f"profile = {profile}" if profile else "# profile = "
    if read_only:
        yield f"read_only = {wording(read_only)}"
    yield ""
    yield from identity_lines(description)
    yield from _eeprom_lines(description)
    for name, (entry, kind, title) in inputs.items():
        yield "[[input]]"
        yield from _signal_lines(description, name, entry, kind)
        yield f"description = {string(title)}"
        yield ""
    for name, (entry, kind, title) in outputs.items():
        yield "[[output]]"
        yield from _signal_lines(description, name, entry, kind)
        yield from _error_lines(description, entry)
        yield f"description = {string(title)}"
        yield ""
    commanded = {(one.index, one.sub) for pdo in pdos(description) if pdo.receives for one in pdo.mapped}
    told = {(entry.index, entry.sub) for entry, _, _ in inputs.values()}
    for name, entry in entries_of(description):
        yield from parameter_lines(
            name, entry, title_of(description, entry), {}, commanded | told, profile or None
        )


def _eeprom_lines(description: Description) -> Iterator[str]:
    """Lines on saving its parameters, where it saves them on command (CiA 301 §7.5.2.13)."""
    entry = description.entry(0x1010, 1)
    if entry is None or not entry.access.writable:
        return
    told = entry.default.at(None) if entry.default else None
    by_itself = isinstance(told, int) and told & _SAVES_BY_ITSELF
    yield "[eeprom]"
    yield 'save = "1010:01"'
    yield f"written_on_save_only = {'false' if by_itself else 'true'}"
    yield ""


def _signal_lines(description: Description, name: str, entry: Entry, kind: str) -> Iterator[str]:
    yield f"name = {string(name)}"
    yield f'object = "{entry.index:04X}:{entry.sub:02X}"'
    yield f"data_type = {string(kind)}"
    if kind in REALS or (kind in INTEGERS and kind != "bool"):
        yield '# unit = ""'
    if _is_eight_bits(description, entry):
        yield f"bits = {strings([f'bit_{bit}' for bit in range(8)])}"


def _error_lines(description: Description, entry: Entry) -> Iterator[str]:
    """Lines with the objects that say what the output becomes when it leaves Operational, as far as the
    device has them."""
    indices = _ERROR_OBJECTS.get(entry.index) if _profile(description) == _PROFILE_IO else None
    keys = ("error_mode", "error_value")
    for key, index in zip(keys, indices or (), strict=False):
        if description.entry(index, entry.sub):
            yield f'{key} = "{index:04X}:{entry.sub:02X}"'


def _signals(description: Description, *, receives: bool) -> Iterator[tuple[str, tuple[Entry, str, str]]]:
    """Signals in the RPDOs or the TPDOs, in their order, and those that modules bring: name, and entry, type
    and title."""
    found: dict[tuple[int, int], Entry] = {}
    for pdo in pdos(description):
        for one in pdo.mapped if pdo.receives == receives else ():
            entry = description.entry(one.index, one.sub)
            if entry and one.index not in _DUMMIES:
                found.setdefault((one.index, one.sub), entry)
    for at in sorted(description.extended):
        # A coupler maps by itself what is plugged in.
        entry = description.entry(*at)
        if entry and entry.pdo_mappable and entry.access.writable == receives:
            found.setdefault(at, entry)
    names: set[str] = set()
    for entry in found.values():
        kind = TYPES.get(entry.data_type) if entry.data_type else None
        if kind is None or kind in ("string", "bytes"):
            continue
        name = name_of(title_of(description, entry), entry)
        if name in names:
            name = f"{name}_{entry.index:04x}_{entry.sub:02x}"
        names.add(name)
        yield name, (entry, kind, title_of(description, entry))


def _is_eight_bits(description: Description, entry: Entry) -> bool:
    return _profile(description) == _PROFILE_IO and entry.index in _EIGHT_BITS


def _profile(description: Description) -> int:
    return (description.number(0x1000) or 0) & 0xFFFF


def wanted_identity(description: Description) -> tuple[int | None, int | None]:
    """Vendor and product that a node of this file has to have, None where it need not say: what 1018h does
    not describe the device does not have, whatever stands in [DeviceInfo]. 0 is what a file has that does not
    say."""
    info = description.device_info
    vendor, product = (
        (description.number(0x1018, sub) or other or None) if description.entry(0x1018, sub) else None
        for sub, other in ((1, info.vendor_id), (2, info.product_code))
    )
    return vendor, product


def is_of(description: Description, vendor: int | None, product: int | None) -> bool:
    """Whether a node with this vendor and product is the device; None is what it does not say. A device whose
    numbers are 0 cannot be told from others."""
    info = description.device_info
    own = description.number(0x1018, 1) or info.vendor_id
    wanted = description.number(0x1018, 2) or info.product_code
    if not own or own != vendor:
        return False
    if product is None:
        return description.entry(0x1018, 1) is not None and description.entry(0x1018, 2) is None
    return bool(wanted) and wanted == product


def identity_lines(description: Description) -> Iterator[str]:
    """1000h and 1018h as far as the file has them."""
    info = description.device_info
    vendor, product = wanted_identity(description)
    facts = (
        ("vendor_id", 1, vendor, info.vendor_id),
        ("product_code", 2, product, info.product_code),
    )
    yield "[identity]"
    if not (vendor or product or info.vendor_id or info.product_code):
        yield "# The file has neither vendor nor product (0/0): any node is taken for this device."
    for key, sub, wanted, other in facts:
        if wanted and other and wanted != other:
            yield f"# The file contradicts itself: [DeviceInfo] has {key} {word(other, 4)}, 1018h counts."
        if other and not wanted:
            yield f"# [DeviceInfo] has {key} {word(other, 4)}, and the device no 1018h:{sub:02X} to compare."
        yield f"{key} = {word(wanted, 4)}" if wanted else f"# {key} = 0x"
    revision = description.number(0x1018, 3) or info.revision
    # Another firmware is the same device.
    yield f"# revision = {word(revision, 8)}" if revision else "# revision = 0x"
    yield ""
