"""What is remembered of a node from one boot-up to the next, so that none of them wears out its EEPROM."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final

NOT_AGAIN: Final = "it is not written again until the node restarts or is reset"


CountWrite = Callable[[str, str, str], str]
"""One more write to an EEPROM: owner, object, name. Returns a warning or an empty text, and raises
``ParameterError`` where it is one too many (``parameter.ledger``)."""


def _not_counted(owner: str, address: str, name: str) -> str:
    del owner, address, name
    return ""


@dataclass(slots=True)
class BootMemory:
    """Kept for as long as the bridge runs; ``start_anew`` is called when the node has started or an
    operator has reset it."""

    unsaved: bool = False
    """Something was written that has not been stored (1010h) yet."""
    unanswered_stores: int = 0
    count_write: CountWrite = _not_counted
    _not_kept: dict[tuple[int, int], bytes] = field(default_factory=dict[tuple[int, int], bytes])
    _commands: set[tuple[int, int, bytes]] = field(default_factory=set[tuple[int, int, bytes]])

    def start_anew(self) -> None:
        self.unanswered_stores = 0
        self._not_kept.clear()
        self._commands.clear()

    def note_not_kept(self, index: int, sub: int, data: bytes) -> None:
        """The node has taken these bytes and holds others."""
        self._not_kept[index, sub] = data

    def was_not_kept(self, index: int, sub: int, data: bytes) -> bool:
        """Whether writing these bytes has been tried, in vain."""
        return self._not_kept.get((index, sub)) == data

    def note_command(self, index: int, sub: int, data: bytes) -> None:
        """A command was carried out by a boot-up that may still fail."""
        self._commands.add((index, sub, data))

    def has_done(self, index: int, sub: int, data: bytes) -> bool:
        return (index, sub, data) in self._commands

    def boot_succeeded(self) -> None:
        """The next boot-up begins with all its commands."""
        self._commands.clear()
