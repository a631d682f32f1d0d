"""Reads single fields of a section; a bad one is reported and left out, and raises nothing."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, TypeVar

from bridge.eds.ini import IniValue, Section, shown
from bridge.eds.model import Access, Report, StaticDataType, Value
from bridge.eds.value_text import BadValue, integer, value
from bridge.text import Said, Text

T = TypeVar("T")

_ACCESS: Final = {
    "readonly": Access.RO,
    "r": Access.RO,
    "writeonly": Access.WO,
    "w": Access.WO,
    "readwrite": Access.RW,
    "wr": Access.RW,
    "rwrw": Access.RW,
    "constant": Access.CONST,
}
"""Words that files use although the standard does not have them."""


class Fields:
    """The fields of one file."""

    def __init__(self, report: Report) -> None:
        self._report = report

    def number(self, section: Section, name: str, low: int = 0, high: int = 0xFFFF_FFFF) -> int | None:
        """A whole number from ``low`` to ``high``, or None if there is none."""
        found = section.get(name)
        if found is None:
            return None
        number = self.whole(found, name)
        if number is not None and not low <= number <= high:
            said = Text.of("eds.not_within", key=name, value=shown(found.text), low=low, high=high)
            self._report.error(found.line, said)
            return None
        return number

    def whole(self, found: IniValue, name: str) -> int | None:
        return self._read(found, name, lambda: integer(found.text))

    def flag(self, section: Section, name: str) -> bool:
        """0 or 1; any other number that is not 0 is taken as 1."""
        found = section.get(name)
        if found is None:
            return False
        if found.text.lower() in ("true", "false", "yes", "no"):
            self._report.warning(found.line, Text.of("eds.not_a_flag", key=name, value=shown(found.text)))
            return found.text.lower() in ("true", "yes")
        number = self.whole(found, name)
        if number not in (None, 0, 1):
            self._taken(found, name, "1")
        return bool(number)

    def value(self, section: Section, name: str, data_type: StaticDataType | None) -> Value | None:
        found = section.get(name)
        return None if found is None else self.value_of(found, name, data_type)

    def value_of(self, found: IniValue, name: str, data_type: StaticDataType | None) -> Value | None:
        return self._read(found, name, lambda: value(found.text, data_type))

    def _read(self, found: IniValue, name: str, read: Callable[[], tuple[T, Said]]) -> T | None:
        """Result of ``read``, with a warning of its note; None where it raises BadValue."""
        try:
            one, note = read()
        except BadValue as error:
            self._report.error(found.line, Text.of("eds.field_left_out", key=name, why=error.said))
            return None
        if note:
            self._report.warning(found.line, Text.of("eds.field_is_odd", key=name, note=note))
        return one

    def _taken(self, found: IniValue, name: str, taken: str) -> None:
        said = Text.of("eds.key_taken_as", key=name, value=shown(found.text), taken=taken)
        self._report.warning(found.line, said)

    def access(self, found: IniValue | None, default: Access, line: int, whose: str) -> Access:
        """The access; if it is missing or unknown, that is reported and ``default`` is taken."""
        if found is None:
            self._report.warning(line, Text.of("eds.no_access", object=whose, access=default))
            return default
        word = found.text.lower()
        if word in {one.value for one in Access}:
            return Access(word)
        known = _ACCESS.get(word.replace("_", "").replace("-", "").replace(" ", ""))
        taken = known or default
        self._taken(found, "AccessType", taken)
        return taken
