"""One drive of the site: its channel, and where its points stand in the image."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

from bridge.command.channel import DriveChannel
from bridge.command.event import Event
from bridge.command.points import drive_points
from bridge.config import BusTable, DriveTable, NodeTable
from bridge.drive import LinearScale, signed
from bridge.image import Image, Point, Quality, Value
from bridge.mapping.model import Family, ScaledValue, Slot

REACTION_BOUND_MS: Final = 20
"""How late the bridge may be itself, beside one cycle of the RPDO (``docs/explanation``)."""

_GOOD: Final = (Quality.GOOD, "")
_IDENTITY: Final = ("vendor", "product", "revision", "serial", "device_name")
_SUPERVISION: Final = (
    "owner",
    "watchdog_state",
    "fieldbus_timeout_ms",
    "telegram_downtime_s",
    "last_fault",
    "current_fault",
    "trips",
    "worst_case_stop_ms",
    "sent_control_word",
    "restart_interlock",
    "refused_writes",
)
"""In the order in which ``_refresh_supervision`` shows them."""


@dataclass(frozen=True, slots=True)
class Identification:
    """What 1018h and 1008h of the node hold; a value the node does not give is 0 or empty."""

    vendor: int = 0
    product: int = 0
    revision: int = 0
    serial: int = 0
    device_name: str = ""


class _Scaled(NamedTuple):
    """One scaled value: the place of its word, value = word × full / at; unknown scales pass the word."""

    place: int
    full: float
    at: int
    unknown: str = ""


class Drive:
    """One drive: its channel, and where its points stand in the image.

    A PDO costs one comparison per value. All that is not process data is shown when the channel says
    that it has settled.
    """

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
        self.table = table
        self.given_parameters = table.parameters
        self._actual = [value for value in family.value if value.group == "actual"]
        self._commands = [value for value in family.value if value.group == "command"]
        for parameter, full in table.parameters.items():
            self._learn(parameter, full)
        self.points: list[Point] = drive_points(self.name, family, self.channel.scales)
        self.words: list[int] = [0] * len(family.process.tpdo)
        """The words of the last TPDO, the status word first."""
        self._quality = Quality.WAITING
        self._shown: tuple[Quality, str] | None = None
        """Quality and reason as the image has them for the process data."""
        self._scaled_actual: list[_Scaled] = []
        self._scaled_commands: list[_Scaled] = []
        self._compile()

    def bind(self, image: Image) -> None:
        """Find this drive's points in the image, and show in it from now on what happens to the drive."""
        self._image = image
        index = {point.name: image.index[point.name] for point in self.points}

        def places(group: str, leaves: Sequence[str]) -> list[int]:
            return [index[f"{self.name}/{group}/{leaf}"] for leaf in leaves]

        process = self.family.process
        self._status = places("status", ("status_word", "drive_status_word", "state", "emcy_code"))
        self._actual_words = places("actual", process.tpdo[1:])
        self._data_scaled = places("actual", [value.name for value in self._actual])
        self._data = self._status + self._actual_words
        self._values = self._actual_words + self._data_scaled
        self._command = places("command", process.rpdo)
        self._command_scaled = places("command", [value.name for value in self._commands])
        self._supervision = places("status", ("fault_text",)) + places("supervision", _SUPERVISION)
        self._ages = places("supervision", ("watchdog_left_ms", "pdo_age_ms"))
        self._identity = places("identity", _IDENTITY)
        self.channel.settled = self.refresh

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
        held, channel = self.words, self.channel
        has_new_status = words[0] != held[0]
        held[:] = words
        channel.on_pdo(now)
        channel.on_status_word(words[0], now)
        if has_new_status or not self._is_good(now):
            self._refresh_data(now)
        else:
            self._refresh_values(now)

    def on_unchanged_data(self, now: float) -> None:
        """A TPDO that says what the last one said."""
        self.channel.on_pdo(now)
        if self._quality is not Quality.GOOD:
            self._refresh_data(now)

    def on_scale(self, parameter: str, full: float) -> None:
        """The drive's own value of a scaling parameter; it wins over the site file."""
        self._learn(parameter, full)
        self._compile()
        self._shown = None

    def _learn(self, parameter: str, full: float) -> None:
        if full <= 0:
            return
        for value in self.family.value:
            if value.scale.full == parameter:
                scale = LinearScale(full, value.scale.at, value.scale.limit)
                self.channel.scales[value.leaf] = scale

    def _compile(self) -> None:
        process = self.family.process
        self._scaled_actual = [self._scaled(value, process.tpdo) for value in self._actual]
        self._scaled_commands = [self._scaled(value, process.rpdo[1:]) for value in self._commands]

    def _scaled(self, value: ScaledValue, words: list[str]) -> _Scaled:
        scale = self.channel.scales.get(value.leaf)
        place = words.index(value.word)
        if scale is None:
            unknown = f"{value.scale.full} cannot be read and is not in the site file"
            return _Scaled(place, 1.0, 1, unknown)
        return _Scaled(place, scale.full, scale.at)

    def on_identification(self, identification: Identification, now: float) -> None:
        self.identification = identification
        self._show(self._identity, [getattr(identification, leaf) for leaf in _IDENTITY], now)

    # into the image

    def refresh(self, now: float) -> None:
        """Bring every point of the drive up to date."""
        self._refresh_data(now)
        self._refresh_command(now)
        self._refresh_supervision(now)

    def _refresh_data(self, now: float) -> None:
        channel = self.channel
        if not self._is_good(now):
            quality = channel.link.quality(now)
            self._judge(quality, now)
            if not quality.has_value:
                return
        status = (
            channel.status_word,
            channel.drive_status_word,
            int(channel.served_state),
            channel.emcy_code,
        )
        self._image.set_values(self._status, status, now)
        self._refresh_values(now)

    def _is_good(self, now: float) -> bool:
        """The process data are good, and the image says so."""
        return self._shown is _GOOD and self.channel.link.quality(now) is Quality.GOOD

    def _refresh_values(self, now: float) -> None:
        """What a TPDO brings beside the status word, as it is and scaled."""
        words = self.words
        values: list[Value] = [*words[1:]]
        for place, full, at, _ in self._scaled_actual:
            word = words[place]
            values.append((word - 0x1_0000 if word & 0x8000 else word) * full / at)
        self._image.set_values(self._values, values, now)

    def _judge(self, quality: Quality, now: float) -> None:
        """Show another quality, or another reason for a bad one."""
        self._quality = quality
        reason = self.channel.link.reason(quality)
        if (quality, reason) == self._shown:
            return
        self._shown = _GOOD if quality is Quality.GOOD else (quality, reason)
        self._image.judge(self._data, quality, now, reason)
        for index, scaled in zip(self._data_scaled, self._scaled_actual, strict=True):
            if scaled.unknown and quality.has_value:
                self._image.judge((index,), Quality.CONFIG_ERROR, now, scaled.unknown)
            else:
                self._image.judge((index,), quality, now, reason)

    def _refresh_command(self, now: float) -> None:
        channel = self.channel
        setpoints = channel.setpoints
        self._show(self._command, (channel.control_word, *setpoints), now)
        for index, scaled in zip(self._command_scaled, self._scaled_commands, strict=True):
            quality = Quality.CONFIG_ERROR if scaled.unknown else Quality.GOOD
            value = signed(setpoints[scaled.place]) * scaled.full / scaled.at
            self._image.set(index, value, now, quality, scaled.unknown)

    def _refresh_supervision(self, now: float) -> None:
        channel = self.channel
        values: tuple[Value, ...] = (
            channel.fault_text,
            str(channel.owner or ""),
            int(channel.watchdog.state),
            channel.watchdog.timeout_ms,
            channel.settings.telegram_downtime_s,
            channel.last_fault,
            channel.current_fault,
            channel.trips,
            self.worst_case_stop_ms(),
            channel.output.words[0],
            channel.restart_interlock,
            channel.refused_writes,
        )
        self._show(self._supervision, values, now)

    def refresh_ages(self, now: float) -> None:
        """The points that change by themselves; called a few times a second."""
        channel = self.channel
        self._show(self._ages, (channel.watchdog.left_ms(now), channel.link.age_ms(now)), now)

    def _show(self, indices: Sequence[int], values: Sequence[Value], now: float) -> None:
        """Values that the bridge itself knows: their quality is always good."""
        for index, value in zip(indices, values, strict=True):
            self._image.set(index, value, now)
