"""The parameters of a device description as ``[[parameter]]`` tables."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping, Sequence
from typing import Final

from bridge.canopen.datatypes import INTEGERS, REALS, TypeName, encode
from bridge.derive.modes import PROFILE_402
from bridge.derive.toml import number, one_line, string, value
from bridge.eds import Description, Entry, StaticDataType, Value
from bridge.mapping.axes import STANDARDISED, profile_of
from bridge.mapping.model import Parameter
from bridge.parameter.profiles import effect_of
from bridge.parameter.write_effect import Effect

TYPES: Final[dict[StaticDataType, TypeName]] = {
    StaticDataType.BOOLEAN: "bool",
    StaticDataType.INTEGER8: "int8",
    StaticDataType.INTEGER16: "int16",
    StaticDataType.INTEGER32: "int32",
    StaticDataType.INTEGER64: "int64",
    StaticDataType.UNSIGNED8: "uint8",
    StaticDataType.UNSIGNED16: "uint16",
    StaticDataType.UNSIGNED32: "uint32",
    StaticDataType.UNSIGNED64: "uint64",
    StaticDataType.REAL32: "real32",
    StaticDataType.REAL64: "real64",
    StaticDataType.VISIBLE_STRING: "string",
    StaticDataType.OCTET_STRING: "bytes",
    StaticDataType.UNICODE_STRING: "bytes",
    StaticDataType.TIME_OF_DAY: "bytes",
    StaticDataType.TIME_DIFFERENCE: "bytes",
    StaticDataType.DOMAIN: "bytes",
}
"""Types that a parameter may have; INTEGER24 and its like are not among them."""
MANUFACTURER: Final = range(0x2000, 0x6000)
PROFILE: Final = profile_of(1)
FURTHER_AXES: Final = range(PROFILE.stop, STANDARDISED.stop)
_OF_BASE: Final = frozenset((0x6040, 0x6042, 0x6071, 0x607A, *range(0x60B0, 0x60B3), 0x60FF))
"""Objects that command a drive and are no parameters of the base."""


def parameter_name(index: int, sub: int, *, has_subs: bool) -> str:
    """Name as ``cia402/base`` writes it: 6083, 6046:01."""
    return f"{index:04X}:{sub:02X}" if has_subs else f"{index:04X}"


def entries_of(
    description: Description, spans: Sequence[range] = (MANUFACTURER, PROFILE)
) -> Iterator[tuple[str, Entry]]:
    """Every entry of the maker's and the profile's objects that can be a parameter, by its name."""
    for one in description.objects:
        if not any(one.index in span for span in spans):
            continue
        has_subs = one.object_type.has_subs
        for entry in one.entries:
            if not (has_subs and entry.sub == 0):  # how many there are
                yield parameter_name(one.index, entry.sub, has_subs=has_subs), entry


def parameter_lines(
    name: str,
    entry: Entry,
    title: str,
    known: Mapping[str, Parameter],
    in_pdos: Container[tuple[int, int]],
    profile: int | None,
) -> list[str]:
    """The table of one entry; of one that is ``known`` from what the mapping extends only what differs. Empty
    where there is nothing to say. ``profile`` is the device's."""
    if entry.index in _OF_BASE or (entry.index, entry.sub) in in_pdos:
        return []
    kind = TYPES.get(entry.data_type) if entry.data_type else None
    if kind is None:
        what = entry.data_type.name if entry.data_type else "not known"
        return [f"# {name} {one_line(title)}: its type is {what}, which no parameter has", ""]
    if name in known:
        facts = [*_changes(entry, kind, known[name]), *_limits(entry, kind)]
        facts += _default(entry, kind)
        return ["[[parameter]]", f"name = {string(name)}", *facts, ""] if facts else []
    lines = ["[[parameter]]", f"name = {string(name)}", f"title = {string(title or name)}"]
    lines.append(f"data_type = {string(kind)}")
    if kind in INTEGERS and kind != "bool":
        lines += ['# unit = ""', "# factor = 1.0"]
    elif kind in REALS:
        lines.append('# unit = ""')
    lines += _limits(entry, kind)
    if _access(entry) != "rw":
        lines.append(f"access = {string(_access(entry))}")
    lines += _protection(entry, profile)
    lines += _default(entry, kind)
    if entry.data_type is StaticDataType.DOMAIN:
        lines.append("backup = false")
    return [*lines, ""]


def _access(entry: Entry) -> str:
    if not entry.access.writable:
        return "ro"
    return "rw" if entry.access.readable else "wo"


def _changes(entry: Entry, kind: TypeName, known: Parameter) -> Iterator[str]:
    if kind != known.data_type:
        yield f"data_type = {string(kind)}"
    if _access(entry) != known.access:
        yield f"access = {string(_access(entry))}"


def _protection(entry: Entry, profile: int | None) -> Iterator[str]:
    """Protection of an entry. An object that can be mapped into an RPDO is made to command the device: of the
    maker's objects nobody says how, and those of a drive's profile begin no movement while it is disabled.
    What the profile itself says of an object is known without the file."""
    if effect_of(entry.index, profile) or not (entry.pdo_mappable and entry.access.writable):
        return
    is_drives = profile == PROFILE_402 and entry.index in PROFILE
    yield f"protected = {string(Effect.OPERATES.value if is_drives else Effect.MAY_MOVE.value)}"


def _limits(entry: Entry, kind: TypeName) -> Iterator[str]:
    """``low`` and ``high``, where they are narrower than the type and do not contradict each other."""
    low, high = _number(entry.low), _number(entry.high)
    if kind not in INTEGERS and kind not in REALS:
        return
    if low is not None and high is not None and low > high:
        yield f"# low = {low}, high = {high}: the file contradicts itself"
        return
    for key, limit in (("low", low), ("high", high)):
        if limit is None:
            continue
        widest = INTEGERS.get(kind)
        if widest and (limit <= widest.low if key == "low" else limit >= widest.high):
            continue
        try:
            yield f"{key} = {number(limit)}"
        except ValueError as error:
            yield f"# {key}: {error}"


def _default(entry: Entry, kind: TypeName) -> Iterator[str]:
    """The value as delivered, if it is one of this type on every node."""
    plain = entry.default.at(None) if entry.default else None
    if plain is None:
        return
    if isinstance(plain, bytes):
        plain = plain.hex()
    if kind == "bool":
        plain = bool(plain)
    elif kind in REALS and isinstance(plain, int):
        plain = float(plain)
    low, high = _number(entry.low), _number(entry.high)
    if isinstance(plain, int | float) and kind != "bool":
        is_within = (low is None or low <= plain) and (high is None or plain <= high)
        if not is_within and not (low is not None and high is not None and low > high):
            yield f"# default = {plain}: the file contradicts itself, it is beyond low or high"
            return
    try:
        encode(kind, plain)
        yield f"default = {value(plain)}"
    except (ValueError, OverflowError) as error:
        yield f"# default = {one_line(str(plain))}: {error}"


def _number(limit: Value | None) -> int | float | None:
    plain = limit.at(None) if limit else None
    return plain if isinstance(plain, int | float) else None
