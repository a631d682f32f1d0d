"""What has to hold in any plant, whatever happens to it: what is said against what was on the wire.

Written from the docs (dead-man-chain.md, outcomes.md) and the manuals' tables, and shares no code with the
bridge. It sees what a technician with an analyser at each end sees: frames, what controllers have sent, what
was done to the plant; and what the bridge says of it all.

A rule never demands more than is published. Where two things happen at once, the bridge may have seen either
first, and both are right.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from typing import Final, NamedTuple

from tests.proof.board import NUMBERS
from tests.proof.drives import TPDO_MS, Drive
from tests.proof.settings import PLANT, REACTION_MS

_WIRE_S: Final = 0.01
"""Frames that wait for the wire, and those that go before them."""
_KERNEL_S: Final = 0.002
"""Each period of the kernel's is a little longer than it should be."""
REACTION_S: Final = (PLANT.rpdo_period_ms + REACTION_MS) / 1000 + _WIRE_S
_SILENT_S: Final = 3 * PLANT.rpdo_period_ms / 1000
_SEEN_S: Final = 0.02
"""Frames that were on their way when the bus went off."""
_GONE_S: Final = 0.5
"""A bridge that is in charge is never silent for so long."""
_TURN_S: Final = 0.3
"""Two bridges that begin at once may both act for a period of the heartbeat."""
_BETWEEN_S: Final = 0.05
_KEPT: Final = 200
_AGE_S: Final = 0.7
"""Longest time for which a value that is no longer told may be good: a TPDO comes each 0.3 s."""
_GRAIN_S: Final = 0.026
"""A controller whose silence is longer than its time-out by less than this may be taken for late or not
(docs: 25 ms on the way)."""


START: Final = -1
"""In place of a word: the command to start, by which the bridge itself leads the drive through its states."""
ALIVE: Final = -2
"""A telegram that says nothing."""


class Telegram(NamedTuple):
    at: float
    """When it reached the bridge's machine."""
    word: int


@dataclass(slots=True)
class Track:
    """What is known of one drive. ``since``: what its controller has sent before does not move it any more;
    frames that enable it may be on the wire until ``until``. ``why`` says what has happened then."""

    drive: Drive
    telegrams: deque[Telegram] = field(default_factory=lambda: deque[Telegram](maxlen=_KEPT))
    since: float = -inf
    until: float = -inf
    why: str = "the bridge has just started"
    needs_acknowledge: bool = False
    said: deque[tuple[float, int]] = field(default_factory=lambda: deque[tuple[float, int]](maxlen=_KEPT))
    """Status words that the drive has sent, with their times."""
    setpoints: deque[tuple[float, int]] = field(
        default_factory=lambda: deque[tuple[float, int]](maxlen=_KEPT)
    )
    """Setpoints that the bridge has sent, with their times."""
    stops: deque[float] = field(default_factory=lambda: deque[float](maxlen=_KEPT))
    """Times of RPDOs that do not enable."""
    stop_word: int = 0
    """Control word of the last of them."""
    enabled_at: float = -inf
    """When the last frame that enables it was on the wire."""
    worst_s: float = inf
    """Published time from its controller's last telegram to the last frame that enables it."""
    bridge_s: float = inf
    """Published time in which it stops by itself where the bridge is dead."""

    last_at: float = -inf
    """When its controller's last telegram came."""
    is_owned: bool = False
    """Its controller's setpoint was on the wire, and it has not gone since."""
    intruded_at: float = -inf
    """When somebody else has last commanded it, or its node."""
    left_at: float = -inf
    """When it went: until its next telegram the bus goes on with what it has said."""
    released_at: float = -inf
    """When it has released the drive: its silence is no fault from then on."""
    is_strangers: bool = False
    """The last setpoint on the wire was a stranger's, who has taken it over in a time without an owner."""
    shared_until: float = -inf
    """By then somebody else at its controller's address, who is the same owner, has left."""
    is_acknowledged: bool = False
    is_primed: bool = False
    """Its controller has sent a word that does not enable, since ``since``."""
    is_armed: bool = False
    """And then one that does: it has asked for what enables the drive."""

    def has_said(self, word: int, since: float) -> bool:
        """Whether the drive has sent this status word since then."""
        for at, said in reversed(self.said):
            if at < since:
                return False
            if said == word:
                return True
        return False

    def sent_since(self, setpoint: int | None, since: float, until: float = inf) -> float:
        """When the bridge has last sent this setpoint, of these times."""
        for at, sent in reversed(self.setpoints):
            if at < since:
                break
            if sent == setpoint and at < until:
                return at
        return -inf

    def started_after(self, since: float) -> float:
        """When its controller has first commanded a start since then."""
        return min((one.at for one in self.telegrams if one.word == START and one.at >= since), default=inf)

    def take(self, telegram: Telegram) -> None:
        self.telegrams.append(telegram)
        self.last_at = telegram.at
        self._look_at(telegram.word)

    def _look_at(self, word: int) -> None:
        family = self.drive.family
        mask, value = family.enabling
        if word in (START, ALIVE):
            self.is_primed |= word == START
            self.is_armed |= word == START and (self.is_acknowledged or not self.needs_acknowledge)
            return
        self.is_acknowledged |= bool(word & family.acknowledge & ~family.ready)
        if word & mask != value:
            self.is_primed = True
        elif self.is_primed and (self.is_acknowledged or not self.needs_acknowledge):
            self.is_armed = True

    def begin_anew(self, since: float, *, needs_acknowledge: bool) -> None:
        """What its controller has sent before ``since`` does not count any more."""
        self.needs_acknowledge &= not self.is_acknowledged
        self.needs_acknowledge |= needs_acknowledge
        self.since = since
        self.is_acknowledged = self.is_primed = self.is_armed = False
        for telegram in self.telegrams:
            if telegram.at >= since:
                self._look_at(telegram.word)


class Oracle:
    """``violations`` has what is wrong, in sentences with times."""

    def __init__(self, drives: list[Drive]) -> None:
        self.tracks = {drive: Track(drive) for drive in drives}
        self._of_rpdo = {drive.rpdo: track for drive, track in self.tracks.items()}
        self._of_tpdo = {drive.tpdo: track for drive, track in self.tracks.items()}
        self._of_setpoint = {drive.number_id: track for drive, track in self.tracks.items()}
        self.violations: list[str] = []
        self.on_trip: Callable[[Drive, float, float], None] = lambda drive, since, due: None
        """Called with a drive whose controller was silent for too long, and from when to when it may trip."""
        self.on_stop: Callable[[Drive, float], None] = lambda drive, at: None
        """Called with a drive that is told to stop, and was told to run before."""
        self.looks = 0
        """How many frames and values were judged."""
        self._still_since = inf
        self._deadman_s = PLANT.deadman_ms / 1000
        self._late_at = -inf
        """When the bridge went on after a pause that it may have taken for a hang, which ends all time-outs:
        it counts from its last round."""
        self._pause = -inf, -inf
        """Begin and end of the bridge's last pause, or of several of them that follow each other closely."""
        self._other_since = self._other_at = -inf
        """First and last frame of another bridge, while it is in charge."""

    def wrong(self, at: float, text: str) -> None:
        """Note what is wrong at this time."""
        self.violations.append(f"{at - 1000.0:.3f} s: {text}")

    # what is told to it

    def published(self, drive: Drive, worst_ms: float | None, bridge_ms: float | None) -> None:
        """Times that the bridge promises; None where it promises none."""
        track = self.tracks[drive]
        track.worst_s = inf if worst_ms is None else worst_ms / 1000
        track.bridge_s = inf if bridge_ms is None else bridge_ms / 1000

    def telegram(self, drive: Drive, at: float, word: int) -> None:
        track = self.tracks[drive]
        if drive.reaction != "hold" and track.last_at > -inf:
            silent_s = at - track.last_at
            timeout_s = PLANT.fieldbus_timeout_ms / 1000
            was_running = track.enabled_at >= track.last_at > self._late_at
            is_released = track.released_at >= track.last_at
            if silent_s > timeout_s + _GRAIN_S and was_running and not is_released:
                # So it has tripped, whatever it gets now.
                trip = track.last_at + timeout_s
                if track.left_at < track.last_at:
                    self.on_trip(drive, trip, track.last_at + min(track.worst_s, silent_s))
                self._interrupt(track, trip, track.last_at + track.worst_s, "its controller was silent", True)
        track.take(Telegram(at, word))

    def _interrupt(
        self, track: Track, since: float, until: float, why: str, needs_acknowledge: bool = False
    ) -> None:
        if since < track.since:
            return
        track.begin_anew(since, needs_acknowledge=needs_acknowledge)
        track.until, track.why = max(until, track.until), why

    def interrupted(self, since: float, until: float, why: str, drives: list[Drive] | None = None) -> None:
        """Nothing that was sent before ``since`` moves these drives, or any, after ``until``."""
        for drive in self.tracks if drives is None else drives:
            self._interrupt(self.tracks[drive], since, until, why)

    def on_still(self, now: float) -> None:
        """The bridge's process stands still from now on."""
        self._still_since = now

    def on_going_on(self, since: float, now: float) -> None:
        self._still_since = inf
        # What came in a pause shortly before this one may be read after it.
        began = self._pause[0] if since < self._pause[1] + _BETWEEN_S else since
        self._pause = began, now
        if now - since > self._deadman_s / 2:
            self._late_at = now
        if now - since > self._deadman_s:
            # The bursts have ended then, and what was right before is not sent any more.
            self.interrupted(began, since + self._deadman_s + _KERNEL_S + _WIRE_S, "the bridge hung")
            self._forget_owners()

    def on_end(self, now: float) -> None:
        self._still_since = min(self._still_since, now)
        self.interrupted(self._still_since, now + _WIRE_S, "the bridge was killed")

    def started(self) -> None:
        self._still_since = inf
        self._forget_owners()
        for track in self.tracks.values():
            # Another process knows nothing of a trip, and of no telegram that it could miss.
            track.needs_acknowledge = False
            track.enabled_at = -inf

    def _forget_owners(self) -> None:
        """After a start and after a hang every drive waits for the next telegram, whoever sends it."""
        for track in self.tracks.values():
            track.is_owned = False

    def left(self, drive: Drive, at: float) -> None:
        """Its controller releases it, or has ended its connection."""
        track = self.tracks[drive]
        track.is_owned, track.left_at = False, at

    def released(self, drive: Drive, came: float, at: float) -> None:
        """Its controller has released it, which was answered well at this time."""
        self.tracks[drive].released_at = came
        self.interrupted(came, at + REACTION_S, "its controller released it", [drive])

    def shared(self, drive: Drive, until: float) -> None:
        """Somebody else at the address of its controller writes to it until then, over another connection."""
        self.tracks[drive].shared_until = until + PLANT.fieldbus_timeout_ms / 1000

    def bus_off(self, at: float) -> None:
        """The bridge's controller sends nothing. A bridge that stands still does not see it, and its bursts
        go on when it is over."""
        still_s = self._still_since + self._deadman_s if self._still_since < inf else at
        self.interrupted(at, max(at, still_s) + _SEEN_S, "the bus was off")

    def stop_answered(self, drive: Drive, came: float, at: float) -> None:
        """Somebody's stop, which was answered *ok*."""
        self.interrupted(came, at + REACTION_S, "somebody stopped it", [drive])

    def intruded(self, drive: Drive, at: float) -> None:
        """Somebody else commands the drive, or its node: nothing is known of what it does by that."""
        for track in self.tracks.values():
            if track.drive.node_id == drive.node_id:
                track.intruded_at = at

    # what it sees

    def frame_of_other(self, at: float, can_id: int, data: bytes) -> None:
        """A frame of another bridge, which no controller knows."""
        if at > self._other_at + _GONE_S:
            self._other_since = at
        self._other_at = at
        track = self._of_rpdo.get(can_id)
        if track is not None and track.drive.enabling(data):
            self.wrong(at, f"{track.drive.path} is enabled by a second bridge, which nobody commands")

    def frame(self, at: float, can_id: int, data: bytes, *, of_bridge: bool) -> None:
        if of_bridge:
            track = self._of_setpoint.get(can_id)
            if track is not None:
                self._setpoint(track, at, data)
            track = self._of_rpdo.get(can_id)
            if track is not None:
                self._command(track, at, data)
        else:
            track = self._of_tpdo.get(can_id)
            if track is not None:
                track.said.append((at, int.from_bytes(data[:2], "little")))

    def _setpoint(self, track: Track, at: float, data: bytes) -> None:
        drive = track.drive
        setpoint = drive.setpoint(data)
        if not setpoint:
            return
        track.setpoints.append((at, setpoint))
        if not drive.family.setpoint <= setpoint <= drive.family.setpoint + NUMBERS:
            # Also where the drive's scale was changed: its word stays (docs: ADR 12).
            self.wrong(at, f"{drive.path} gets a setpoint that nobody has sent: {data.hex()}")
        was_strangers = track.is_strangers
        track.is_strangers = setpoint >= drive.family.setpoint + NUMBERS
        is_there = track.is_owned and at <= track.last_at + PLANT.fieldbus_timeout_ms / 1000
        if track.is_strangers and is_there:
            self.wrong(at, f"{drive.path} got the setpoint of a stranger: {data.hex()}")
        track.is_owned = not track.is_strangers and track.last_at > track.left_at
        goes_on = not track.stops or track.stops[-1] < track.enabled_at
        if was_strangers and not track.is_strangers and goes_on and at < track.shared_until:
            # An identity goes on where its last connection was (docs: "Who owns a drive").
            track.is_armed = True

    def _command(self, track: Track, at: float, data: bytes) -> None:
        drive = track.drive
        self.looks += 1
        if not drive.enabling(data):
            latest = track.stops[-1] if track.stops else -inf
            # Who was told nothing for a while has been stopped by that.
            if track.enabled_at > max(latest, at - _SILENT_S):
                self.on_stop(drive, at)
            track.stops.append(at)
            track.stop_word = drive.control_word(data)
            return
        track.enabled_at = at
        if at < self._other_at + _TURN_S and at > self._other_since + _TURN_S:
            self.wrong(at, f"{drive.path} is enabled while another bridge is in charge")
        if at > self._still_since + self._deadman_s + _KERNEL_S + _WIRE_S:
            since = at - self._still_since
            self.wrong(at, f"{drive.path} is enabled {since * 1000:.0f} ms after the bridge fell silent")
        if track.is_strangers:
            return
        if drive.reaction != "hold" and at > track.last_at + track.worst_s + _WIRE_S:
            late_ms = (at - track.last_at) * 1000
            self.wrong(
                at,
                f"{drive.path} is enabled {late_ms:.0f} ms after its controller's last telegram; "
                f"{track.worst_s * 1000:.0f} ms are published",
            )
        if at > track.until and not track.is_armed:
            self.wrong(
                at, f"{drive.path} is enabled, and its controller has not asked for it since {track.why}"
            )

    def value(self, drive: Drive, at: float, word: int, older_s: float = 0.0) -> None:
        """The bridge says that this is the drive's status word, and that it is good; by ``older_s`` it may be
        older than in the bus process."""
        self.looks += 1
        track = self.tracks[drive]
        if not track.has_said(word, at - _AGE_S - older_s):
            last = (
                f"{track.said[-1][1]:04X} {(at - track.said[-1][0]) * 1000:.0f} ms ago"
                if track.said
                else "none"
            )
            self.wrong(
                at, f"{drive.path}: {word:04X} is said to be good, and the drive's last word is {last}"
            )

    def dead_for(self, drive: Drive, since: float, at: float) -> None:
        """The bridge has been silent since then for longer than the drive may need to see it."""
        track = self.tracks[drive]
        if at < since + track.bridge_s + TPDO_MS / 1000 + _WIRE_S or not track.said:
            return
        said_at, word = track.said[-1]
        mask, value = drive.family.enabled
        if track.intruded_at > since - PLANT.heartbeat_ms / 1000:
            return
        if said_at > since + track.bridge_s + TPDO_MS / 1000 and word & mask == value:
            self.wrong(
                at, f"{drive.path} still runs {(at - since) * 1000:.0f} ms after the bridge fell silent"
            )
