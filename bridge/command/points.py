"""Every point, made from the site file and the mappings: the one place where the user's view is defined.
What each means: ``docs/reference/points.md``."""

from __future__ import annotations

from typing import Final

from bridge.command import follow
from bridge.command.leg.state import STATES as WATCHDOG_STATES
from bridge.command.link import NodeState
from bridge.config import BusTable, NodeTable
from bridge.drive import STATES, LinearScale, ValueCodec
from bridge.image import DataType, Point
from bridge.mapping.model import Family, Poll, ProcessValue, Slot

NMT_STATES: Final = (
    (0, "initialising"),
    (4, "stopped"),
    (5, "operational"),
    (127, "pre_operational"),
    (255, "unknown"),
)
NODE_CODES: Final = {
    NodeState.ABSENT: 0,
    NodeState.BOOTING: 1,
    NodeState.OPERATIONAL: 2,
    NodeState.LOST: 3,
    NodeState.STOPPED: 4,
    NodeState.DISABLED: 5,
    NodeState.CONFIG_ERROR: 6,
}
NODE_STATES: Final = tuple((code, state.name.lower()) for state, code in NODE_CODES.items())
CONNECTION_COUNTS: Final = {
    "modbus_refused_connections": "Modbus connections that were refused",
    "modbus_broken_connections": "Modbus connections that the bridge ended",
    "opcua_refused_connections": "OPC UA connections, channels and logins that were refused",
    "opcua_broken_connections": "OPC UA connections that the bridge ended",
    "zenoh_broken_connections": "zenoh connections that have ended, whoever ended them",
}
CONTROLLER_STATES: Final = ((0, "ok"), (1, "warning"), (2, "passive"), (3, "bus_off"), (4, "down"))


def _word(name: str, description: str, bits: tuple[str, ...] = (), *, writable: bool = False) -> Point:
    return Point(name=name, data_type=DataType.UINT16, writable=writable, description=description, bits=bits)


def drive_points(
    name: str, family: Family, slot: Slot, scales: dict[str, LinearScale], *, timeout_writable: bool
) -> list[Point]:
    """The points of the drive called ``<node>/<drive>``, without those of words that its PDOs do not carry.

    ``scales``: those already known, by the value's leaf; they give the ranges.
    ``timeout_writable``: the owner may change ``fieldbus_timeout_ms``.
    """
    return [
        *_command_points(name, family, slot, scales),
        *_status_points(name, family),
        *_actual_points(name, family, slot, scales),
        *_supervision_points(name, timeout_writable),
        *_identity_points(name),
    ]


def _command_points(name: str, family: Family, slot: Slot, scales: dict[str, LinearScale]) -> list[Point]:
    bits = tuple(family.control_word.bits)
    points = [
        _word(f"{name}/command/control_word", "control word as the owner wrote it", bits, writable=True),
        *(
            _word(f"{name}/command/{word}", "setpoint word as the owner wrote it", writable=True)
            for word in family.carried(slot)[0][1:]
        ),
    ]
    return points + _values(name, family, slot, scales, "command")


def _status_points(name: str, family: Family) -> list[Point]:
    bits = tuple(family.status_word.bits)
    return [
        _word(f"{name}/status/status_word", "status word; shows fault while the watchdog is tripped", bits),
        _word(f"{name}/status/drive_status_word", "status word as the drive sent it", bits),
        Point(
            name=f"{name}/status/state", data_type=DataType.UINT8, states=STATES, description="drive state"
        ),
        Point(name=f"{name}/status/fault_text", data_type=DataType.STRING, description="present fault"),
        _word(f"{name}/status/emcy_code", "code of the last emergency message, CiA 301 §7.2.7"),
    ]


def _actual_points(name: str, family: Family, slot: Slot, scales: dict[str, LinearScale]) -> list[Point]:
    points = [
        _word(f"{name}/actual/{word}", "actual value word as the drive sent it")
        for word in family.carried(slot)[1][1:]
    ]
    return points + _values(name, family, slot, scales, "actual")


def _values(name: str, family: Family, slot: Slot, scales: dict[str, LinearScale], group: str) -> list[Point]:
    return [_value(name, value, scales) for value in family.values_of(slot) if value.group == group]


def _value(name: str, value: ProcessValue, scales: dict[str, LinearScale]) -> Point:
    low, high = ValueCodec(value, value.word_names, scales.get(value.leaf)).range
    return Point(
        name=f"{name}/{value.leaf}",
        data_type=value.point_type,
        unit=value.unit,
        low=low,
        high=high,
        writable=value.group == "command",
        description=value.description,
        states=tuple(sorted(value.states.items())),
        bits=tuple(value.bits),
    )


def _supervision_points(name: str, timeout_writable: bool) -> list[Point]:
    top = f"{name}/supervision"
    u32, ms = DataType.UINT32, "ms"
    return [
        Point(name=f"{top}/owner", data_type=DataType.STRING, description="who commands the drive"),
        Point(
            name=f"{top}/watchdog_state",
            data_type=DataType.UINT8,
            states=WATCHDOG_STATES,
            description="state of the watchdog on the controller",
        ),
        Point(name=f"{top}/watchdog_left_ms", data_type=u32, unit=ms, description="time until the trip"),
        Point(
            name=f"{top}/fieldbus_timeout_ms",
            data_type=u32,
            unit=ms,
            writable=timeout_writable,
            description="how long the controller may be silent; 0: off (as NORD's P151)",
        ),
        Point(
            name=f"{top}/telegram_downtime_s",
            data_type=DataType.FLOAT,
            unit="s",
            description="how long the drive may be silent; 0: off, -0.1: errors are ignored (as P513)",
        ),
        Point(name=f"{top}/last_fault", data_type=DataType.FLOAT, description="such as 10.3 for E010/10.3"),
        Point(name=f"{top}/current_fault", data_type=DataType.FLOAT, description="present fault; 0: none"),
        Point(name=f"{top}/trips", data_type=u32, description="watchdog trips since start"),
        Point(
            name=f"{top}/worst_case_stop_ms",
            data_type=u32,
            unit=ms,
            description="longest time from the controller's last telegram to the stop on the bus",
        ),
        Point(name=f"{top}/pdo_age_ms", data_type=u32, unit=ms, description="age of the last TPDO"),
        _word(f"{top}/sent_control_word", "control word that the bridge sends to the drive"),
        Point(
            name=f"{top}/restart_interlock",
            data_type=DataType.BOOL,
            description="true until the owner has sent a control word that does not enable",
        ),
        Point(name=f"{top}/refused_writes", data_type=u32, description="refused requests since start"),
        Point(
            name=f"{top}/worst_case_bridge_ms",
            data_type=u32,
            unit=ms,
            description="longest time from the moment the bridge hangs to the drive's own reaction",
        ),
        Point(
            name=f"{top}/follows",
            data_type=DataType.BOOL,
            description="false while the drive still reports enabled after the bound of its last stop",
        ),
        Point(
            name=f"{top}/last_stop",
            data_type=DataType.UINT8,
            states=follow.STATES,
            description="how the last stop ended",
        ),
        _word(f"{top}/telegrams", "number of the owner's last valid telegram, modulo 65536"),
        Point(
            name=f"{top}/sdo_abort_code",
            data_type=u32,
            description="why the drive last refused an SDO of a client; 0: never",
        ),
    ]


def _identity_points(name: str) -> list[Point]:
    top = f"{name}/identity"
    return [
        Point(name=f"{top}/vendor", data_type=DataType.UINT32, description="vendor id, 1018h:1"),
        Point(name=f"{top}/product", data_type=DataType.UINT32, description="product code, 1018h:2"),
        Point(name=f"{top}/revision", data_type=DataType.UINT32, description="revision number, 1018h:3"),
        Point(name=f"{top}/serial", data_type=DataType.UINT32, description="serial number, 1018h:4"),
        Point(name=f"{top}/device_name", data_type=DataType.STRING, description="device name, 1008h"),
    ]


def node_points(node: NodeTable, polls: list[Poll]) -> list[Point]:
    top = f"{node.name}/node"
    return [
        Point(
            name=f"{top}/nmt_state",
            data_type=DataType.UINT8,
            states=NMT_STATES,
            description="NMT state as the node reports it",
        ),
        Point(
            name=f"{top}/supervision_state", data_type=DataType.STRING, description="heartbeat or guarding"
        ),
        Point(name=f"{top}/software_version", data_type=DataType.STRING, description="version, 100Ah"),
        Point(name=f"{top}/boot_status", data_type=DataType.STRING, description="boot-up step or result"),
        Point(
            name=f"{top}/current_fault",
            data_type=DataType.FLOAT,
            description="102.0 while a controller of its drives is silent (as NORD's P170[-01])",
        ),
        Point(name=f"{top}/last_fault", data_type=DataType.FLOAT, description="the one before, P170[-02]"),
        Point(
            name=f"{top}/rejected_frames",
            data_type=DataType.UINT32,
            description="received frames that did not match the expected layout",
        ),
        Point(
            name=f"{top}/emcy_history",
            data_type=DataType.STRING,
            description="the last eight emergency messages as JSON, newest first",
        ),
        Point(
            name=f"{top}/emcy_suppressed",
            data_type=DataType.UINT32,
            description="emergency messages not reported because too many came",
        ),
        *(
            Point(
                name=f"{top}/{poll.name}",
                data_type=poll.data_type,
                description=poll.description,
                bits=tuple(poll.bits),
            )
            for poll in polls
        ),
        Point(
            name=f"{top}/device_errors",
            data_type=DataType.STRING,
            description="errors that the node reported at its last boot-up, 1001h and 1003h",
        ),
        Point(
            name=f"{top}/state",
            data_type=DataType.UINT8,
            states=NODE_STATES,
            description="what the bridge does with the node",
        ),
    ]


def bus_points(bus: BusTable) -> list[Point]:
    top = f"bus/{bus.name}"
    u32 = DataType.UINT32
    return [
        Point(
            name=f"{top}/state",
            data_type=DataType.UINT8,
            states=CONTROLLER_STATES,
            description="state of the CAN controller",
        ),
        Point(
            name=f"{top}/load", data_type=DataType.FLOAT, unit="%", low=0, high=100, description="bus load"
        ),
        Point(
            name=f"{top}/nmt_state",
            data_type=DataType.UINT8,
            states=NMT_STATES,
            description="the bridge's own NMT state on this bus, as in its heartbeat",
        ),
        Point(
            name=f"{top}/held_by",
            data_type=DataType.STRING,
            description="missing nodes for which the others wait",
        ),
        Point(
            name=f"{top}/second_master",
            data_type=DataType.BOOL,
            description="another master sent an NMT command within the last minute",
        ),
        Point(
            name=f"{top}/unexpected_nodes",
            data_type=DataType.STRING,
            description="nodes heard within the last minute that are not in the site file",
        ),
        Point(
            name=f"{top}/duplicate_ids",
            data_type=DataType.STRING,
            description="node ids that seemed to be used twice within the last minute",
        ),
        Point(name=f"{top}/tx_errors", data_type=u32, description="transmit error counter"),
        Point(name=f"{top}/rx_errors", data_type=u32, description="receive error counter"),
        Point(name=f"{top}/frames_lost", data_type=u32, description="received frames lost: buffer full"),
        Point(name=f"{top}/frames_expired", data_type=u32, description="frames not sent in time and dropped"),
        Point(name=f"{top}/error_frames", data_type=u32, description="error frames of the controller"),
        Point(name=f"{top}/last_error", data_type=DataType.STRING, description="the latest trouble in words"),
        Point(
            name=f"{top}/sync_window_misses",
            data_type=u32,
            description="synchronous TPDOs that came after the SYNC window",
        ),
        Point(
            name=f"{top}/intruders",
            data_type=u32,
            description="frames of others on identifiers that belong to the bridge alone",
        ),
        Point(name=f"{top}/last_intruder", data_type=DataType.STRING, description="the latest one in words"),
        Point(
            name=f"{top}/passive",
            data_type=DataType.BOOL,
            description="another bridge is in charge of the bus; this one only listens",
        ),
    ]


def bridge_points() -> list[Point]:
    u32 = DataType.UINT32
    return [
        Point(name="bridge/version", data_type=DataType.STRING, description="version of drivebridge"),
        Point(name="bridge/drives_configured", data_type=u32, description="drives in the site file"),
        Point(name="bridge/drives_good", data_type=u32, description="drives with good data"),
        Point(name="bridge/refused_writes", data_type=u32, description="refused requests since start"),
        Point(name="bridge/audit_lost", data_type=u32, description="lines missing from the audit log"),
        Point(
            name="bridge/fronts_failing",
            data_type=DataType.STRING,
            description="servers and fronts that are not serving, each with the reason",
        ),
        Point(
            name="bridge/worst_trip_lateness_ms",
            data_type=DataType.FLOAT,
            unit="ms",
            description="longest time from a deadline to the stop's hand-over to the bus, since start",
        ),
        Point(
            name="bridge/worst_round_lateness_ms",
            data_type=DataType.FLOAT,
            unit="ms",
            description="longest delay of a round of the bus process, since start",
        ),
        *(
            Point(name=f"bridge/{leaf}", data_type=u32, description=f"{what}, since start")
            for leaf, what in CONNECTION_COUNTS.items()
        ),
    ]
