"""What the proof knows of each family: its words, and the objects that set its own supervision.

All of it is read from the manuals' tables beside the mapping files and not taken from the program: the
witness must not err together with what it watches.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from tests.proof.settings import PLANT

GUARD_MS, LIFE_TIME_FACTOR = 200, 3
OWN_TIMEOUT_MS: Final = 500
"""Of each drive's own supervision."""

Bits = tuple[int, int]
"""Mask and value of a word."""


@dataclass(frozen=True, slots=True)
class Reserved:
    """An object that nobody but an engineer, or nobody at all, writes as a parameter while a drive runs, and
    a value that it might take."""

    name: str
    value: int


@dataclass(frozen=True, slots=True)
class Family:
    name: str
    mapping: str
    ready: int
    run: int
    acknowledge: int
    setpoint: int
    speed: int
    """What the drive says of its speed at this setpoint."""
    enabling: Bits
    """Of a control word that enables operation."""
    enabled: Bits
    """Of a status word that says "operation enabled"."""
    stops: Mapping[str, Bits] = field(hash=False)
    """Of the control word of each reaction."""
    control_bytes: int = 2
    supervision: str = f'supervision = "heartbeat"\nsupervision_ms = {PLANT.heartbeat_ms}'
    configure: tuple[str, ...] = ()
    parameters: str = ""
    lost_after_ms: int = PLANT.heartbeat_ms
    """When the bridge knows that a node is silent, from the node's last sign of life."""
    own_timeout_ms: int = OWN_TIMEOUT_MS
    """When the drive knows that the bridge is silent."""
    reserved: tuple[Reserved, ...] = ()

    @property
    def is_guarded(self) -> bool:
        """Its node says in what state it is when it is asked, and not by itself."""
        return "guarding" in self.supervision


_HEARTBEAT_CONSUMER: Final = 0x7F_0000 | OWN_TIMEOUT_MS

NORD: Final = Family(
    "NORD SK TU4-CAO",
    "nord/sk-tu4-cao",
    ready=0x047E,
    run=0x047F,
    acknowledge=0x04FE,
    setpoint=0x2000,
    speed=0x2000,
    enabling=(0x000F, 0x000F),  # BU 2500 §6.5.1
    enabled=(0x007F, 0x0037),  # §6.5.2
    # §6.5.1: bits 0 … 2 are "on", "no disable voltage", "no quick stop".
    stops={"disable_voltage": (0x0002, 0), "quick_stop": (0x0006, 0x0002), "stop": (0x0007, 0x0006)},
    # SDO2 … 4 reach the parameters of fu2 … fu4, P513 among them.
    supervision=f'supervision = "heartbeat"\nsupervision_ms = {PLANT.heartbeat_ms}\nsdo_channels = [2, 3, 4]',
    configure=(f'{{ object = "2097:01", type = "uint16", value = {OWN_TIMEOUT_MS} }}',),  # P151
    parameters="P105 = 50.0, P112 = 10.0",
    # The interface's time-out for us (BU 2500 §8.2.4), and the drive's for its interface.
    reserved=(Reserved("P151", 0), Reserved("P513", 100)),
)
NORD_INVALID: Final = 0x007F
"""NORD: "run" without bit 10, "control data valid" (BU 2500 §6.5.1)."""
LENZE: Final = Family(
    "Lenze 8400 motec",
    "lenze/8400-motec",
    ready=0x0001,
    run=0x0009,
    acknowledge=0x0081,
    setpoint=0x2000,
    speed=0x2000,
    enabling=(0x000F, 0x0009),
    enabled=(0x0F00, 0x0500),
    # Bits 1 and 2 stop where they are 1; its quick stop is its only ramp.
    stops={"disable_voltage": (0x0002, 0x0002), "quick_stop": (0x0006, 0x0004), "stop": (0x0006, 0x0004)},
    configure=(  # EDS84DMOTCAN §10.1: C00357/1, C00593/1
        f'{{ object = "5E9A:01", type = "uint16", value = {OWN_TIMEOUT_MS} }}',
        '{ object = "5DAE:01", type = "uint8", value = 1 }',
    ),
    parameters="C00011 = 1500.0",
)
STOEBER: Final = Family(
    "STÖBER 5000",
    "stoeber/5000",
    ready=0x0000,
    run=0x0001,
    acknowledge=0x0002,
    setpoint=500,
    speed=1500,
    enabling=(0x0005, 0x0001),
    enabled=(0x00FF, 0x0004),  # E48 in the low byte
    # A180: bit 0 enables, bit 2 is the quick stop, its only ramp.
    stops={"disable_voltage": (0x0001, 0), "quick_stop": (0x0005, 0x0005), "stop": (0x0005, 0x0005)},
    control_bytes=1,
    supervision=f'supervision = "guarding"\nsupervision_ms = {GUARD_MS}\n'
    f"life_time_factor = {LIFE_TIME_FACTOR}",
    parameters="C01 = 3000.0",
    lost_after_ms=GUARD_MS * LIFE_TIME_FACTOR,
    own_timeout_ms=GUARD_MS * LIFE_TIME_FACTOR,
)
CIA402: Final = Family(
    "CiA 402",
    "cia402/velocity",
    ready=0x0006,
    run=0x007F,
    acknowledge=0x0086,
    setpoint=1000,
    speed=1000,
    enabling=(0x000F, 0x000F),
    enabled=(0x006F, 0x0027),
    # CiA 402, the commands of 6040h; the ramp is "disable operation".
    stops={"disable_voltage": (0x0002, 0), "quick_stop": (0x0006, 0x0002), "stop": (0x000E, 0x0006)},
    configure=(
        f'{{ object = "1016:01", type = "uint32", value = {_HEARTBEAT_CONSUMER:#x} }}',
        '{ object = "6007:00", type = "int16", value = 3 }',  # quick stop
    ),
    # Control word, setpoint; what its supervision and its stops do.
    reserved=(
        Reserved("6040:00", 0x000F),
        Reserved("6042:00", 2000),
        Reserved("1016:01", 0),
        Reserved("6007:00", 0),
        Reserved("605A:00", 0),
    ),
)
