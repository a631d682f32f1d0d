"""Reasons why a parameter was not read or not written."""

from __future__ import annotations

from enum import Enum

from bridge.text import Text, render


class Why(Enum):
    UNKNOWN_NAME = "unknown name"
    READ_ONLY = "read-only"
    WRITE_ONLY = "write-only"
    OUT_OF_RANGE = "out of range"
    PROTECTED = "protected"
    """An object that is not written by anybody but the bridge."""
    TOO_OFTEN = "too often"
    """Written again and again: the EEPROM would not last."""
    REFUSED = "refused"
    """The drive has aborted the transfer."""
    NO_ANSWER = "no answer"
    NOT_TAKEN = "not taken"
    """The drive has accepted a value and holds another one."""
    OTHER_VALUE = "other value"
    """It does not hold what the client expects, and was not written."""
    NOT_CONFIGURED = "not configured"


class ParameterError(Exception):
    """``said`` is one sentence for a human, ``str()`` its English; ``abort_code`` is the drive's, or 0."""

    def __init__(self, why: Why, said: Text, abort_code: int = 0) -> None:
        super().__init__(render(said))
        self.why = why
        self.said = said
        self.abort_code = abort_code


class TransferFailed(Exception):
    """A transfer failed; thrown into a procedure by the code that carries out its transfers.

    ``by_drive``: the drive has said so itself, and has not done what was asked.
    """

    def __init__(self, said: Text, abort_code: int, *, by_drive: bool) -> None:
        super().__init__(render(said))
        self.said = said
        self.abort_code = abort_code
        self.by_drive = by_drive
