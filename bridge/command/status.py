"""Status of a drive by its own reports: status word, emergency, faults."""

from __future__ import annotations

from bridge.drive import FAULTED, DriveState, EmergencyMeaning, Explained, FaultWords, StatusWords
from bridge.mapping.model import Family
from bridge.text import Text, Words


class DriveStatus:
    """Last known status of one drive. Fault numbers are the family's own, 0 where there is none."""

    def __init__(self, family: Family) -> None:
        self._fault_words = FaultWords(family)
        self.words = StatusWords(family.status_word)
        self.word = 0
        self.emcy_code = 0
        self._told: EmergencyMeaning | None = None
        """Meaning of the active emergency message; None when cleared."""
        self.link_fault = 0.0
        """Present fault of the leg between bridge and drive."""
        self.drive_fault: float = 0.0
        """Present fault as read from the drive itself."""
        self._drive_last: float = 0.0
        self.last_fault = 0.0

    def on_emcy(self, told: EmergencyMeaning) -> None:
        self.emcy_code = told.code
        self._told = None if told.is_gone else told

    def on_drive_fault(self, current: float | None, last: float | None) -> bool:
        """Take over the drive's answers; returns True where they change something. Of the last faults that
        the bridge and the drive tell, the newest counts."""
        before = (self.drive_fault, self.last_fault)
        if current is not None:
            if current and current != self.drive_fault:
                self.last_fault = current
            self.drive_fault = current
        if last is not None:
            if last and last != self._drive_last:
                self.last_fault = last
            self._drive_last = last
        return (self.drive_fault, self.last_fault) != before

    def fault_said(self, bridge_fault: float, state: DriveState) -> Words:
        """The present fault, the bridge's own before the drive's; empty where there is none."""
        if not (bridge_fault or self.drive_fault) and state in FAULTED:
            return self._told.said if self._told else Text.word("drive_state", "fault")
        return self.fault(bridge_fault, state).said

    def fault(self, bridge_fault: float, state: DriveState) -> Explained:
        """The present fault with its cause and remedy; empty texts where there is none."""
        words, told = self._fault_words, self._told
        if bridge_fault:
            return words.own(bridge_fault)
        if self.drive_fault:
            cause = told.cause if told and told.number == self.drive_fault else None
            return words.of_drive(self.drive_fault, cause, words.code_text(told.code) if told else "")
        if told is None or state not in FAULTED:
            return Explained()
        return words.of_code(told.code) if told.number is None else words.of_drive(told.number, told.cause)

    @property
    def last_fault_said(self) -> Words:
        """The last fault in the maker's form; empty where there was none."""
        return self._fault_words.of_drive(self.last_fault).said if self.last_fault else ""
