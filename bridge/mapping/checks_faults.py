"""Checks of the emergencies and faults of a mapping file."""

from __future__ import annotations

from typing import Final

from bridge.mapping.checks_process import check_parameter, twice
from bridge.mapping.faults import FORM_FIELD, FaultEntry
from bridge.mapping.merge import MergedFile
from bridge.mapping.model import Family
from bridge.text import Text
from bridge.tomlfile import Key

_WIDEST: Final = 32


def check_faults(family: Family, file: MergedFile) -> None:
    """Note in ``file`` all entries that do not go together."""
    emcy, faults = family.emcy, family.faults
    if emcy.events and emcy.event is None and emcy.number is None:
        file.fault(("emcy", "events"), Text.of("mapping.events_without_place"))
    if emcy.number is not None and emcy.number.byte + emcy.number.size > 8:
        file.fault(("emcy", "number"), Text.of("mapping.number_beyond_message"))
    for name, given in (("current", faults.current), ("last", faults.last)):
        if given is not None:
            check_parameter(given.parameter, family, ("faults", name, "parameter"), file)
    for field in FORM_FIELD.finditer(faults.form):
        if field[2] and not _WIDEST > int(field[2]) >= int(field[3]):
            said = Text.of("mapping.form_without_bits", field=field[0])
            file.fault(("faults", "form"), said, Text.of("mapping.form_without_bits_advice"))
    named: list[tuple[str, Key]] = [(one.name, ("fault", n, "name")) for n, one in enumerate(family.fault)]
    twice(named, Text.of("mapping.noun_fault"), file)
    known = known_faults(family)
    for name, key in [*named, *((name, ("faults", "german", name)) for name in faults.german)]:
        if name not in known and name.partition(".")[0] not in emcy.events:
            file.fault(key, Text.of("mapping.no_fault", name=name), Text.of("mapping.no_fault_advice"))
    for n, one in enumerate(family.fault):
        _check_languages(one, ("fault", n), file)
    kinds: list[tuple[str, Key]] = [(kind, ("faults", "kinds", name)) for name, kind in faults.kinds.items()]
    if faults.other_kind is not None:
        kinds.append((faults.other_kind, ("faults", "other_kind")))
    for kind, key in kinds:
        if kind not in faults.advice:
            there = tuple(sorted(faults.advice))
            hint = Text.of("mapping.it_has", names=there) if there else Text.of("mapping.it_has_none")
            file.fault(key, Text.of("mapping.no_kind", kind=kind), hint)


def known_faults(family: Family) -> dict[str, str]:
    """Faults that have a text, with it in English, by the name that a ``[[fault]]`` would have."""
    codes = {f"{code}h": text for code, text in family.emcy.codes.items()}
    return {**family.faults.texts, **family.emcy.events, **codes}


def _check_languages(one: FaultEntry, key: Key, file: MergedFile) -> None:
    """Check that a cause or remedy in one language is there in the other."""
    for field in ("cause", "remedy"):
        for language, other in (("en", "de"), ("de", "en")):
            if getattr(getattr(one, language), field) and not getattr(getattr(one, other), field):
                said = Text.of("mapping.one_language", field=field, language=language)
                file.fault((*key, other), said)
