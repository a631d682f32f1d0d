"""Checks of the keys of a site file against each other.

Judged on the raw file, so that these faults are found beside those of single values.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Final, cast

from bridge.config.field_types import LIFE_SIGN_MS
from bridge.config.model import BusTable, OpcUaHistoryTable, Site, SiteTable
from bridge.text import Text
from bridge.tomlfile import Key, RawTable, TomlFile

_RESERVED_NODES: Final = ("bus", "bridge")
_LOOPBACK: Final = re.compile(r"127\.|localhost:|\[::1\]:")
_PROTOCOLS: Final = ("modbus", "opcua", "zenoh")
_LOCAL: Final = re.compile(r"(unixsock-stream|unixpipe)/.*|[a-z]+/(127\.[0-9.]+|localhost|\[::1\])(:.*)?")
_MUTUAL_TLS: Final = re.compile(r"(tls|quic)/.*[#;]enable_mtls=(true|1)\b.*")
_WITHOUT_CONNECTIONS: Final = ("opcua", "zenoh")
"""Protocols of which the command side does not know whether a client is still connected."""
_BUS: Final = BusTable.model_construct()
_HISTORY: Final = OpcUaHistoryTable.model_construct()
_SITE: Final = SiteTable.model_construct()
"""Tables with the defaults of the site file."""


def check(file: TomlFile) -> None:
    """Note every contradiction in ``file``."""
    names = _Unique(file, lambda name: Text.of("site.bus_name_twice", name=name))
    nodes = _Unique(file, lambda name: Text.of("site.node_name_twice", name=name))
    units = _Unique(file, lambda unit: Text.of("site.unit_id_twice", unit=unit))
    channels: dict[str, _Unique] = {}
    for bus in file.root.tables("bus"):
        names.add(bus, "name")
        _check_bus(bus, channels, file)
        ids = _Unique(file, lambda node_id: Text.of("site.node_id_twice", id=node_id))
        for node in bus.tables("node"):
            nodes.add(node, "name")
            ids.add(node, "id")
            _check_node(bus, node, file)
            _check_drives(node, units, file)
    _check_users(file)
    _check_ports(file)
    _check_page(file)
    _check_history(file)
    _check_zenoh(file)


@dataclass(slots=True)
class _Unique:
    """Values that may occur only once in the file; ``twice`` is what is said of one that comes again."""

    file: TomlFile
    twice: Callable[[str | int], Text]
    seen: dict[str | int, Key] = field(default_factory=dict[str | int, Key])

    def add(self, table: RawTable, name: str) -> bool:
        """Whether this value of ``name`` occurs for the first time."""
        value = table.text(name) if table.text(name) is not None else table.whole(name)
        if value is None:
            return True
        key = (*table.key, name)
        first = self.seen.setdefault(value, key)
        if first != key:
            self.file.fault(key, self.twice(value), Text.of("site.first_used", line=self.file.line(first)))
        return first == key


def _check_bus(bus: RawTable, channels: dict[str, _Unique], file: TomlFile) -> None:
    """Check a bus; ``channels`` has those used so far by their interface."""
    interface, channel = bus.text("interface"), bus.text("channel")
    if interface and interface != "virtual":
        if "channel" not in bus.content:
            said = Text.of("site.needs_channel", interface=interface)
            file.fault(bus.key, said, Text.of("site.needs_channel_advice"))
        elif channel:
            channels.setdefault(interface, _channels_of(interface, file)).add(bus, "channel")
    sync_ms = _given(bus, "sync_period_ms", _BUS.sync_period_ms)
    period_s = BusTable.model_construct(
        sync_period_ms=sync_ms, rpdo_period_ms=bus.whole("rpdo_period_ms")
    ).rpdo_period_s
    window_us = _given(bus, "sync_window_us", _BUS.sync_window_us)
    if window_us and window_us > 1000 * sync_ms:
        file.fault(
            (*bus.key, "sync_window_us"),
            Text.of("site.window_long", window_us=window_us),
            Text.of("site.window_long_advice", most_us=1000 * sync_ms, sync_ms=sync_ms),
        )
    deadman_ms = _given(bus, "deadman_ms", _BUS.deadman_ms)
    if deadman_ms < 2000 * period_s:
        file.fault(
            (*bus.key, "deadman_ms"),
            Text.of("site.deadman_short", deadman_ms=deadman_ms, period_ms=1000 * period_s),
            Text.of("site.deadman_short_advice", least_ms=2000 * period_s),
        )


def _channels_of(interface: str, file: TomlFile) -> _Unique:
    def twice(channel: str | int) -> Text:
        return Text.of("site.channel_twice", interface=interface, channel=channel)

    return _Unique(file, twice)


def _given(table: RawTable, name: str, default: int) -> int:
    value = table.whole(name)
    return default if value is None else value


def _check_node(bus: RawTable, node: RawTable, file: TomlFile) -> None:
    """Check a node, whose name is the first word of every point."""
    name, node_id = node.text("name"), node.whole("id")
    if name in _RESERVED_NODES:
        said = Text.of("site.reserved", name=name)
        file.fault((*node.key, "name"), said, Text.of("site.reserved_advice"))
    master = _given(bus, "master_node_id", _BUS.master_node_id)
    if node.content.get("enforce") is True and "own_timeout_ms" not in node.content:
        said = Text.of("site.enforce_alone")
        file.fault((*node.key, "enforce"), said, Text.of("site.enforce_alone_advice"))
    if node_id == master and _given(bus, "heartbeat_ms", _BUS.heartbeat_ms):
        said = Text.of("site.own_node_id", id=master)
        file.fault((*node.key, "id"), said, Text.of("site.own_node_id_advice"))


def _check_drives(node: RawTable, units: _Unique, file: TomlFile) -> None:
    names = _Unique(file, lambda name: Text.of("site.drive_name_twice", name=name))
    slots = _Unique(file, lambda slot: Text.of("site.slot_twice", slot=slot))
    units.add(node, "unit_id")
    for drive in node.tables("drive"):
        slot_is_new = slots.add(drive, "slot")
        units.add(drive, "unit_id")
        given = "name" if "name" in drive.content else "slot"
        if drive.text(given) == "node":
            said = Text.of("site.reserved", name="node")
            file.fault((*drive.key, given), said, Text.of("site.reserved_advice"))
        if given == "name" or slot_is_new:
            names.add(drive, given)
        _check_control(drive, file)
    if "outputs" in node.content:
        _check_control(node.table("outputs"), file)


def _check_control(drive: RawTable, file: TomlFile) -> None:
    control = drive.text("control")
    if control in (*_PROTOCOLS, "lease") and "fieldbus_timeout_ms" not in drive.content:
        file.fault(
            (*drive.key, "fieldbus_timeout_ms"),
            Text.of("site.timeout_missing"),
            Text.of("site.timeout_missing_advice"),
        )
    if control in _PROTOCOLS and control not in file.data:
        file.fault(
            (*drive.key, "control"),
            Text.of("site.not_served", protocol=control),
            Text.of("site.not_served_advice", table=control),
        )
    if drive.content.get("life_sign") is True:
        _check_life_sign(drive, file)
    if control in _WITHOUT_CONNECTIONS and drive.content.get("stop_by_anyone") is False:
        _check_dead_owner(drive, control, file)


def _check_life_sign(drive: RawTable, file: TomlFile) -> None:
    """Check time-outs: a token that is read last thing is ``LIFE_SIGN_MS`` old when a program returns it."""
    if drive.text("control") not in (*_PROTOCOLS, "lease"):
        said = Text.of("site.life_sign_vain")
        file.fault((*drive.key, "life_sign"), said, Text.of("site.life_sign_vain_advice"))
        return
    right = Text.of("site.life_sign_advice", old_ms=LIFE_SIGN_MS)
    given = drive.whole("fieldbus_timeout_ms")
    if given is not None and given <= LIFE_SIGN_MS:
        said = Text.of(
            "site.life_sign_short" if given else "site.life_sign_unsupervised",
            time_ms=given,
            old_ms=LIFE_SIGN_MS,
        )
        file.fault((*drive.key, "fieldbus_timeout_ms"), said, right)
    span = drive.content.get("fieldbus_timeout_range_ms")
    low = next(iter(cast("list[object]", span)), None) if isinstance(span, list) else None
    if isinstance(low, int) and low <= LIFE_SIGN_MS:
        said = Text.of("site.life_sign_short", time_ms=low, old_ms=LIFE_SIGN_MS)
        advice = Text.of("site.life_sign_range_advice", right=right)
        file.fault((*drive.key, "fieldbus_timeout_range_ms"), said, advice)


def _check_dead_owner(drive: RawTable, control: str, file: TomlFile) -> None:
    """Check the time-out: without one only the end of its connection shows that an owner is dead."""
    content = drive.content
    given = content.get("fieldbus_timeout_range_ms")
    low = next(iter(cast("list[object]", given)), None) if isinstance(given, list) else None
    may_be_off = content.get("fieldbus_timeout_writable") is True and low == 0
    if content.get("fieldbus_timeout_ms") == 0 or may_be_off:
        advice = Text.of("site.dead_owner_range_advice" if may_be_off else "site.dead_owner_advice")
        file.fault((*drive.key, "stop_by_anyone"), Text.of("site.dead_owner", protocol=control), advice)


def _check_users(file: TomlFile) -> None:
    users = _Unique(file, lambda name: Text.of("site.user_twice", name=name))
    for user in file.root.table("opcua").tables("user"):
        users.add(user, "name")


def _check_ports(file: TomlFile) -> None:
    ports = _Unique(file, lambda address: Text.of("site.address_twice", address=address))
    for name in Site.model_fields:
        ports.add(file.root.table(name), "listen")


def _check_history(file: TomlFile) -> None:
    """Check that the history leaves the server room: a front with too much memory is killed."""
    history = file.root.table("opcua").table("history")
    size_mb = _given(history, "size_mb", _HISTORY.size_mb)
    # While the events of the last run are read they are there twice.
    needed_mb = size_mb + 2 * _given(history, "events_mb", _HISTORY.events_mb)
    front_mb = _given(file.root.table("site"), "front_memory_mb", _SITE.front_memory_mb)
    if needed_mb > front_mb // 2:
        key = "size_mb" if "size_mb" in history.content else "events_mb"
        file.fault(
            (*history.key, key),
            Text.of("site.history_large", needed_mb=needed_mb, front_mb=front_mb),
            Text.of("site.history_large_advice", least_mb=2 * needed_mb),
        )


def _check_page(file: TomlFile) -> None:
    """Check the page's encryption: passwords and commands go over it."""
    page = file.root.table("page")
    listen, content = page.text("listen"), page.content
    for one, other in (("certificate", "private_key"), ("private_key", "certificate")):
        if one in content and other not in content:
            said = Text.of("site.goes_together", other=other)
            file.fault(("page", one), said, Text.of("site.goes_together_advice", other=other))
    is_open = "certificate" not in content and content.get("no_security") is not True
    if listen is not None and is_open and not _LOOPBACK.match(listen):
        file.fault(
            ("page", "listen"),
            Text.of("site.page_open", place=listen),
            Text.of("site.page_open_advice"),
        )


def _check_zenoh(file: TomlFile) -> None:
    """Check who may connect: each of them may command, so connecting has to take a user or a certificate."""
    zenoh = file.root.table("zenoh")
    given = zenoh.content.get("listen")
    listen = cast("list[object]", given) if isinstance(given, list) else []
    if zenoh.text("mode") == "client" or "password_file" in zenoh.content:
        return
    open_to_all = [
        (i, place)
        for i, place in enumerate(listen)
        if isinstance(place, str) and "/" in place and not _MUTUAL_TLS.fullmatch(place)
    ]
    if "controllers" in zenoh.content and (open_to_all or not listen):
        file.fault(
            ("zenoh", "controllers"),
            Text.of("site.controllers_unproven"),
            Text.of("site.controllers_unproven_advice"),
        )
    for i, place in open_to_all:
        if not _LOCAL.fullmatch(place) and zenoh.content.get("no_security") is not True:
            file.fault(
                ("zenoh", "listen", i),
                Text.of("site.zenoh_open", place=place),
                Text.of("site.zenoh_open_advice"),
            )
