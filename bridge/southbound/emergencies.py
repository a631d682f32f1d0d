"""Emergency messages of one node: each to the drive it is about, and their history as points."""

from __future__ import annotations

from collections.abc import Callable

from bridge.command import Plant
from bridge.command.plant import Node
from bridge.southbound.bus.frame import Frame
from bridge.southbound.canopen import emcy


class Emergencies:
    """``reject`` is called with what is no emergency message."""

    def __init__(self, node: Node, plant: Plant, reject: Callable[[Frame, str], None]) -> None:
        self._node = node
        self._plant = plant
        self._reject = reject
        self._log = emcy.EmergencyLog()

    def on_frame(self, frame: Frame) -> None:
        emergency = emcy.decode(frame.data)
        if emergency is None:
            self._reject(frame, "an emergency message has 8 bytes")
            return
        byte = self._node.family.emcy.drive_byte
        number = frame.data[byte] if byte is not None and byte < len(frame.data) else None
        if self._log.add(emergency, number, frame.time):
            self._tell(emergency.code, number, frame.time)

    def on_time(self, now: float) -> None:
        for emergency, number, at in self._log.on_time(now):
            self._tell(emergency.code, number, at)

    def next_deadline(self) -> float | None:
        return self._log.next_deadline()

    def _tell(self, code: int, number: int | None, at: float) -> None:
        for drive in self._node.drives:
            if drive.slot.emcy_drive is None or drive.slot.emcy_drive == number:
                drive.channel.on_emcy(code, at)
                drive.refresh(at)

    def refresh(self, now: float) -> None:
        top = f"{self._node.name}/node"
        if self._log.changed:
            history = self._log.as_json(self._node.family.emcy.text)
            self._plant.set(f"{top}/emcy_history", history, now)
        self._plant.set(f"{top}/emcy_suppressed", self._log.suppressed, now)
