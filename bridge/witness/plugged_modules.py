"""Modules of a coupler as the witness reads them (CiA 306): the modules plugged in, and the elements of
shared objects that they bring."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import Final

Sections = dict[tuple[int, int | None], dict[str, str]]
"""Keys in lower case and their values, of objects and elements by index and sub-index."""
_HEAD: Final = re.compile(
    r"\[\s*(?:M\s*(\d+)\s*(ModuleInfo|SubExt([0-9a-f]{4})|Fixed([0-9a-f]{4})(?:sub([0-9a-f]{1,2}))?)"
    r"|(ConnectedModules))\s*\]",
    re.IGNORECASE,
)
_BITS: Final = {1: 1, 2: 8, 5: 8, 3: 16, 6: 16, 4: 32, 7: 32}
"""Bits by data type, for digital inputs and outputs (CiA 301 §7.4.7)."""
_LAST: Final = 0xFE


def plug(sections: Sections, text: str, names: Sequence[str]) -> frozenset[tuple[int, int]]:
    """Add to ``sections`` the objects of the modules with these names, or of those that the file says are
    plugged in. Returns the elements of shared objects that an RPDO may set."""
    found = list(_modules(text))
    plugged = [_number_of(name, found) for name in names]
    if not names:
        connected = [keys for _, kind, _, keys in found if kind == "connectedmodules"][:1]
        places = sorted(
            (int(key), value) for keys in connected for key, value in keys.items() if key.isdigit()
        )
        plugged = [_whole(value) for _, value in places]
    ends: dict[int, list[int]] = {}
    outputs: set[tuple[int, int]] = set()
    there = {index for index, sub in sections if sub}
    for number in plugged:
        for whose, kind, at, keys in found:
            if whose != number or at is None:
                continue
            if kind == "fixed":
                sections.setdefault(at, keys)
            elif names or at[0] not in there:
                end = ends.setdefault(at[0], [at[0], _highest(sections, at[0]), 0])
                for new in _elements(end, keys):
                    sections[new] = {**keys, "parametername": f"{keys.get('parametername', '')} {new[1]}"}
                    sections.setdefault((new[0], None), {"parametername": keys.get("parametername", "")})
                    if keys.get("accesstype", "rw").lower() not in ("ro", "const"):
                        outputs.add(new)
    return frozenset(at for at in outputs if _whole(sections[at].get("pdomapping", "0")))


_Part = tuple[int, str, tuple[int, int | None] | None, dict[str, str]]
"""Section of a module: module, kind, object or element, and keys."""


def _modules(text: str) -> Iterator[_Part]:
    keys: dict[str, str] | None = None
    for line in (one.strip() for one in re.split(r"\r\n|\n|\r", text)):
        if line.startswith("["):
            keys = None
            if match := _HEAD.match(line):
                number, kind, extended, fixed, sub, connected = match.groups()
                keys = {}
                at = (
                    None
                    if not (extended or fixed)
                    else (int(extended or fixed, 16), int(sub, 16) if sub else None)
                )
                name = "subext" if extended else "fixed" if fixed else (kind or connected).lower()
                yield int(number or 0), name, at, keys
        elif keys is not None:
            key, _, value = line.partition("=")
            if value.strip():
                keys.setdefault(key.strip().lower(), value.strip())


def _number_of(name: str, found: Sequence[_Part]) -> int:
    wanted = _plain(name)
    for key in ("ordercode", "productname"):
        for number, kind, _, keys in found:
            if kind == "moduleinfo" and _plain(keys.get(key, "")) == wanted:
                return number
    return _whole(name)


def _plain(text: str) -> str:
    return re.sub(r"\s+", "", text).lower()


def _whole(text: str) -> int:
    try:
        return int(text, 16 if text.lower().startswith("0x") else 10)
    except ValueError:
        return -1


def _highest(sections: Sections, index: int) -> int:
    return max((sub for at, sub in sections if at == index and sub and sub <= _LAST), default=0)


def _elements(end: list[int], keys: dict[str, str]) -> Iterator[tuple[int, int]]:
    """Next elements after ``end``: index, sub-index, and free bits."""
    count, _, shared = keys.get("count", "").partition(";")
    wanted, bits = max(0, _whole(count)), max(0, _whole(shared or "0"))
    if wanted:
        end[2] = 0
    else:
        width = _BITS.get(_whole(keys.get("datatype", "5")), 8)
        while end[2] < bits:
            end[2] += width
            wanted += 1
        end[2] -= bits
    last = max(0, _whole(keys.get("objextend", "0")))
    for _ in range(wanted):
        end[1] += 1
        if last and end[1] > last:
            end[0], end[1] = end[0] + 1, 1
        if end[1] <= _LAST:
            yield end[0], end[1]
