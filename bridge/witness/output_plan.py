"""Plan for a node that is no drive: its outputs, their frames, and their state when the node is stopped.

Which RPDO carries which output is read of the device description that the node has as its mapping, or, for a
mapping file, what the site file writes into the node, or the default of CiA 401. What the node does with its
outputs when it is stopped or hears nothing any more, too: CiA 401's error modes and values.
"""

from __future__ import annotations

import re
import struct
import tomllib
import unicodedata
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from bridge.config import BusTable, NodeTable, SafeValue
from bridge.witness.description import At, ObjectDictionary, Unreadable, describe

_RPDOS, _TPDOS = (0x1400, 0x1600), (0x1800, 0x1A00)
_MOST_PDOS: Final = 512
_MOST_MAPPED: Final = 64
_OFF, _LONG = 0x8000_0000, 0x2000_0000
"""Flags of a COB-ID: the PDO is not used; 29 bits (CiA 301 §7.5.2.35)."""
_DUMMIES: Final = range(0x0001, 0x0020)
_SPELT: Final = str.maketrans(
    {"ä": "ae", "ö": "oe", "ü": "ue", "ß": "ss", "æ": "ae", "œ": "oe", "ø": "oe", "å": "aa"}
    | {"đ": "d", "ł": "l", "ı": "i"}
)
_TYPES: Final = {
    0x01: "bool",
    0x02: "int8",
    0x03: "int16",
    0x04: "int32",
    0x05: "uint8",
    0x06: "uint16",
    0x07: "uint32",
    0x08: "real32",
    0x11: "real64",
    0x15: "int64",
    0x1B: "uint64",
}
"""Codes of data types (CiA 301 §7.4.7)."""
_REALS: Final = {"real32": "<f", "real64": "<d"}
_IN_ERROR: Final = {
    0x6200: (0x6206, 0x6207),
    0x6300: (0x6306, 0x6307),
    0x6320: (0x6326, 0x6327),
    0x6410: (0x6443, 0x6444),
    0x6411: (0x6443, 0x6444),
    0x6412: (0x6443, 0x6444),
}
"""Objects of CiA 401: error mode and error value of digital outputs in groups of 8, 16, 32, and of analogue
ones."""
_DIGITAL: Final = range(0x6200, 0x6400)
"""Digital outputs: each bit of their error mode lets that of the error value through. Analogue ones take the
error value where the mode is 1."""
_BEHAVIOUR: Final = (0x1029, 1)
_PRE_OPERATIONAL, _STAYS = 0, 1
"""Values of 1029h:01, the state after an error of communication; 2 is Stopped (CiA 301 §7.5.2.32)."""
_CONSUMER: Final = (0x1016, 1)
_CIA_401: Final = (
    (0x6200, "uint8", range(1, 9)),
    (0x6411, "int16", range(1, 5)),
    (0x6411, "int16", range(5, 9)),
    (0x6411, "int16", range(9, 13)),
)
"""Default RPDOs 1 to 4 of the profile: object, type, elements."""
_PREDEFINED: Final = (0x200, 0x300, 0x400, 0x500)


@dataclass(frozen=True, slots=True)
class Values:
    """The outputs in one PDO: ``mask`` has the bits of those that are not on hold, ``safe`` their values."""

    bytes: int
    mask: int
    safe: int

    def are_active(self, data: bytes) -> bool | None:
        """True if ``data`` sets one of the outputs to anything but its safe value; None where the frame does
        not have the mapped length."""
        if len(data) != self.bytes:
            return None
        return int.from_bytes(data, "little") & self.mask != self.safe


@dataclass(frozen=True, slots=True)
class OutputFrames:
    """Outputs of a node, as far as files tell. ``rpdos`` and ``tpdos`` are by identifier, ``event_ms`` the
    longest time between two of the latter, ``written`` the objects that move outputs or make them safe.
    ``own_ms`` is after how long the node notices a silent bridge, 0 where that is not known; ``why_active``
    why its outputs would stay as they are then, nothing where they become safe; ``why_unknown`` why nothing
    is known of its PDOs."""

    rpdos: Mapping[int, Values]
    tpdos: Mapping[int, Values]
    event_ms: int = 0
    written: frozenset[int] = frozenset()
    own_ms: int = 0
    why_active: str = ""
    why_unknown: str = ""


@dataclass(frozen=True, slots=True)
class _Output:
    """One output. ``safe`` is an integer without sign, None where it is on hold. ``mode`` and ``error`` are
    the objects of its error behaviour."""

    name: str
    at: At
    bits: int
    safe: int | None
    mode: At | None
    error: At | None


class _Unknown(Exception):
    """Reason why nothing can be known of the outputs."""


def output_frames(bus: BusTable, node: NodeTable, folder: Path) -> OutputFrames | None:
    """Outputs of a node, whose site file is in ``folder``; None where it has none."""
    try:
        if node.mapping.startswith("eds:"):
            description = _described(folder / node.mapping.removeprefix("eds:"), node.id, node.modules)
            numbers = _numbers(description) | _written(node, folder)
            outputs = _described_outputs(description, node)
            _refuse_unmapped(description.by_modules, numbers)
        else:
            numbers = _written(node, folder)
            try:
                outputs, profile = _mapped_outputs(node, folder)
            except (KeyError, ValueError, TypeError, AttributeError) as error:
                raise _Unknown(f"{node.mapping}: is no mapping file ({error})") from error
            numbers = _default_pdos(outputs, node.id, profile) | numbers
        if not outputs:
            return None
        rpdos, tpdos = (_pdos(numbers, bases, outputs) for bases in (_RPDOS, _TPDOS))
        if not rpdos:
            raise _Unknown("no file says which RPDO carries them")
    except (_Unknown, Unreadable, OSError, OverflowError) as error:
        return OutputFrames({}, {}, why_unknown=f"{error}")
    moved = {one.at[0] for one in outputs.values()}
    safe = {at[0] for one in outputs.values() for at in (one.mode, one.error) if at}
    own_ms = _own_ms(bus, node, numbers)
    return OutputFrames(
        {cob_id: values for cob_id, (values, _) in rpdos.items()},
        {cob_id: values for cob_id, (values, _) in tpdos.items()},
        max((event_ms for _, event_ms in tpdos.values()), default=0),
        frozenset(moved | safe | {_BEHAVIOUR[0]}),
        own_ms,
        _why_active(numbers, outputs),
    )


# a device description


def _described(path: Path, node_id: int, modules: Sequence[str] = ()) -> ObjectDictionary:
    try:
        return describe(path.read_bytes(), node_id, modules)
    except Unreadable as error:
        raise Unreadable(f"{path}: {error}") from None


def _numbers(description: ObjectDictionary) -> dict[At, int]:
    return {at: one.number for at, one in description.entries.items() if one.number is not None}


def _described_outputs(description: ObjectDictionary, node: NodeTable) -> dict[At, _Output]:
    """Outputs by object: those that RPDOs carry, also RPDOs that are off, and those that modules bring for
    them. All of them have names."""
    carried: list[At] = []
    found: dict[At, _Output] = {}
    names: set[str] = set()
    numbers, there = _numbers(description), {index for index, _ in description.entries}
    for number in range(_MOST_PDOS):
        if _RPDOS[0] + number not in there:
            continue
        carried += [(index, sub) for index, sub, _ in _entries(numbers, _RPDOS[1] + number)]
    for at in (*carried, *sorted(description.by_modules)):
        entry = description.entries.get(at)
        kind = _TYPES.get(entry.data_type or 0) if entry else None
        if kind is None or at[0] in _DUMMIES or at in found:
            continue
        index, sub = at
        name = _name(description.title(at), at)
        name = f"{name}_{index:04x}_{sub:02x}" if name in names else name
        names.add(name)
        mode, error = _IN_ERROR.get(index, (0, 0))
        safe = _safe(node.outputs.on_expiry.get(name, 0), kind)
        found[at] = _Output(name, at, _bits(kind), safe, (mode, sub), (error, sub))
    return found


def _refuse_unmapped(by_modules: Collection[At], numbers: Mapping[At, int]) -> None:
    """Raise ``_Unknown`` for outputs in no RPDO: a coupler maps its modules by itself, and no file may say
    where."""
    carried = {
        (index, sub)
        for number in range(_MOST_PDOS)
        if not numbers.get((_RPDOS[0] + number, 1), _OFF) & (_OFF | _LONG)
        for index, sub, _ in _entries(numbers, _RPDOS[1] + number)
    }
    lost = sorted(at for at in by_modules if at not in carried)
    if lost:
        named = ", ".join(f"{index:04X}:{sub:02X}" for index, sub in lost)
        raise _Unknown(f"no file says which RPDO carries {named}")


def _name(title: str, at: At) -> str:
    """Name of an output as in docs/how-to/generic-nodes.md: the title's words in lower case, umlauts written
    as two letters, accents left out."""
    spelt = unicodedata.normalize("NFC", title.lower()).translate(_SPELT)
    plain = re.sub("[\u0300-\u036f]", "", unicodedata.normalize("NFD", spelt))
    words = "_".join(re.findall("[a-z0-9]+", plain))
    return words if words[:1].isalpha() else f"object_{at[0]:04x}_{at[1]:02x}"


# a mapping file (docs/reference/mapping-file.md)


def _mapped_outputs(node: NodeTable, folder: Path) -> tuple[dict[At, _Output], int]:
    """Outputs by object, and the profile that the file names."""
    tables: dict[str, dict[str, Any]] = {}
    profile = 0
    for data in _chain(node.mapping, folder / "mappings"):
        for gone in data.get("without", ()):
            kind, _, name = gone.partition(":")
            if kind == "output":
                tables.pop(name, None)
        for table in data.get("output", ()):
            tables.setdefault(table["name"], {}).update(table)
        profile = data.get("family", {}).get("profile", profile)
    found: dict[At, _Output] = {}
    for name, table in tables.items():
        at, kind = _at(table["object"]), table["data_type"]
        safe: SafeValue = table.get("on_expiry", 0)
        safe = node.outputs.on_expiry.get(name, safe)
        raw = _safe(safe, kind, table.get("factor", 1.0), table.get("offset", 0.0))
        mode, error = (_at(table[key]) if key in table else None for key in ("error_mode", "error_value"))
        found[at] = _Output(name, at, _bits(kind), raw, mode, error)
    return found, profile


def _chain(mapping: str, folder: Path) -> list[dict[str, Any]]:
    """The file and those beside the site file that it extends, the last first. No mapping that comes with the
    program has outputs."""
    chain: list[dict[str, Any]] = []
    seen: set[str] = set()
    while mapping not in seen and (path := folder / f"{mapping}.toml").is_file():
        seen.add(mapping)
        try:
            chain.insert(0, tomllib.loads(path.read_text(encoding="utf-8")))
        except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
            raise _Unknown(f"{path}: {error}") from None
        mapping = chain[0].get("extends", "")
    return chain


def _at(text: str) -> At:
    index, _, sub = text.partition(":")
    return int(index, 16), int(sub or "0", 16)


def _default_pdos(outputs: Mapping[At, _Output], node_id: int, profile: int) -> dict[At, int]:
    """CiA 401's RPDOs, as the device has them that says so, as far as it has the outputs. None where one of
    them has an output that is in no such RPDO: then it is mapped in another way."""
    numbers: dict[At, int] = {}
    carried: set[At] = set()
    for place, (index, kind, subs) in enumerate(_CIA_401):
        ats = [(index, sub) for sub in subs if (index, sub) in outputs]
        carried |= {at for at in ats if outputs[at].bits == _bits(kind)}
        if ats:
            numbers[_RPDOS[0] + place, 1] = _PREDEFINED[place] + node_id
            numbers[_RPDOS[1] + place, 0] = len(ats)
            words = (index << 16 | at[1] << 8 | _bits(kind) for at in ats)
            numbers |= {(_RPDOS[1] + place, sub): word for sub, word in enumerate(words, 1)}
    return numbers if profile == 401 and carried == set(outputs) else {}


# both


def _written(node: NodeTable, folder: Path) -> dict[At, int]:
    """Numbers that the site file, or its configuration file, writes into the node, by object."""
    numbers: dict[At, int] = {}
    if node.configuration:
        entries = _described(folder / node.configuration, node.id).entries
        numbers = {
            at: one.number for at, one in entries.items() if one.is_configured and one.number is not None
        }
    for one in node.configure:
        download = one.download
        numbers[download.index, download.sub] = int.from_bytes(download.data, "little")
    if node.enforce and node.own_timeout_ms:
        # With its time-out, that it acts on it.
        numbers[_BEHAVIOUR] = _PRE_OPERATIONAL
    return numbers


def _bits(kind: str) -> int:
    return 1 if kind == "bool" else int(kind.lstrip("abcdefghijklmnopqrstuvwxyz"))


def _safe(value: SafeValue, kind: str, factor: float = 1.0, offset: float = 0.0) -> int | None:
    """Safe value as it is sent, without sign; None for "hold"."""
    if isinstance(value, str):
        return None
    number = (value - offset) / factor if (factor, offset) != (1.0, 0.0) and kind != "bool" else value
    if kind in _REALS:
        return int.from_bytes(struct.pack(_REALS[kind], number), "little")
    return round(number) & (1 << _bits(kind)) - 1


def _entries(numbers: Mapping[At, int], mapping: int) -> Iterator[tuple[int, int, int]]:
    """Index, sub-index and bits of the objects in a PDO."""
    for sub in range(1, min(numbers.get((mapping, 0), 0), _MOST_MAPPED) + 1):
        word = numbers.get((mapping, sub), 0)
        yield word >> 16 & 0xFFFF, word >> 8 & 0xFF, word & 0xFF


def _pdos(
    numbers: Mapping[At, int], bases: tuple[int, int], outputs: Mapping[At, _Output]
) -> dict[int, tuple[Values, int]]:
    """PDOs that are on and carry one of the outputs, by identifier, and their event timers in ms."""
    found: dict[int, tuple[Values, int]] = {}
    for number in range(_MOST_PDOS):
        cob_id = numbers.get((bases[0] + number, 1), _OFF)
        mapped = list(_entries(numbers, bases[1] + number))
        if cob_id & (_OFF | _LONG) or not any((index, sub) in outputs for index, sub, _ in mapped):
            continue
        place = mask = safe = 0
        for index, sub, bits in mapped:
            output = outputs.get((index, sub))
            if output and output.safe is not None and output.bits == bits:
                mask |= (1 << bits) - 1 << place
                safe |= output.safe << place
            place += bits
        event_ms = numbers.get((bases[0] + number, 5), 0)
        found[cob_id & 0x7FF] = Values((place + 7) // 8, mask, safe), event_ms
    return found


def _own_ms(bus: BusTable, node: NodeTable, numbers: Mapping[At, int]) -> int:
    """Time in ms after which the node notices that the bridge is silent; 0 where none is known."""
    times = [node.supervision_ms * node.life_time_factor] if node.supervision == "guarding" else []
    if bus.heartbeat_ms:
        watched = numbers.get(_CONSUMER, 0)
        is_ours = watched >> 16 & 0x7F == bus.master_node_id
        times += [node.own_timeout_ms or (watched & 0xFFFF if is_ours else 0)]
    return min((time_ms for time_ms in times if time_ms), default=0)


def _why_active(numbers: Mapping[At, int], outputs: Mapping[At, _Output]) -> str:
    """Reason why the outputs would stay as they are: the node keeps them when it leaves Operational, or does
    not leave it. Empty where they become safe."""
    if numbers.get(_BEHAVIOUR, _PRE_OPERATIONAL) == _STAYS:
        return "it stays operational: 1029:01 is 1"
    return next((why for one in outputs.values() if (why := _why_one(numbers, one))), "")


def _why_one(numbers: Mapping[At, int], output: _Output) -> str:
    if output.safe is None:
        return ""
    mode, error = (numbers.get(at) if at else None for at in (output.mode, output.error))
    if mode is None or error is None:
        return f"what {output.name} does then is in no file"
    name, full = f"{output.mode[0]:04X}:{output.mode[1]:02X}" if output.mode else "", (1 << output.bits) - 1
    takes = mode & full == full if output.at[0] in _DIGITAL else mode == 1
    if not takes:
        return f"{output.name} keeps its value: {name} is {mode:X}h"
    if error & full != output.safe:
        return f"{output.name} becomes {error & full:X}h, and not {output.safe:X}h"
    return ""
