"""The plants of the proof. Together they have every family, each commanded through each protocol, with every
reaction, RPDOs that go by SYNC, and a drive with two of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from tests.proof.families import CIA402, LENZE, NORD, STOEBER, Family
from tests.proof.settings import IS_RECORDED, PLANT

PROTOCOLS: Final = ("modbus", "opcua", "zenoh")
SERVERS: Final = {"modbus": "127.0.0.10", "opcua": "127.0.0.11", "zenoh": "127.0.0.12"}
"""An address of loopback for each server, so that the network to one of them can be cut."""
_SECOND: Final = "127.0.0.30"
PORTS: Final = {"modbus": 1502, "opcua": 4840, "zenoh": 7447}
BRIDGE_SIDE: Final = "vcan0"
DRIVE_SIDE: Final = "vcan1"

CLIENT_MS: Final = 200
"""What the time from the client's call to the stop may exceed the published time, which runs from when the
telegram came: the client's and the network's, on a CPU that they share with the bridge."""
WAY_MS: Final = {"modbus": 100 + CLIENT_MS, "opcua": 500 + CLIENT_MS, "zenoh": 200 + CLIENT_MS}
"""How long a telegram may be on its way from its client's call to the bus: what is carried out so late that
it exceeds this has waited somewhere."""
IGNORED_STOP_MS: Final = 1500
"""How long a stop of a CiA 402 drive, which is the one that is made deaf, may go without being followed."""
TPDO_MS: Final = 300
"""Event timer of every TPDO: what the drive does is on the bus so soon."""
INHIBIT_MS: Final = 100
"""A ramp would fill the bus otherwise, and a slow machine's time."""


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
    reaction: str = "disable_voltage"
    syncs: int = 0
    """Its RPDO is sent for every so many SYNCs, and counts with the next one (CiA 301 §7.2.2.2); 0 where it
    does not wait for them."""
    settings: str = ""
    """Of its RPDOs, in the site file."""
    setpoint_rpdo: int = 0
    """Where its setpoint has an RPDO of its own."""

    @property
    def path(self) -> str:
        return f"{self.node}/{self.slot}"

    @property
    def unit(self) -> int:
        """Its Modbus unit id."""
        return self.place + 1

    @property
    def way_ms(self) -> int:
        """How long the bridge allows its RPDO to the drive."""
        return max(1, self.syncs) * PLANT.rpdo_period_ms

    @property
    def family_name(self) -> str:
        return self.family.name

    @property
    def number_id(self) -> int:
        """The RPDO that carries the telegrams' numbers."""
        return self.setpoint_rpdo or self.rpdo

    def enabling(self, data: bytes) -> bool:
        mask, value = self.family.enabling
        return self.control_word(data) & mask == value

    def control_word(self, data: bytes) -> int:
        return int.from_bytes(data[: self.family.control_bytes], "little")

    def reacts(self, data: bytes) -> bool:
        """This RPDO has the word of the drive's reaction, and no setpoint."""
        mask, value = self.family.stops[self.reaction]
        return self.control_word(data) & mask == value and not any(data[self.family.control_bytes :])

    def setpoint(self, data: bytes) -> int:
        """Of the RPDO ``number_id``."""
        begin = 0 if self.setpoint_rpdo else self.family.control_bytes
        return int.from_bytes(data[begin : begin + 2], "little")

    def telegram(self, data: bytes) -> int:
        """The number of the telegram that the RPDO ``number_id`` carries in its setpoint."""
        return self.setpoint(data) - self.family.setpoint

    def enabled(self, data: bytes) -> bool:
        mask, value = self.family.enabled
        return int.from_bytes(data[:2], "little") & mask == value

    def speed(self, data: bytes) -> int:
        return int.from_bytes(data[2:4], "little", signed=True)


_SPLIT_ID: Final = 0x300
_ELSEWHERE: Final = 0x400
"""Not the factory's."""
_CIA402_SYNCS: Final = {"modbus": 1, "opcua": 3}
_CIA402_RPDOS: Final = {
    "modbus": "rpdo = {{ transmission_type = {syncs}, cob_id = {rpdo} }}",
    "opcua": "rpdo = {{ transmission_type = {syncs}, cob_id = {rpdo} }}",
    "zenoh": "rpdo = [{{ number = 1, transmission_type = 255 }}, {{ number = 2, cob_id = {split} }}]",
}
_SPLIT: Final = """
extends = "cia402/velocity"
[family]
name = "CiA 402, velocity, with an RPDO for the setpoint"
[[slot]]
name = "drive"
[[slot.rpdo]]
number = 1
cob_id = 0x200
words = ["control_word"]
objects = [["6040:00"]]
write = true
transmission_type = 255
[[slot.rpdo]]
number = 2
cob_id = 0x300
words = ["setpoint_1"]
objects = [["6042:00"]]
write = true
transmission_type = 255
[[slot.tpdo]]
number = 1
cob_id = 0x180
objects = [["6041:00"], ["6044:00"], ["6061:00/8"]]
signed = ["6061:00"]
write = true
transmission_type = 255
[[slot.start]]
object = "6060:00"
type = "int8"
value = 2
"""
"""A site's own mapping: the catalogue's has no CiA 402 drive with two RPDOs."""
_REACTIONS: Final = {
    "pump_modbus": "quick_stop",
    "pump_opcua": "silence",  # it watches its own RPDO: C00357
    "lift_opcua": "quick_stop",
    "lift_zenoh": "hold",
    "fan_modbus": "stop",
    "fan_zenoh": "quick_stop",
}


def _single(place: int, family: Family, protocol: str, name: str, node_id: int) -> Drive:
    split = _SPLIT_ID + node_id
    is_fan = family is CIA402
    syncs = _CIA402_SYNCS.get(protocol, 0) if is_fan else 0
    rpdo = (_ELSEWHERE if syncs else 0x200) + node_id
    return Drive(
        place,
        family,
        protocol,
        f"{name}_{protocol}",
        "drive",
        node_id,
        rpdo=rpdo,
        tpdo=0x180 + node_id,
        emcy=0x080 + node_id,
        reaction=_REACTIONS.get(f"{name}_{protocol}", "disable_voltage"),
        syncs=syncs,
        settings=_CIA402_RPDOS[protocol].format(syncs=syncs, rpdo=rpdo, split=split) if is_fan else "",
        setpoint_rpdo=split if is_fan and protocol == "zenoh" else 0,
    )


def _all() -> tuple[Drive, ...]:
    # The fourth drive of the NORD node is Modbus's, too.
    drives = [
        Drive(n, NORD, protocol, "conveyor", f"fu{n + 1}", 5, 0x205 + 0x100 * n, 0x185 + 0x100 * n, None, how)
        for n, (protocol, how) in enumerate(
            zip((*PROTOCOLS, "modbus"), ("disable_voltage", "quick_stop", "stop", "hold"), strict=True)
        )
    ]
    for family, name, first_id in ((LENZE, "pump", 11), (STOEBER, "lift", 21), (CIA402, "fan", 31)):
        drives += [
            _single(len(drives) + n, family, protocol, name, first_id + n)
            for n, protocol in enumerate(PROTOCOLS)
        ]
    return tuple(drives)


ALL: Final = _all()
DRIVES: Final = tuple(
    replace(drive, place=place)
    for place, drive in enumerate(drive for drive in ALL if drive.node in PLANT.nodes)
)
"""Those of this run's plant."""


def drives_of(protocol: str) -> list[Drive]:
    return [drive for drive in DRIVES if drive.protocol == protocol]


SPOKEN: Final = tuple(protocol for protocol in PROTOCOLS if drives_of(protocol))
"""Those by which this plant's drives are commanded."""
SERVED: Final = tuple(protocol for protocol in PROTOCOLS if protocol in (*SPOKEN, "zenoh"))
"""By zenoh the proof itself asks the bridge."""


def write_site(path: Path, channel: str, state: Path, run: Path, *, others: Sequence[str] = ()) -> Path:
    """The site file with everything on ``channel``, and its own mapping beside it; ``others`` are the tables
    of further nodes."""
    (path.parent / "mappings").mkdir(exist_ok=True)
    (path.parent / "mappings" / "split.toml").write_text(_SPLIT, encoding="utf-8")
    nodes: dict[str, list[Drive]] = {}
    for drive in DRIVES:
        nodes.setdefault(drive.node, []).append(drive)
    servers = {
        "modbus": f'[modbus]\nlisten = "{SERVERS["modbus"]}:{PORTS["modbus"]}"',
        "opcua": f'[opcua]\nlisten = "{SERVERS["opcua"]}:{PORTS["opcua"]}"\n'
        'no_security = true\nanonymous = "operator"',
        "zenoh": f'[zenoh]\nlisten = ["tcp/{SERVERS["zenoh"]}:{PORTS["zenoh"]}"]',
    }
    text = [
        f'[site]\nname = "proof"\nstate_dir = "{state}"\nruntime_dir = "{run}"',
        f'[[bus]]\nname = "can0"\ninterface = "socketcan"\nchannel = "{channel}"\nbitrate = 1000000',
        PLANT.bus,
        *(_node(drives) for drives in nodes.values()),
        *others,
        *(servers[protocol] for protocol in SERVED),
        f"[recorder]\nenabled = {'true' if IS_RECORDED else 'false'}\nsize_mb = 4\nblack_box_mb = 4",
    ]
    path.write_text("\n".join(text) + "\n", encoding="utf-8")
    return path


def write_second_site(folder: Path, others: Sequence[str]) -> Path:
    """The same bus for a second bridge, with ports and folders of its own."""
    state, run = folder / "second_state", folder / "second_run"
    site = write_site(folder / "first.toml", BRIDGE_SIDE, state, run, others=others)
    text = site.read_text(encoding="utf-8")
    for protocol, server in SERVERS.items():
        text = text.replace(f"{server}:{PORTS[protocol]}", f"{_SECOND}:{PORTS[protocol]}")
    second = folder / "second.toml"
    second.write_text(text, encoding="utf-8")
    return second


def _node(drives: list[Drive]) -> str:
    first = drives[0]
    family = first.family
    mapping = "split" if first.setpoint_rpdo else family.mapping
    lines = [
        f'[[bus.node]]\nname = "{first.node}"\nid = {first.node_id}\nmapping = "{mapping}"',
        family.supervision,
        f"configure = [{', '.join(family.configure)}]" if family.configure else "",
    ]
    for drive in drives:
        slot = {"drive": "axis1"}.get(drive.slot, drive.slot) if family is STOEBER else drive.slot
        lines += [
            f'[[bus.node.drive]]\nslot = "{slot}"\nunit_id = {drive.unit}',
            f'control = "{drive.protocol}"\nfieldbus_timeout_ms = {PLANT.fieldbus_timeout_ms}',
            f'on_expiry = "{drive.reaction}"',
            "fieldbus_timeout_writable = true" if drive.protocol == "modbus" else "",
            drive.settings,
            f"ignored_stop_ms = {IGNORED_STOP_MS}" if family is CIA402 else "",
            f"tpdo = {{ event_ms = {TPDO_MS}, inhibit_ms = {INHIBIT_MS} }}",
            f"parameters = {{ {family.parameters} }}" if family.parameters else "",
        ]
    return "\n".join(lines)
