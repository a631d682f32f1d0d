"""The plant of the proof: every family on one bus, each commanded through each protocol.

The masks here are read from the manuals' tables beside the mapping files and not taken from the program:
the witness must not err together with what it watches.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Final

PROTOCOLS: Final = ("modbus", "opcua", "zenoh")
SERVERS: Final = {"modbus": "127.0.0.10", "opcua": "127.0.0.11", "zenoh": "127.0.0.12"}
"""An address of loopback for each server, so that the network to one of them can be cut."""
PORTS: Final = {"modbus": 1502, "opcua": 4840, "zenoh": 7447}
BRIDGE_SIDE: Final = "vcan0"
DRIVE_SIDE: Final = "vcan1"

RPDO_PERIOD_MS: Final = 100
REACTION_MS: Final = 20
"""How late the bridge may be (docs/explanation/dead-man-chain.md)."""
FIELDBUS_TIMEOUT_MS: Final = 800
OWNER_PERIOD_S: Final = 0.35
DEADMAN_MS: Final = 400
HEARTBEAT_MS: Final = 600
GUARD_MS, LIFE_TIME_FACTOR = 200, 3
TPDO_MS: Final = 300
"""Event timer of every TPDO: what the drive does is on the bus so soon."""
INHIBIT_MS: Final = 100
"""A ramp would fill the bus otherwise, and a slow machine's time."""
OWN_TIMEOUT_MS: Final = 500
"""Of each drive's own supervision."""


@dataclass(frozen=True, slots=True)
class Family:
    """What the proof knows of a family: its words, and the objects that set its own supervision."""

    name: str
    mapping: str
    ready: int
    run: int
    acknowledge: int
    setpoint: int
    speed: int
    """What the drive says of its speed at this setpoint."""
    enabling: tuple[int, int]
    """Mask and value of a control word that enables operation."""
    enabled: tuple[int, int]
    """Mask and value of a status word that says "operation enabled"."""
    control_bytes: int = 2
    supervision: str = f'supervision = "heartbeat"\nsupervision_ms = {HEARTBEAT_MS}'
    configure: tuple[str, ...] = ()
    parameters: str = ""
    lost_after_ms: int = HEARTBEAT_MS
    """When the bridge knows that a node is silent, from the node's last sign of life."""
    own_timeout_ms: int = OWN_TIMEOUT_MS
    """When the drive knows that the bridge is silent."""


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
    # SDO2 … 4 reach the parameters of fu2 … fu4, P513 among them.
    supervision=f'supervision = "heartbeat"\nsupervision_ms = {HEARTBEAT_MS}\nsdo_channels = [2, 3, 4]',
    configure=(f'{{ object = "2097:01", type = "uint16", value = {OWN_TIMEOUT_MS} }}',),  # P151
    parameters="P105 = 50.0, P112 = 10.0",
)
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
    configure=(
        f'{{ object = "1016:01", type = "uint32", value = {_HEARTBEAT_CONSUMER:#x} }}',
        '{ object = "6007:00", type = "int16", value = 3 }',  # quick stop
    ),
)


@dataclass(frozen=True, slots=True)
class Drive:
    """One drive; ``place`` is its place in the shared memory and its Modbus unit less one."""

    place: int
    family: Family
    protocol: str
    node: str
    slot: str
    node_id: int
    rpdo: int
    tpdo: int
    emcy: int | None
    """Where the emergency messages of the node are about this drive alone."""

    @property
    def path(self) -> str:
        return f"{self.node}/{self.slot}"

    def enabling(self, data: bytes) -> bool:
        mask, value = self.family.enabling
        return int.from_bytes(data[: self.family.control_bytes], "little") & mask == value

    def control_word(self, data: bytes) -> int:
        return int.from_bytes(data[: self.family.control_bytes], "little")

    def telegram(self, data: bytes) -> int:
        """The number of the telegram that an RPDO carries in its setpoint."""
        begin = self.family.control_bytes
        return int.from_bytes(data[begin : begin + 2], "little") - self.family.setpoint

    def enabled(self, data: bytes) -> bool:
        mask, value = self.family.enabled
        return int.from_bytes(data[:2], "little") & mask == value

    def speed(self, data: bytes) -> int:
        return int.from_bytes(data[2:4], "little", signed=True)


def _single(place: int, family: Family, protocol: str, name: str, node_id: int) -> Drive:
    rpdo, tpdo, emcy = 0x200 + node_id, 0x180 + node_id, 0x080 + node_id
    return Drive(place, family, protocol, f"{name}_{protocol}", "drive", node_id, rpdo, tpdo, emcy)


def _drives() -> tuple[Drive, ...]:
    # The fourth drive of the NORD node is Modbus's, too.
    drives = [
        Drive(n, NORD, protocol, "conveyor", f"fu{n + 1}", 5, 0x205 + 0x100 * n, 0x185 + 0x100 * n, None)
        for n, protocol in enumerate((*PROTOCOLS, "modbus"))
    ]
    for family, name, first_id in ((LENZE, "pump", 11), (STOEBER, "lift", 21), (CIA402, "fan", 31)):
        drives += [
            _single(len(drives) + n, family, protocol, name, first_id + n)
            for n, protocol in enumerate(PROTOCOLS)
        ]
    return tuple(drives)


DRIVES: Final = _drives()


def drives_of(protocol: str) -> list[Drive]:
    return [drive for drive in DRIVES if drive.protocol == protocol]


def write_site(path: Path, channel: str, state: Path, run: Path) -> Path:
    """The site file with everything on ``channel``."""
    nodes: dict[str, list[Drive]] = {}
    for drive in DRIVES:
        nodes.setdefault(drive.node, []).append(drive)
    text = [
        f'[site]\nname = "proof"\nstate_dir = "{state}"\nruntime_dir = "{run}"',
        f'[[bus]]\nname = "can0"\ninterface = "socketcan"\nchannel = "{channel}"\nbitrate = 1000000',
        f"sync_period_ms = 0\nrpdo_period_ms = {RPDO_PERIOD_MS}\ndeadman_ms = {DEADMAN_MS}",
        *(_node(drives) for drives in nodes.values()),
        f'[modbus]\nlisten = "{SERVERS["modbus"]}:{PORTS["modbus"]}"',
        f'[opcua]\nlisten = "{SERVERS["opcua"]}:{PORTS["opcua"]}"',
        'no_security = true\nanonymous = "operator"',
        f'[zenoh]\nlisten = ["tcp/{SERVERS["zenoh"]}:{PORTS["zenoh"]}"]',
    ]
    path.write_text("\n".join(text) + "\n", encoding="utf-8")
    return path


def _node(drives: list[Drive]) -> str:
    first = drives[0]
    family = first.family
    lines = [
        f'[[bus.node]]\nname = "{first.node}"\nid = {first.node_id}\nmapping = "{family.mapping}"',
        family.supervision,
        f"configure = [{', '.join(family.configure)}]" if family.configure else "",
    ]
    for drive in drives:
        slot = {"drive": "axis1"}.get(drive.slot, drive.slot) if family is STOEBER else drive.slot
        lines += [
            f'[[bus.node.drive]]\nslot = "{slot}"\nunit_id = {drive.place + 1}',
            f'control = "{drive.protocol}"\nfieldbus_timeout_ms = {FIELDBUS_TIMEOUT_MS}',
            f"tpdo = {{ event_ms = {TPDO_MS}, inhibit_ms = {INHIBIT_MS} }}",
            f"parameters = {{ {family.parameters} }}" if family.parameters else "",
        ]
    return "\n".join(lines)
