"""Every point, made from the site file and the mappings: the one place where the user's view is defined.
What each means: ``docs/reference/points.md``."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from typing import Any, Final

from bridge.catalogue.codes import (
    CONDITIONS,
    CONTROLLER_STATES,
    LAST_STOPS,
    NMT_STATES,
    NODE_STATES,
    WATCHDOG_STATES,
)
from bridge.catalogue.parameter_points import parameter_points
from bridge.config import BusTable, DriveTable, NodeTable, Site
from bridge.drive import DRIVE_STATES, LinearScale, ValueCodec, scales_of
from bridge.image.point import DataType, Point, WriteKind
from bridge.mapping.device_signals import Signal
from bridge.mapping.model import Family, Poll, ProcessValue
from bridge.parameter import Names

CONNECTION_COUNTS: Final = {
    "modbus_refused_connections": "Modbus connections that were refused",
    "modbus_broken_connections": "Modbus connections that the bridge ended",
    "opcua_refused_connections": "OPC UA connections, channels and logins that were refused",
    "opcua_broken_connections": "OPC UA connections that the bridge ended",
    "zenoh_broken_connections": "zenoh connections that have ended, whoever ended them",
}
LIFE_SIGN: Final = "life_sign"
"""Name of the point that offers the token, in ``supervision``, and of the one that takes it, in
``command``."""

_FLAG, _TEXT, _REAL = DataType.BOOL, DataType.STRING, DataType.FLOAT
_U8, _U16, _U32 = DataType.UINT8, DataType.UINT16, DataType.UINT32

_REFUSED_WRITES: Final = "refused requests since start"
_ABORT_CODE: Final = "why the drive last refused an SDO of a client; 0: never"


def _point(top: str, leaf: str, data_type: DataType, description: str, **nature: Any) -> Point:
    return Point(name=f"{top}/{leaf}", data_type=data_type, description=description, **nature)


def site_points(
    site: Site, families: Mapping[str, Family], names: Mapping[str, Names]
) -> dict[str, list[Point]]:
    """Every point, by what has it: the bridge, a bus, a node, a drive. ``families`` and ``names`` are by the
    node's mapping."""
    points = {"bridge": _bridge_points()}
    for bus in site.bus:
        points[f"bus/{bus.name}"] = _bus_points(bus)
        for node in bus.node:
            family, shown = families[node.mapping_key], names[node.mapping_key]
            points[node.name] = _node_points(node, family.poll)
            if family.is_device:
                points[node.name] += _input_points(node.name, family) + parameter_points(node.name, shown)
            for table in node.drive:
                name = f"{node.name}/{family.leaf_of(table)}"
                points[name] = _drive_points(name, family, table) + parameter_points(name, shown)
    return points


def _drive_points(name: str, family: Family, table: DriveTable) -> list[Point]:
    """The points of the drive called ``<node>/<drive>``, without those of words that its PDOs do not carry.
    Scales that are known already give the ranges."""
    command, actual = partial(_point, f"{name}/command"), partial(_point, f"{name}/actual")
    control_bits = tuple(family.control_word.bits)
    slot = family.slot_named(table.slot)
    setpoints, actual_values = family.carried(slot)
    values = family.values_of(slot)
    scales = scales_of(family, table.parameters)
    as_written = "the owner's setpoint word, until a stop replaces it"
    as_sent = "actual value word as the drive sent it"
    last = "the owner's control word, or the stop or start that has replaced it"
    return [
        command("control_word", _U16, last, bits=control_bits, writable=True),
        *(command(word, _U16, as_written, writable=True) for word in setpoints[1:]),
        *(_value(name, value, scales) for value in values if value.group == "command"),
        *_status_points(name, family),
        *(actual(word, _U16, as_sent) for word in actual_values[1:]),
        *(_value(name, value, scales) for value in values if value.group == "actual"),
        *_supervision_points(name, table.fieldbus_timeout_writable),
        *(_life_points(name) if table.life_sign else ()),
        *_identity_points(name),
    ]


def _input_points(name: str, family: Family) -> list[Point]:
    age = "age of the oldest of its TPDOs; 4294967295: one never came"
    return [
        _point(f"{name}/node", "pdo_age_ms", _U32, age, unit="ms"),
        _point(f"{name}/supervision", "refused_writes", _U32, _REFUSED_WRITES),
        _point(f"{name}/supervision", "sdo_abort_code", _U32, _ABORT_CODE),
        *(_signal(f"{name}/input", signal) for signal in family.input),
        *(_signal(f"{name}/output", signal, writable=True) for signal in family.output),
        *(_output_supervision(name) if family.output else ()),
    ]


def _signal(top: str, signal: Signal, *, writable: bool = False) -> Point:
    return Point(
        name=f"{top}/{signal.name}",
        data_type=signal.value_type,
        unit=signal.unit,
        low=signal.low,
        high=signal.high,
        writable=writable,
        description=signal.description,
        states=tuple(sorted(signal.states.items())),
        bits=tuple(signal.bits),
    )


_OF_OUTPUTS: Final = (
    "owner",
    "watchdog_state",
    "watchdog_left_ms",
    "fieldbus_timeout_ms",
    "trips",
    "worst_case_stop_ms",
    "restart_interlock",
    "worst_case_bridge_ms",
    "telegrams",
    "last_stop",
)


def _output_supervision(name: str) -> list[Point]:
    """Points of the supervision of outputs: some of a drive's, by the same names, and ``follows``."""
    points = {point.name.rpartition("/")[2]: point for point in _supervision_points(name, False)}
    follows = "false while an output has not what its last stop gives it, after the bound"
    shared = [points[leaf] for leaf in _OF_OUTPUTS]
    return [*shared, _point(f"{name}/supervision", "follows", _FLAG, follows)]


def _status_points(name: str, family: Family) -> list[Point]:
    bits = tuple(family.status_word.bits)
    point = partial(_point, f"{name}/status")
    return [
        point("status_word", _U16, "status word; shows fault while the watchdog is tripped", bits=bits),
        point("drive_status_word", _U16, "status word as the drive sent it", bits=bits),
        point("state", _U8, "drive state", states=DRIVE_STATES),
        point("fault_text", _TEXT, "present fault"),
        point("fault_number", _TEXT, "number of the present fault as its maker writes it, such as E010/10.3"),
        point("fault_cause", _TEXT, "what may have caused the present fault, by its manual"),
        point("fault_remedy", _TEXT, "what to do about the present fault, by its manual"),
        point("emcy_code", _U16, "code of the last emergency message, CiA 301 §7.2.7"),
    ]


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
    point = partial(_point, f"{name}/supervision")
    return [
        point("owner", _TEXT, "who commands the drive"),
        point("watchdog_state", _U8, "state of the watchdog on the controller", states=WATCHDOG_STATES),
        point("watchdog_left_ms", _U32, "time until the trip", unit="ms"),
        point(
            "fieldbus_timeout_ms",
            _U32,
            "how long the controller may be silent; 0: off (as NORD's P151)",
            unit="ms",
            writable=timeout_writable,
            write=WriteKind.TIMEOUT,
        ),
        point(
            "telegram_downtime_s",
            _REAL,
            "how long the drive may be silent; 0: off, -0.1: errors are ignored (as P513)",
            unit="s",
        ),
        point("last_fault", _REAL, "such as 10.3 for E010/10.3"),
        point("current_fault", _REAL, "present fault; 0: none"),
        point("last_fault_text", _TEXT, "last fault as its maker writes it, with its text"),
        point("trips", _U32, "watchdog trips since start"),
        point(
            "worst_case_stop_ms",
            _U32,
            "longest time from the controller's last telegram to the stop on the bus",
            unit="ms",
        ),
        point("pdo_age_ms", _U32, "age of the last TPDO", unit="ms"),
        point("sent_control_word", _U16, "control word that the bridge sends to the drive"),
        point("restart_interlock", _FLAG, "true while a control word that enables is not forwarded"),
        point("refused_writes", _U32, _REFUSED_WRITES),
        point(
            "worst_case_bridge_ms",
            _U32,
            "longest time from the moment the bridge hangs to the drive's own reaction",
            unit="ms",
        ),
        point(
            "follows", _FLAG, "false while the drive still reports enabled after the bound of its last stop"
        ),
        point("last_stop", _U8, "how the last stop ended", states=LAST_STOPS),
        point("telegrams", _U16, "counts the owner's valid telegrams, modulo 65536"),
        point("sdo_abort_code", _U32, _ABORT_CODE),
    ]


def _life_points(name: str) -> list[Point]:
    offered = "token that a telegram has to bring back, another one each second"
    brought = "token that the owner has brought back last; 0: none that counts"
    return [
        _point(f"{name}/supervision", LIFE_SIGN, _U16, offered),
        _point(f"{name}/command", LIFE_SIGN, _U16, brought, writable=True),
    ]


def _identity_points(name: str) -> list[Point]:
    point = partial(_point, f"{name}/identity")
    return [
        point("vendor", _U32, "vendor id, 1018h:1"),
        point("product", _U32, "product code, 1018h:2"),
        point("revision", _U32, "revision number, 1018h:3"),
        point("serial", _U32, "serial number, 1018h:4"),
        point("device_name", _TEXT, "device name, 1008h"),
    ]


def _node_points(node: NodeTable, polls: list[Poll]) -> list[Point]:
    point = partial(_point, f"{node.name}/node")
    return [
        point("nmt_state", _U8, "NMT state as the node reports it", states=NMT_STATES),
        point("supervision_state", _TEXT, "heartbeat or guarding"),
        point("software_version", _TEXT, "version, 100Ah"),
        point("boot_status", _TEXT, "boot-up step or result"),
        point(
            "current_fault", _REAL, "102.0 while a controller of its drives is silent (as NORD's P170[-01])"
        ),
        point("last_fault", _REAL, "the one before, P170[-02]"),
        point("rejected_frames", _U32, "received frames that did not match the expected layout"),
        point("emcy_history", _TEXT, "the last eight emergency messages as JSON, newest first"),
        point("emcy_suppressed", _U32, "emergency messages not reported because too many came"),
        *(point(poll.name, poll.data_type, poll.description, bits=tuple(poll.bits)) for poll in polls),
        point("condition", _U8, "the worst that is wrong with the node or its drives", states=CONDITIONS),
        point("device_errors", _TEXT, "errors that the node reported at its last boot-up, 1001h and 1003h"),
        point("state", _U8, "what the bridge does with the node", states=NODE_STATES),
    ]


def _bus_points(bus: BusTable) -> list[Point]:
    point = partial(_point, f"bus/{bus.name}")
    return [
        point("state", _U8, "state of the CAN controller", states=CONTROLLER_STATES),
        point("load", _REAL, "bus load", unit="%", low=0, high=100),
        point(
            "nmt_state", _U8, "the bridge's own NMT state on this bus, as in its heartbeat", states=NMT_STATES
        ),
        point("held_by", _TEXT, "missing nodes for which the others wait"),
        point("second_master", _FLAG, "another master sent an NMT command within the last minute"),
        point("unexpected_nodes", _TEXT, "nodes heard within the last minute that are not in the site file"),
        point("duplicate_ids", _TEXT, "node ids that seemed to be used twice within the last minute"),
        point("tx_errors", _U32, "transmit error counter"),
        point("rx_errors", _U32, "receive error counter"),
        point("frames_lost", _U32, "received frames lost: buffer full"),
        point("frames_expired", _U32, "frames not sent in time and dropped"),
        point("error_frames", _U32, "error frames of the controller"),
        point("last_error", _TEXT, "the latest trouble in words"),
        point("sync_window_misses", _U32, "synchronous TPDOs that came after the SYNC window"),
        point("intruders", _U32, "frames of others on identifiers that belong to the bridge alone"),
        point("last_intruder", _TEXT, "the latest one in words"),
        point("condition", _U8, "the worst that is wrong on the bus or anything on it", states=CONDITIONS),
        point("passive", _FLAG, "another bridge is in charge of the bus; this one only listens"),
    ]


def _bridge_points() -> list[Point]:
    point = partial(_point, "bridge")
    return [
        point("version", _TEXT, "version of drivebridge"),
        point("drives_configured", _U32, "drives in the site file"),
        point("drives_good", _U32, "drives with good data"),
        point("refused_writes", _U32, "refused requests since start"),
        point("audit_lost", _U32, "lines missing from the audit log"),
        point("fronts_failing", _TEXT, "servers and fronts that are not serving, each with the reason"),
        point(
            "worst_trip_lateness_ms",
            _REAL,
            "longest time from a deadline to the stop's hand-over to the bus, since start",
            unit="ms",
        ),
        point(
            "worst_round_lateness_ms",
            _REAL,
            "longest delay of a round of the bus process, since start",
            unit="ms",
        ),
        point("hangs", _U32, "times for which the bus process could not run for 100 ms or longer"),
        point("last_hang_ms", _U32, "how long it could not run the last time", unit="ms"),
        point("condition", _U8, "the worst that is wrong anywhere", states=CONDITIONS),
        point("troubles", _TEXT, "what is wrong as JSON, the worst first, each with what it explains"),
        point("recent_troubles", _TEXT, "what was wrong and is over since ten minutes at most, as JSON"),
        point("drives_waiting", _U32, "drives that do not tell their state yet, with nothing wrong"),
        point("stops_unproven", _TEXT, "drives that may run on when the bridge falls silent"),
        point("missed_deadlines", _U32, "deadlines of drives that the bridge had not planned, since start"),
        *(point(leaf, _U32, f"{what}, since start") for leaf, what in CONNECTION_COUNTS.items()),
    ]
