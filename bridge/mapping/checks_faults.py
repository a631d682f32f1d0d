"""Checks of the emergencies and faults of a mapping file."""

from __future__ import annotations

from typing import Final

from bridge.mapping.checks_process import check_parameter, twice
from bridge.mapping.faults import FORM_FIELD, FaultEntry
from bridge.mapping.merge import MergedFile
from bridge.mapping.model import Family
from bridge.tomlfile import Key

_WIDEST: Final = 32


def check_faults(family: Family, file: MergedFile) -> None:
    """Note in ``file`` all entries that do not go together."""
    emcy, faults = family.emcy, family.faults
    if emcy.events and emcy.event is None and emcy.number is None:
        file.fault(("emcy", "events"), "has no meaning without emcy.event or emcy.number")
    if emcy.number is not None and emcy.number.byte + emcy.number.size > 8:
        file.fault(("emcy", "number"), "ends behind the message, which has bytes 0…7")
    for name, given in (("current", faults.current), ("last", faults.last)):
        if given is not None:
            check_parameter(given.parameter, family, ("faults", name, "parameter"), file)
    for field in FORM_FIELD.finditer(faults.form):
        if field[2] and not _WIDEST > int(field[2]) >= int(field[3]):
            file.fault(("faults", "form"), f"{field[0]} has no bits", "the higher one first, 31…0")
    twice(((one.name, ("fault", n, "name")) for n, one in enumerate(family.fault)), "fault", file)
    known = known_faults(family)
    named: list[tuple[str, Key]] = [(one.name, ("fault", n, "name")) for n, one in enumerate(family.fault)]
    for name, key in [*named, *((name, ("faults", "german", name)) for name in faults.german)]:
        if name not in known and name.partition(".")[0] not in emcy.events:
            hint = "it is in faults.texts, in emcy.events, or in emcy.codes with an h behind it"
            file.fault(key, f"there is no fault {name!r}", hint)
    for n, one in enumerate(family.fault):
        _check_languages(one, ("fault", n), file)
    kinds: list[tuple[str, Key]] = [(kind, ("faults", "kinds", name)) for name, kind in faults.kinds.items()]
    if faults.other_kind is not None:
        kinds.append((faults.other_kind, ("faults", "other_kind")))
    for kind, key in kinds:
        if kind not in faults.advice:
            hint = f"it has {', '.join(sorted(faults.advice)) or 'none'}"
            file.fault(key, f"faults.advice has no {kind!r}", hint)


def known_faults(family: Family) -> dict[str, str]:
    """Faults that have a text, with it in English, by the name that a ``[[fault]]`` would have."""
    codes = {f"{code}h": text for code, text in family.emcy.codes.items()}
    return {**family.faults.texts, **family.emcy.events, **codes}


def _check_languages(one: FaultEntry, key: Key, file: MergedFile) -> None:
    """Check that a cause or remedy in one language is there in the other."""
    for what in ("cause", "remedy"):
        for language, other in (("en", "de"), ("de", "en")):
            if getattr(getattr(one, language), what) and not getattr(getattr(one, other), what):
                file.fault((*key, other), f"has no {what}, which {language} has")
