"""The site file: which buses, nodes and drives there are, and who may see and command them.

Reference for users: ``docs/reference/site-file.md``. Times are in ms unless the name says otherwise.
"""

from __future__ import annotations

import ipaddress
import re
from pathlib import Path
from typing import Annotated, Final, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from bridge.tomlfile import Key, TomlFile

Control = Literal["modbus", "opcua", "zenoh", "lease", "none"]
Reaction = Literal["disable_voltage", "quick_stop", "stop", "silence", "hold"]
WordOrder = Literal["ABCD", "CDAB", "BADC", "DCBA"]

IGNORE_ALL_S: Final = -0.1
"""``telegram_downtime_s`` that reports communication errors and otherwise ignores them (P513 = -0.1)."""

_NAME: Final = re.compile(r"[a-z][a-z0-9_]*")
_PREFIX: Final = re.compile(r"[\w.-]+(/[\w.-]+)*", re.ASCII)
_RESERVED_NODES: Final = ("bus", "bridge")


def _name(text: str) -> str:
    if not _NAME.fullmatch(text):
        raise ValueError("must be lower_snake_case: a letter, then letters, digits and _")
    return text


def _prefix(text: str) -> str:
    if not _PREFIX.fullmatch(text):
        raise ValueError("must be words of letters, digits and _ . - with / between them")
    return text


def _endpoint(text: str) -> str:
    host, colon, port = text.rpartition(":")
    if not colon or not port.isdigit() or not 0 <= int(port) <= 65535:
        raise ValueError("must be an address and a port such as 127.0.0.1:4840")
    try:
        ipaddress.ip_address(host.strip("[]"))
    except ValueError:
        raise ValueError("must start with an IP address; 0.0.0.0 is every interface") from None
    return text


def _network(text: str) -> str:
    try:
        ipaddress.ip_network(text, strict=True)
    except ValueError as error:
        raise ValueError(f"must be a network such as 192.168.1.0/24: {error}") from None
    return text


def _downtime(seconds: float) -> float:
    if seconds in (IGNORE_ALL_S, 0) or 0.1 <= seconds <= 100.0:
        return seconds
    raise ValueError("must be -0.1 (ignore), 0 (off) or 0.1…100.0")


Name = Annotated[str, AfterValidator(_name)]
Endpoint = Annotated[str, AfterValidator(_endpoint)]
Network = Annotated[str, AfterValidator(_network)]


class Table(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True, populate_by_name=True)


class SiteTable(Table):
    name: Name = Field(description="a name for this site, lower_snake_case")
    state_dir: str = "/var/lib/drivebridge"
    runtime_dir: str = Field("/run/drivebridge", description="folder for the socket between our processes")


class DriveTable(Table):
    slot: str = Field(description="the drive as the mapping calls it, such as fu1")
    name: Name | None = None
    unit_id: int | None = Field(None, ge=1, le=247, description="a Modbus unit id, 1…247")
    control: Control = Field("none", description="modbus, opcua, zenoh, lease or none")
    fieldbus_timeout_ms: int | None = Field(
        None, ge=0, le=32767, description="0 (off) or 1…32767 ms, the twin of P151"
    )
    fieldbus_timeout_writable: bool = False
    telegram_downtime_s: Annotated[float, AfterValidator(_downtime)] = 0.5
    on_expiry: Reaction = Field(
        "disable_voltage", description="disable_voltage, quick_stop, stop, silence or hold"
    )
    then_silence_ms: int = Field(0, ge=0, le=600_000, description="0 (never) or a time in ms")
    parameters: dict[str, float] = Field(default_factory=dict[str, float])


class IdentityTable(Table):
    vendor_id: int | None = Field(None, ge=0, le=0xFFFF_FFFF)
    product_code: int | None = Field(None, ge=0, le=0xFFFF_FFFF)
    revision: int | None = Field(None, ge=0, le=0xFFFF_FFFF)
    serial: int | None = Field(None, ge=0, le=0xFFFF_FFFF)


class NodeTable(Table):
    name: Name = Field(description="a name for this node, lower_snake_case")
    id: int = Field(ge=1, le=127, description="the node's CANopen address, 1…127")
    mapping: str = Field(description="a file below mappings/ without .toml, such as nord/sk-tu4-cao")
    supervision: Literal["heartbeat", "guarding", "none"] = Field(
        "heartbeat", description="heartbeat, guarding or none"
    )
    supervision_ms: int = Field(200, ge=20, le=65535, description="20…65535 ms")
    life_time_factor: int = Field(3, ge=1, le=255)
    mandatory: bool = False
    enabled: bool = True
    hold_ms: int = Field(2000, ge=0, le=3_600_000)
    sdo_timeout_ms: int = Field(500, ge=10, le=60_000)
    identity: IdentityTable = Field(default_factory=lambda: IdentityTable.model_validate({}))
    drive: list[DriveTable] = Field(min_length=1, description="a [[bus.node.drive]] table for each drive")


class BusTable(Table):
    name: Name = Field(description="a name for this bus, lower_snake_case")
    interface: str = Field(description='"socketcan", "virtual", or a python-can interface')
    channel: str | None = None
    bitrate: int = Field(250_000, ge=10_000, le=1_000_000, description="10000…1000000 bit/s")
    master_node_id: int = Field(127, ge=1, le=127, description="1…127")
    heartbeat_ms: int = Field(100, ge=0, le=65535, description="0 (off) or a time in ms")
    sync_period_ms: int = Field(10, ge=0, le=1000, description="0 (off) or 1…1000 ms")
    rpdo_period_ms: int | None = Field(None, ge=1, le=1000, description="1…1000 ms")
    deadman_ms: int = Field(100, ge=10, le=10_000, description="10…10000 ms")
    node: list[NodeTable] = Field(default_factory=list[NodeTable])

    @property
    def rpdo_period_s(self) -> float:
        """How often an unchanged RPDO is repeated: as often as SYNC, or every 20 ms without one."""
        return (self.rpdo_period_ms or self.sync_period_ms or 20) / 1000


class ModbusTable(Table):
    listen: Endpoint = Field("127.0.0.1:502", description="address:port")
    word_order: WordOrder = Field("ABCD", description="ABCD, CDAB, BADC or DCBA")
    allow: list[Network] = Field(
        default_factory=lambda: ["127.0.0.0/8", "::1/128"], description="networks that may connect"
    )
    max_connections: int = Field(32, ge=1, le=1024)


class UserTable(Table):
    name: str = Field(min_length=1, max_length=64)
    role: Literal["observer", "operator", "engineer"] = Field(description="observer, operator or engineer")
    password_hash: str = Field(description="the line that `drivebridge hash-password` prints")


class OpcUaTable(Table):
    listen: Endpoint = Field("127.0.0.1:4840", description="address:port")
    no_security: bool = Field(False, description="true opens an endpoint without encryption")
    anonymous: Literal["none", "observer", "operator"] = "none"
    certificate: str | None = None
    private_key: str | None = None
    trusted_dir: str | None = None
    user: list[UserTable] = Field(default_factory=list[UserTable])


class ZenohTable(Table):
    mode: Literal["peer", "client"] = Field("peer", description="peer or client")
    listen: list[str] = Field(default_factory=lambda: ["tcp/127.0.0.1:7447"])
    connect: list[str] = Field(default_factory=list[str])
    prefix: Annotated[str, AfterValidator(_prefix)] = "drives"
    encoding: Literal["json", "bare"] = "json"
    accept_put: bool = Field(False, description="true takes a plain put on a command key as a command")
    period_ms: int = Field(10, ge=1, le=10_000, description="1…10000 ms")
    user: str | None = Field(None, description="the bridge's own user, one of password_file")
    password_file: str | None = Field(None, description="a file with user:password for each who may connect")


class Site(Table):
    """One site file, checked. Lists are in the order of the file."""

    site: SiteTable = Field(description="a [site] table with a name")
    bus: list[BusTable] = Field(min_length=1, description="a [[bus]] table for each bus")
    modbus: ModbusTable | None = None
    opcua: OpcUaTable | None = None
    zenoh: ZenohTable | None = None


def load_site(path: Path) -> Site:
    """Read and check a site file. Raises ``FileFaults`` with every fault in it."""
    file = TomlFile(path)
    site = file.validate(Site)
    if site is not None:
        _check_names(site, file)
        _check_buses(site, file)
        _check_drives(site, file)
        if site.zenoh and (site.zenoh.user is None) != (site.zenoh.password_file is None):
            file.fault(("zenoh",), "user and password_file belong together", "give both or neither")
    file.finish()
    if site is None:
        raise AssertionError("a site file without a model always has faults")
    return site


def _check_names(site: Site, file: TomlFile) -> None:
    """Node names are the first word of every point, so they are unique over all buses."""
    seen: dict[str, Key] = {}
    for b, bus in enumerate(site.bus):
        _unique(seen, f"bus {bus.name}", ("bus", b, "name"), f"bus name {bus.name!r}", file)
        for n, node in enumerate(bus.node):
            key: Key = ("bus", b, "node", n, "name")
            _unique(seen, node.name, key, f"node name {node.name!r}", file)
            if node.name in _RESERVED_NODES:
                file.fault(key, f"{node.name!r} is reserved", "choose another name")


def _unique(seen: dict[str, Key], name: str, key: Key, what: str, file: TomlFile) -> None:
    if name in seen:
        file.fault(key, f"{what} is used twice", f"first used in line {file.line(seen[name])}")
    else:
        seen[name] = key


def _check_buses(site: Site, file: TomlFile) -> None:
    for b, bus in enumerate(site.bus):
        if bus.interface != "virtual" and bus.channel is None:
            file.fault(("bus", b), f"interface {bus.interface!r} needs a channel", 'such as channel = "can0"')
        period_ms = bus.rpdo_period_s * 1000
        if bus.deadman_ms < 2 * period_ms:
            file.fault(
                ("bus", b, "deadman_ms"),
                f"{bus.deadman_ms} ms is too short for process data every {period_ms:g} ms",
                f"at least {2 * period_ms:g}: the dead-man burst must outlive one lost cycle",
            )
        seen: dict[str, Key] = {}
        for n, node in enumerate(bus.node):
            key: Key = ("bus", b, "node", n, "id")
            _unique(seen, str(node.id), key, f"node id {node.id}", file)
            if node.id == bus.master_node_id and bus.heartbeat_ms:
                file.fault(key, f"node id {node.id} is the bridge's own", "change it or master_node_id")


def _check_drives(site: Site, file: TomlFile) -> None:
    units: dict[str, Key] = {}
    for b, bus in enumerate(site.bus):
        for n, node in enumerate(bus.node):
            names: dict[str, Key] = {}
            slots: dict[str, Key] = {}
            for d, drive in enumerate(node.drive):
                key: Key = ("bus", b, "node", n, "drive", d)
                name = drive.name or drive.slot
                _unique(names, name, (*key, "name"), f"drive name {name!r}", file)
                _unique(slots, drive.slot, (*key, "slot"), f"slot {drive.slot!r}", file)
                if name == "node":
                    file.fault((*key, "name"), "'node' is reserved", "choose another name")
                if drive.unit_id is not None:
                    what = f"unit id {drive.unit_id}"
                    _unique(units, str(drive.unit_id), (*key, "unit_id"), what, file)
                _check_control(site, drive, key, file)


def _check_control(site: Site, drive: DriveTable, key: Key, file: TomlFile) -> None:
    if drive.control != "none" and drive.fieldbus_timeout_ms is None:
        file.fault(
            (*key, "fieldbus_timeout_ms"),
            "is missing: a drive that can be commanded states how long its controller may be silent",
            "1…32767 ms, or 0 for no supervision, which is a decision",
        )
    if drive.control in ("modbus", "opcua", "zenoh") and getattr(site, drive.control) is None:
        file.fault(
            (*key, "control"),
            f"the drive is controlled by {drive.control}, which this site does not serve",
            f"add a [{drive.control}] table",
        )


def warnings(site: Site) -> list[str]:
    """What is allowed and still worth repeating, one sentence each."""
    found: list[str] = []
    for bus in site.bus:
        for node in bus.node:
            for drive in node.drive:
                name = f"{node.name}/{drive.name or drive.slot}"
                if drive.control != "none" and drive.fieldbus_timeout_ms == 0:
                    found.append(f"{name}: fieldbus_timeout_ms = 0: a silent controller will not stop it")
                if drive.telegram_downtime_s == IGNORE_ALL_S:
                    found.append(f"{name}: telegram_downtime_s = -0.1: no communication error will stop it")
                if drive.on_expiry == "hold" and drive.control != "none":
                    found.append(f'{name}: on_expiry = "hold": a silent controller is only reported')
    if site.opcua and site.opcua.no_security:
        found.append("opcua: no_security = true: anyone who reaches the port reads everything in clear text")
    return found
