"""The errors a user can meet, sorted by whose fault they are.

The command line turns each into its exit code; nothing below it decides how a program ends.
"""

from __future__ import annotations

import errno
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from bridge.text import Said, Text, Words, render

_EXHAUSTED: Final = frozenset((errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM))


def is_exhausted(error: BaseException | None) -> bool:
    """True if this process, or the machine, has no descriptor or no memory left."""
    return isinstance(error, OSError) and error.errno in _EXHAUSTED


class BridgeError(Exception):
    """Base of all errors that the user gets as one sentence; ``str()`` is its English."""

    exit_code: int = 1

    def __init__(self, said: Words = "") -> None:
        super().__init__(render(said))
        self.said = said


class OperationFailed(BridgeError):
    """A node, a client or a drive did not do what was asked."""


class Unavailable(BridgeError):
    """A bus or a port could not be opened. The message says what helps."""

    exit_code = 3


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault in a file the user wrote.

    ``key`` is the dotted path of the value (``bus[0].node[1].id``), ``line`` counts from 1 and is
    0 where the file as a whole is meant; ``advice`` says what would be right.
    """

    file: str
    line: int
    key: str
    said: Text
    advice: Said = ""

    @property
    def message(self) -> str:
        """The fault in English."""
        return render(self.said)

    @property
    def hint(self) -> str:
        """The advice in English."""
        return render(self.advice)

    @property
    def text(self) -> Text:
        """All of it in one."""
        place = f"{self.file}:{self.line}" if self.line else self.file
        if self.key and self.advice:
            return Text.of("file.key_advised", place=place, key=self.key, said=self.said, advice=self.advice)
        if self.key:
            return Text.of("file.key", place=place, key=self.key, said=self.said)
        if self.advice:
            return Text.of("file.at_advised", place=place, said=self.said, advice=self.advice)
        return Text.of("file.at", place=place, said=self.said)

    def __str__(self) -> str:
        return render(self.text)


class FileFaults(BridgeError):
    """A site or mapping file has faults; all of them are here, not only the first."""

    exit_code = 2

    def __init__(self, faults: Sequence[Fault]) -> None:
        super().__init__(Text.of("file.several", faults=tuple(fault.text for fault in faults)))
        self.faults = tuple(faults)
