"""Memory of the oracle's rules (``leg_oracle``) on one drive."""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum
from operator import attrgetter
from typing import Any, NamedTuple

from tests.support.leg_words import LegWords


class Missing(IntEnum):
    """Steps that the owner still has to take before an enabling word may leave the bridge."""

    ACKNOWLEDGE = 0
    STOP_WORD = 1
    ENABLE = 2
    NOTHING = 3


class Rules(NamedTuple):
    """The drive's keys of the site file. ``mutes_after_s``: how long after a trip the drive is spoken to,
    None for always."""

    words: LegWords
    timeout_s: float
    ignores: bool
    reaction: str
    mutes_after_s: float | None
    control: str
    stop_by_anyone: bool
    is_writable: bool
    ages_s: Mapping[int, float] | None = None
    """Ages in seconds of the tokens of a drive that asks for a life sign."""


class Times(NamedTuple):
    """Everything that happens at a time, or has happened."""

    heard_at: float | None = None
    deadline: float | None = None
    lease_until: float | None = None
    absent_at: float | None = None
    gone_at: float | None = None
    mute_at: float | None = None
    coasts_at: float | None = None
    speaks_until: float | None = None
    start_until: float | None = None
    news_from: float | None = None
    news_until: float | None = None
    up_until: float | None = None
    down_until: float | None = None
    quiet_at: float | None = None
    dead_at: float | None = None


class Seen(NamedTuple):
    """All else that the rules remember. ``bit``: the acknowledge bit of the owner's last control word;
    ``pressed_by``: whose last telegram acknowledged by a register."""

    times: Times
    timeout_s: float
    owner: Any = None
    lease_s: float = 0.0
    is_silent: bool = False
    is_tripped: bool = False
    stop_kind: str = ""
    """Tripped: how the drive is being stopped, by the reaction or by somebody who has asked for more."""
    said: int | None = None
    """The control word that has broken the silence."""
    watches: bool = True
    """The drive stops by itself without its RPDOs."""
    is_held: bool = False
    missing: Missing = Missing.STOP_WORD
    is_starting: bool = False
    """A start was taken and its end has not been told."""
    is_plain: bool = False
    """True if it leads a drive that was heard and has said nothing since that asks for another word than
    "enable"."""
    is_late: bool = False
    """True if the drive, when it began, might still follow an enabling word from before a stop."""
    is_braking: bool = False
    """It began while the drive was in its quick stop, and the drive is still in it."""
    has_begun: bool = False
    bit: bool | None = None
    pressed_by: Any = None
    is_cut: bool = False
    """The owner's connection has ended."""
    is_pressed_cut: bool = False
    """So has that of ``pressed_by``."""
    is_there: bool = True
    is_placed: bool = True
    is_heard: bool = True
    may_enable: bool = True
    sends: bool = False
    """True while the frames on the bus enable the drive."""
    says: str = "ready"
    followed: bool = True
    """True if it has said "enabled" since the last enabling word, or nothing from before counts any more."""
    ordered: Any = None
    """A position to be handed over."""
    handed: Any = None
    """The drive has it, or gets it now: the same again is no new one."""
    is_up: bool = False
    """The bit that hands it over, as it should be."""
    was_up: bool = False
    """The same bit as it was on the bus."""
    is_acknowledged: bool = False
    was_commanded: bool = False
    is_unsent: bool = False
    """No words to the drive are on the bus."""
    has_set: bool = False
    """The owner has written setpoints since the last stop that was not its own."""
    at: tuple[int, ...] = ()
    """The setpoints of a drive that nobody commands, where they are not zero: its own position."""


def first(rules: Rules) -> Seen:
    return Seen(Times(), rules.timeout_s)


_times = attrgetter(*Times._fields)
_others = attrgetter(*Seen._fields[1:])


class Memory:
    """Memory of the rules while one step is judged; the attributes are those of ``Seen`` and ``Times``."""

    __slots__ = ("asks", "now", "rules", *Times._fields, *Seen._fields[1:])

    def __init__(self, rules: Rules, seen: Seen, now: float) -> None:
        self.rules = rules
        self.now = now
        self.asks = False
        """True if somebody has just asked for a stop."""
        (
            self.heard_at,
            self.deadline,
            self.lease_until,
            self.absent_at,
            self.gone_at,
            self.mute_at,
            self.coasts_at,
            self.speaks_until,
            self.start_until,
            self.news_from,
            self.news_until,
            self.up_until,
            self.down_until,
            self.quiet_at,
            self.dead_at,
        ) = seen.times
        (
            _,
            self.timeout_s,
            self.owner,
            self.lease_s,
            self.is_silent,
            self.is_tripped,
            self.stop_kind,
            self.said,
            self.watches,
            self.is_held,
            self.missing,
            self.is_starting,
            self.is_plain,
            self.is_late,
            self.is_braking,
            self.has_begun,
            self.bit,
            self.pressed_by,
            self.is_cut,
            self.is_pressed_cut,
            self.is_there,
            self.is_placed,
            self.is_heard,
            self.may_enable,
            self.sends,
            self.says,
            self.followed,
            self.ordered,
            self.handed,
            self.is_up,
            self.was_up,
            self.is_acknowledged,
            self.was_commanded,
            self.is_unsent,
            self.has_set,
            self.at,
        ) = seen

    def end(self) -> Seen:
        return Seen(Times._make(_times(self)), *_others(self))
