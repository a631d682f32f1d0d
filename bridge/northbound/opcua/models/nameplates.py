"""Nameplates of drives: what their families say of them, for those who know drives by their type."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from bridge.catalogue import Catalogue

UNKNOWN: Final = "any"
"""Vendor of a family that is anybody's."""


@dataclass(frozen=True, slots=True)
class Nameplate:
    """``manufacturer`` and ``model`` are "" where nobody knows them, ``drive_type`` is as the mapping file
    calls it."""

    manufacturer: str = ""
    model: str = ""
    drive_type: str = ""


def nameplates_of(catalogue: Catalogue) -> dict[str, Nameplate]:
    """Nameplates by the drive's name, ``<node>/<drive>``."""
    made: dict[str, Nameplate] = {}
    for name, drive in catalogue.drives.items():
        family = drive.family.family
        known = family.vendor != UNKNOWN
        made[name] = Nameplate(
            family.vendor if known else "", family.name if known else "", family.drive_type or ""
        )
    return made
