"""Emergency messages of one node: each goes to the drive it is about, or becomes an event where there is
none; their history becomes points."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final, NamedTuple

from bridge.canopen import emcy
from bridge.canopen.frame import Frame
from bridge.command import BusSide, Drive, Event, EventKind
from bridge.command.node import Node
from bridge.drive import EmergencyMeaning, EmergencyReader
from bridge.node.emergency_log import EmergencyLog
from bridge.text import Text

_COMES: Final = 700
_GONE: Final = 100
"""Severities of the events for an emergency that comes or is gone, the same as a drive's."""


class Concerned(NamedTuple):
    """A drive that an emergency message is about, and the time at which the message came."""

    drive: Drive
    at: float


class Emergencies:
    """Emergency messages of one node, in its points and its drives."""

    def __init__(self, node: Node, side: BusSide) -> None:
        self._node = node
        self._image = side.image
        self._events = side.events
        self._reader = EmergencyReader(node.family)
        self._log = EmergencyLog()

    def on_frame(self, frame: Frame) -> Sequence[Concerned] | None:
        """Drives that the message is about, if it is reported now; None where it is no emergency message."""
        emergency = emcy.decode(frame.data)
        if emergency is None:
            return None
        byte = self._node.family.emcy.drive_byte
        number = frame.data[byte] if byte is not None and byte < len(frame.data) else None
        if self._log.add(emergency, number, frame.time):
            return self._tell(emergency, number, frame.time)
        return ()

    def on_time(self, now: float) -> Sequence[Concerned]:
        """Drives concerned by messages that were held back and are reported now."""
        told = self._log.on_time(now)
        return [one for emergency, number, at in told for one in self._tell(emergency, number, at)]

    def next_deadline(self) -> float | None:
        return self._log.next_deadline()

    def _tell(self, emergency: emcy.Emergency, number: int | None, at: float) -> Sequence[Concerned]:
        told = self._reader.read(emergency.code, emergency.vendor)
        concerned = [one for one in self._node.drives if one.slot.emcy_drive in (None, number)]
        is_of_one_drive = len(concerned) == 1 or any(one.slot.emcy_drive is not None for one in concerned)
        if concerned and not is_of_one_drive:
            self._report(self._node.name, told, at)
        for device in self._node.devices:
            self._report(device.name, told, at)
        for drive in concerned:
            drive.channel.on_emcy(told, at, is_its_own=is_of_one_drive)
            drive.refresh(at)
        return [Concerned(drive, at) for drive in concerned]

    def _report(self, source: str, told: EmergencyMeaning, at: float) -> None:
        severity = _GONE if told.is_gone else _COMES
        said = Text.of("node.emergency", number=told.code, text=told.said)
        self._events.report(Event(at, EventKind.EMERGENCY, source, severity, said))

    def refresh(self, now: float) -> None:
        top = f"{self._node.name}/node"
        if self._log.changed:
            history = self._log.as_json(lambda one: self._reader.read(one.code, one.vendor).text)
            self._image.put(f"{top}/emcy_history", history, now)
        self._image.put(f"{top}/emcy_suppressed", self._log.suppressed, now)
