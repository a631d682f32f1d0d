"""The keys of a site file. Times are in ms unless the name says otherwise."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Final, Literal

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationInfo,
    field_validator,
)

from bridge.base.data_type_texts import text_of_misfit
from bridge.canopen.datatypes import DataTypeError, TypeName, encode
from bridge.canopen.pdo import PdoEntry
from bridge.config.download import Download
from bridge.config.field_types import (
    LIFE_SIGN_MS,
    LONGEST_TIMEOUT_MS,
    Control,
    ControllerName,
    Downtime,
    Endpoint,
    EndpointUrl,
    Full,
    Gateway,
    HostName,
    Locator,
    MandatoryMissing,
    Name,
    Network,
    ObjectName,
    OnFailedStart,
    OnIgnoredStop,
    OnIntruder,
    OnLoss,
    ParameterRights,
    PdoMapping,
    PlainValue,
    PointPattern,
    Prefix,
    Reason,
    RegularExpression,
    SyncCounter,
    TimeoutRange,
    Uri,
    WordOrder,
    listed,
)
from bridge.config.point_patterns import HISTORY_POINTS
from bridge.config.reaction import REACTIONS, Reaction, ReactionRule
from bridge.tomlfile import Unfit


class Table(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)


class SiteTable(Table):
    name: Name = Field(description="a name for this site, lower_snake_case")
    state_dir: str = "/var/lib/drivebridge"
    runtime_dir: str = Field("/run/drivebridge", description="folder for the socket between our processes")
    all_ports: bool = Field(False, description="true: starts only where each port can be opened")
    front_memory_mb: int = Field(400, ge=200, le=1_000_000, description="200…1000000 MB")


class PdoTable(Table):
    """Settings of one PDO that the bridge writes to the node; what is left out stays as the node has it."""

    number: int | None = Field(None, ge=1, le=512, description="left out: the drive's first")
    enable: bool = True
    cob_id: int | None = Field(None, ge=0x181, le=0x6DF, description="385…1759 (181h…6DFh), with the node id")
    transmission_type: int | None = Field(None, ge=0, le=255, description="0…255, as the device allows")
    inhibit_ms: float | None = Field(None, ge=0, le=6553.5, description="0…6553.5 ms, in steps of 0.1")
    event_ms: int | None = Field(None, ge=0, le=65535, description="0…65535 ms")
    mapping: PdoMapping = Field(default_factory=list[PdoEntry])


PdoTables = Annotated[list[PdoTable], BeforeValidator(listed)]


def pdo_table(tables: Sequence[PdoTable], number: int, first: int) -> PdoTable | None:
    """Table of a drive's PDO in the site file; one without a number is for the drive's ``first``."""
    return next((table for table in tables if (table.number or first) == number), None)


class AcceptsTable(Table):
    """Risks that a site accepts, each with its reason."""

    runs_on: Reason | None = Field(
        None, description="reason why the drive may run on when the bridge falls silent"
    )


class CommandedTable(Table):
    """Owner of a drive or of outputs, the reaction to its loss, and that to an ignored stop."""

    control: Control = "none"
    fieldbus_timeout_ms: int | None = Field(
        None, ge=0, le=LONGEST_TIMEOUT_MS, description="0 (off) or 1…32767 ms, like P151"
    )
    stop_by_anyone: bool = True
    accepts: AcceptsTable = Field(default_factory=lambda: AcceptsTable.model_validate({}))
    on_ignored_stop: OnIgnoredStop = "stop_node"
    ignored_stop_ms: int | None = Field(None, ge=50, le=600_000, description="50…600000 ms")

    @property
    def reacts_to_ignored_stop(self) -> OnIgnoredStop:
        """Reaction to an ignored stop; by default a report if ``control`` is none: others may run it."""
        is_given = "on_ignored_stop" in self.model_fields_set
        return self.on_ignored_stop if is_given or self.control != "none" else "report"


class DriveTable(CommandedTable):
    slot: str = Field(description="the drive as the mapping calls it, such as fu1")
    name: Name | None = None
    unit_id: int | None = Field(None, ge=1, le=247, description="a Modbus unit id, 1…247")
    life_sign: bool = False
    fieldbus_timeout_writable: bool = False
    fieldbus_timeout_range_ms: TimeoutRange | None = Field(
        None, description="[lowest, highest] that the owner may set, each 0…32767 ms"
    )
    telegram_downtime_s: Downtime = 0.5
    on_expiry: Reaction = "disable_voltage"
    then_silence_ms: int = Field(0, ge=0, le=600_000, description="0 (never) or a time in ms")
    parameters: dict[str, Full] = Field(
        default_factory=dict[str, float], description="scaling, where it is not read from the drive"
    )
    tpdo_deadline_ms: int | None = Field(None, ge=0, le=600_000, description="0 (never late) or a time in ms")
    rtr_poll_ms: int = Field(100, ge=5, le=60_000, description="5…60000 ms")
    rpdo: PdoTables = Field(default_factory=list[PdoTable])
    tpdo: PdoTables = Field(default_factory=list[PdoTable])

    @property
    def reaction(self) -> ReactionRule:
        return REACTIONS[self.on_expiry]

    @property
    def falls_silent(self) -> bool:
        """Whether a trip ends the RPDOs, at once or later."""
        return self.reaction.is_silent or (self.then_silence_ms > 0 and not self.reaction.holds)

    @property
    def timeout_range_ms(self) -> tuple[int, int]:
        """Range in ms for the owner: by default never off, and up to ten times the site's own time."""
        if self.fieldbus_timeout_range_ms is not None:
            low, high = self.fieldbus_timeout_range_ms
            return low, high
        low = LIFE_SIGN_MS + 1 if self.life_sign else 1
        return low, min(10 * (self.fieldbus_timeout_ms or LONGEST_TIMEOUT_MS), LONGEST_TIMEOUT_MS)


SafeValue = bool | int | float | Literal["hold"]


class OutputsTable(CommandedTable):
    """Owner of the outputs of a node without drives, and their values when nobody commands them."""

    on_expiry: dict[str, SafeValue] = Field(
        default_factory=dict[str, SafeValue], description='for each output a value, or "hold"'
    )


class IdentityTable(Table):
    device_type: int | None = Field(None, ge=0, le=0xFFFF_FFFF)
    device_type_mask: int | None = Field(None, ge=0, le=0xFFFF_FFFF)
    vendor_id: int | None = Field(None, ge=0, le=0xFFFF_FFFF)
    vendor_id_mask: int | None = Field(None, ge=0, le=0xFFFF_FFFF)
    product_code: int | None = Field(None, ge=0, le=0xFFFF_FFFF)
    product_code_mask: int | None = Field(None, ge=0, le=0xFFFF_FFFF)
    revision: int | None = Field(None, ge=0, le=0xFFFF_FFFF)
    revision_mask: int | None = Field(None, ge=0, le=0xFFFF_FFFF)
    serial: int | None = Field(None, ge=0, le=0xFFFF_FFFF)
    serial_mask: int | None = Field(None, ge=0, le=0xFFFF_FFFF)
    device_name: RegularExpression | None = Field(
        None, description="a regular expression that is found in 1008h"
    )
    software_version: RegularExpression | None = Field(
        None, description="a regular expression that is found in 100Ah"
    )


class ConfigureTable(Table):
    """One object, with the value that the node is to hold."""

    object: ObjectName = Field(description='an object as "2097:01", index and sub-index in hexadecimal')
    type: TypeName = Field(description="the object's data type, such as uint16")
    value: PlainValue
    read_back: bool = Field(True, description="false writes it blindly, as a command")

    @field_validator("value")
    @classmethod
    def _encodes(cls, value: bool | int | float | str, info: ValidationInfo) -> bool | int | float | str:
        """The fault is the value's, with its line. Without a type there is a fault already."""
        kind = info.data.get("type")
        if kind is not None:
            try:
                encode(kind, value)
            except DataTypeError as error:
                raise Unfit(text_of_misfit(error)) from None
        return value

    @property
    def download(self) -> Download:
        index, sub = self.object.split(":")
        return Download(
            int(index, 16), int(sub, 16), encode(self.type, self.value), self.read_back, self.type
        )


MODULES: Final = "modules"
"""Key of a fault about the modules plugged into a device, found in its description."""


def mapping_key(mapping: str, modules: Sequence[str]) -> str:
    """A mapping, and the modules that are plugged into the device, one to a line."""
    return "\n".join((mapping, *modules))


class NodeTable(Table):
    name: Name = Field(description="a name for this node, lower_snake_case")
    id: int = Field(ge=1, le=127, description="the node's CANopen address, 1…127")
    mapping: str = Field(description="a file below mappings/ without .toml, such as nord/sk-tu4-cao")
    modules: list[Annotated[str, Field(min_length=1)]] = Field(
        default_factory=list[str],
        description="modules of a coupler, in their order: order codes, names or numbers of its EDS",
    )
    supervision: Literal["heartbeat", "guarding", "none"] = "heartbeat"
    supervision_ms: int = Field(200, ge=20, le=65535, description="20…65535 ms")
    life_time_factor: int = Field(3, ge=1, le=255)
    mandatory: bool = False
    start_order: int = Field(0, ge=0, le=126, description="0…126, lower ones start first")
    on_loss: OnLoss = "restart"
    on_failed_start: OnFailedStart = "reset_communication"
    enabled: bool = True
    hold_ms: int = Field(2000, ge=0, le=3_600_000)
    sdo_timeout_ms: int = Field(500, ge=10, le=60_000)
    sdo_retries: int = Field(1, ge=0, le=10, description="0…10")
    sdo_channels: list[Annotated[int, Field(ge=2, le=128)]] = Field(default_factory=list[int])
    identity: IdentityTable = Field(default_factory=lambda: IdentityTable.model_validate({}))
    own_timeout_ms: int | None = Field(
        None, ge=1, le=65535, description="the drives' own supervision of the bridge, 1…65535 ms"
    )
    enforce: bool = Field(False, description="true writes own_timeout_ms at boot-up where it differs")
    configuration: str | None = None
    configuration_store: bool = False
    configure: list[ConfigureTable] = Field(default_factory=list[ConfigureTable])
    unit_id: int | None = Field(
        None, ge=1, le=247, description="a Modbus unit id, 1…247, of a node without drives"
    )
    outputs: OutputsTable = Field(
        default_factory=lambda: OutputsTable.model_validate({}),
        description="owner of the outputs of a node without drives",
    )
    drive: list[DriveTable] = Field(
        default_factory=list[DriveTable], description="a [[bus.node.drive]] table for each drive"
    )

    @property
    def mapping_key(self) -> str:
        """The key of its family: nodes with the same mapping and the same modules share one."""
        return mapping_key(self.mapping, self.modules)


class CableTable(Table):
    """A segment of the cable, from the repeater before it on."""

    length_m: float = Field(ge=0.1, le=10_000, description="0.1…10000 m")
    cross_section_mm2: float | None = Field(None, ge=0.1, le=10, description="0.1…10 mm²")
    nodes: int | None = Field(None, ge=2, le=127, description="2…127, the bridge included")
    terminations: int | None = Field(None, ge=0, le=127, description="terminating resistors")
    longest_stub_m: float = Field(0.0, ge=0, le=1000, description="0 (none) or a length in m")
    repeater_m: float = Field(30.0, ge=0, le=1000, description="0…1000 m")


class BusTable(Table):
    name: Name = Field(description="a name for this bus, lower_snake_case")
    interface: str = Field(description='"socketcan", "virtual", or a python-can interface')
    channel: str | None = None
    bitrate: int = Field(250_000, ge=10_000, le=1_000_000, description="10000…1000000 bit/s")
    master_node_id: int = Field(127, ge=1, le=127, description="1…127")
    heartbeat_ms: int = Field(100, ge=0, le=65535, description="0 (off) or a time in ms")
    sync_period_ms: int = Field(10, ge=0, le=1000, description="0 (off) or 1…1000 ms")
    sync_counter: SyncCounter = Field(0, description="0 (none) or 2…240")
    sync_window_us: int = Field(0, ge=0, le=1_000_000, description="0 (not judged) or a time in µs")
    time_period_s: int = Field(0, ge=0, le=86_400, description="0 (off) or 1…86400 s")
    rpdo_period_ms: int | None = Field(None, ge=1, le=1000, description="1…1000 ms")
    deadman_ms: int = Field(100, ge=10, le=10_000, description="10…10000 ms")
    mandatory_missing: MandatoryMissing = "go_on"
    reset_at_start: Literal["none", "communication", "node"] = "none"
    on_intruder: OnIntruder = "stop_node"
    gateway: Gateway | None = Field(None, description='"socket", or address:port on loopback')
    cable: list[CableTable] = Field(
        default_factory=list[CableTable], description="a [[bus.cable]] table for each segment"
    )
    node: list[NodeTable] = Field(default_factory=list[NodeTable])

    @property
    def rpdo_period_s(self) -> float:
        """Period in seconds of an unchanged RPDO: by default that of SYNC, or 20 ms without one."""
        return (self.rpdo_period_ms or self.sync_period_ms or 20) / 1000


class ListeningTable(Table):
    """Settings of a server that listens on one port, which no other may have."""

    listen: Endpoint


class ModbusTable(ListeningTable):
    listen: Endpoint = Field("127.0.0.1:502", description="address:port")
    word_order: WordOrder = Field("ABCD", description="ABCD, CDAB, BADC or DCBA")
    allow: list[Network] = Field(
        default_factory=lambda: ["127.0.0.0/8", "::1/128"], description="networks that may connect"
    )
    max_connections: int = Field(32, ge=1, le=1024)
    parameters: ParameterRights = "write"


class UserTable(Table):
    name: str = Field(min_length=1, max_length=64)
    role: Literal["observer", "operator", "engineer", "admin"] = Field(
        description="observer, operator, engineer or admin"
    )
    password_hash: str | None = Field(None, description="the line that `drivebridge hash-password` prints")
    certificate: str | None = None


class OpcUaHistoryTable(Table):
    """History that the OPC UA server keeps."""

    points: list[PointPattern] = Field(default_factory=lambda: list(HISTORY_POINTS))
    samples_per_point: int = Field(20_000, ge=10, le=10_000_000, description="10…10000000")
    size_mb: int = Field(16, ge=1, le=10_000, description="1…10000 MB")
    event_hours: int = Field(168, ge=0, le=87_600, description="0 (none are kept) or 1…87600 h")
    events_mb: int = Field(8, ge=1, le=1000, description="1…1000 MB")
    black_boxes: int = Field(3, ge=0, le=20, description="0…20 of each drive")
    before_s: float = Field(30.0, ge=1, le=600, description="1…600 s")
    after_s: float = Field(5.0, ge=0, le=600, description="0…600 s")


class OpcUaTable(ListeningTable):
    listen: Endpoint = Field("127.0.0.1:4840", description="address:port")
    no_security: bool = Field(False, description="true opens an endpoint without encryption")
    anonymous: Literal["none", "observer", "operator"] = "none"
    application_uri: Uri | None = None
    names: list[HostName] = Field(
        default_factory=list[str], description="host names and addresses by which it is reached"
    )
    certificate: str | None = None
    private_key: str | None = None
    trust: Literal["list", "anybody"] = "list"
    trusted_dir: str | None = None
    powertrain_draft: bool = Field(
        False, description="true serves a draft of OPC 40400-2, which is not published yet"
    )
    endpoints: list[EndpointUrl] = Field(
        default_factory=list[str], description="further addresses by which it is reached, opc.tcp://host:port"
    )
    shutdown_notice_s: float = Field(2.0, ge=0, le=5, description="0…5 s")
    discovery_server: EndpointUrl | None = None
    return_after_s: float | None = Field(None, ge=0, le=86_400, description="0…86400 s")
    history: OpcUaHistoryTable = Field(default_factory=lambda: OpcUaHistoryTable.model_validate({}))
    acknowledge_resets: bool = Field(
        False, description="true has whoever acknowledges the alarm of a drive reset its fault"
    )
    user: list[UserTable] = Field(default_factory=list[UserTable])


class PageTable(ListeningTable):
    """The web page. Its users, and who may read without a login, are OPC UA's."""

    listen: Endpoint = Field("127.0.0.1:8480", description="address:port")
    names: list[str] = Field(
        default_factory=list[str], description="host names by which it may be reached; empty: by any"
    )
    certificate: str | None = None
    private_key: str | None = None
    no_security: bool = Field(False, description="true serves it in clear text beyond loopback")


class ZenohTable(Table):
    mode: Literal["peer", "client"] = "peer"
    listen: list[Locator] = Field(default_factory=lambda: ["tcp/127.0.0.1:7447"])
    connect: list[Locator] = Field(default_factory=list[str])
    prefix: Prefix = "drives"
    encoding: Literal["json", "bare"] = "json"
    accept_put: bool = Field(False, description="true takes a plain put on a command key as a command")
    period_ms: int = Field(10, ge=1, le=10_000, description="1…10000 ms")
    parameters: ParameterRights = "write"
    user: str | None = Field(None, description="the bridge's own user, one of password_file")
    password_file: str | None = Field(None, description="a file with user:password for each who may connect")
    controllers: list[ControllerName] | None = None
    no_security: bool = Field(False, description="true listens beyond loopback for anybody")


class AuditTable(Table):
    enabled: bool = True
    file: str | None = None
    max_bytes: int = Field(10_000_000, ge=10_000, le=10_000_000_000, description="10000…10000000000")
    keep: int = Field(5, ge=0, le=1000, description="0…1000")
    every_telegram: bool = False


class RecorderTable(Table):
    enabled: bool = True
    size_mb: int = Field(16, ge=4, le=100_000, description="4…100000 MB")
    before_s: float = Field(30.0, ge=1, le=3600, description="1…3600 s")
    after_s: float = Field(5.0, ge=0, le=600, description="0…600 s")
    black_box_mb: int = Field(64, ge=4, le=100_000, description="4…100000 MB")


class Site(Table):
    """One site file, checked. Lists are in the order of the file."""

    site: SiteTable = Field(description="a [site] table with a name")
    bus: list[BusTable] = Field(min_length=1, description="a [[bus]] table for each bus")
    modbus: ModbusTable | None = None
    opcua: OpcUaTable | None = None
    zenoh: ZenohTable | None = None
    page: PageTable | None = None
    audit: AuditTable = Field(default_factory=lambda: AuditTable.model_validate({}))
    recorder: RecorderTable = Field(default_factory=lambda: RecorderTable.model_validate({}))
