"""What a drive says of itself: status word, emergency, faults."""

from __future__ import annotations

from bridge.drive import FAULTED, DriveState, StatusWords, Told
from bridge.mapping.model import Family


class DriveStatus:
    """Last known status of one drive. Fault numbers are the family's own, 0 where there is none."""

    def __init__(self, family: Family) -> None:
        self._emcy = family.emcy
        self.faults = family.faults
        self.words = StatusWords(family.status_word)
        self.word = 0
        self.emcy_code = 0
        self._emcy_text = ""
        self.link_fault = 0.0
        """Present fault of the leg between bridge and drive."""
        self.drive_fault: float = 0.0
        """Present fault as the drive itself was asked for it."""
        self._drive_last: float = 0.0
        self.last_fault = 0.0

    def on_emcy(self, told: Told) -> None:
        self.emcy_code = told.code
        self._emcy_text = "" if told.is_gone else told.text

    def on_drive_fault(self, current: float | None, last: float | None) -> bool:
        """What the drive answered; True where that changes something. Of the last faults that the bridge
        and the drive tell, the newest counts."""
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

    def fault_text(self, bridge_fault: float, state: DriveState) -> str:
        """The present fault, the bridge's own before the drive's; empty where there is none."""
        if bridge_fault:
            number = f"{bridge_fault:.1f}"
            return f"{self.faults.prefix}{number} {self.faults.texts.get(number, '')}".strip()
        if self.drive_fault:
            return self._drive_text(self.drive_fault)
        if state in FAULTED:
            return self._emcy_text or "fault"
        return ""

    def _drive_text(self, fault: float) -> str:
        """The number the drive gives with its text: the family's, or that of the emergency message."""
        number = f"{fault:g}"
        text = self.faults.texts.get(f"{fault:.1f}") or self._emcy.events.get(number) or self._emcy_text
        return text if text.startswith(f"{number} ") else f"{number} {text}".rstrip()
