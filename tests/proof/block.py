"""A node with outputs (CiA 401) beside the drives, and its owner, who is there for a fault alone."""

from __future__ import annotations

import shutil
import time
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Final, Self

from tests.proof.drives import DRIVES
from tests.proof.settings import PLANT
from tests.proof.strangers import Connection
from tests.support.process import REPOSITORY

if TYPE_CHECKING:
    from tests.proof.rig import Rig

_EDS: Final = REPOSITORY / "tests" / "devices" / "io16.eds"
_ADDRESS: Final = "127.0.0.40"
_ACKNOWLEDGE, _OUTPUTS = 11, 32
"""Holding registers (docs/reference/modbus.md)."""
_COMES_S: Final = 5.0


@dataclass(frozen=True, slots=True)
class Block:
    """Sixteen digital outputs in one RPDO: the first eight are to hold when their owner is silent."""

    node: str = "valves"
    node_id: int = 41
    family_name: str = "CiA 401, outputs"
    protocol: str = "modbus"
    active: bytes = b"\xfe\x0f"
    held: bytes = b"\xfe\x00"
    safe: bytes = b"\x00\x00"
    reserved: tuple[str, ...] = ("6200:01", "6206:01", "6207:01")
    """What moves them, and what makes them safe where the bridge is silent (CiA 401)."""

    @property
    def path(self) -> str:
        return self.node

    @property
    def rpdo(self) -> int:
        return 0x200 + self.node_id

    @property
    def unit(self) -> int:
        return len(DRIVES) + 1

    def site(self, folder: Path) -> str:
        """Its table of the site file, with its EDS beside that."""
        shutil.copy(_EDS, folder / _EDS.name)
        return f"""[[bus.node]]
name = "{self.node}"
id = {self.node_id}
unit_id = {self.unit}
mapping = "eds:{_EDS.name}"
supervision = "heartbeat"
supervision_ms = {PLANT.heartbeat_ms}
[bus.node.outputs]
control = "{self.protocol}"
fieldbus_timeout_ms = {PLANT.fieldbus_timeout_ms}
on_expiry = {{ digital_outputs_1_to_8 = "hold" }}"""


BLOCK: Final = Block()


class BlockOwner:
    """Owns the outputs until the end of its ``with``, where it makes them safe and goes."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        self._connection = Connection(_ADDRESS)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.acknowledge()
        self.write(BLOCK.safe)
        self._connection.close()

    def write(self, outputs: bytes) -> int:
        return self._connection.write(BLOCK, _OUTPUTS, *outputs)

    def acknowledge(self) -> int:
        return self._connection.write(BLOCK, _ACKNOWLEDGE, 1)

    def activate(self) -> None:
        """What is left of before is acknowledged, safe values are sent once, and then the active ones."""
        self.acknowledge()
        self.write(BLOCK.safe)

        def comes() -> bool:
            self.write(BLOCK.active)
            return self.sent() == BLOCK.active

        self._rig.wait(comes, _COMES_S, "the outputs get what their owner writes")

    def sent(self) -> bytes:
        """What the bridge sends; empty where it sends nothing."""
        told = self._rig.told.last(BLOCK.rpdo)
        is_fresh = told is not None and time.monotonic() - told.last < PLANT.deadman_ms / 1000
        return told.data[: len(BLOCK.safe)] if told and is_fresh else b""

    def safe_since(self, since: float) -> float | None:
        """From when on after ``since`` nothing but safe values was sent; None where that is not so."""
        first: float | None = None
        for run in self._rig.told.runs(BLOCK.rpdo, since):
            if run.data[: len(BLOCK.safe)] != BLOCK.safe:
                if first is not None:
                    return None
            elif first is None:
                first = run.first
        return first
