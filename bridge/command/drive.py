"""One drive of the site: its channel and its points in the image."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

from bridge.catalogue import DriveSpec
from bridge.catalogue.points import LIFE_SIGN
from bridge.command.actual import ActualData
from bridge.command.commanded import WordTiming
from bridge.command.drive_channel import DriveChannel
from bridge.command.drive_link import FurtherTpdo, NodeState
from bridge.command.effects import Effects
from bridge.command.meaning_news import MeaningNews
from bridge.command.messages.request import Identity
from bridge.command.setpoint_doubts import InForce, in_force
from bridge.command.stop_check.drive_check import DriveStopCheck
from bridge.command.stop_check.ignored_texts import drive_says, ignored_by_drive
from bridge.command.stop_check.state import StopVerdict
from bridge.command.worst_case import StopTime, Wire, stop_time
from bridge.drive import MOVING, Codes, Lack, OwnJudgement, OwnVerdict, ParameterSet, ValueCodec, codecs
from bridge.drive.own_judgement import why_silence_does_not_stop
from bridge.image import Image, Quality, Value
from bridge.text import Said, Text

_IDENTITY: Final = ("vendor", "product", "revision", "serial", "device_name")
_FAULT: Final = ("fault_number", "fault_cause", "fault_remedy")
_SUPERVISION: Final = (
    "owner",
    "watchdog_state",
    "fieldbus_timeout_ms",
    "telegram_downtime_s",
    "last_fault",
    "current_fault",
    "trips",
    "sent_control_word",
    "restart_interlock",
    "refused_writes",
)
"""Leaves in the order in which ``_refresh_supervision`` shows them."""


@dataclass(frozen=True, slots=True)
class Identification:
    """Identity of the node by 1018h and 1008h; a value that it does not give is 0 or empty."""

    vendor: int = 0
    product: int = 0
    revision: int = 0
    serial: int = 0
    device_name: str = ""


class _Command(NamedTuple):
    """A scaled command in one parameter set, at ``point`` of the image; ``lack`` is None where it is served
    there."""

    point: int
    codec: ValueCodec
    lack: Lack | None


class Drive(WordTiming):
    """One drive: its channel and its points. All but process data is shown when the channel has settled."""

    def __init__(self, spec: DriveSpec, image: Image, effects: Effects) -> None:
        super().__init__(spec.bus)
        self.spec = spec
        self.name, self.node_name = spec.name, spec.node.name
        self.slot = spec.slot
        family, table = self.family, self.table = spec.family, spec.table
        self.channel = DriveChannel(
            self.name,
            family,
            table,
            spec.node.hold_ms,
            effects,
            self.refresh,
        )
        self.stop_check = DriveStopCheck(self.channel)
        self.identification = Identification()
        self.own: OwnJudgement | None = None
        """Its own reaction to a silent bridge; None until the boot-up has read it, empty when outdated."""
        self.sync_period_ms = spec.bus.sync_period_ms
        self.given_parameters = table.parameters
        self._shown_for: tuple[int, int, Wire, float | None] | None = None
        self._set = ParameterSet(family.control_word.parameter_set_bits)
        self.news = MeaningNews(self, effects.events)
        self._actual = ActualData(self.channel, self.slot, self.stop_check, image, self.news)
        # Forwarded unchanged from the node.
        self.on_process_data = self._actual.on_process_data
        self.on_unchanged_data = self._actual.on_unchanged_data
        self.on_further_data = self._actual.on_further_data
        self._image = image
        self._find_points()

    def _find_points(self) -> None:
        """Look up its points in the image."""
        family, words = self.family, self.family.process.rpdo[1:]

        def places(group: str, leaves: Sequence[str]) -> list[int]:
            return [self._place(f"{group}/{leaf}") for leaf in leaves]

        carried = [(word, f"command/{word}") for word in family.carried(self.slot)[0][1:]]
        self._setpoints = [(self._place(leaf), words.index(word), leaf) for word, leaf in carried]
        self._commands = codecs(family, self.slot, "command", words, self.table.parameters)
        self._commands_in: dict[int, list[_Command]] = {}
        (self._control_word,) = places("command", ("control_word",))
        self._faults = places("status", ("fault_text",)) + places("supervision", ("last_fault_text",))
        self._supervision = places("status", _FAULT) + places("supervision", _SUPERVISION)
        self._ages = places("supervision", ("watchdog_left_ms", "pdo_age_ms", "telegrams"))
        self._life = places("supervision", (LIFE_SIGN,)) if self.table.life_sign else []
        self._brought = places("command", (LIFE_SIGN,)) if self.table.life_sign else []
        (self._abort_code,) = places("supervision", ("sdo_abort_code",))
        self._follows = places("supervision", ("follows", "last_stop"))
        self._stop_ms, self._bridge_ms = places("supervision", ("worst_case_stop_ms", "worst_case_bridge_ms"))
        self._identity = places("identity", _IDENTITY)

    def _place(self, leaf: str) -> int:
        return self._image.index[f"{self.name}/{leaf}"]

    @property
    def quality(self) -> Quality:
        return self._actual.quality

    @property
    def words(self) -> list[int]:
        """The words of the last TPDOs, the status word first, in the order of ``process.tpdo``."""
        return self._actual.words

    def stop_time(self) -> StopTime:
        """Longest time from the controller's last telegram to the stop on the bus."""
        timeout_ms = self.channel.timeout_ms
        return stop_time(self.table, self.bus, timeout_ms, self.rpdo_type, self.wire, self._own_ms)

    @property
    def _own_ms(self) -> float | None:
        """Its own time-out without RPDOs, 0 where it has none, None where nobody has asked it yet."""
        if self.own is None:
            return None
        return self.own.process_data_ms if self.channel.silence_stops else 0.0

    # fed by its node

    def on_pdos(
        self,
        unserved: Mapping[str, Text],
        further: Sequence[FurtherTpdo],
        now: float,
        *,
        deadline_s: float | None,
        rpdo_type: int,
    ) -> None:
        """Take over the findings of the boot-up: ``unserved`` has the reason for each word or value that the
        node does not carry, by its leaf such as ``actual/value_2``. ``further`` are the TPDOs beside the one
        with the status word, which is late after ``deadline_s``; ``rpdo_type`` is the transmission type of
        the control word's RPDO."""
        self.channel.link.on_boot(deadline_s, further)
        self.rpdo_type = rpdo_type
        self.channel.unserved.clear()
        self.channel.unserved.update(unserved)
        self.compile()
        self.refresh(now)

    def on_heard_again(self) -> None:
        """Go on after a pause in which its node was not heard; the state that follows shows it."""
        self._actual.on_heard_again()

    def on_parameter(self, name: str, setting: float, now: float) -> None:
        """Take over its own setting, in set 1, of a parameter that decides the meaning of its words."""
        self.news.on_parameter(name, setting, now)

    @property
    def told_by_tpdo(self) -> frozenset[str]:
        """Leaves of the words whose meaning its TPDOs tell, so that it need not be asked."""
        return self._actual.told_by_tpdo

    def in_force(self) -> dict[str, InForce]:
        """Scaled commands that are served under the control word in force, by their names."""
        setpoints = self.channel.setpoints
        commands = self._commands_of(self._set.of(self.channel.control_word))
        return {
            one.codec.model.name: in_force(one.codec, setpoints)
            for one in commands
            if one.codec.places and not one.lack
        }

    def on_codes(self, codes: Codes, why_unread: Text | None = None) -> bool:
        """Take over the codes of what its words carry. Returns True where a setpoint written before means
        something else now: it must not be sent to a drive that is enabled next."""
        meanings = self.channel.meanings
        means_otherwise = meanings.on_codes(codes, why_unread) if why_unread else meanings.on_codes(codes)
        self.compile()
        return means_otherwise

    def compile(self) -> None:
        """Take over the meanings of its words that have been read."""
        self._commands_in.clear()
        self._actual.compile()

    def _commands_of(self, in_set: int) -> list[_Command]:
        """Scaled commands in this parameter set, compiled when it is used for the first time."""
        found = self._commands_in.get(in_set)
        if found is None:
            found = self._commands_in[in_set] = self._compiled_commands(in_set)
        return found

    def _compiled_commands(self, in_set: int) -> list[_Command]:
        meanings, words = self.channel.meanings, self.family.process.rpdo[1:]

        def compiled(codec: ValueCodec) -> _Command:
            found, lack = meanings.codec(codec, in_set)
            carried = [codec.model.leaf, *(f"command/{words[place]}" for place in found.places)]
            why = next((why for leaf in carried if (why := self.channel.unserved.get(leaf))), None)
            lack = Lack(Quality.CONFIG_ERROR, why) if why else lack
            return _Command(self._place(codec.model.leaf), found, lack)

        return [compiled(codec) for codec in self._commands]

    def on_own_supervision(self, own: OwnJudgement, now: float) -> None:
        """Take over its own reaction to a silent bridge, as the boot-up has read it."""
        self.own = own
        self.channel.on_own_watch(why_silence_does_not_stop(self.family, own, self.spec.node), now)
        self._refresh_supervision(now)
        if own.verdict is OwnVerdict.STOPS or own.accepted:
            accepted = Text.plain(own.accepted) if own.accepted else ""
            self._image.set(self._bridge_ms, own.bridge_ms, now, Quality.GOOD, accepted)
            return
        runs_on = own.verdict is OwnVerdict.RUNS_ON
        why = Text.of("own.drive_runs_on" if runs_on else "own.drive_not_known", why=own.because)
        self._image.set(self._bridge_ms, 0, now, Quality.CONFIG_ERROR, why)

    def on_own_supervision_changed(self, why: Text, now: float) -> None:
        """Forget its own reaction to a silent bridge: an object that decides it was written."""
        self.own = OwnJudgement()
        self.channel.on_own_watch(why, now)
        self._image.set(self._bridge_ms, 0, now, Quality.CONFIG_ERROR, why)

    def on_wire(self, wire: Wire, now: float) -> None:
        """Take over the predicted delays of its bus."""
        self.wire = wire
        self._show_stop_time(now)

    def on_identification(self, identification: Identification, now: float) -> None:
        self.identification = identification
        self._show(self._identity, [getattr(identification, leaf) for leaf in _IDENTITY], now)

    # a member of its node

    @property
    def commanded(self) -> Sequence[Drive]:
        return (self,)

    @property
    def refused_writes(self) -> int:
        return self.channel.refused_writes

    def begin(self, now: float) -> None:
        """Show what is known from the start."""
        self._image.set(self._abort_code, 0, now)

    def on_node(self, state: NodeState, now: float) -> None:
        self.channel.on_node(state, now)

    @property
    def is_enabled(self) -> bool:
        """It is in motion, or the word that it gets enables it."""
        channel = self.channel
        return channel.state in MOVING or channel.words.enables(channel.output.words[0])

    def refusal(self, identity: Identity) -> Text | None:
        """Reason why ``identity`` may not command it; None where it may."""
        return self.channel.refusal(identity)

    def on_refused(self, now: float) -> None:
        """Count a request about it that was refused elsewhere as one refused here."""
        self.channel.on_refused(now)

    def on_sdo_refused(self, abort_code: int, now: float) -> None:
        """Show the abort code of an SDO that a client had asked for."""
        self._image.set(self._abort_code, abort_code, now)

    # time

    def on_time(self, now: float) -> Sequence[StopVerdict]:
        """Do all that is due by ``now``, with the bus drained. Returns verdicts on stops that have ended."""
        self.channel.on_time(now)
        verdicts = self.stop_check.on_time(now)
        if verdicts:
            self._refresh_follows(now)
        return verdicts

    def next_deadline(self, now: float) -> float | None:
        """Time of the next ``on_time``: ``now`` where something is due already, None for never."""
        at, of_stop = self.channel.next_deadline(now), self.stop_check.next_deadline()
        if of_stop is None:
            return at
        return max(now, of_stop if at is None else min(at, of_stop))

    def on_handed_over(self, now: float) -> None:
        """Begin the bound of its stop: the output of the channel has been handed to the bus."""
        self.stop_check.on_handed_over(now, self.rpdo_period_ms, self.own)

    def on_cut_off(self, now: float) -> None:
        """Judge its stop by the last report: the bridge cuts off its node, with stopped words before that."""
        self.stop_check.on_cut_off(now, self.rpdo_period_ms, self.own)

    # its stops

    @property
    def is_heard(self) -> bool:
        return self.quality is Quality.GOOD

    @property
    def unproven(self) -> Said | None:
        """None: a drive that is heard says whether it follows."""
        return None

    @property
    def says(self) -> Text:
        return drive_says(self.channel)

    def why_ignored(self, verdict: StopVerdict, took_s: float) -> Text:
        return ignored_by_drive(self.channel, self.node_name, verdict, took_s)

    # into the image

    def refresh(self, now: float) -> None:
        """Bring all points up to date, after something about the drive has changed."""
        self.channel.plan_anew()
        self.stop_check.on_settled()
        self._actual.refresh(now)
        self._refresh_command(now)
        self._refresh_supervision(now)
        self._refresh_follows(now)

    def _refresh_follows(self, now: float) -> None:
        """Show ``follows``, as good as the drive's data, and ``last_stop``, which the bridge itself knows."""
        quality = self.channel.link.quality(now)
        reason = self.channel.link.reason(quality)
        follows, last_stop = self._follows
        self._image.set(follows, self.stop_check.follows, now, quality, reason)
        self._image.set(last_stop, int(self.stop_check.last_stop), now)

    def _refresh_command(self, now: float) -> None:
        channel, image = self.channel, self._image
        setpoints, unserved = channel.setpoints, channel.unserved
        image.set(self._control_word, channel.control_word, now)
        for index, place, leaf in self._setpoints:
            why = unserved.get(leaf)
            quality = Quality.CONFIG_ERROR if why else Quality.GOOD
            image.set(index, setpoints[place], now, quality, why or "")
        in_set = self._set.of(channel.control_word)
        for point, codec, lack in self._commands_of(in_set):
            value = codec.from_words(setpoints)
            why = channel.doubts.why(codec.model.name, setpoints)
            why = why or channel.meanings.doubt(codec.model, in_set)
            quality, why = lack or (Quality.STALE if why else Quality.GOOD, why)
            image.set(point, value, now, quality, why)
        if self._brought:
            image.set(self._brought[0], channel.life_sign(now), now)

    def _refresh_supervision(self, now: float) -> None:
        channel = self.channel
        fault = channel.fault
        values: tuple[Value, ...] = (
            fault.number,
            fault.cause,
            fault.remedy,
            str(channel.owner or ""),
            int(channel.watchdog_state),
            channel.timeout_ms,
            channel.settings.telegram_downtime_s,
            channel.last_fault,
            channel.current_fault,
            channel.trips,
            channel.output.words[0],
            channel.restart_interlock,
            channel.refused_writes,
        )
        self._show(self._supervision, values, now)
        for index, said in zip(self._faults, (channel.fault_said, channel.last_fault_said), strict=True):
            if said:
                self._image.say(index, said, now)
            else:
                self._image.set(index, "", now)
        self._show_stop_time(now)

    def _show_stop_time(self, now: float) -> None:
        settings = self.channel.timeout_ms, self.rpdo_type, self.wire, self._own_ms
        if settings == self._shown_for:
            return
        self._shown_for = settings
        stop = self.stop_time()
        quality = Quality.CONFIG_ERROR if stop.unknown else Quality.GOOD
        self._image.set(self._stop_ms, stop.ms, now, quality, stop.unknown)

    def look(self, now: float) -> None:
        """Bring ages and qualities to ``now``: a few times a second, and whenever somebody wants to know."""
        self._actual.look(now)
        self._refresh_follows(now)
        channel = self.channel
        left, age, telegrams = self._ages
        self._image.keep(left, channel.left_ms(now), now)
        self._image.keep(age, channel.link.age_ms(now), now)
        self._image.keep(telegrams, channel.telegrams, now)
        life = channel.leg_settings.life
        if life is not None:
            self._image.keep(self._life[0], life.token(now), now)

    def _show(self, indices: Sequence[int], values: Sequence[Value], now: float) -> None:
        """Show values that the bridge itself knows: their quality is always good."""
        for index, value in zip(indices, values, strict=True):
            self._image.set(index, value, now)
