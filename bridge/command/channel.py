"""Command side of one drive, or of the outputs of one node: frames and requests become events of the leg, and
its effects become outcomes, events and words.

Sans-IO: every entry takes ``now`` (monotonic seconds). A request lets the controller's timers run first, so a
telegram that waited in a buffer while the process hung cannot save a drive whose time was up. The drive's own
timers are judged in ``on_time`` alone, which is called after the bus has been drained: a late process must
not look like a dead drive.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from bridge.catalogue.codes import WatchdogState
from bridge.command.drive_link import DriveLink, NodeState
from bridge.command.effects import Effects
from bridge.command.leg import event, owners
from bridge.command.leg.effect import (
    Answer,
    Effect,
    Heard,
    Ignored,
    LetGo,
    StartBegun,
    StartEnded,
    Tell,
    Tripped,
)
from bridge.command.leg.outlook import next_deadline, output_then, until, watchdog_state
from bridge.command.leg.settings import LegSettings
from bridge.command.leg.state import WANTS_STOP_WORD, LegState, RpdoWords, Way
from bridge.command.leg.step import initial, step
from bridge.command.messages.event import Event, EventKind
from bridge.command.messages.request import Identity, Outcome, Reply, Request
from bridge.image import Quality
from bridge.text import Said, Text


class Channel:
    """The command side of one drive, or of the outputs of one node.

    After any call the caller compares ``output`` and sends it. ``settled`` is called when what others may see
    has changed beyond the status word, before outcomes are told: so a client that reads after its outcome
    sees the new values. Everything else that comes of it is collected in ``effects``.
    """

    def __init__(
        self,
        name: str,
        leg_settings: LegSettings,
        link: DriveLink,
        effects: Effects,
        settled: Callable[[float], None],
    ) -> None:
        self.name = name
        self.leg_settings = leg_settings
        self.words = leg_settings.words
        self.leg = initial(leg_settings)
        """The state of the leg."""
        self.link = link
        self._effects = effects
        self._show = settled
        self._followed = frozenset(source for _, source in leg_settings.follows)
        self._start_reply: Reply | None = None
        self.trips = 0
        self.refused_writes = 0
        self.telegrams = 0
        """Number of the last valid telegram, modulo 2¹⁶: a witness outside sees by it that one came."""

    # what others may see

    @property
    def output(self) -> RpdoWords:
        """The words that belong on the bus now."""
        return self.leg.sent

    @property
    def wired(self) -> RpdoWords | tuple[int, ...]:
        """Words that ``output`` puts on the bus."""
        return self.leg.sent

    @property
    def until(self) -> float | None:
        """Time until which ``output`` may be on the bus if no more is heard of the owner; None for ever."""
        return until(self.leg_settings, self.leg)

    def output_then(self) -> RpdoWords:
        """Words that belong on the bus from ``until`` on."""
        return output_then(self.leg_settings, self.leg)

    @property
    def setpoints(self) -> tuple[int, ...]:
        return self.leg.setpoints

    @property
    def restart_interlock(self) -> bool:
        return self.leg.stage in WANTS_STOP_WORD

    @property
    def owner(self) -> Identity | None:
        return self.leg.owner.identity

    @property
    def watchdog_state(self) -> WatchdogState:
        return watchdog_state(self.leg_settings, self.leg)

    @property
    def controller_is_overdue(self) -> bool:
        """No valid telegram for longer than the time-out, after there had been one."""
        return self.leg.timer.is_overdue

    @property
    def timeout_ms(self) -> int:
        return self.leg.timer.timeout_ms

    def left_ms(self, now: float) -> int:
        """Time until the trip, in ms; 0 when the timer does not run."""
        deadline = self.leg.timer.deadline
        if deadline is None or self.watchdog_state is not WatchdogState.RUNNING:
            return 0
        return max(0, round((deadline - now) * 1000))

    @property
    def is_tripped(self) -> bool:
        return self.leg.stage.is_tripped

    def refusal(self, identity: Identity) -> Text | None:
        """Reason why ``identity`` may not command it, None where it may. An owner counts as there, and may
        command it over any of its connections."""
        owner = self.leg.owner.identity
        if owner is not None and identity.is_same(owner):
            identity = replace(identity, connection=owner.connection)
        return owners.refusal(self.leg_settings.control, self.leg.owner, identity, is_replaceable=False)

    def life_sign(self, now: float) -> int:
        """Newest token that the owner has brought back; 0 where none counts."""
        life, until = self.leg_settings.life, self.leg.owner.alive_until
        if life is None or until is None:
            return 0
        return life.token(round(until - self.timeout_ms / 1000, 3)) if now < until else 0

    # the node

    def on_node(self, state: NodeState, now: float) -> None:
        """Take over the state of its node."""
        before = self.link.node
        self.link.on_node(state, now)
        if state is not before:
            self._node_has_changed(state, now)
            if state is NodeState.OPERATIONAL:
                self._happen(event.NodeBack(), now)
        self._happen(self._way(now), now)

    def _way(self, now: float) -> Way:
        link = self.link
        why: Said = ""
        if link.is_expired:
            why = link.reason(Quality.LOST)
        elif not link.may_enable:
            why = Text.of("node.state_of_drives", state=Text.word("node_state", link.node.value))
        # It is heard when it has reported: until then what it said before would count.
        is_heard = link.is_heard and self.leg.way.is_heard
        return Way(link.may_enable, why, self._why_unplaced(now), is_heard, link.why_unsent)

    def on_sending(self, why_not: Said, now: float) -> None:
        """Take over whether ``output`` is repeated on the bus: ``why_not`` is empty where it is."""
        if why_not != self.link.why_unsent:
            self.link.why_unsent = why_not
            self._happen(self._way(now), now)

    # time

    def on_time(self, now: float) -> None:
        """Do all that is due by ``now``. Call it when the bus has been drained."""
        is_lost = self.link.on_time(now)
        self._happen(event.Time(self._way(now)), now, is_lost=is_lost)

    def next_deadline(self, now: float) -> float | None:
        """Time of the next ``on_time``: ``now`` where something is due already, None for never."""
        of_link, of_leg = self.link.next_deadline(), next_deadline(self.leg)
        if of_link is None:
            return None if of_leg is None else max(of_leg, now)
        return max(of_link if of_leg is None else min(of_link, of_leg), now)

    def on_bridge_gap(self, now: float) -> None:
        """Start anew: the bridge itself was away for longer than the dead-man time."""
        self._happen(event.BridgeGap(), now)

    def start_anew(self, now: float) -> None:
        """Start anew: the bus was gone, or the node was stopped or has restarted. Nothing that it was told
        before counts, not even where communication errors are ignored."""
        self._happen(event.StartAnew(), now)

    # requests

    def handle(self, request: Request, now: float, reply: Reply) -> None:
        """Do what ``request`` asks; ``reply`` is called exactly once, now or later."""
        self._happen(request, now, reply)

    def on_connection(
        self, identity: Identity, now: float, *, is_there: bool, has_others: bool = False
    ) -> None:
        """Note that a connection of ``identity`` has begun or ended, and whether the same user has others. It
        is no telegram, and no end of control."""
        connection = event.Connection(identity, is_there, has_others)
        self.leg, _ = step(self.leg_settings, self.leg, connection, now)

    def plan_anew(self) -> None:
        """Have ``next_deadline`` asked again: it may be earlier than before."""
        self._effects.due[self.name] = None

    def on_refused(self, now: float) -> None:
        """Count a request about it that was refused elsewhere as one refused here."""
        self.refused_writes += 1
        self._settled(now)

    # what comes of it

    def _happen(
        self, what: event.Event, now: float, reply: Reply | None = None, *, is_lost: bool = False
    ) -> None:
        outcomes: list[tuple[Reply, Outcome]] = []
        brings_way = isinstance(what, event.Time | Way)
        if self._followed and not brings_way and self._why_unplaced(now) != self.leg.way.why_unplaced:
            outcomes = self._take_in(*step(self.leg_settings, self.leg, self._way(now), now), now, None)
        outcomes += self._take_in(*step(self.leg_settings, self.leg, what, now), now, reply)
        if is_lost:
            self._is_silent(now)
        self._settled(now)
        for answer, outcome in outcomes:
            answer(outcome)

    def _take_in(
        self, leg: LegState, effects: list[Effect], now: float, reply: Reply | None
    ) -> list[tuple[Reply, Outcome]]:
        """Take over a state of the leg; returns the outcomes to be told once everybody can see it."""
        self.leg = leg
        outcomes: list[tuple[Reply, Outcome]] = []
        for effect in effects:
            match effect:
                case Heard(names=names):
                    self.telegrams = (self.telegrams + 1) & 0xFFFF
                    self._on_heard(names)
                case Answer(outcome=outcome, is_refused=is_refused):
                    self.refused_writes += is_refused
                    if reply is not None:
                        outcomes.append((reply, outcome))
                case StartBegun():
                    self._start_reply = reply
                case StartEnded(outcome=outcome):
                    started, self._start_reply = self._start_reply, None
                    if started is not None:
                        outcomes.append((started, outcome))
                case Tripped():
                    self._on_tripped(effect, now)
                case LetGo():
                    self._on_let_go()
                case Ignored():
                    self._on_ignored(now)
                case Tell(kind=kind, severity=severity, said=said):
                    self._tell(now, kind, severity, said)
        return outcomes

    def _on_tripped(self, tripped: Tripped, now: float) -> None:
        self.trips += 1
        who, reaction = str(tripped.who), self._reaction()
        said = Text.of("watchdog.tripped", who=who, timeout_ms=tripped.timeout_ms, reaction=reaction)
        self._tell(now, EventKind.WATCHDOG, 900, said)
        self._effects.tripped(tripped.due)

    def _tell(self, now: float, kind: EventKind, severity: int, said: Text) -> None:
        self._effects.events.report(Event(now, kind, self.name, severity, said))

    def _settled(self, now: float) -> None:
        self._show(now)
        self._effects.settled[self.name] = now

    # what is different for drives and outputs

    def _reaction(self) -> Text:
        """Reaction of the watchdog that has just tripped, in words."""
        raise NotImplementedError

    def _on_ignored(self, now: float) -> None:
        """Note that the controller is silent where the site file has that ignored."""

    def _on_heard(self, names: tuple[str, ...]) -> None:
        """Note a valid telegram of the owner, which has brought these commands."""

    def _on_let_go(self) -> None:
        """Note that somebody has stopped it by a command."""

    def _node_has_changed(self, state: NodeState, now: float) -> None:
        """React to another state of the node."""

    def _is_silent(self, now: float) -> None:
        """React to a drive that sends no process data for longer than the telegram downtime."""

    def _why_unplaced(self, now: float) -> Said:
        """Reason why the position that setpoints have to follow is not known; empty where it is."""
        return ""
