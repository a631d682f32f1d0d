"""Somebody else on the wire of a plant."""

from __future__ import annotations

from typing import Final

from bridge.canopen.frame import Frame
from tests.plant.wire import Wire
from tests.plant.world import World
from tests.proof.board import NUMBERS
from tests.proof.drives import Drive

_EACH_S: Final = 0.02
_NMT: Final = 0x000
_SDO: Final = 0x600
_START, _PRE_OPERATIONAL = 0x01, 0x80
_WRITE_SYNC: Final = bytes.fromhex("23 05 10 00 80 00 00 00")
"""1005h, what it hears, as it is."""
_WRITE_P105: Final = bytes.fromhex("2B 69 20 01 F4 01 00 00")


class Intruder:
    """A tool that commands a node beside the bridge: ``how`` is one of ``WAYS``."""

    WAYS: Final = ("rpdo", "nmt", "sdo", "watch", "master")

    def __init__(self, world: World, wire: Wire, drive: Drive, how: str) -> None:
        self._world = world
        self._port = wire.port("intruder", lambda frame: None)
        self._drive = drive
        self._how = how
        self._is_there = True
        self._cycle()

    def _cycle(self) -> None:
        if self._is_there:
            if self._how == "master":
                self._port.send(Frame(_NMT, bytes((_START, self._drive.node_id))))
            self._port.send(self._frame())
            self._world.after(_EACH_S, self._cycle)

    def _frame(self) -> Frame:
        drive = self._drive
        if self._how == "nmt":
            return Frame(_NMT, bytes((_PRE_OPERATIONAL, drive.node_id)))
        if self._how == "sdo":
            return Frame(_SDO + drive.node_id, _WRITE_P105)
        if self._how == "watch":
            return Frame(_SDO + drive.node_id, _WRITE_SYNC)
        setpoint = drive.family.setpoint + NUMBERS
        return Frame(drive.rpdo, drive.family.run.to_bytes(2, "little") + setpoint.to_bytes(2, "little"))

    def leave(self) -> None:
        self._is_there = False
