"""The plant: every drive of the site with its channel and its points, and the image they share.

Northbounds read the image and submit requests; southbounds feed it. Neither knows the other.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from bridge.command.channel import DriveChannel
from bridge.command.event import Event, Kind
from bridge.command.link import NodeState
from bridge.command.points import bridge_points, bus_points, drive_points, node_points
from bridge.command.request import NODE_ACTIONS, Code, Outcome, Reply, Request
from bridge.config import BusTable, DriveTable, NodeTable, Site
from bridge.drive import LinearScale, signed
from bridge.errors import Fault, FileFaults
from bridge.image import Image, Point, Quality, Value
from bridge.mapping.model import Family, Slot

REACTION_BOUND_MS = 20
"""How late the bridge may be itself, beside one cycle of the RPDO (``docs/explanation``)."""


@dataclass(frozen=True, slots=True)
class Identification:
    """What 1018h and 1008h of the node hold; a value the node does not give is 0 or empty."""

    vendor: int = 0
    product: int = 0
    revision: int = 0
    serial: int = 0
    device_name: str = ""


class Drive:
    """One drive: its channel, and where its points stand in the image."""

    def __init__(
        self,
        node: NodeTable,
        bus: BusTable,
        table: DriveTable,
        family: Family,
        unit_id: int,
        report: Callable[[Event], None],
    ) -> None:
        leaf = table.name or (table.slot if len(family.slot) > 1 else "drive")
        self.name = f"{node.name}/{leaf}"
        self.node_name = node.name
        self.unit_id = unit_id
        self.family = family
        self.slot: Slot = family.slot_named(table.slot)
        self.channel = DriveChannel(self.name, family, table, node.hold_ms, report)
        self.identification = Identification()
        self.sdo_abort_code = 0
        self.rpdo_period_ms = round(bus.rpdo_period_s * 1000)
        self.given_parameters = table.parameters
        for value in family.value:
            full = table.parameters.get(value.scale.full)
            if full:
                self.channel.scales[value.scale.full] = LinearScale(full, value.scale.at, value.scale.limit)
        self.points: list[Point] = drive_points(self.name, family, self.channel.scales)
        self.words: list[int] = [0] * len(family.process.tpdo)
        """The words of the last TPDO, the status word first."""
        self._index: dict[str, int] = {}
        self._actual_indices: list[int] = []
        self._quality = Quality.WAITING

    def bind(self, image: Image) -> None:
        """Find this drive's points in the image."""
        self._image = image
        top = len(self.name) + 1
        self._index = {point.name[top:]: image.index[point.name] for point in self.points}
        self._actual_indices = [
            index
            for leaf, index in self._index.items()
            if leaf.startswith(("actual/", "status/")) and leaf != "status/fault_text"
        ]

    @property
    def quality(self) -> Quality:
        return self._quality

    def worst_case_stop_ms(self) -> int:
        """Longest time from the controller's last telegram to the reaction on the bus; 0 where none."""
        settings = self.channel.settings
        timeout_ms = self.channel.watchdog.timeout_ms
        if not timeout_ms or self.channel.link.ignores_errors or settings.on_expiry == "hold":
            return 0
        return timeout_ms + self.rpdo_period_ms + REACTION_BOUND_MS

    # fed by the southbound side

    def on_process_data(self, words: Sequence[int], now: float) -> None:
        """A TPDO with changed words; ``words`` are raw, in the order of ``process.tpdo``."""
        self.words[:] = words
        self.channel.on_pdo(now)
        self.channel.on_status_word(words[0], now)
        self.refresh(now)

    def on_unchanged_data(self, now: float) -> None:
        """A TPDO that says what the last one said."""
        self.channel.on_pdo(now)
        if self._quality is not Quality.GOOD:
            self.refresh(now)

    def on_scale(self, parameter: str, full: float) -> None:
        """The drive's own value of a scaling parameter; it wins over the site file."""
        for value in self.family.value:
            if value.scale.full == parameter:
                self.channel.scales[parameter] = LinearScale(full, value.scale.at, value.scale.limit)

    def on_identification(self, identification: Identification, now: float) -> None:
        self.identification = identification
        for leaf in ("vendor", "product", "revision", "serial", "device_name"):
            self._set(f"identity/{leaf}", getattr(identification, leaf), now)

    # into the image

    def refresh(self, now: float) -> None:
        """Bring every point of the drive up to date."""
        self._refresh_data(now)
        self._refresh_command(now)
        self._refresh_supervision(now)

    def _refresh_data(self, now: float) -> None:
        channel = self.channel
        quality = channel.link.quality(now)
        if not quality.has_value:
            if quality is not self._quality:
                self._image.judge(self._actual_indices, quality, now, channel.link.node.value)
            self._quality = quality
            return
        self._quality = quality
        reason = "" if quality is Quality.GOOD else channel.link.node.value
        self._set("status/status_word", channel.status_word, now, quality, reason)
        self._set("status/drive_status_word", channel.drive_status_word, now, quality, reason)
        self._set("status/state", int(channel.served_state), now, quality, reason)
        self._set("status/emcy_code", channel.emcy_code, now)
        for leaf, word in zip(self.family.process.tpdo[1:], self.words[1:], strict=True):
            self._set(f"actual/{leaf}", word, now, quality, reason)
        for value in self.family.value:
            if value.group == "actual":
                word = self.words[self.family.process.tpdo.index(value.word)]
                self._set_scaled(f"actual/{value.name}", value.scale.full, word, now, quality, reason)

    def _refresh_command(self, now: float) -> None:
        channel = self.channel
        self._set("command/control_word", channel.control_word, now)
        names = self.family.process.rpdo[1:]
        for leaf, word in zip(names, channel.setpoints, strict=True):
            self._set(f"command/{leaf}", word, now)
        for value in self.family.value:
            if value.group == "command":
                word = channel.setpoints[names.index(value.word)]
                self._set_scaled(f"command/{value.name}", value.scale.full, word, now, Quality.GOOD, "")

    def _set_scaled(self, leaf: str, full: str, word: int, now: float, quality: Quality, reason: str) -> None:
        scale = self.channel.scales.get(full)
        if scale:
            self._set(leaf, scale.from_word(word), now, quality, reason)
        else:
            reason = f"{full} cannot be read and is not in the site file"
            self._set(leaf, float(signed(word)), now, Quality.CONFIG_ERROR, reason)

    def _refresh_supervision(self, now: float) -> None:
        channel = self.channel
        self._set("status/fault_text", channel.fault_text, now)
        self._set("supervision/owner", str(channel.owner or ""), now)
        self._set("supervision/watchdog_state", int(channel.watchdog.state), now)
        self._set("supervision/fieldbus_timeout_ms", channel.watchdog.timeout_ms, now)
        self._set("supervision/telegram_downtime_s", channel.settings.telegram_downtime_s, now)
        self._set("supervision/last_fault", channel.last_fault, now)
        self._set("supervision/current_fault", channel.current_fault, now)
        self._set("supervision/trips", channel.trips, now)
        self._set("supervision/worst_case_stop_ms", self.worst_case_stop_ms(), now)
        self._set("supervision/sent_control_word", channel.output.words[0], now)
        self._set("supervision/restart_interlock", channel.restart_interlock, now)
        self._set("supervision/refused_writes", channel.refused_writes, now)

    def refresh_ages(self, now: float) -> None:
        """The points that change by themselves; called a few times a second."""
        self._set("supervision/watchdog_left_ms", self.channel.watchdog.left_ms(now), now)
        self._set("supervision/pdo_age_ms", self.channel.link.age_ms(now), now)

    def _set(
        self, leaf: str, value: Value, now: float, quality: Quality = Quality.GOOD, reason: str = ""
    ) -> None:
        self._image.set(self._index[leaf], value, now, quality, reason)


NodeCommand = Callable[[Request, float, Reply], None]


@dataclass(slots=True)
class Node:
    """A configured node: its drives, and who carries out commands on it."""

    bus: BusTable
    table: NodeTable
    family: Family
    drives: list[Drive] = field(default_factory=list[Drive])
    command: NodeCommand | None = None

    @property
    def name(self) -> str:
        return self.table.name


class Plant:
    """All drives of a site.

    ``outputs_changed`` is called when a channel's output may have changed and should go to the bus at
    once; ``on_event`` callbacks get every event.
    """

    def __init__(self, site: Site, families: dict[str, Family], version: str) -> None:
        self.site = site
        self.nodes: dict[str, Node] = {}
        self.drives: dict[str, Drive] = {}
        self.by_unit: dict[int, Drive] = {}
        self.outputs_changed: Callable[[], None] = lambda: None
        self._listeners: list[Callable[[Event], None]] = []
        points = bridge_points()
        units = _unit_ids(site)
        for bus in site.bus:
            points += bus_points(bus)
            for table in bus.node:
                family = families[table.mapping]
                node = self.nodes[table.name] = Node(bus, table, family)
                points += node_points(table, family.poll)
                for position, drive_table in enumerate(table.drive):
                    unit_id = units[table.name, position]
                    drive = Drive(table, bus, drive_table, family, unit_id, self.report)
                    node.drives.append(drive)
                    self.drives[drive.name] = drive
                    self.by_unit[unit_id] = drive
                    points += drive.points
        self.image = Image(points)
        for drive in self.drives.values():
            drive.bind(self.image)
            drive.refresh(0.0)
        self.set("bridge/version", version, 0.0)
        self.set("bridge/drives_configured", len(self.drives), 0.0)

    def on_event(self, listener: Callable[[Event], None]) -> None:
        self._listeners.append(listener)

    def report(self, event: Event) -> None:
        for listener in self._listeners:
            listener(event)

    def set(
        self, name: str, value: Value, now: float, quality: Quality = Quality.GOOD, reason: str = ""
    ) -> None:
        """Set a point by its full name."""
        self.image.set(self.image.index[name], value, now, quality, reason)

    def submit(self, request: Request, now: float, reply: Reply) -> None:
        """Carry out ``request``; ``reply`` is called exactly once, now or later."""
        if request.action in NODE_ACTIONS:
            node = self.nodes.get(request.target)
            if node is None or node.command is None:
                reply(Outcome(Code.UNKNOWN_TARGET, f"there is no node {request.target!r}"))
            else:
                node.command(request, now, reply)
            return
        drive = self.drives.get(request.target)
        if drive is None:
            reply(Outcome(Code.UNKNOWN_TARGET, f"there is no drive {request.target!r}"))
            return
        before = drive.channel.output
        drive.channel.handle(request, now, reply)
        drive.refresh(now)
        if drive.channel.output != before:
            self.outputs_changed()

    def on_time(self, now: float) -> None:
        """Let the timers of every channel run and bring the image up to date."""
        for drive in self.drives.values():
            deadline = drive.channel.next_deadline(now)
            if deadline is None or deadline > now:
                continue
            drive.channel.on_time(now)
            drive.refresh(now)

    def refresh(self, now: float) -> None:
        """The slow part: ages, counters and the faults of the nodes; a few times a second."""
        for drive in self.drives.values():
            drive.refresh(now)
            drive.refresh_ages(now)
        for node in self.nodes.values():
            self._refresh_node_fault(node, now)
        good = sum(drive.quality is Quality.GOOD for drive in self.drives.values())
        self.set("bridge/drives_good", good, now)
        refused = sum(drive.channel.refused_writes for drive in self.drives.values())
        self.set("bridge/refused_writes", refused, now)

    def _refresh_node_fault(self, node: Node, now: float) -> None:
        """102.0 while a controller is silent; it clears by itself and is then the last fault, as P170."""
        silent = any(
            drive.channel.is_tripped and drive.channel.watchdog.controller_is_silent for drive in node.drives
        )
        fault = node.family.faults.bridge_timeout if silent else 0.0
        before = self.image.read(f"{node.name}/node/current_fault").value
        if before and not fault:
            self.set(f"{node.name}/node/last_fault", before, now)
        self.set(f"{node.name}/node/current_fault", fault, now)
        if self.image.read(f"{node.name}/node/last_fault").quality is Quality.WAITING:
            self.set(f"{node.name}/node/last_fault", 0.0, now)

    def next_deadline(self, now: float) -> float | None:
        times = [drive.channel.next_deadline(now) for drive in self.drives.values()]
        known = [time for time in times if time is not None]
        return min(known) if known else None

    def on_node(self, node: Node, state: NodeState, now: float) -> None:
        """The southbound side says that a node is in another state."""
        for drive in node.drives:
            drive.channel.on_node(state, now)
            drive.refresh(now)
        if state is NodeState.LOST:
            self.report(Event(now, Kind.NODE_LOST, node.name, 800, "node lost"))
        elif state is NodeState.OPERATIONAL:
            self.report(Event(now, Kind.NODE_BACK, node.name, 200, "node operational"))


def check_against_mappings(site: Site, families: dict[str, Family], path: str) -> list[Fault]:
    """What the site file asks of a mapping that the mapping does not have."""
    faults: list[Fault] = []
    for b, bus in enumerate(site.bus):
        for n, node in enumerate(bus.node):
            family = families.get(node.mapping)
            if family is None:
                continue
            key = f"bus[{b}].node[{n}]"
            low, high = family.family.node_id_low, family.family.node_id_high
            if not low <= node.id <= high:
                message = f"{family.family.name} has addresses {low}…{high}, not {node.id}"
                faults.append(Fault(path, 0, f"{key}.id", message))
            slots = [slot.name for slot in family.slot]
            for d, drive in enumerate(node.drive):
                if drive.slot not in slots:
                    message = f"{family.family.name} has no slot {drive.slot!r}"
                    hint = f"it has {', '.join(slots)}"
                    faults.append(Fault(path, 0, f"{key}.drive[{d}].slot", message, hint))
                known = [parameter.name for parameter in family.parameter]
                for name in drive.parameters:
                    if name not in known:
                        hint = f"known: {', '.join(known)}"
                        message = f"{family.family.name} does not scale with {name!r}"
                        faults.append(Fault(path, 0, f"{key}.drive[{d}].parameters.{name}", message, hint))
    return faults


def _unit_ids(site: Site) -> dict[tuple[str, int], int]:
    """Modbus unit ids: as given, the others in order from 1."""
    given = {d.unit_id for bus in site.bus for node in bus.node for d in node.drive if d.unit_id}
    free = (unit for unit in range(1, 248) if unit not in given)
    units: dict[tuple[str, int], int] = {}
    for bus in site.bus:
        for node in bus.node:
            for position, drive in enumerate(node.drive):
                unit = drive.unit_id or next(free, 0)
                if not unit:
                    raise FileFaults([Fault("", 0, "unit_id", "more than 247 drives have no Modbus unit id")])
                units[node.name, position] = unit
    return units
