"""A fault as its maker writes it, with its text, cause and remedy.

Both are the manual's where it explains the fault. Where it does not, they are general advice for its kind:
marked as general, with the manual that knows more behind it.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final, Literal

from bridge.mapping.faults import FORM_FIELD, Explanation
from bridge.mapping.model import Family
from bridge.text import Text, Words, render

Language = Literal["en", "de"]
_DECIMAL: Final = ("number", "group")
"""Fields of a form for numbers such as 10.3; the others take a whole number apart."""
_GENERAL: Final[dict[Language, tuple[str, str, str]]] = {
    "en": ("Possible causes: {}.", "General advice: {}", " Details: {}."),
    "de": ("Mögliche Ursachen: {}.", "Allgemeiner Rat: {}", " Genaueres: {}."),
}
"""Marks of general advice, by language: its cause, its remedy, and the manual behind it."""


_NUMBERS: Final = re.compile(r"(\d+\.\d)[\d./… ]*")
"""Numbers of the drive's own before the text of a code: 20.1 … 21.3."""


@dataclass(frozen=True, slots=True)
class Explained:
    """A fault explained. ``number`` is in the maker's form; a text is empty where nobody says anything."""

    number: str = ""
    text: Words = ""
    cause: str = ""
    remedy: str = ""

    def __str__(self) -> str:
        return render(self.said)

    @property
    def said(self) -> Words:
        """Number and text, as far as they are there."""
        if not self.number:
            return self.text
        if not self.text:
            return Text.of("fault.number", number=self.number)
        return Text.of("fault.numbered", number=self.number, text=self.text)


class FaultWords:
    """Explanations of one family's faults, in one language."""

    def __init__(self, family: Family, language: Language = "en") -> None:
        self._emcy, self._faults = family.emcy, family.faults
        self._language: Language = language
        self._german = family.faults.german if language == "de" else {}
        self._entries = {one.name: one for one in family.fault}
        fields = {field[1] for field in FORM_FIELD.finditer(self._faults.form)}
        self._is_decimal = bool(fields.intersection(_DECIMAL))
        self._is_code = "hex" in fields
        number = self._emcy.number
        self._mask = number.mask if number else None
        self._no_faults = no_faults(family)

    def own(self, fault: float) -> Explained:
        """Fault found by the bridge, under the number that the family has for it."""
        name = f"{fault:.1f}"
        return self._explained(f"{self._faults.prefix}{name}", name, self._text(name))

    def of_drive(self, fault: float, cause: int | None = None, text: Words = "") -> Explained:
        """Fault told by the drive: by its number, or by that of an event and the ``cause`` that came with it.
        ``text`` is that of the emergency code, for numbers that have none."""
        name = self._name(fault)
        number = self._decimal(name) if "." in name else self._whole(int(fault))
        found = self._text(name) or text
        if not cause:
            return self._explained(number, name, found)
        exact = f"{name}.{cause}"
        said = self._explained(number, exact, self._text(exact) or found)
        told = Text.of("fault.with_cause", text=said.text, cause=cause)
        return Explained(number, told, said.cause, said.remedy)

    def knows(self, fault: float) -> bool:
        """Whether the family has a text for what a drive tells."""
        return bool(self._text(self._name(fault)))

    def of_code(self, code: int) -> Explained:
        """Fault by an emergency message that has nothing but its code."""
        name = f"{code:04X}h"
        return self._explained(name, name, self._text(name))

    def code_text(self, code: int) -> Words:
        """Text of an emergency code."""
        return self._text(f"{code:04X}h")

    def listed(self, name: str) -> Explained:
        """A fault by the name that the mapping file has for it: ``10.3``, ``41``, ``52.1``, ``8130h``."""
        if name.endswith("h"):
            return self._explained(name, name, self._german.get(name) or self._code_text(name[:-1]))
        number = self._decimal(name) if "." in name else self._whole(int(name), self._mask)
        return self._explained(number, name, self._text(name))

    def _name(self, fault: float) -> str:
        """Name of a number in the mapping file."""
        decimal = f"{fault:.1f}"
        if decimal in self._faults.texts or fault != int(fault):
            return decimal
        whole = int(fault)
        if self._is_code:
            return f"{whole:04X}h"
        return str(whole & self._mask if self._mask else whole)

    def _text(self, name: str) -> Words:
        if german := self._german.get(name):
            return german
        if name.endswith("h"):
            return self._code_text(name[:-1]) or self._emcy.text(int(name[:-1], 16))
        return self._faults.texts.get(name) or self._emcy.events.get(name) or ""

    def _code_text(self, code: str) -> str:
        """Text of an emergency code, or of a group, that the family lists; "" for any other. One that begins
        with the drive's own numbers has their German."""
        text = self._emcy.codes.get(code, "")
        numbers = _NUMBERS.match(text)
        german = self._german.get(numbers[1]) if numbers else None
        return f"{numbers[0]}{german}" if numbers and german else text

    def _decimal(self, name: str) -> str:
        highest = self._faults.form_to
        if not self._is_decimal or (highest is not None and float(name) > highest):
            return name
        group = name.partition(".")[0]

        def digits(field: re.Match[str]) -> str:
            return (group if field[1] == "group" else name).rjust(int(field[4] or 0), "0")

        return FORM_FIELD.sub(digits, self._faults.form)

    def _whole(self, number: int, mask: int | None = None) -> str:
        """Number in the maker's form. Bits beside ``mask`` are not known, and shown as x."""
        form = self._faults.form
        if not form or self._is_decimal:
            return str(number)

        def digits(field: re.Match[str]) -> str:
            count = int(field[4] or 0)
            if field[1] == "hex":
                return f"{number:0{count}X}"
            high, low = int(field[2]), int(field[3])
            bits = (1 << high - low + 1) - 1
            if mask is not None and not mask >> low & bits:
                return "x" * count
            return f"{number >> low & bits:0{count}}"

        return FORM_FIELD.sub(digits, form)

    def _explained(self, number: str, name: str, text: Words) -> Explained:
        if name in self._no_faults:
            return Explained(number, text)
        names = _from_exact_to_group(name)
        entry = next((self._entries[one] for one in names if one in self._entries), None)
        said = getattr(entry, self._language) if entry else Explanation.model_validate({})
        if not (said.cause or said.remedy):
            said = self._general(names) or said
        return Explained(number, text, said.cause, said.remedy)

    def _general(self, names: tuple[str, ...]) -> Explanation | None:
        """General advice for a fault that nobody explains; None where the family has none for its kind."""
        faults = self._faults
        kind = next((faults.kinds[one] for one in names if one in faults.kinds), faults.other_kind)
        if kind is None:
            return None
        cause, remedy, details = _GENERAL[self._language]
        advised, elsewhere = getattr(faults.advice[kind], self._language), faults.elsewhere
        more = details.format(getattr(elsewhere, self._language)) if elsewhere is not None else ""
        return Explanation(cause=cause.format(advised.cause), remedy=remedy.format(advised.remedy) + more)


def _from_exact_to_group(name: str) -> tuple[str, ...]:
    """Names under which something may be said of a fault, the nearest first: a cause is of its event, a code
    of its group and of its class (CiA 301 §7.2.7.1; from F000h on, groups are classes of their own)."""
    if not name.endswith("h"):
        return (name, name.partition(".")[0])
    group = (name, f"{name[:2]}xxh")
    return (*group, f"{name[0]}0xxh") if name[0].isdecimal() else group


def listed_faults(family: Family) -> list[str]:
    """Names of all faults: the drive's numbers and events, and the emergency codes that say more than these
    or stand for them."""
    emcy, faults = family.emcy, family.faults
    explained = [one.name for one in family.fault]
    own = {*explained, *faults.german}
    codes = [f"{code}h" for code in emcy.codes if "{hex" in faults.form or f"{code}h" in own]
    codes = [code for code in codes if "xx" not in code]  # groups, for codes that nobody lists
    none = no_faults(family)
    names = dict.fromkeys([*faults.texts, *emcy.events, *codes, *explained])
    return [name for name in names if name not in none]


def emergency_codes(family: Family) -> list[str]:
    """Names of all emergency codes that the mapping file lists one by one: ``4210h``."""
    none = no_faults(family)
    return [f"{code}h" for code in family.emcy.codes if "xx" not in code and f"{code}h" not in none]


def no_faults(family: Family) -> frozenset[str]:
    """Names by which an emergency message says that there is no fault any more."""
    event = family.emcy.event
    return frozenset(("0000h", *([] if event is None or event.gone is None else [str(event.gone)])))
