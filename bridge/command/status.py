"""What a drive says of itself: status word, state, emergency, faults."""

from __future__ import annotations

from bridge.drive import FAULTED, DriveState, StatusWords
from bridge.mapping.model import Family


class DriveStatus:
    """Last known status of one drive. Fault numbers are the family's own, 0 where there is none."""

    __slots__ = ("_emcy", "emcy_code", "faults", "last_fault", "link_fault", "state", "word", "words")

    def __init__(self, family: Family) -> None:
        self._emcy = family.emcy
        self.faults = family.faults
        self.words = StatusWords(family.status_word)
        self.word = 0
        self.state = DriveState.UNKNOWN
        self.emcy_code = 0
        self.link_fault = 0.0
        """Present fault of the leg between bridge and drive."""
        self.last_fault = 0.0

    def emcy_text(self) -> str:
        return self._emcy.text(self.emcy_code)

    def fault_text(self, current_fault: float) -> str:
        """The present fault in words; empty where there is none."""
        if current_fault:
            number = f"{current_fault:.1f}"
            return f"{self.faults.prefix}{number} {self.faults.texts.get(number, '')}".strip()
        if self.state in FAULTED:
            return self.emcy_text() if self.emcy_code else "fault"
        return ""
