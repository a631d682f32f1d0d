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
from bridge.mapping.entry_types import said_of
from bridge.mapping.model import Family, Poll, ProcessValue
from bridge.parameter import Names
from bridge.text import Text, Words

CONNECTION_COUNTS: Final = {
    "modbus_refused_connections": Text.of("point.modbus_refused"),
    "modbus_broken_connections": Text.of("point.modbus_broken"),
    "opcua_refused_connections": Text.of("point.opcua_refused"),
    "opcua_broken_connections": Text.of("point.opcua_broken"),
    "zenoh_broken_connections": Text.of("point.zenoh_broken"),
}
LIFE_SIGN: Final = "life_sign"
"""Name of the point that offers the token, in ``supervision``, and of the one that takes it, in
``command``."""

_FLAG, _TEXT, _REAL = DataType.BOOL, DataType.STRING, DataType.FLOAT
_U8, _U16, _U32 = DataType.UINT8, DataType.UINT16, DataType.UINT32

_REFUSED_WRITES: Final = Text.of("point.refused_writes")
_ABORT_CODE: Final = Text.of("point.sdo_abort_code")


def _point(top: str, leaf: str, data_type: DataType, description: Words, **nature: Any) -> Point:
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
    as_written = Text.of("point.setpoint_word")
    as_sent = Text.of("point.actual_word")
    last = Text.of("point.control_word")
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
    age = Text.of("point.oldest_pdo_age")
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
        description=said_of(signal.description),
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
    follows = Text.of("point.outputs_follow")
    shared = [points[leaf] for leaf in _OF_OUTPUTS]
    return [*shared, _point(f"{name}/supervision", "follows", _FLAG, follows)]


def _status_points(name: str, family: Family) -> list[Point]:
    bits = tuple(family.status_word.bits)
    point = partial(_point, f"{name}/status")
    return [
        point("status_word", _U16, Text.of("point.status_word"), bits=bits),
        point("drive_status_word", _U16, Text.of("point.drive_status_word"), bits=bits),
        point("state", _U8, Text.of("point.drive_state"), states=DRIVE_STATES),
        point("fault_text", _TEXT, Text.of("point.fault_text")),
        point("fault_number", _TEXT, Text.of("point.fault_number")),
        point("fault_cause", _TEXT, Text.of("point.fault_cause")),
        point("fault_remedy", _TEXT, Text.of("point.fault_remedy")),
        point("emcy_code", _U16, Text.of("point.emcy_code")),
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
        description=said_of(value.description),
        states=tuple(sorted(value.states.items())),
        bits=tuple(value.bits),
    )


def _supervision_points(name: str, timeout_writable: bool) -> list[Point]:
    point = partial(_point, f"{name}/supervision")
    return [
        point("owner", _TEXT, Text.of("point.owner")),
        point("watchdog_state", _U8, Text.of("point.watchdog_state"), states=WATCHDOG_STATES),
        point("watchdog_left_ms", _U32, Text.of("point.watchdog_left"), unit="ms"),
        point(
            "fieldbus_timeout_ms",
            _U32,
            Text.of("point.fieldbus_timeout"),
            unit="ms",
            writable=timeout_writable,
            write=WriteKind.TIMEOUT,
        ),
        point(
            "telegram_downtime_s",
            _REAL,
            Text.of("point.telegram_downtime"),
            unit="s",
        ),
        point("last_fault", _REAL, Text.of("point.last_fault")),
        point("current_fault", _REAL, Text.of("point.current_fault")),
        point("last_fault_text", _TEXT, Text.of("point.last_fault_text")),
        point("trips", _U32, Text.of("point.trips")),
        point(
            "worst_case_stop_ms",
            _U32,
            Text.of("point.worst_case_stop"),
            unit="ms",
        ),
        point("pdo_age_ms", _U32, Text.of("point.pdo_age"), unit="ms"),
        point("sent_control_word", _U16, Text.of("point.sent_control_word")),
        point("restart_interlock", _FLAG, Text.of("point.restart_interlock")),
        point("refused_writes", _U32, _REFUSED_WRITES),
        point(
            "worst_case_bridge_ms",
            _U32,
            Text.of("point.worst_case_bridge"),
            unit="ms",
        ),
        point("follows", _FLAG, Text.of("point.follows")),
        point("last_stop", _U8, Text.of("point.last_stop"), states=LAST_STOPS),
        point("telegrams", _U16, Text.of("point.telegrams")),
        point("sdo_abort_code", _U32, _ABORT_CODE),
    ]


def _life_points(name: str) -> list[Point]:
    offered = Text.of("point.life_sign_offered")
    brought = Text.of("point.life_sign_brought")
    return [
        _point(f"{name}/supervision", LIFE_SIGN, _U16, offered),
        _point(f"{name}/command", LIFE_SIGN, _U16, brought, writable=True),
    ]


def _identity_points(name: str) -> list[Point]:
    point = partial(_point, f"{name}/identity")
    return [
        point("vendor", _U32, Text.of("point.vendor")),
        point("product", _U32, Text.of("point.product")),
        point("revision", _U32, Text.of("point.revision")),
        point("serial", _U32, Text.of("point.serial")),
        point("device_name", _TEXT, Text.of("point.device_name")),
    ]


def _node_points(node: NodeTable, polls: list[Poll]) -> list[Point]:
    point = partial(_point, f"{node.name}/node")
    return [
        point("nmt_state", _U8, Text.of("point.nmt_state"), states=NMT_STATES),
        point("supervision_state", _TEXT, Text.of("point.supervision_state")),
        point("software_version", _TEXT, Text.of("point.software_version")),
        point("boot_status", _TEXT, Text.of("point.boot_status")),
        point("current_fault", _REAL, Text.of("point.node_current_fault")),
        point("last_fault", _REAL, Text.of("point.node_last_fault")),
        point("rejected_frames", _U32, Text.of("point.rejected_frames")),
        point("emcy_history", _TEXT, Text.of("point.emcy_history")),
        point("emcy_suppressed", _U32, Text.of("point.emcy_suppressed")),
        *(
            point(poll.name, poll.data_type, said_of(poll.description), bits=tuple(poll.bits))
            for poll in polls
        ),
        point("condition", _U8, Text.of("point.node_condition"), states=CONDITIONS),
        point("device_errors", _TEXT, Text.of("point.device_errors")),
        point("state", _U8, Text.of("point.node_state"), states=NODE_STATES),
    ]


def _bus_points(bus: BusTable) -> list[Point]:
    point = partial(_point, f"bus/{bus.name}")
    return [
        point("state", _U8, Text.of("point.controller_state"), states=CONTROLLER_STATES),
        point("load", _REAL, Text.of("point.bus_load"), unit="%", low=0, high=100),
        point("nmt_state", _U8, Text.of("point.own_nmt_state"), states=NMT_STATES),
        point("held_by", _TEXT, Text.of("point.held_by")),
        point("second_master", _FLAG, Text.of("point.second_master")),
        point("unexpected_nodes", _TEXT, Text.of("point.unexpected_nodes")),
        point("duplicate_ids", _TEXT, Text.of("point.duplicate_ids")),
        point("tx_errors", _U32, Text.of("point.tx_errors")),
        point("rx_errors", _U32, Text.of("point.rx_errors")),
        point("frames_lost", _U32, Text.of("point.frames_lost")),
        point("frames_expired", _U32, Text.of("point.frames_expired")),
        point("error_frames", _U32, Text.of("point.error_frames")),
        point("last_error", _TEXT, Text.of("point.last_error")),
        point("sync_window_misses", _U32, Text.of("point.sync_window_misses")),
        point("intruders", _U32, Text.of("point.intruders")),
        point("last_intruder", _TEXT, Text.of("point.last_intruder")),
        point("condition", _U8, Text.of("point.bus_condition"), states=CONDITIONS),
        point("passive", _FLAG, Text.of("point.bus_passive")),
    ]


def _bridge_points() -> list[Point]:
    point = partial(_point, "bridge")
    return [
        point("version", _TEXT, Text.of("point.version")),
        point("drives_configured", _U32, Text.of("point.drives_configured")),
        point("drives_good", _U32, Text.of("point.drives_good")),
        point("refused_writes", _U32, Text.of("point.refused_writes")),
        point("audit_lost", _U32, Text.of("point.audit_lost")),
        point("fronts_failing", _TEXT, Text.of("point.fronts_failing")),
        point(
            "worst_trip_lateness_ms",
            _REAL,
            Text.of("point.worst_trip_lateness"),
            unit="ms",
        ),
        point(
            "worst_round_lateness_ms",
            _REAL,
            Text.of("point.worst_round_lateness"),
            unit="ms",
        ),
        point("hangs", _U32, Text.of("point.hangs")),
        point("last_hang_ms", _U32, Text.of("point.last_hang"), unit="ms"),
        point("condition", _U8, Text.of("point.bridge_condition"), states=CONDITIONS),
        point("troubles", _TEXT, Text.of("point.troubles")),
        point("recent_troubles", _TEXT, Text.of("point.recent_troubles")),
        point("drives_waiting", _U32, Text.of("point.drives_waiting")),
        point("stops_unproven", _TEXT, Text.of("point.stops_unproven")),
        point("missed_deadlines", _U32, Text.of("point.missed_deadlines")),
        *(point(leaf, _U32, what) for leaf, what in CONNECTION_COUNTS.items()),
    ]
