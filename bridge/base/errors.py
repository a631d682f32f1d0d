"""The errors a user can meet, sorted by whose fault they are.

The command line turns each into its exit code; nothing below it decides how a program ends.
"""

from __future__ import annotations

import errno
from dataclasses import dataclass
from typing import Final

_EXHAUSTED: Final = frozenset((errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM))


def is_exhausted(error: BaseException | None) -> bool:
    """True if this process, or the machine, has no descriptor or no memory left."""
    return isinstance(error, OSError) and error.errno in _EXHAUSTED


class BridgeError(Exception):
    """Base of all errors that the user gets as one sentence."""

    exit_code: int = 1


class OperationFailed(BridgeError):
    """A node, a client or a drive did not do what was asked."""


class Unavailable(BridgeError):
    """A bus or a port could not be opened. The message says what helps."""

    exit_code = 3


@dataclass(frozen=True, slots=True)
class Fault:
    """One fault in a file the user wrote.

    ``key`` is the dotted path of the value (``bus[0].node[1].id``), ``line`` counts from 1 and is
    0 where the file as a whole is meant; ``hint`` says what would be right.
    """

    file: str
    line: int
    key: str
    message: str
    hint: str = ""

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}" if self.line else self.file
        hint = f" ({self.hint})" if self.hint else ""
        return f"{place}: {self.key}: {self.message}{hint}" if self.key else f"{place}: {self.message}{hint}"


class FileFaults(BridgeError):
    """A site or mapping file has faults; all of them are here, not only the first."""

    exit_code = 2

    def __init__(self, faults: list[Fault]) -> None:
        super().__init__("\n".join(str(fault) for fault in faults))
        self.faults = tuple(faults)
