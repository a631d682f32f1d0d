"""One drive and the judge of its stops, played by a script: what is sent and said when, and what comes of it.

All times are sums of powers of two, so that "exactly at the bound" means just that.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum, auto

from bridge.command.stop_check.state import Bounds, LastStop, Says, Sent, StopVerdict
from tests.support.judge import Judge

STEP_S = 1 / 16
PAUSE_S = 1 / 8
OFF_S, RAMP_S, SILENCE_S = 0.5, 4.0, 6.0
BOUNDS = Bounds(OFF_S, RAMP_S, SILENCE_S)
UNWATCHED = Bounds(OFF_S, RAMP_S)
"""Bounds of a drive of which nobody knows whether it stops when we fall silent."""
END_S = 48.0


class Deed(Enum):
    """Further events beside words and reports."""

    MUTE = auto()
    HEARD_AGAIN = auto()
    SAYS_SO_AGAIN = auto()
    """Another status word of the same state."""
    NODE_LEAVES = auto()
    NODE_BACK = auto()
    CUT_OFF = auto()
    """The bridge takes the node out of operation."""
    NODE_STOPPED = auto()
    NODE_STARTS = auto()


Script = list[tuple[float, Sent | Says | Deed]]
Told = list[tuple[LastStop, float]]


@dataclass
class Play:
    """The drive is enabled from the start, and sends every 1/16 s, or changes alone; also while its node is
    not in operation."""

    on_change: bool = False
    always: bool = True
    """The judge is asked at each step."""
    bounds: Bounds = BOUNDS
    now: float = 0.0
    follow: Judge = field(default_factory=Judge)
    drive: Says = Says.ENABLED
    is_mute: bool = False
    heard_at: float | None = None
    shown: Says | None = None
    looks: list[float] = field(default_factory=list[float])
    """Times at which it was asked."""
    verdicts: list[StopVerdict] = field(default_factory=list[StopVerdict])

    def run(self, script: Script, end: float = END_S) -> Play:
        self.follow.on_node(is_there=True)
        self.do(Sent.ENABLES)
        left = list(script)
        while self.now < end:
            while left and left[0][0] <= self.now:
                self.do(left.pop(0)[1])
            if not self.is_mute and not (self.on_change and self.shown is self.drive):
                self.telegram()
            if self.always or self.is_due:
                self.ask()
            self.now += STEP_S
        assert not left
        return self

    def wait(self, end: float) -> None:
        """The drive says nothing, and the judge is asked whenever it asked for it."""
        while (due := self.follow.next_deadline()) is not None and due <= end:
            self.now = max(due, self.now)
            self.ask()
            assert len(self.looks) < 100

    def ask(self) -> None:
        self.looks.append(self.now)
        pause_s = None if self.on_change else PAUSE_S
        self.verdicts += self.follow.on_time(self.now, self.heard_at, pause_s)

    @property
    def is_due(self) -> bool:
        due = self.follow.next_deadline()
        return due is not None and due <= self.now

    def telegram(self) -> None:
        if not self.on_change and self.heard_at is not None and self.now - self.heard_at > PAUSE_S:
            self.follow.on_pause(self.now)
        self.heard_at = self.now
        if self.shown is not self.drive or not self.follow.is_informed:
            self.shown = self.drive
            self.follow.on_report(self.drive, self.now)

    def do(self, deed: Sent | Says | Deed) -> None:
        match deed:
            case Sent():
                self.follow.on_output(deed)
                self.follow.on_handed_over(self.now, self.bounds)
            case Says():
                self.drive = deed
            case Deed.MUTE | Deed.HEARD_AGAIN:
                self.is_mute = deed is Deed.MUTE
            case Deed.SAYS_SO_AGAIN:
                self.shown = None
            case Deed.NODE_LEAVES | Deed.NODE_BACK:
                self.follow.on_node(is_there=deed is Deed.NODE_BACK)
                self.follow.on_handed_over(self.now, self.bounds)
            case Deed.CUT_OFF:
                self.follow.on_cut_off(self.now, self.bounds)
                self.follow.on_node(is_there=False)
                self.is_mute = True
            case Deed.NODE_STOPPED:
                self.follow.on_node_stopped(self.now)
            case Deed.NODE_STARTS:
                self.follow.on_restart()

    @property
    def told(self) -> Told:
        return [(verdict.outcome, verdict.at) for verdict in self.verdicts]


def told(script: Script, expected: Told, *, on_change: bool = False, bounds: Bounds = BOUNDS) -> None:
    """This is what comes of it, however often the judge is asked."""
    often = Play(on_change, always=True, bounds=bounds).run(script)
    assert often.told == expected
    seldom = Play(on_change, always=False, bounds=bounds).run(script)
    assert seldom.told == expected
