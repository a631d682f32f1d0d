"""The ways in which device descriptions of the field differ from CiA 306: each makes one of a good file.

A dialect takes the text of an EDS and a source of chance, and returns the bytes of the file.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from random import Random
from typing import Final

Dialect = Callable[[str, Random], bytes]
_SECTION: Final = re.compile(r"^\[(.*)\]\s*$", re.MULTILINE)
_SUB: Final = re.compile(r"([0-9A-Fa-f]{4})sub([0-9A-Fa-f]+)", re.IGNORECASE)
_OBJECT: Final = re.compile(r"[0-9A-Fa-f]{4}")
_CORE: Final = ("1000", "1018", "6040", "6041")
"""Objects whose loss makes another device of it."""
_PDOS: Final = ("14", "16", "18", "1A")


def sections(text: str) -> list[tuple[str, list[str]]]:
    """The sections with their lines."""
    found: list[tuple[str, list[str]]] = []
    for line in text.splitlines():
        match = _SECTION.match(line)
        if match:
            found.append((match[1], []))
        elif found:
            found[-1][1].append(line)
    return found


def joined(parts: list[tuple[str, list[str]]]) -> str:
    return "\n".join("\n".join([f"[{name}]", *lines]) for name, lines in parts) + "\n"


def _keys(text: str, change: Callable[[str, str, str], str | None]) -> str:
    """Every line ``key=value`` of every section by ``change``, which gets those three; None drops it."""
    parts: list[tuple[str, list[str]]] = []
    for name, lines in sections(text):
        kept: list[str] = []
        for line in lines:
            key, equals, value = line.partition("=")
            new = change(name, key.strip(), value.strip()) if equals and not key.startswith(";") else line
            if new is not None:
                kept.append(new)
        parts.append((name, kept))
    return joined(parts)


def cp1252(text: str, chance: Random) -> bytes:
    names = ("Überlast", "Größe °C", "Prüfung – µs")

    def change(section: str, key: str, value: str) -> str:
        if key.lower() == "parametername":
            value = f"{value} {chance.choice(names)}"
        return f"{key}={value}"

    return _keys(text, change).encode("cp1252", "replace")


def byte_order_mark(text: str, chance: Random) -> bytes:
    return text.encode(chance.choice(("utf-8-sig", "utf-16")))


def lower_case(text: str, chance: Random) -> bytes:
    del chance
    return _SECTION.sub(
        lambda match: f"[{match[1].lower()}]",
        _keys(text, lambda section, key, value: f"{key.lower()}={value}"),
    ).encode()


def line_ends(text: str, chance: Random) -> bytes:
    return text.replace("\n", chance.choice(("\r\n", "\r", " \t\n", "\n\n"))).encode()


def spaces(text: str, chance: Random) -> bytes:
    def change(section: str, key: str, value: str) -> str:
        gap = " " * chance.randrange(3)
        return f"{gap}{key}{gap}={gap}{value}{gap}"

    return _keys(text, change).encode()


def duplicate_keys(text: str, chance: Random) -> bytes:
    """Keys come twice; the second time they say something else."""

    def change(section: str, key: str, value: str) -> str:
        line = f"{key}={value}"
        return f"{line}\n{key}=0x7F" if chance.random() < 0.1 and _OBJECT.match(section) else line

    return _keys(text, change).encode()


def duplicate_sections(text: str, chance: Random) -> bytes:
    parts = sections(text)
    again = [part for part in parts if chance.random() < 0.1]
    return joined([*parts, *again]).encode()


def missing_keys(text: str, chance: Random) -> bytes:
    """Any key of any object, but for types and defaults of what makes it the device that it is."""

    def change(section: str, key: str, value: str) -> str | None:
        is_core = section[:4].upper() in _CORE or section[:2].upper() in _PDOS
        drop = key.lower() in ("objecttype", "accesstype", "pdomapping", "parametername", "subnumber")
        return None if drop and not is_core and chance.random() < 0.15 else f"{key}={value}"

    return _keys(text, change).encode()


def no_types(text: str, chance: Random) -> bytes:
    """Objects of the maker without DataType."""

    def change(section: str, key: str, value: str) -> str | None:
        drop = key.lower() == "datatype" and section.startswith("2") and chance.random() < 0.2
        return None if drop else f"{key}={value}"

    return _keys(text, change).encode()


def node_id_forms(text: str, chance: Random) -> bytes:
    def form(match: re.Match[str]) -> str:
        number = match[1]
        forms = (
            f"{number}+$NODEID",
            f"$NodeId + {number}",
            f"$nodeid+{number}",
            f"$NODEID+{int(number, 16)}",
        )
        return chance.choice(forms)

    return re.sub(r"\$NODEID\s*\+\s*(0x[0-9A-Fa-f]+)", form, text, flags=re.IGNORECASE).encode()


def no_sub_0(text: str, chance: Random) -> bytes:
    """Sub-index 0 is not described, but for PDO mappings, where it says how much is mapped."""
    kept = [
        part
        for part in sections(text)
        if not (
            (match := _SUB.fullmatch(part[0])) and int(match[2], 16) == 0 and match[1][:2] not in ("16", "1A")
        )
        or chance.random() < 0.3
    ]
    return joined(kept).encode()


def wrong_counts(text: str, chance: Random) -> bytes:
    counts = ("subnumber", "supportedobjects", "nrofrxpdo", "nroftxpdo")

    def change(section: str, key: str, value: str) -> str:
        if key.lower() in counts:
            value = str(chance.randrange(1, 40))
        return f"{key}={value}"

    return _keys(text, change).encode()


def compact(text: str, chance: Random) -> bytes:
    """Arrays of equal elements as CompactSubObj."""
    del chance
    parts = sections(text)
    subs: dict[str, list[list[str]]] = {}
    for name, lines in parts:
        if (match := _SUB.fullmatch(name)) and int(match[2], 16):
            subs.setdefault(match[1].upper(), []).append(lines)
    kept: list[tuple[str, list[str]]] = []
    fits = {
        index
        for index, each in subs.items()
        if _are_alike(each) and index[:2] not in ("14", "16", "18", "1A")
    }
    fits -= {"1018"}
    for name, lines in parts:
        match = _SUB.fullmatch(name)
        if match and match[1].upper() in fits:
            continue
        if name.upper() in fits:
            each = subs[name.upper()]
            typed = [line for line in each[0] if not line.lower().startswith("parametername")]
            head = [line for line in lines if line.lower().startswith("parametername")]
            lines = [*head, *[line for line in typed if "ObjectType" not in line], "ObjectType=0x8"]
            lines.append(f"CompactSubObj={len(each)}")
        kept.append((name, lines))
    return joined(kept).encode()


def _are_alike(subs: list[list[str]]) -> bool:
    def facts(lines: list[str]) -> list[str]:
        return sorted(
            line for line in lines if line.lower().startswith(("datatype", "accesstype", "pdomapping"))
        )

    return len(subs) > 1 and all(facts(one) == facts(subs[0]) for one in subs)


def noise(text: str, chance: Random) -> bytes:
    """Comments, lines that belong nowhere, and sections that nobody knows."""
    lines: list[str] = []
    for line in text.splitlines():
        if chance.random() < 0.05:
            lines.append(chance.choice(("; remark", "stray line", "// remark", "# 1 = 2", "")))
        lines.append(line)
    return "\n".join([*lines, "[Tool]", "Owner=nobody", "", "[]", "[broken", "x", ""]).encode()


def shuffled(text: str, chance: Random) -> bytes:
    parts = sections(text)
    chance.shuffle(parts)
    return joined(parts).encode()


def odd_numbers(text: str, chance: Random) -> bytes:
    """Numbers in decimal, with other prefixes, with leading zeros."""

    def change(section: str, key: str, value: str) -> str:
        if re.fullmatch(r"0x[0-9A-Fa-f]{1,8}", value):
            number = int(value, 16)
            value = chance.choice((value, f"0X{number:X}", f"0x{number:08x}", str(number)))
        return f"{key}={value}"

    return _keys(text, change).encode()


def no_values(text: str, chance: Random) -> bytes:
    """Defaults of the maker's objects are empty."""

    def change(section: str, key: str, value: str) -> str:
        if (
            key.lower() in ("defaultvalue", "lowlimit", "highlimit")
            and section[:1] in "26"
            and chance.random() < 0.3
        ):
            value = ""
        return f"{key}={value}"

    return _keys(text, change).encode()


def no_last_line_end(text: str, chance: Random) -> bytes:
    """The last line has no end, or is a remark of a kind that CiA 306 does not have."""
    return (text.rstrip() + chance.choice(("", "\n// end", "\n-- end --", "\n*** EOF ***"))).encode()


def joined_encodings(text: str, chance: Random) -> bytes:
    """Lines in UTF-8 among lines in Windows-1252, as of two files that were joined."""
    encodings = ("utf-8", "cp1252")

    def change(section: str, key: str, value: str) -> str:
        return f"{key}={value} Größe" if key.lower() == "parametername" else f"{key}={value}"

    lines = _keys(text, change).splitlines()
    return b"\n".join(line.encode(chance.choice(encodings), "replace") for line in lines) + b"\n"


def vendor_alone(text: str, chance: Random) -> bytes:
    """1018h has the vendor alone, and [DeviceInfo] a product number all the same."""
    del chance
    further = ("1018sub2", "1018sub3", "1018sub4")
    parts = [part for part in sections(text) if part[0].lower() not in further]
    for name, lines in parts:
        if name.lower() == "deviceinfo":
            lines[:] = [line for line in lines if not line.lower().startswith("productnumber")]
            lines.append("ProductNumber=1")
        elif name.lower() == "1018":
            lines[:] = [line for line in lines if not line.lower().startswith("subnumber")]
            lines.append("SubNumber=2")
    return joined(parts).encode()


def modular(text: str, chance: Random) -> bytes:
    """A device that could have modules, of which some are plugged in: they bring an object of their own and
    elements of another."""
    spelt = chance.choice((str, str.lower, str.upper))
    parts = [
        ("SupportedModules", ["NrOfEntries=2"]),
        ("M1ModuleInfo", ["ProductName=Inputs", "OrderCode=IN 8"]),
        ("M1FixedObjects", ["NrOfEntries=1", "1=0x2FF1"]),
        ("M1Fixed2FF1", ["ParameterName=Filter", "ObjectType=0x7", "DataType=0x6", "AccessType=rw"]),
        ("M2ModuleInfo", ["ProductName=Gains"]),
        ("M2SubExtends", ["NrOfEntries=1", "1=0x2FF2"]),
        ("M2SubExt2FF2", ["ParameterName=Gain", "DataType=0x6", "AccessType=rw", "PDOMapping=0"]),
    ]
    parts[-1][1].append(f"Count={chance.choice(('1', '2', '0;8'))}")
    plugged = [chance.choice((1, 2)) for _ in range(chance.randrange(5))]
    if plugged:
        listed = [f"{place}={number}" for place, number in enumerate(plugged, 1)]
        parts.append(("ConnectedModules", [f"NrOfEntries={len(plugged)}", *listed]))
    return (joined(sections(text)) + joined([(spelt(name), lines) for name, lines in parts])).encode()


DIALECTS: Final[dict[str, Dialect]] = {
    one.__name__: one
    for one in (
        cp1252, byte_order_mark, lower_case, line_ends, spaces, duplicate_keys, duplicate_sections,
        missing_keys, no_types, node_id_forms, no_sub_0, wrong_counts, compact, noise, shuffled, odd_numbers,
        no_values, no_last_line_end, joined_encodings, vendor_alone, modular,
    )
}  # fmt: skip


def in_every_dialect(text: str, seed: int) -> Iterator[tuple[str, bytes]]:
    """The file in each dialect, by the dialect's name; the same for the same seed."""
    for name, dialect in DIALECTS.items():
        yield name, dialect(text, Random(f"{name} {seed}"))
