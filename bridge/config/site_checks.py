"""Checks of the keys of a site file against each other.

Judged on the raw file, so that these faults are found beside those of single values.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Final, cast

from bridge.config.field_types import LIFE_SIGN_MS
from bridge.config.model import BusTable, Site
from bridge.tomlfile import Key, RawTable, TomlFile

_RESERVED_NODES: Final = ("bus", "bridge")
_LOOPBACK: Final = re.compile(r"127\.|localhost:|\[::1\]:")
_PROTOCOLS: Final = ("modbus", "opcua", "zenoh")
_LOCAL: Final = re.compile(r"(unixsock-stream|unixpipe)/.*|[a-z]+/(127\.[0-9.]+|localhost|\[::1\])(:.*)?")
_MUTUAL_TLS: Final = re.compile(r"(tls|quic)/.*[#;]enable_mtls=(true|1)\b.*")
_WITHOUT_CONNECTIONS: Final = ("opcua", "zenoh")
"""Protocols of which the command side does not know whether a client is still connected."""
_BUS: Final = BusTable.model_construct()
"""Bus with the defaults of the site file."""


def check(file: TomlFile) -> None:
    """Note every contradiction in ``file``."""
    nodes, units, channels, names = _Unique(file), _Unique(file), _Unique(file), _Unique(file)
    for bus in file.root.tables("bus"):
        names.add(bus, "name", "bus name")
        _check_bus(bus, channels, file)
        ids = _Unique(file)
        for node in bus.tables("node"):
            nodes.add(node, "name", "node name")
            ids.add(node, "id", "node id")
            _check_node(bus, node, file)
            _check_drives(node, units, file)
    _check_users(file)
    _check_ports(file)
    _check_page(file)
    _check_zenoh(file)


@dataclass(slots=True)
class _Unique:
    """Values that may occur only once in the file."""

    file: TomlFile
    seen: dict[str | int, Key] = field(default_factory=dict[str | int, Key])

    def add(self, table: RawTable, name: str, what: str) -> bool:
        """Whether this value of ``name`` occurs for the first time."""
        value = table.text(name) if table.text(name) is not None else table.whole(name)
        return value is None or self.add_value(value, (*table.key, name), f"{what} {value!r}")

    def add_value(self, value: str | int, key: Key, what: str) -> bool:
        first = self.seen.setdefault(value, key)
        if first != key:
            self.file.fault(key, f"{what} is used twice", f"first used in line {self.file.line(first)}")
        return first == key


def _check_bus(bus: RawTable, channels: _Unique, file: TomlFile) -> None:
    interface, channel = bus.text("interface"), bus.text("channel")
    if interface and interface != "virtual":
        if "channel" not in bus.content:
            file.fault(bus.key, f"interface {interface!r} needs a channel", 'such as channel = "can0"')
        elif channel:
            key = (*bus.key, "channel")
            channels.add_value(f"{interface} {channel}", key, f"{interface} channel {channel!r}")
    sync_ms = _given(bus, "sync_period_ms", _BUS.sync_period_ms)
    period_s = BusTable.model_construct(
        sync_period_ms=sync_ms, rpdo_period_ms=bus.whole("rpdo_period_ms")
    ).rpdo_period_s
    window_us = _given(bus, "sync_window_us", _BUS.sync_window_us)
    if window_us and window_us > 1000 * sync_ms:
        file.fault(
            (*bus.key, "sync_window_us"),
            f"{window_us} µs is longer than the SYNC period",
            f"at most {1000 * sync_ms} with sync_period_ms = {sync_ms}",
        )
    deadman_ms = _given(bus, "deadman_ms", _BUS.deadman_ms)
    if deadman_ms < 2000 * period_s:
        file.fault(
            (*bus.key, "deadman_ms"),
            f"{deadman_ms} ms is too short for process data every {1000 * period_s:g} ms",
            f"at least {2000 * period_s:g}: the dead-man burst must outlive one lost cycle",
        )


def _given(table: RawTable, name: str, default: int) -> int:
    value = table.whole(name)
    return default if value is None else value


def _check_node(bus: RawTable, node: RawTable, file: TomlFile) -> None:
    """Check a node, whose name is the first word of every point."""
    name, node_id = node.text("name"), node.whole("id")
    if name in _RESERVED_NODES:
        file.fault((*node.key, "name"), f"{name!r} is reserved", "choose another name")
    master = _given(bus, "master_node_id", _BUS.master_node_id)
    if node.content.get("enforce") is True and "own_timeout_ms" not in node.content:
        file.fault((*node.key, "enforce"), "has no effect without own_timeout_ms", "give the time, in ms")
    if node_id == master and _given(bus, "heartbeat_ms", _BUS.heartbeat_ms):
        file.fault((*node.key, "id"), f"node id {node_id} is the bridge's own", "change it or master_node_id")


def _check_drives(node: RawTable, units: _Unique, file: TomlFile) -> None:
    names, slots = _Unique(file), _Unique(file)
    units.add(node, "unit_id", "unit id")
    for drive in node.tables("drive"):
        slot_is_new = slots.add(drive, "slot", "slot")
        units.add(drive, "unit_id", "unit id")
        given = "name" if "name" in drive.content else "slot"
        if drive.text(given) == "node":
            file.fault((*drive.key, given), "'node' is reserved", "choose another name")
        if given == "name" or slot_is_new:
            names.add(drive, given, "drive name")
        _check_control(drive, file)
    if "outputs" in node.content:
        _check_control(node.table("outputs"), file)


def _check_control(drive: RawTable, file: TomlFile) -> None:
    control = drive.text("control")
    if control in (*_PROTOCOLS, "lease") and "fieldbus_timeout_ms" not in drive.content:
        file.fault(
            (*drive.key, "fieldbus_timeout_ms"),
            "is missing: a drive that can be commanded states how long its controller may be silent",
            "1…32767 ms, or 0 for no supervision, which is a decision",
        )
    if control in _PROTOCOLS and control not in file.data:
        file.fault(
            (*drive.key, "control"),
            f"the drive is controlled by {control}, which this site does not serve",
            f"add a [{control}] table",
        )
    if drive.content.get("life_sign") is True:
        _check_life_sign(drive, file)
    if control in _WITHOUT_CONNECTIONS and drive.content.get("stop_by_anyone") is False:
        _check_dead_owner(drive, file)


def _check_life_sign(drive: RawTable, file: TomlFile) -> None:
    """Check time-outs: a token that is read last thing is ``LIFE_SIGN_MS`` old when a program returns it."""
    if drive.text("control") not in (*_PROTOCOLS, "lease"):
        file.fault((*drive.key, "life_sign"), "has no effect: nobody controls the drive", "leave it out")
        return
    why_long = f"with life_sign, what a living program brings back is up to {LIFE_SIGN_MS} ms old"
    right = f"more than {LIFE_SIGN_MS} ms, by the time that a token needs to the program and back"
    given = drive.whole("fieldbus_timeout_ms")
    if given is not None and given <= LIFE_SIGN_MS:
        why = "too short" if given else "no supervision"
        file.fault((*drive.key, "fieldbus_timeout_ms"), f"{given} ms is {why}: {why_long}", right)
    span = drive.content.get("fieldbus_timeout_range_ms")
    low = next(iter(cast("list[object]", span)), None) if isinstance(span, list) else None
    if isinstance(low, int) and low <= LIFE_SIGN_MS:
        key = (*drive.key, "fieldbus_timeout_range_ms")
        file.fault(key, f"{low} ms is too short: {why_long}", f"[lowest, highest], lowest {right}")


def _check_dead_owner(drive: RawTable, file: TomlFile) -> None:
    """Check the time-out: without one only the end of its connection shows that an owner is dead."""
    content = drive.content
    given = content.get("fieldbus_timeout_range_ms")
    low = next(iter(cast("list[object]", given)), None) if isinstance(given, list) else None
    may_be_off = content.get("fieldbus_timeout_writable") is True and low == 0
    if content.get("fieldbus_timeout_ms") == 0 or may_be_off:
        way = "fieldbus_timeout_range_ms from 1 ms on" if may_be_off else "a fieldbus_timeout_ms from 1 ms on"
        file.fault(
            (*drive.key, "stop_by_anyone"),
            f"nobody would notice that an owner by {drive.text('control')} is dead: without a time-out it "
            "would block the drive for ever",
            f"{way}, or stop_by_anyone = true",
        )


def _check_users(file: TomlFile) -> None:
    users = _Unique(file)
    for user in file.root.table("opcua").tables("user"):
        users.add(user, "name", "user")


def _check_ports(file: TomlFile) -> None:
    ports = _Unique(file)
    for name in Site.model_fields:
        ports.add(file.root.table(name), "listen", "address")


def _check_page(file: TomlFile) -> None:
    """Check the page's encryption: passwords and commands go over it."""
    page = file.root.table("page")
    listen, content = page.text("listen"), page.content
    for one, other in (("certificate", "private_key"), ("private_key", "certificate")):
        if one in content and other not in content:
            file.fault(("page", one), f"goes together with {other}", f"add {other}, or leave both out")
    is_open = "certificate" not in content and content.get("no_security") is not True
    if listen is not None and is_open and not _LOOPBACK.match(listen):
        file.fault(
            ("page", "listen"),
            f"{listen} is not on loopback: passwords would go over it in clear text",
            "certificate and private_key; or no_security = true, which is a decision",
        )


def _check_zenoh(file: TomlFile) -> None:
    """Check who may connect: each of them may command, so connecting has to take a user or a certificate."""
    zenoh = file.root.table("zenoh")
    given = zenoh.content.get("listen")
    listen = cast("list[object]", given) if isinstance(given, list) else []
    if zenoh.text("mode") == "client" or "password_file" in zenoh.content:
        return
    open_to_all = [
        i
        for i, place in enumerate(listen)
        if isinstance(place, str) and "/" in place and not _MUTUAL_TLS.fullmatch(place)
    ]
    if "controllers" in zenoh.content and (open_to_all or not listen):
        file.fault(
            ("zenoh", "controllers"),
            "names users, but clients need not authenticate",
            "user and password_file, or listen on tls with enable_mtls=true",
        )
    for i in open_to_all:
        if not _LOCAL.fullmatch(cast("str", listen[i])) and zenoh.content.get("no_security") is not True:
            file.fault(
                ("zenoh", "listen", i),
                f"{listen[i]} is not on loopback: anybody who reaches it could command the drives",
                "user and password_file, or tls with enable_mtls=true; no_security = true is a decision",
            )
