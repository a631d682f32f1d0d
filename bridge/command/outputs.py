"""Outputs of a node without drives: commanded by one owner, and safe when nobody does.

They are commanded by the same leg as drives. Its control word has one bit: the telegram of an owner that
leaves every output safe stops, any other is active. So the rules of a drive hold word by word: who owns them,
how long an owner may be silent, and that after a trip or a pause of the node nothing is active until the
owner has acknowledged or has sent the safe values once; after a stop by a command, until it has sent them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Final, NamedTuple

from bridge.catalogue import DeviceSpec
from bridge.command.channel import Channel
from bridge.command.commanded import WordTiming
from bridge.command.drive_link import DriveLink, NodeState
from bridge.command.effects import Effects
from bridge.command.leg.settings import LegSettings
from bridge.command.leg.state import RpdoWords
from bridge.command.messages.event import EventKind
from bridge.command.messages.request import Action, Code, Outcome, Reply, Request, refused
from bridge.command.output_words import ACTIVE, OutputWords
from bridge.command.stop_check.ignored_texts import ignored_by_outputs
from bridge.command.stop_check.output_check import OutputReadback, OutputStopCheck, Question, StoppedOutput
from bridge.command.stop_check.state import StopVerdict
from bridge.command.worst_case import StopTime, Wire, output_stop_time
from bridge.config import REACTIONS, OutputsTable
from bridge.drive import ControlWords, OwnJudgement
from bridge.image import Image, Quality, Value
from bridge.mapping.entry_types import ObjectRef
from bridge.mapping.model import ControlWord
from bridge.text import Said, Text

_SAFE: Final = {"mask": ACTIVE, "value": 0}
_CONTROL_WORD: Final = ControlWord.model_validate(
    {
        "bits": ["active", "acknowledge"],
        "enabling": {"mask": ACTIVE, "value": ACTIVE},
        "stop": _SAFE,
        "quick_stop": _SAFE,
        "disable_voltage": _SAFE,
        "acknowledge_bit": 1,
        "stopped": 0,
        "ready": 0,
        "run": ACTIVE,
    }
)
_SUPERVISION: Final = (
    "owner",
    "watchdog_state",
    "fieldbus_timeout_ms",
    "trips",
    "restart_interlock",
    "refused_writes",
)
_TAKEN_S: Final = 0.25
"""Longest time in seconds from an RPDO to the node's objects, as in ``stopping`` to a drive's status word."""
_DEADLINES: Final = 3


class Telling(NamedTuple):
    """The TPDO that brings an output; ``deadline_s`` is the longest regular pause between two of them, None
    if it is sent on change only."""

    tpdo: str
    deadline_s: float | None


class OutputChannel(Channel):
    """Command channel of the outputs of one node. Words are those of the leg, the control word first."""

    def __init__(
        self,
        name: str,
        words: OutputWords,
        settings: OutputsTable,
        hold_ms: int,
        effects: Effects,
        settled: Callable[[float], None],
    ) -> None:
        self.output_words = words
        of_leg = LegSettings(
            words=ControlWords(_CONTROL_WORD),
            decode=lambda values, before, held, is_heard: words.decode(values, before, held),
            setpoints=words.count,
            control=settings.control,
            reaction=REACTIONS["disable_voltage"],
            timeout_ms=settings.fieldbus_timeout_ms or 0,
            then_silence_s=0.0,
            ignores_errors=False,
            stop_by_anyone=settings.stop_by_anyone,
            timeout_writable=False,
            timeout_range_ms=(0, 0),
            follows=(),
            handshake=None,
            acknowledge_resumes=True,
        )
        super().__init__(name, of_leg, DriveLink(0.0, hold_ms), effects, settled)
        safe = words.held
        self.leg = self.leg._replace(rest=safe, setpoints=safe, sent=RpdoWords((0, *safe)))

    @property
    def wired(self) -> tuple[int, ...]:
        return self.on_wire(self.output)

    def on_wire(self, output: RpdoWords) -> tuple[int, ...]:
        """Words that the outputs get by this output of the leg."""
        return self.output_words.on_wire(output.words)

    def handle(self, request: Request, now: float, reply: Reply) -> None:
        if request.action is Action.START:
            self.on_refused(now)
            said = refused(request.action, str(request.identity), Text.of("request.not_started"))
            self._tell(now, EventKind.REFUSED, 300, said)
            reply(Outcome(Code.UNKNOWN_POINT, Text.of("request.outputs_not_started"), forwarded=False))
            return
        super().handle(request, now, reply)

    def _on_let_go(self) -> None:
        self.output_words.let_go()

    def _node_has_changed(self, state: NodeState, now: float) -> None:
        if state is NodeState.OPERATIONAL:
            # Nothing comes back of outputs: they are as good as their node is there.
            self.link.on_pdo(now)

    def _reaction(self) -> Text:
        return Text.of("watchdog.outputs_safe")


class Outputs(WordTiming):
    """Outputs of one node: their channel and their points in the image. Times are monotonic seconds."""

    def __init__(self, spec: DeviceSpec, image: Image, effects: Effects) -> None:
        super().__init__(spec.bus)
        node = spec.node
        self.name = self.node_name = node.name
        self.table = spec.table
        self.words = OutputWords.of(node, spec.family)
        self.channel = OutputChannel(
            node.name,
            self.words,
            spec.table,
            node.hold_ms,
            effects,
            self.refresh,
        )
        self.stop_check = OutputStopCheck()
        self._telling: dict[ObjectRef, Telling] = {}
        """Outputs that a TPDO of the node carries, too."""
        self.unserved: dict[ObjectRef, Text] = {}
        """Outputs that no RPDO carries, with the reason."""
        self.bridge_stop: tuple[int, Said] = (0, Text.of("meaning.not_read_yet"))
        """Longest time in ms from the bridge's hang to outputs that the node itself has made safe, or why
        there is none."""
        self.own: OwnJudgement | None = None
        """The node's own reaction to a silent bridge, in detail."""
        self._image = image
        index = image.index
        self._points = [
            (place, index[f"{node.name}/output/{name}"]) for name, place in self.words.places.items()
        ]
        self._supervision = [index[f"{node.name}/supervision/{leaf}"] for leaf in _SUPERVISION]
        self._left, self._telegrams, self._stop_ms, self._bridge_ms = (
            index[f"{node.name}/supervision/{leaf}"]
            for leaf in ("watchdog_left_ms", "telegrams", "worst_case_stop_ms", "worst_case_bridge_ms")
        )
        self._follows, self._last_stop = (
            index[f"{node.name}/supervision/{leaf}"] for leaf in ("follows", "last_stop")
        )

    @property
    def is_active(self) -> bool:
        """An owner's values are sent."""
        return bool(self.channel.output.words[0] & ACTIVE)

    @property
    def is_moving(self) -> bool:
        """An output has another value than its safe one; one that holds its last value is at rest at 0."""
        words = self.channel.on_wire(self.channel.output)
        places = self.words.places.values()
        return any(self.words.raw(words, place) != (place.safe or 0) for place in places)

    def stop_time(self) -> StopTime:
        """Longest time from the controller's last telegram to safe values on the bus."""
        if self.words.all_hold:
            return StopTime()
        return output_stop_time(self.table, self.bus, self.rpdo_type, self.wire)

    # fed by its node

    def on_pdos(
        self,
        rpdo_type: int,
        unserved: Mapping[ObjectRef, Text],
        held: Mapping[str, int],
        bridge_stop: tuple[int, Said],
        now: float,
    ) -> None:
        """Take over the findings of the boot-up: the transmission type of the RPDOs, the outputs that none of
        them carries, the integers that outputs hold, and the node's own reaction to a silent bridge."""
        self.rpdo_type = rpdo_type
        self.unserved = dict(unserved)
        self.bridge_stop = bridge_stop
        self.words.hold(held)
        self.refresh(now)

    def on_telling(self, telling: Mapping[ObjectRef, Telling]) -> None:
        """Take over the TPDO that carries each of these outputs, as the boot-up has found it."""
        self._telling = {
            place.output.object: telling[place.output.object]
            for place in self.words.places.values()
            if place.output.object in telling
        }

    def on_own_supervision_changed(self, why: Text, now: float) -> None:
        """Forget the node's own reaction to a silent bridge: an object that decides it was written."""
        self.bridge_stop = (0, why)
        self.own = None
        self.refresh(now)

    def on_wire(self, wire: Wire, now: float) -> None:
        """Take over the predicted delays of its bus."""
        self.wire = wire
        self.refresh(now)

    # its stops

    @property
    def is_heard(self) -> bool:
        """False: outputs do not report by themselves, their values are read back."""
        return False

    @property
    def unproven(self) -> Said | None:
        return self.stop_check.why if self.stop_check.is_stuck else None

    @property
    def says(self) -> Text:
        return Text.of("stop.outputs_as_sent")

    def why_ignored(self, verdict: StopVerdict, took_s: float) -> Text:
        return ignored_by_outputs(self.stop_check, verdict, took_s)

    def on_handed_over(self, now: float) -> None:
        """Begin the bound of its stop: the output of the channel has been handed to the bus."""
        way_s = self.rpdo_period_ms / 1000
        stopped = self._stopped()
        self.stop_check.on_handed_over(now, stopped, way_s=way_s, bound_s=self._bound_s(stopped, way_s))
        self._judged(now)

    def _stopped(self) -> list[StoppedOutput]:
        """Outputs to which the stop in force gives a value, as far as an RPDO carries them. One that holds
        its last value gets none, unless somebody has stopped it by a command."""
        words = self.words.safe(self.words.held)
        stopped: list[StoppedOutput] = []
        for name, place in self.words.places.items():
            ref = place.output.object
            if ref not in self.unserved and (place.safe is not None or self.words.has_let_go):
                tpdo, deadline_s = self._telling.get(ref, ("", None))
                told_by = "" if deadline_s is None else tpdo
                size, raw = place.output.size, self.words.raw(words, place)
                stopped.append(StoppedOutput(name, ref, size, raw, told_by))
        return stopped

    def _bound_s(self, stopped: Sequence[StoppedOutput], way_s: float) -> float:
        if self.table.ignored_stop_ms is not None:
            return self.table.ignored_stop_ms / 1000
        deadlines = [self._telling[one.object].deadline_s or 0.0 for one in stopped if one.told_by]
        return _DEADLINES * max(deadlines, default=0.0) + way_s + _TAKEN_S

    def on_answer(self, question: Question, answer: OutputReadback, now: float) -> None:
        """Take over the answer to a question of ``stop_check``."""
        self.stop_check.on_answer(question, answer, now)
        self._judged(now)

    def on_told(self, values: Sequence[tuple[ObjectRef, int]], now: float, *, after_pause: bool) -> None:
        """Take over outputs from a TPDO, as integers without sign. ``after_pause``: it came late."""
        if after_pause:
            self.stop_check.on_pause(now)
        self.stop_check.on_told(values, now)
        self._judged(now)

    def _judged(self, now: float) -> None:
        self._refresh_follows(now)
        self.channel.plan_anew()

    # time

    def on_time(self, now: float) -> Sequence[StopVerdict]:
        """Do all that is due by ``now``. Returns the verdicts on stops that have ended."""
        self.channel.on_time(now)
        return self.stop_check.take_verdicts()

    def next_deadline(self, now: float) -> float | None:
        at, of_stop = self.channel.next_deadline(now), self.stop_check.next_deadline()
        return at if of_stop is None else now

    # into the image

    def refresh(self, now: float) -> None:
        """Bring all points up to date, after something has changed."""
        channel = self.channel
        channel.plan_anew()
        is_active = self.is_active
        if is_active:
            self.words.take(channel.output.words[1:])
        sent = channel.on_wire(channel.output)
        is_there = channel.link.node is NodeState.OPERATIONAL
        self.stop_check.on_settled(None if is_active else sent, is_there=is_there)
        self._refresh_follows(now)
        quality = channel.link.quality(now)
        for place, index in self._points:
            why = self.unserved.get(place.output.object)
            value = self.words.value(sent, place)
            if why:
                self._image.set(index, value, now, Quality.CONFIG_ERROR, why)
            else:
                self._image.set(index, value, now, quality, channel.link.reason(quality))
        values: tuple[Value, ...] = (
            str(channel.owner or ""),
            int(channel.watchdog_state),
            channel.timeout_ms,
            channel.trips,
            channel.restart_interlock,
            channel.refused_writes,
        )
        for index, value in zip(self._supervision, values, strict=True):
            self._image.set(index, value, now)
        stop = self.stop_time()
        quality = Quality.CONFIG_ERROR if stop.unknown else Quality.GOOD
        self._image.set(self._stop_ms, stop.ms, now, quality, stop.unknown)
        ms, why = self.bridge_stop
        self._image.set(self._bridge_ms, ms, now, Quality.GOOD if ms else Quality.CONFIG_ERROR, why)
        self.look(now)

    def _refresh_follows(self, now: float) -> None:
        """Show how its last stop has ended, and the reason why it is not followed."""
        check, link = self.stop_check, self.channel.link
        quality = link.quality(now)
        self._image.set(self._follows, check.follows, now, quality, link.reason(quality))
        self._image.set(self._last_stop, int(check.last_stop), now, Quality.GOOD, check.why)

    def look(self, now: float) -> None:
        """Bring to ``now`` what changes by itself."""
        self._image.keep(self._left, self.channel.left_ms(now), now)
        self._image.keep(self._telegrams, self.channel.telegrams, now)
