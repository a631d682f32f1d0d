"""Why PDOs of a node cannot be used."""

from __future__ import annotations

from bridge.base.sdo_texts import text_of
from bridge.canopen.pdo import MappingError
from bridge.canopen.sdo import SdoError
from bridge.text import Text, render


class Unusable(MappingError):
    """A PDO, or what it carries, that cannot be used: ``said`` names it."""

    def __init__(self, said: Text) -> None:
        super().__init__(said)
        self.said = said

    def __str__(self) -> str:
        return render(self.said)


def why_unusable(error: MappingError | SdoError) -> Text:
    """What there is to say of it."""
    match error:
        case Unusable():
            return error.said
        case SdoError():
            return text_of(error)
        case _:
            return Text.plain(str(error))
