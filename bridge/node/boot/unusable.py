"""Reasons why PDOs of a node cannot be used."""

from __future__ import annotations

from bridge.base.sdo_texts import text_of
from bridge.canopen.pdo import MOST_BITS, MOST_BYTES, MappingError, PdoEntry
from bridge.canopen.sdo import SdoError
from bridge.text import Text, render


class Unusable(MappingError):
    """A PDO, or its content, that cannot be used: ``said`` names it."""

    def __init__(self, said: Text) -> None:
        super().__init__(said)
        self.said = said

    def __str__(self) -> str:
        return render(self.said)


def why_unusable(error: MappingError | SdoError) -> Text:
    """Reason of the error, as a text."""
    match error:
        case Unusable():
            return error.said
        case SdoError():
            return text_of(error)
        case MappingError(entry=PdoEntry() as entry):
            return Text.of("boot.entry_bits", entry=str(entry), most=MOST_BITS)
        case MappingError(length=length):
            return Text.of("boot.pdo_too_long", length=length, most=MOST_BYTES)
