"""Checks of communication objects under any name: aliases are some, and no drive's start writes one."""

from __future__ import annotations

from bridge.mapping.alias_places import aliases, place_of
from bridge.mapping.aliases import COMMUNICATION
from bridge.mapping.merge import MergedFile
from bridge.mapping.model import Family


def check_aliases(family: Family, file: MergedFile) -> None:
    if _are_known(family, file):
        _check_starts(family, file)


def _are_known(family: Family, file: MergedFile) -> bool:
    fine = True
    for kind, table in (("same", family.aliases.same), ("related", family.aliases.related)):
        for name, targets in table.items():
            key = ("aliases", kind, name)
            try:
                place_of(family, name)
            except ValueError as error:
                file.fault(key, str(error))
                fine = False
            for ref in (ref for objects in targets for ref in objects):
                if ref.index not in COMMUNICATION:
                    file.fault(key, f"{ref} is no communication object", "those are 1000 … 1FFF")
    return fine


def _check_starts(family: Family, file: MergedFile) -> None:
    """Check that no start write sets what the boot-up sets by itself (PDOs, error control, identifiers)."""
    known = {(one.ref.index, one.ref.sub): one for one in aliases(family)}
    for s, slot in enumerate(family.slot):
        for n, start in enumerate(slot.start):
            alias = known.get((start.object.index, start.object.sub))
            if start.object.index in COMMUNICATION or alias:
                what = f"{start.object} stands for {alias.objects[0]}, which" if alias else f"{start.object}"
                file.fault(
                    ("slot", s, "start", n, "object"),
                    f"{what} belongs to the communication",
                    "the keys of the slot's PDOs set theirs, the site file sets the others",
                )
