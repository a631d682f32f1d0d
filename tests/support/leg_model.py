"""What the shared design (watchdog) says of the controller leg, written down a second time.

Nothing here is taken from ``bridge.command``: the exploration compares the two after every event.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum

from bridge.command import Identity, Role
from tests.support.handshake_model import HandshakeModel
from tests.support.leg_words import STRENGTH

START_LIMIT_S = 3.0
BELIEVED_S = 1.0
GONE_S = 0.0
"""Of an owner that nobody watches; the exploration makes it that short, lest each pause be a state."""
SETTLE_S = 0.2
QUICK_STOP_LIMIT_S = 2.0
"""As long as the time-out, to which the exploration sets it: far fewer states than with one that outlives
five of them."""


class Says(IntEnum):
    """What the drive says of itself; it says nothing else here."""

    READY = 0
    ENABLED = 1
    FAULT = 2


class Stage(IntEnum):
    """What is still missing before an enabling control word may leave the bridge."""

    ACKNOWLEDGE = 0
    STOP_WORD = 1
    ENABLE = 2
    ENABLED = 3


@dataclass(slots=True)
class LegModel:
    """One drive's controller leg. ``timeout_s`` 0 is off; ``ignores``: telegram downtime -0.1;
    ``mutes_after_s`` is how long after a trip the drive is spoken to, or None for always."""

    control: str
    timeout_s: float
    ignores: bool
    reaction: str
    mutes_after_s: float | None
    now: float
    is_there: bool = False
    """The node is operational."""
    owner: Identity | None = None
    deadline: float | None = None
    """The timer of the controller leg."""
    lease_until: float | None = None
    ttl_s: float = 0.0
    start_until: float | None = None
    believed_at: float | None = None
    """A start waits for what becomes of a stop that is on its way, until then."""
    believes_from: float | None = None
    """And takes from then on what the drive says, though it is nothing new."""
    sent: bool = False
    """What is sent enables the drive."""
    says: Says = Says.READY
    followed: bool = True
    """The drive has said that it follows the last word that enabled it."""
    silent: bool = False
    tripped: bool = False
    held: bool = False
    """With the reaction "hold": a drive that moved when the watchdog tripped goes on."""
    mute_at: float | None = None
    """Tripped: from then on nothing is sent to the drive."""
    stop_kind: str = ""
    """Tripped: how the drive is being stopped, by the reaction or by somebody who has asked for more."""
    coasts_at: float | None = None
    """Tripped with a quick stop: from then on it is disable voltage."""
    has_begun: bool = False
    """A start has come to its end, and what it raises then is up."""
    handshake: HandshakeModel = field(default_factory=HandshakeModel)
    acknowledges: bool | None = None
    """The acknowledge bit of the owner's last control word; None where it has written none."""
    gone_at: float | None = None
    """Without a watchdog: the owner's drive was stopped by another, and it has sent nothing since."""
    stage: Stage = Stage.STOP_WORD

    # what it may do

    @property
    def may_enable(self) -> bool:
        return self.is_there

    @property
    def is_enabled(self) -> bool:
        return self.says is Says.ENABLED

    @property
    def enables(self) -> bool:
        return self.held or self.stage is Stage.ENABLED

    def may(self, who: Identity, *, take: bool = False) -> bool:
        """Whether ``who`` may command the drive, or take control of it."""
        if who.role < Role.OPERATOR:
            return False
        is_owner = who.is_same(self.owner)
        is_gone = self.gone_at is not None and self.now >= self.gone_at
        if self.control == "lease":
            free = self.owner is None or self.silent or is_gone
            return is_owner or (take and (free or who.role >= Role.ENGINEER))
        never_spoke = self.deadline is None and not self.silent and not self.tripped
        free = self.owner is None or self.silent or (never_spoke and self.timeout_s > 0 and not self.ignores)
        return who.source.label == self.control and (is_owner or free or is_gone)

    # time

    def judge(self) -> None:
        """The controller's timers."""
        if self.deadline is not None and self.now >= self.deadline:
            self.deadline = None
            self.silent = True
            if not self.ignores and not self.tripped:
                self.trip()
        if self.lease_until is not None and self.now >= self.lease_until:
            self.leave()

    def trip(self) -> None:
        is_held = self.reaction == "hold"
        self.held = is_held and self.stage is Stage.ENABLED
        self.tripped = True
        self.stage = Stage.ACKNOWLEDGE
        self.end_start()
        if self.reaction in STRENGTH:
            self.stop_kind = self.reaction
        if not is_held:
            self.handshake.forget()
            self.mute_at = None if self.mutes_after_s is None else self.now + self.mutes_after_s
        if self.reaction == "quick_stop":
            self.coasts_at = self.now + QUICK_STOP_LIMIT_S

    def pump(self) -> None:
        """All timers, as in each round of the service."""
        self.judge()
        if self.start_until is not None and self.now >= self.start_until:
            self.stop()
        elif self.believed_at is not None and self.now >= self.believed_at:
            self.stage = Stage.ENABLED
            self.believed_at = self.believes_from = None
            if self.is_enabled:
                self.conclude_start()

    # what happens

    def stop(self) -> None:
        """Whatever was enabled has to be enabled anew."""
        self.stage = min(self.stage, Stage.STOP_WORD)
        self.held = self.has_begun = False
        self.handshake.forget()
        self.end_start()

    def asked_to_stop(self, kind: str) -> None:
        self.stop()
        if self.stop_kind:
            self.stop_kind = max(self.stop_kind, kind, key=STRENGTH.index)

    def stopped_by_another(self) -> None:
        if self.owner is not None and not self.timeout_s and self.gone_at is None:
            self.gone_at = self.now + GONE_S

    def end_start(self) -> None:
        self.start_until = self.believed_at = self.believes_from = None

    def conclude_start(self) -> None:
        """The drive is enabled."""
        self.end_start()
        self.has_begun = True

    def leave(self) -> None:
        self.stop()
        self.owner = self.lease_until = self.deadline = self.acknowledges = self.gone_at = None
        self.silent = False

    def own(self, who: Identity) -> None:
        if not who.is_same(self.owner):
            if self.owner is not None:
                self.leave()
            self.owner = who
        self.gone_at = None
        if self.control == "lease":
            self.lease_until = self.now + self.ttl_s

    def telegram(self, who: Identity) -> None:
        self.own(who)
        self.silent = False
        self.deadline = self.now + self.timeout_s if self.timeout_s else None

    def take(self, who: Identity, ttl_s: float) -> None:
        if self.control == "lease":
            self.ttl_s = ttl_s
        self.own(who)

    def acknowledge(self, who: Identity, *, fault: bool = False) -> None:
        """``fault``: the drive has one of its own, and is reset."""
        self.telegram(who)
        if fault and not self.tripped:
            self.stop()
        if self.tripped:
            self.tripped = False
            self.mute_at = self.coasts_at = None
            self.stop_kind = ""
            self.stop()
            self.stage = Stage.STOP_WORD

    def word(self, who: Identity, *, enables: bool, acknowledges: bool) -> None:
        """A valid control word."""
        self.telegram(who)
        self.end_start()
        self.has_begun = False
        if not enables:
            self.handshake.forget()
        is_edge = acknowledges and self.acknowledges is False
        if self.tripped and is_edge:
            self.acknowledge(who)
        elif self.tripped:
            self.held = self.held and enables
        elif enables:
            self.stage = Stage.ENABLED if self.stage >= Stage.ENABLE else self.stage
        elif self.may_enable:
            self.stage = Stage.ENABLE
        self.acknowledges = acknowledges

    def see(self, *, sent: bool) -> None:
        """What is on the bus after an event: whether an enabling word."""
        if sent and not self.sent:
            self.followed = False
        self.sent = sent
        self.followed |= self.is_enabled

    def start(self, who: Identity) -> None:
        """A start that was taken."""
        self.telegram(who)
        self.has_begun = False
        believed_at, believes_from = self.believed_at, self.believes_from
        self.end_start()
        is_stopped = self.stage is not Stage.ENABLED and (self.is_enabled or not self.followed)
        self.stage = Stage.ENABLE if is_stopped else Stage.ENABLED
        if is_stopped:
            self.believed_at = believed_at or self.now + BELIEVED_S
            self.believes_from = believes_from or self.now + SETTLE_S
        if is_stopped or not self.is_enabled:
            self.start_until = self.now + START_LIMIT_S
        else:
            self.conclude_start()

    def drive_says(self, says: Says) -> None:
        before, self.says = self.says, says
        if self.coasts_at is not None and says is not Says.ENABLED:
            self.coasts_at = min(self.coasts_at, self.now)  # it stands
        if says is not before:
            if says is Says.FAULT or before is Says.ENABLED:
                self.handshake.forget()
            self._drive_is()
        elif says is not Says.FAULT:
            self._drive_is_still()

    def _drive_is(self) -> None:
        if self.start_until is None:
            return
        self.believed_at = self.believes_from = None
        if self.says is Says.FAULT:
            self.stop()
        elif self.stage >= Stage.ENABLE:
            self.stage = Stage.ENABLED
        if self.is_enabled:
            self.conclude_start()

    def _drive_is_still(self) -> None:
        """The drive has said once more what it said before."""
        if self.believes_from is not None and self.now >= self.believes_from:
            self.stage = Stage.ENABLED
            self.believed_at = self.believes_from = None

    def node(self, *, is_there: bool) -> None:
        was_there = self.is_there
        self.is_there = is_there or (self.ignores and was_there)
        if is_there or not self.is_there:
            held = self.held and self.is_there
            self.stop()
            self.held = held

    def gap(self) -> None:
        """The bridge itself hung."""
        self.judge()
        if self.tripped:
            self.stop()
        else:
            self.leave()
