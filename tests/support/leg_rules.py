"""Rules of the controller leg, to which ``leg_oracle`` holds it.

Nothing here is taken from ``bridge.command``, and nothing is known of how the leg does it: a rule sees what
was asked and by whom, how that was answered, what the drive says, and what is on the bus. The rules of
telegrams, trips, owners and stops are those of the design of the watchdog. What it leaves open is from the
reference: a start (``Start`` in opcua.md), an owner that is gone and the end of a quick stop
(dead-man-chain.md), the handshake of a position (CiA 402-2, mapping-file.md).
"""

from __future__ import annotations

from typing import Any, Final

from tests.support.leg_seen import Memory, Missing
from tests.support.leg_words import STRENGTH

START_S: Final = 3.0
"""Longest duration of a start in seconds."""
OLD_S: Final = 0.2
"""So long after a stop a drive may still say what it was before."""
NEWS_S: Final = 1.0
"""A drive that says nothing for so long says what it has said last."""
RAMP_S: Final = 10.0
"""A quick stop by the watchdog ends with disable voltage then, at the latest."""
GONE_S: Final = 10.0
"""Without a time-out: an owner that gives no sign for so long is gone."""

RESTING: Final = frozenset(("ready", "inhibited", "fault", "switched on", "not ready"))
"""States of a drive that is not enabled and does not brake."""
LED: Final = frozenset(("ready", "switched on", "enabled"))
"""States from which the enabling word is the next one."""
FAULTED: Final = frozenset(("fault", "fault reaction"))
MOVING: Final = frozenset(("enabled", "braking", "fault reaction"))


class Model(Memory):
    """Model of the leg, one step at a time."""

    __slots__ = ()

    # who may

    def owns(self, who: Any) -> bool:
        """An owner is one connection; when that has ended, whichever its user comes by next."""
        owner = self.owner
        return who is owner or (self.is_cut and who.user == owner.user)

    def pressed(self, who: Any) -> bool:
        """True if its last telegram acknowledged by a register."""
        last = self.pressed_by
        return who is last or (self.is_pressed_cut and who.user == last.user)

    def dies_at(self, who: Any, token: Any) -> float | None:
        """Time at which telegrams of ``who`` end to count, with this token or the one brought before; None
        for never."""
        ages_s = self.rules.ages_s
        if ages_s is None:
            return None
        before = self.dead_at if self.owns(who) and self.dead_at is not None else self.now
        return before if token is None else max(before, self.now + self.timeout_s - ages_s[token])

    def lives(self, who: Any, token: Any = None) -> bool:
        dies_at = self.dies_at(who, token)
        return dies_at is None or self.now < dies_at

    def press(self, who: Any) -> None:
        self.pressed_by, self.is_pressed_cut = who, False

    @property
    def is_gone(self) -> bool:
        """The owner, where no time-out says so."""
        absent, gone = self.absent_at, self.gone_at
        is_over = (absent is not None and self.now >= absent) or (gone is not None and self.now >= gone)
        return is_over and not self.timeout_s

    def may(self, who: Any, *, take: bool = False) -> bool:
        """Whether ``who`` may command the drive, or take control of it."""
        rules = self.rules
        if who.role < 1 or rules.control == "none":
            return False
        is_owner = self.owns(who)
        is_free = self.owner is None or self.is_silent or self.is_gone
        is_quiet = self.quiet_at is not None and self.now >= self.quiet_at
        if rules.control == "lease":
            return is_owner or (take and (is_free or who.role >= 2))
        is_free = is_free or (self.heard_at is None and self.timeout_s > 0)
        is_free = is_free or (is_quiet and who.user == self.owner.user)
        return who.source.label == rules.control and (is_owner or is_free or (take and who.role >= 2))

    def may_stop(self, who: Any) -> bool:
        anyone = self.rules.stop_by_anyone or self.is_gone
        return who.role >= 1 and (anyone or self.may(who))

    # time

    def judge(self) -> None:
        """Is the controller still there?"""
        if self.deadline is not None and self.now >= self.deadline:
            self.deadline = None
            self.is_silent = True
            if not self.rules.ignores and not self.is_tripped:
                self._trip()
        if self.lease_until is not None and self.now >= self.lease_until:
            self.leave()

    def _trip(self) -> None:
        rules, now = self.rules, self.now
        self.is_tripped = True
        self._end_start()
        if rules.reaction == "hold":
            self.is_held = self.missing is Missing.NOTHING and self.sends
        else:
            self.drop()
            self.mute_at = None if rules.mutes_after_s is None else now + rules.mutes_after_s
        if rules.reaction == "quick_stop":
            self.coasts_at = now + RAMP_S
        self.stop_kind = rules.reaction if rules.reaction in STRENGTH else ""
        self.missing = Missing.ACKNOWLEDGE

    def round(self) -> None:
        """All that is due."""
        self.judge()
        if self.start_until is not None and self.now >= self.start_until:
            self.drop()
            self.stop()
        elif self.news_until is not None and self.now >= self.news_until:
            self._no_news()

    # what the owner and others do

    def drop(self) -> None:
        """Setpoints go to rest, and are not gone back to."""
        self.has_set = False
        self._forget()

    def stop(self, kind: str = "") -> None:
        """Note a stop: whatever was enabled has to be enabled anew."""
        self.missing = min(self.missing, Missing.STOP_WORD)
        self.is_held = self.has_begun = False
        self._forget()
        self._end_start()
        if kind and self.stop_kind:
            self.stop_kind = max(self.stop_kind, kind, key=STRENGTH.index)

    def asked_to_stop(self, who: Any, kind: str, *, is_late: bool) -> None:
        if not self.owns(who):
            if self.owner is not None and not self.timeout_s and self.gone_at is None:
                self.gone_at = self.now + GONE_S
        elif not is_late and self.lives(who):
            self.telegram(who)
        self.drop()
        self.stop(kind)
        self.asks = True

    def leave(self) -> None:
        self.drop()
        self.stop()
        self.owner = self.deadline = self.heard_at = self.lease_until = self.bit = None
        self.absent_at = self.gone_at = self.quiet_at = self.dead_at = None
        self.is_silent = self.is_cut = False
        self.timeout_s = self.rules.timeout_s

    def connection(self, who: Any, *, is_there: bool, has_others: bool) -> None:
        if not is_there:
            self.is_pressed_cut |= who is self.pressed_by
        if self.owner is None or who.user != self.owner.user:
            return
        if is_there:
            self.absent_at = None
            return
        self.is_cut |= who is self.owner
        if not has_others:
            self.absent_at = self.now + GONE_S

    def own(self, who: Any) -> None:
        if not self.owns(who) and self.owner is not None:
            self.leave()
        self.owner, self.is_cut = who, False
        self.absent_at = self.gone_at = None
        judges_by_itself = self.timeout_s or self.rules.control == "lease"
        self.quiet_at = None if judges_by_itself else self.now + GONE_S
        if self.rules.control == "lease":
            self.lease_until = self.now + self.lease_s

    def take_control(self, who: Any, ttl_s: float) -> None:
        if self.rules.control == "lease":
            self.lease_s = ttl_s
        self.own(who)

    def set_timeout(self, timeout_s: float) -> None:
        """Counted from the last telegram; a silence that has been found out stays one."""
        if self.dead_at is not None:
            self.dead_at += timeout_s - self.timeout_s
        self.timeout_s = timeout_s
        runs = timeout_s and self.heard_at is not None and not self.is_silent
        self.deadline = (self.heard_at or 0.0) + timeout_s if runs else None
        if self.deadline and self.dead_at is not None:
            self.deadline = min(self.deadline, self.dead_at)
        judges_by_itself = timeout_s or self.rules.control == "lease"
        self.quiet_at = None if judges_by_itself else (self.heard_at or self.now) + GONE_S

    def telegram(self, who: Any, token: Any = None) -> None:
        dies_at = self.dies_at(who, token)
        self.own(who)
        self.is_silent = False
        self.heard_at = self.now
        self.deadline = self.now + self.timeout_s if self.timeout_s else None
        if dies_at is not None and self.deadline is not None:
            self.dead_at, self.deadline = dies_at, min(dies_at, self.deadline)

    def acknowledge(self, who: Any, *, is_reset: bool = False) -> None:
        """``is_reset``: the drive's own fault is reset, too."""
        self.telegram(who)
        if self.is_tripped or (is_reset and self.says in FAULTED):
            self.is_tripped = False
            self.mute_at = self.coasts_at = self.speaks_until = self.said = None
            self.stop_kind = ""
            self.drop()
            self.stop()
            self.missing = Missing.STOP_WORD

    def word(self, who: Any, word: int, token: Any = None) -> None:
        words = self.rules.words
        self.telegram(who, token)
        self._end_start()
        self.has_begun = False
        enables, acknowledges = words.enabling.fit(word), bool(word & words.acknowledge)
        if not enables:
            self._forget()
        if self.is_tripped and acknowledges and self.bit is False:
            self.acknowledge(who)
        elif self.is_tripped:
            self.is_held = self.is_held and enables
        elif enables:
            self.missing = Missing.NOTHING if self.missing >= Missing.ENABLE else self.missing
        elif self.may_enable:
            self.missing = Missing.ENABLE
        self.bit = acknowledges

    def late_stop(self) -> None:
        """A word of the owner's that does not enable and has waited too long for a telegram."""
        self.drop()
        self.stop()

    # a start

    def _end_start(self) -> None:
        self.is_starting = self.is_plain = self.is_late = self.is_braking = False
        self.start_until = self.news_from = self.news_until = None

    def start(self, who: Any) -> None:
        self.telegram(who)
        news_from, news_until = self.news_from, self.news_until
        has_waited = self.is_starting and not self.sends and self.missing is Missing.NOTHING
        self._end_start()
        self.has_begun = False
        self.is_starting = True
        self.is_plain = self.is_heard and self.says in LED and not has_waited
        self.is_late = not self.followed
        self.is_braking = self.is_heard and self.says == "braking"
        self.start_until = self.now + START_S
        waits = not self.is_heard or (not self.sends and (self.says == "enabled" or not self.followed))
        self.missing = Missing.NOTHING
        if waits and not has_waited:
            self.missing = Missing.ENABLE
            self.news_until = news_until or self.now + NEWS_S
            self.news_from = (news_from or self.now + OLD_S) if self.is_heard else None

    def start_has_ended(self, *, is_done: bool) -> None:
        if is_done:
            assert self.is_starting, "a start that was ended is not done"
            assert self.says == "enabled", "a start is done when the drive says that it is enabled"
            self.missing = Missing.NOTHING
            self.has_begun = True
            self._end_start()
        elif self.is_starting:
            self.stop()

    def _no_news(self) -> None:
        """Keep what the drive has said last; of one that makes no sense nothing holds, unless it said nothing
        at all when the start began."""
        self.news_until = None
        if self.says != "unknown" or self.news_from is None:
            self.missing = Missing.NOTHING
            self.news_from = None

    # the way to the drive

    def way(self, *, is_there: bool, is_placed: bool = True, is_heard: bool = True) -> None:
        self.is_there, self.is_placed, self.is_heard = is_there, is_placed, is_heard

    @property
    def is_open(self) -> bool:
        """A drive that is enabled needs no position any more."""
        is_commanded = self.says == "enabled" and self.is_heard and self.sends
        return self.is_there and (self.is_placed or is_commanded)

    def look_at_way(self) -> None:
        if self.may_enable and not self.is_open:
            self.stop()
        self.may_enable = self.is_open

    def hear(self, says: str, *, is_acknowledged: bool) -> None:
        """The drive says something."""
        before, self.says = self.says, says
        self.is_braking &= says == "braking"
        was_enabled = before == "enabled" and self.is_heard
        self.is_acknowledged = is_acknowledged
        self.is_heard = True
        self.followed |= says in ("enabled", "braking")
        if self.coasts_at is not None and says in RESTING:
            self.coasts_at = min(self.coasts_at, self.now)
        if says in FAULTED or (was_enabled and says != "enabled"):
            self._forget()
        if not self.is_starting:
            return
        self.is_plain = self.is_plain and says in LED
        if says in FAULTED:
            self.drop()
            self.stop()
        elif self.missing is Missing.ENABLE and says != "unknown":
            is_early = self.news_from is not None and self.now < self.news_from
            is_old = is_early
            if says != before:
                is_old = says == "enabled" or (is_early and says in LED and self.is_late)
                self.is_plain = self.is_plain and says != "enabled"
            if not is_old:
                self._no_news()

    # the handshake of a position

    def order(self, position: object) -> None:
        """Tripped, nothing new goes to the drive, and before something does the owner has to stop it."""
        if not self.is_tripped:
            self.ordered = position if position != self.handed else None

    def _forget(self) -> None:
        self.ordered = self.handed = self.up_until = None
        self.is_up = False
