"""Command channel of one drive: its leg, and the status that the drive reports."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from bridge.command.channel import Channel
from bridge.command.drive_link import DriveLink, NodeState
from bridge.command.effects import Effects
from bridge.command.leg import event
from bridge.command.leg.effect import Tripped
from bridge.command.leg.settings import leg_settings
from bridge.command.leg.state import AWAITS_REPORT
from bridge.command.leg.word_table import control_word
from bridge.command.messages.event import EventKind
from bridge.command.messages.telegram import TelegramDecoder
from bridge.command.setpoint_doubts import SetpointDoubts
from bridge.command.status import DriveStatus
from bridge.config import DriveTable
from bridge.drive import FAULTED, DriveState, EmergencyMeaning, Explained, Meanings
from bridge.image import Quality
from bridge.mapping.model import Family
from bridge.text import Said, Text, Words, render


class DriveChannel(Channel):
    """Command channel of one drive: its link is judged by TPDOs, its stops by the status word."""

    def __init__(
        self,
        name: str,
        family: Family,
        settings: DriveTable,
        hold_ms: int,
        effects: Effects,
        settled: Callable[[float], None],
    ) -> None:
        self.family = family
        self.settings = settings
        slot = family.slot_named(settings.slot)
        self.meanings = Meanings(family, slot, settings.parameters)
        """Meanings of the words in each parameter set: from the mapping and the site file, and as read from
        the drive."""
        self.unserved: dict[str, Text] = {}
        """Points that the node cannot serve, by their leaf, with the reason; known after boot-up."""
        self.doubts = SetpointDoubts()
        words = family.process.rpdo[1:]
        self._places = {word: place for place, word in enumerate(words)}
        self._status = DriveStatus(family)
        decode = TelegramDecoder(name, family, slot, self.meanings, self.unserved, self._status).decode
        link = DriveLink(settings.telegram_downtime_s, hold_ms)
        of_leg = leg_settings(family, settings, decode)
        super().__init__(name, of_leg, link, effects, settled)

    # what others may see

    @property
    def control_word(self) -> int:
        """Control word in force, as if it were the owner's (``bridge.command.leg.word_table``)."""
        return control_word(self.words, self.leg)

    @property
    def silence_stops(self) -> bool:
        """The drive is known to stop by itself without RPDOs, or nobody has asked it yet."""
        return self.leg.silence_stops

    @property
    def drive_status_word(self) -> int:
        """The status word as the drive sent it."""
        return self._status.word

    @property
    def status_word(self) -> int:
        """The status word as served: *fault* while tripped, as a bus interface would show it."""
        status = self._status
        return status.words.as_fault(status.word) if self.is_tripped else status.word

    @property
    def state(self) -> DriveState:
        """The state as the drive reports it."""
        return self.leg.drive

    @property
    def served_state(self) -> DriveState:
        return DriveState.FAULT if self.is_tripped else self.leg.drive

    @property
    def emcy_code(self) -> int:
        return self._status.emcy_code

    @property
    def last_fault(self) -> float:
        return self._status.last_fault

    @property
    def current_fault(self) -> float:
        """Present fault: the bridge's own such as 10.3, else the one that the drive tells; 0 where there is
        none."""
        return self._bridge_fault or self._status.drive_fault

    @property
    def _bridge_fault(self) -> float:
        return self.family.faults.controller_silent if self.is_tripped else self._status.link_fault

    @property
    def fault_said(self) -> Words:
        """The present fault with its number; empty where there is none."""
        return self._status.fault_said(self._bridge_fault, self.state)

    @property
    def fault_text(self) -> str:
        """The present fault in English."""
        return render(self.fault_said)

    @property
    def fault(self) -> Explained:
        """The present fault as its maker writes it, with cause and remedy."""
        return self._status.fault(self._bridge_fault, self.state)

    @property
    def last_fault_said(self) -> Words:
        """The last fault with its number; empty where there was none."""
        return self._status.last_fault_said

    # from the drive

    def on_own_watch(self, why_not: Said, now: float) -> None:
        """Take over whether the drive stops by itself without RPDOs: ``why_not`` is empty where it does."""
        stops = not why_not
        if stops is self.leg.silence_stops:
            return
        if why_not and self.settings.falls_silent:
            said = Text.of("watchdog.silence_replaced", why=why_not)
            self._tell(now, EventKind.WATCHDOG, 700, said)
        self._happen(event.StopsOnSilence(stops), now)

    def on_status_word(self, word: int, now: float) -> None:
        """Take over the status word of a TPDO."""
        status, leg, handshake = self._status, self.leg, self.leg_settings.handshake
        state = status.words.state(word)
        is_acknowledged = handshake is not None and bool(word & handshake.acknowledged)
        is_news = state is not leg.drive or (handshake is not None and word != status.word)
        status.word = word
        is_news = is_news or not leg.way.is_heard
        if is_news or leg.stage in AWAITS_REPORT or leg.trip.ramps_until is not None:
            said = status.fault_said(self._bridge_fault, state) if state in FAULTED else ""
            self._happen(event.StatusReport(state, is_acknowledged, said), now)

    def on_unchanged(self, now: float) -> None:
        """Take note of a TPDO with the same data as the last one."""
        self.on_pdo(now)
        if self.leg.stage in AWAITS_REPORT or not self.leg.way.is_heard:
            self.on_status_word(self._status.word, now)

    def on_actual_words(self, words: Sequence[int], now: float) -> None:
        """Take over the words of TPDOs, the status word first, in the order of ``process.tpdo``."""
        follows, rest = self.leg_settings.follows, self.leg.rest
        unknown = self.meanings.unknown_followed(words)
        words = [0 if place in unknown else word for place, word in enumerate(words)] if unknown else words
        if any(rest[place] != words[source] for place, source in follows):
            self._happen(event.ActualWords(tuple(words)), now)

    def on_pdo(self, now: float) -> None:
        """Take note of a TPDO; its content comes after this."""
        link = self.link
        if link.pdo_deadline_s is not None and link.brings_forward(now):
            self.plan_anew()
        if link.on_pdo(now):
            self._status.link_fault = 0.0
            self._happen(self._way(now), now)

    def on_emcy(self, told: EmergencyMeaning, now: float, *, is_its_own: bool = True) -> None:
        """Take over an emergency message about this drive, or else about one of those of its node."""
        self._status.on_emcy(told)
        if is_its_own:
            severity = 100 if told.is_gone else 700
            said = Text.of("node.emergency", number=told.code, text=told.said)
            self._tell(now, EventKind.EMERGENCY, severity, said)
        self._settled(now)

    def on_drive_fault(self, current: float | None, last: float | None, now: float) -> None:
        """Take over the drive's answers, its present and its last fault; None for what it did not tell."""
        if self._status.on_drive_fault(current, last):
            self._settled(now)

    def _node_has_changed(self, state: NodeState, now: float) -> None:
        if state in (NodeState.OPERATIONAL, NodeState.DISABLED):
            self._status.link_fault = 0.0
        if state is NodeState.LOST:
            self._link_is_lost(self.family.faults.node_missing, Text.of("watchdog.node_lost"), now)

    def _link_is_lost(self, fault: float, why: Text, now: float) -> None:
        self._status.link_fault = self._status.last_fault = fault
        said = Text.of("watchdog.link_fault", prefix=self.family.faults.prefix, fault=fault, why=why)
        self._tell(now, EventKind.WATCHDOG, 700, said)

    def _why_unplaced(self, now: float) -> Said:
        if not self._followed:
            return ""
        quality = self.link.quality(now)
        why = self.link.reason(quality)
        if quality is Quality.GOOD:
            why = self.link.why_lacking(self._followed, now)
        return Text.of("start.unplaced", why=why) if why else ""

    # its owner and its watchdogs

    def _on_heard(self, names: tuple[str, ...]) -> None:
        self.doubts.forget(names, [self._places[name] for name in names if name in self._places])

    def _is_silent(self, now: float) -> None:
        self._link_is_lost(self.family.faults.telegram_downtime, Text.of("watchdog.no_process_data"), now)

    def _on_tripped(self, tripped: Tripped, now: float) -> None:
        self._status.last_fault = self.family.faults.controller_silent
        super()._on_tripped(tripped, now)

    def _reaction(self) -> Text:
        is_replaced = self.settings.reaction.is_silent and not self.leg.silence_stops
        reaction = "disable_voltage" if is_replaced else self.settings.on_expiry
        fault = self._status.fault_said(self.family.faults.controller_silent, self.state)
        return Text.of("watchdog.reaction", reaction=Text.word("reaction", reaction), fault=fault)

    def _on_ignored(self, now: float) -> None:
        self._status.last_fault = self.family.faults.controller_silent
        self._tell(now, EventKind.WATCHDOG, 500, Text.of("watchdog.silence_ignored"))
