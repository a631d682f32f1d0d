"""Checks of the drives' own supervision in a mapping file."""

from __future__ import annotations

from bridge.canopen.datatypes import INTEGERS
from bridge.mapping.checks_process import check_parameter, twice
from bridge.mapping.merge import MergedFile
from bridge.mapping.model import Family, OwnObject
from bridge.text import Text
from bridge.tomlfile import Key


def check_own_supervision(family: Family, file: MergedFile) -> None:
    entries = family.own_supervision
    named = [(one.name, ("own_supervision", n, "name")) for n, one in enumerate(entries)]
    twice(named, Text.of("mapping.noun_own_supervision"), file)
    for n, entry in enumerate(entries):
        key: Key = ("own_supervision", n)
        _check_object(entry, family, key, file)
        if entry.watches in ("heartbeat", "guarding") and (entry.per_drive or entry.unit_ms != 1.0):
            file.fault((*key, "watches"), Text.of("mapping.watch_of_node", kind=entry.watches))
        if entry.reaction is None:
            continue
        if entry.watches == "link":
            file.fault((*key, "reaction"), Text.of("mapping.reaction_of_link"))
        _check_object(entry.reaction, family, (*key, "reaction"), file)
        if entry.reaction.stop is not None and entry.reaction.stop in entry.reaction.nothing:
            file.fault((*key, "reaction", "stop"), Text.of("mapping.stop_runs_on"))


def _check_object(one: OwnObject, family: Family, key: Key, file: MergedFile) -> None:
    if (one.parameter is None) is (one.object is None):
        file.fault(key, Text.of("mapping.one_of_two"))
        return
    data_type, where = one.data_type, "data_type"
    if one.parameter is not None:
        if not check_parameter(one.parameter, family, (*key, "parameter"), file):
            return
        data_type, where = family.parameter_named(one.parameter).data_type, "parameter"
    if data_type not in INTEGERS:
        file.fault((*key, where), Text.of("mapping.no_whole_number", type=data_type))
