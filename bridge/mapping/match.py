"""Choice of the mapping file for a node that was found on a bus."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from bridge.mapping.model import Family, IdentityRule

_ALL: Final = 0xFFFF_FFFF


@dataclass(frozen=True, slots=True)
class Found:
    """Identity that a node reports; None where it reports none."""

    device_type: int | None = None
    vendor: int | None = None
    product: int | None = None
    revision: int | None = None
    device_name: str = ""


@dataclass(frozen=True, slots=True)
class Match:
    """Mapping that fits a node; ``by`` names the keys of ``[identity]`` that fit."""

    mapping: str
    by: tuple[str, ...]


def best_match(found: Found, families: Mapping[str, Family]) -> Match | None:
    """Family with the most identity rules of those whose rules all fit; None where no family has such rules.

    Where two fit equally well, one that is ``preferred``, then the first in the order of the names.
    """
    best: Match | None = None
    for name in sorted(families, key=lambda name: (not families[name].family.preferred, name)):
        by = _fits(found, families[name].identity)
        if by and (best is None or _weight(by) > _weight(best.by)):
            best = Match(name, by)
    return best


def _weight(by: tuple[str, ...]) -> tuple[int, bool]:
    """Weight of the keys that fit: a profile that many makers' devices have says less than anything else."""
    return len(by), by != ("device_type",)


def _fits(found: Found, rule: IdentityRule) -> tuple[str, ...]:
    """Keys that fit; none where one of them does not."""
    by: list[str] = []
    for key, want, mask, have in (
        ("device_type", rule.device_type, rule.device_type_mask, found.device_type),
        ("vendor_id", rule.vendor_id, None, found.vendor),
        ("product_code", rule.product_code, rule.product_code_mask, found.product),
        ("revision", rule.revision, rule.revision_mask, found.revision),
    ):
        if want is None:
            continue
        if have is None or (want ^ have) & (_ALL if mask is None else mask):
            return ()
        by.append(key)
    if rule.device_name is not None:
        if not re.search(rule.device_name, found.device_name, re.IGNORECASE):
            return ()
        by.append("device_name")
    return tuple(by)
