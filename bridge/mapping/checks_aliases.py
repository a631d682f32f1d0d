"""Checks of communication objects under any name: aliases are some, and no drive's start writes one."""

from __future__ import annotations

from bridge.mapping.alias_places import aliases, place_of
from bridge.mapping.aliases import COMMUNICATION
from bridge.mapping.merge import MergedFile
from bridge.mapping.model import Family
from bridge.text import Text
from bridge.tomlfile import Unfit


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
            except Unfit as error:
                file.fault(key, error.said)
                fine = False
            for ref in (ref for objects in targets for ref in objects):
                if ref.index not in COMMUNICATION:
                    said = Text.of("mapping.no_communication_object", object=str(ref))
                    file.fault(key, said, Text.of("mapping.no_communication_object_advice"))
    return fine


def _check_starts(family: Family, file: MergedFile) -> None:
    """Check that no start write sets what the boot-up sets by itself (PDOs, error control, identifiers)."""
    known = {(one.ref.index, one.ref.sub): one for one in aliases(family)}
    for s, slot in enumerate(family.slot):
        for n, start in enumerate(slot.start):
            alias = known.get((start.object.index, start.object.sub))
            if start.object.index in COMMUNICATION or alias:
                written = str(start.object)
                file.fault(
                    ("slot", s, "start", n, "object"),
                    Text.of("mapping.start_of_alias", object=written, other=str(alias.objects[0]))
                    if alias
                    else Text.of("mapping.start_of_communication", object=written),
                    Text.of("mapping.start_of_communication_advice"),
                )
