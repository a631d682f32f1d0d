"""Error status of the process "boot NMT slave" (CiA 302-2, error status A … O), with hints."""

from __future__ import annotations

from typing import Final

from bridge.text import Text, render

_OTHER_DEVICE: Final = Text.of("boot_hint.other_device")
_EXCHANGED: Final = Text.of("boot_hint.exchanged")
HINTS: Final = {
    "B": Text.of("boot_hint.is_it_reached"),
    "C": _OTHER_DEVICE,
    "D": _OTHER_DEVICE,
    "E": Text.of("boot_hint.is_it_there"),
    "J": Text.of("boot_hint.manual"),
    "K": Text.of("boot_hint.error_control"),
    "F": Text.of("boot_hint.guarding"),
    "M": _EXCHANGED,
    "N": Text.of("boot_hint.firmware"),
    "O": _EXCHANGED,
}

SILENT: Final = Text.of("boot_hint.silent")
"""Hint for a node that was there and no longer answers, whatever the step."""

ABSENT: Final = frozenset("BEFK")
"""Error status of a node that is not there; with any other it is there and cannot be used."""


class BootError(Exception):
    """Failure of a boot-up. ``letter`` is the error status, ``what`` names object, expected and read.

    ``absent`` is true where the node did not answer, whatever the step was. ``hint`` replaces the usual one.
    """

    def __init__(
        self, letter: str, what: Text, *, absent: bool | None = None, hint: Text | None = None
    ) -> None:
        super().__init__(letter, what)
        self.letter = letter
        self.what = what
        self.absent = letter in ABSENT if absent is None else absent
        usual = SILENT if self.absent and letter not in ABSENT else HINTS.get(letter)
        self._hint = hint or usual

    @property
    def said(self) -> Text:
        """Error status, reason and hint in one text."""
        if self._hint is None:
            return Text.of("boot.failed", letter=self.letter, what=self.what)
        return Text.of("boot.failed_advised", letter=self.letter, what=self.what, hint=self._hint)

    @property
    def detail(self) -> str:
        """Reason of the failure, in English."""
        return render(self.what)

    def __str__(self) -> str:
        return render(self.said)
