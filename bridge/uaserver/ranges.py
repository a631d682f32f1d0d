"""NumericRange (OPC 10000-4 §7.27): a part of an array or of a text."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any, Final, cast

from bridge.uaserver.library import ua, variant

Ranges = tuple[slice, ...]
"""One slice for each dimension; the last may be that of the texts in an array. Empty: all of it."""

_RANGE: Final = re.compile(r"([0-9]{1,10})(?::([0-9]{1,10}))?")


def parse(written: str | None) -> Ranges:
    """``"2"``, ``"1:3"`` or ``"0:1,4"`` as slices. Raises ValueError for anything else."""
    return tuple(_slice(part) for part in written.split(",")) if written else ()


def _slice(written: str) -> slice:
    found = _RANGE.fullmatch(written)
    if found is None:
        raise ValueError(f"{written!r} is no index and no range")
    first, last = int(found[1]), int(found[2] or found[1])
    # "5:5" is none either: one element is written as one number.
    if found[2] and last <= first:
        raise ValueError(f"{written!r} does not rise")
    return slice(first, last + 1)


def can_have(whole: ua.Variant | None) -> bool:
    """Whether a value such as this has parts, now or once it is longer."""
    if whole is None or whole.Value is None:
        return True
    return isinstance(whole.Value, list | str | bytes)


def part(ranges: Ranges, whole: ua.Variant | None) -> ua.Variant | None:
    """Part of ``whole`` that lies within; None where nothing does. The upper bounds may lie beyond the
    end."""
    if not ranges:
        return whole
    taken = None if whole is None else _taken(whole.Value, ranges)
    return variant(taken, whole.VariantType) if whole is not None and taken else None


def _taken(value: Any, ranges: Ranges) -> Sequence[Any] | None:
    first, *rest = ranges
    if isinstance(value, str | bytes):
        return None if rest else value[first]
    if not isinstance(value, list):
        return None
    # Arrays of more than one dimension are not served, so a second range is that of texts in an array.
    elements = cast("list[Any]", value)[first]
    if not rest:
        return elements
    if len(rest) > 1 or not all(isinstance(element, str | bytes) for element in elements):
        return None
    texts = [element[rest[0]] for element in elements]
    return texts if any(texts) else None
