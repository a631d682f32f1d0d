"""Emergency messages of one node: each to the drive it is about, or an event where there is none, and their
history as points."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from bridge.canopen import emcy
from bridge.canopen.frame import Frame
from bridge.command import BusSide, Drive, Event, EventKind
from bridge.command.node import Node
from bridge.drive import EmergencyMeaning, EmergencyReader
from bridge.node.emergency_log import EmergencyLog
from bridge.text import Text

_COMES: Final = 700
_GONE: Final = 100
"""Severities of an emergency message, as of a drive's."""


class Emergencies:
    """``reject`` is called with what is no emergency message, ``told`` with each drive that one was
    about."""

    def __init__(
        self,
        node: Node,
        side: BusSide,
        reject: Callable[[Frame, Text], None],
        told: Callable[[Drive, float], None] = lambda drive, now: None,
    ) -> None:
        self._node = node
        self._image = side.image
        self._events = side.events
        self._reject = reject
        self._told = told
        self._reader = EmergencyReader(node.family)
        self._log = EmergencyLog()

    def on_frame(self, frame: Frame) -> None:
        emergency = emcy.decode(frame.data)
        if emergency is None:
            self._reject(frame, Text.of("frame.emergency_length"))
            return
        byte = self._node.family.emcy.drive_byte
        number = frame.data[byte] if byte is not None and byte < len(frame.data) else None
        if self._log.add(emergency, number, frame.time):
            self._tell(emergency, number, frame.time)

    def on_time(self, now: float) -> None:
        for emergency, number, at in self._log.on_time(now):
            self._tell(emergency, number, at)

    def next_deadline(self) -> float | None:
        return self._log.next_deadline()

    def _tell(self, emergency: emcy.Emergency, number: int | None, at: float) -> None:
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
            self._told(drive, at)

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
