"""Meaning of an emergency message in a drive family."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from bridge.drive.fault_words import FaultWords
from bridge.mapping.model import Family
from bridge.text import Text, Words, render

_VENDOR_BYTE: Final = 3
"""Place of the first manufacturer-specific byte (CiA 301 §7.2.7.3.1)."""


@dataclass(frozen=True, slots=True)
class EmergencyMeaning:
    """Meaning of an emergency message. ``is_gone``: it says that there is no fault any more. ``number`` is
    the family's own number of the event or error, None where the message has none; ``cause`` that of the
    event."""

    code: int
    said: Words
    is_gone: bool
    number: int | None = None
    cause: int | None = None

    @property
    def text(self) -> str:
        """The meaning in English."""
        return render(self.said)


class EmergencyReader:
    """Reader of the emergency messages of one family: the event number first, the code second."""

    def __init__(self, family: Family) -> None:
        self._model = family.emcy
        self._words = FaultWords(family)

    def read(self, code: int, vendor: bytes) -> EmergencyMeaning:
        """Meaning of a message; ``vendor`` is the manufacturer's five bytes, fewer in a short message."""
        model = self._model
        if model.event is not None and (event := _byte(vendor, model.event.byte)) is not None:
            is_gone = code == 0 or event == model.event.gone
            cause = None if model.event.cause_byte is None else _byte(vendor, model.event.cause_byte)
            said = model.text(code) if is_gone else self._event(event, code, cause)
            return EmergencyMeaning(code, said, is_gone, event, None if is_gone else cause)
        if model.number is not None and self._has_number(code):
            first = model.number.byte - _VENDOR_BYTE
            number = int.from_bytes(vendor[first : first + model.number.size], "little")
            if number:
                return EmergencyMeaning(code, self._error(number, code), is_gone=False, number=number)
        return EmergencyMeaning(code, model.text(code), is_gone=code == 0)

    def _has_number(self, code: int) -> bool:
        names = (f"{code:04X}", f"{code >> 8:02X}xx")
        return any(name in names for name in self._model.number.codes) if self._model.number else False

    def _event(self, event: int, code: int, cause: int | None) -> Words:
        found = self._words.of_drive(event, cause)
        if self._words.knows(event):
            return found.said
        said = Text.of("fault.unknown_event", number=found.number, text=self._model.text(code))
        return Text.of("fault.with_cause", text=said, cause=cause) if cause else said

    def _error(self, number: int, code: int) -> Words:
        found = self._words.of_drive(number)
        if self._words.knows(number):
            return found.said
        return Text.of("fault.unknown_error", number=found.number, text=self._model.text(code))


def _byte(vendor: bytes, place: int) -> int | None:
    index = place - _VENDOR_BYTE
    return vendor[index] if index < len(vendor) else None
