"""What the bridge owes to nodes: none but stopped words where one is lost or begins anew, a stop after it has
stood still and before it ends, an answer to who commands them beside it, and silence when it is dead.

Written from the docs (dead-man-chain.md).
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from math import inf
from typing import Final

from tests.plant.oracle import REACTION_S, Oracle, Track
from tests.proof.drives import Drive
from tests.proof.settings import PLANT

_NMT: Final = 0x000
_SYNC: Final = 0x080
_ERROR_CONTROL: Final = range(0x701, 0x780)
_START, _STOP, _PRE_OPERATIONAL = 0x01, 0x02, 0x80
_OPERATIONAL: Final = 0x05
_CANCELS: Final = (_STOP, _PRE_OPERATIONAL, 0x82)
"""NMT commands that leave Operational with drives that may go on as they were told."""
_HALTS: Final = (_STOP, 0x81, 0x82)
"""NMT commands after which a node does not move its drives: stop and the resets."""
_DEADMAN_S: Final = PLANT.deadman_ms / 1000
_JUST_S: Final = 0.3
_STOPS_S: Final = 0.1
"""By then a drive that is told to run has said that it does."""
_HEARD_S, _GONE_S, _IN_CHARGE_S = 0.2, 0.5, 3.0
"""A bridge in charge sends at least each 0.1 s; so long after a silence somebody else may have taken over."""
_OWES_S: Final = 0.5
_PASSIVE_S: Final = 6.5
"""So long after it has begun, has failed or has given way a bridge may listen, and sends nothing: it takes an
intruder's RPDO for one of a bridge in charge."""
_ANSWERS_S: Final = 1.5
"""By then each frame of an intruder is answered, also one that brings nothing back."""


@dataclass(frozen=True, slots=True)
class _Owed:
    """Something that has to be so by ``due``; excused where the bridge has failed since ``since``."""

    since: float
    due: float
    is_done: Callable[[], bool]
    text: str


class Debts:
    """Judge of what nodes get. What is wrong goes to the oracle's violations."""

    def __init__(self, oracle: Oracle) -> None:
        self._oracle = oracle
        self._of_rpdo = {track.drive.rpdo: track for track in oracle.tracks.values()}
        self._of_node: dict[int, list[Track]] = {}
        for track in oracle.tracks.values():
            self._of_node.setdefault(track.drive.node_id, []).append(track)
        self._signs: dict[int, float] = {}
        self._states: dict[int, int] = {}
        self._sync_at = -inf
        self._began_anew: dict[int, float] = {}
        self._gave_way_at = -inf
        self._commands: deque[tuple[float, int, int, bool]] = deque(maxlen=400)
        """NMT commands: when, which, to whom, and whether by the bridge."""
        self._owed: list[_Owed] = []
        self._disturbed_at = -inf
        self._still_since, self._went_on_at = inf, -inf
        self._ending_since = inf
        self._is_new = False
        self._ours_at = self._ours_since = -inf
        """Last frame of the bridge, and the first since it was silent."""
        self.is_quiet: Callable[[], bool] = lambda: True
        """Whether frames reach everybody."""

    # what happens

    def disturbed(self, at: float) -> None:
        """The bridge stands still, begins, ends, has no bus or is not in charge."""
        self._disturbed_at = at

    def on_still(self, now: float) -> None:
        self._still_since = now

    def on_going_on(self, since: float, now: float) -> None:
        self._still_since, self._went_on_at = inf, now
        if now - since < _DEADMAN_S + 0.05 or not self.is_quiet():
            return
        for track in self._oracle.tracks.values():
            was_enabled = track.enabled_at > since - _JUST_S and track.intruded_at < since - 3.0
            if was_enabled and not _is_silenced(track, now):
                self._owe_stop(track, since, now, "the bridge has hung")

    def _owe_stop(self, track: Track, since: float, now: float, why: str) -> None:
        def is_done() -> bool:
            # A node that started anew just before has ended the debt, though the bursts went on.
            told = any(at >= since for at in track.stops)
            # A bridge that gives way owes nothing to a drive that it has seen stopped.
            is_stopped = self._gave_way_at >= since and _has_followed(track)
            return told or is_stopped or self._was_halted(track.drive.node_id, since - _JUST_S)

        text = f"{track.drive.path} gets no stop though {why}"
        self._owed.append(_Owed(now, now + _OWES_S, is_done, text))

    def on_end(self, now: float) -> None:
        self._still_since = min(self._still_since, now)
        self._ending_since = inf

    def started(self) -> None:
        self._still_since, self._is_new = inf, True

    def ending(self, at: float) -> None:
        """The service is told to end."""
        self._ending_since = at

    def ended(self, at: float) -> None:
        """It is about to close its buses: by now it has stopped what it had enabled. What silence is to stop
        gets nothing even then: a trip outlasts it."""
        since = self._ending_since
        for track in self._oracle.tracks.values():
            # One whose owner has just stopped it has been told.
            is_told = any(when > track.enabled_at for when in track.stops) or _is_silenced(track, at)
            if track.enabled_at > since - _JUST_S and self.is_quiet() and self._disturbed_at < since - 1.0:
                self._oracle.looks += 1
                if not (is_told or self._was_halted(track.drive.node_id, since)):
                    self._oracle.wrong(at, f"{track.drive.path} gets no stop though the service ends")

    def gives_way(self, since: float, back: float) -> None:
        """A frame of a second bridge waits for one that has stood still since then. A drive that has said
        since its stop that it is not enabled is owed none (docs: the debt ends when it has reported so)."""
        self._gave_way_at = back
        for node_id, tracks in self._of_node.items():
            enabled_at = max((one.enabled_at for one in tracks if not _has_followed(one)), default=-inf)
            if enabled_at > since - _JUST_S and not self._was_halted(node_id, enabled_at):
                text = f"node {node_id} gets no NMT stop before the bridge gives way"
                is_done = partial(self._was_halted, node_id, since - _JUST_S)
                self._owed.append(_Owed(back, back + _OWES_S, is_done, text))

    def intruded(self, drive: Drive, how: str, at: float) -> None:
        """Somebody sends a frame beside the bridge that has its node stopped."""
        since, text = at - 1.0, f"an intruder's {how} at {drive.path} is not answered"
        if not self._may_listen(at):
            is_done = lambda: self._was_halted(drive.node_id, since) or self._may_listen(at)  # noqa: E731
            self._owed.append(_Owed(at, at + _ANSWERS_S, is_done, text))

    def master_left(self, drive: Drive, at: float) -> None:
        """One that has started a node again and again has ended: the last word is the bridge's."""

        is_done = partial(self.is_halted, drive.node_id)
        text = f"the node of {drive.path} was started by an intruder, and nobody stops it"
        if not self._may_listen(at):
            self._owed.append(_Owed(at, at + _OWES_S, is_done, text))

    def _may_listen(self, at: float) -> bool:
        return at < max(self._disturbed_at, self._gave_way_at) + _PASSIVE_S

    def deaf(self, drive: Drive, since: float, seconds: float) -> None:
        """It does not hear its RPDOs: where it is told to stop, its node has to be stopped by then."""

        def is_done() -> bool:
            return not self.ignores(drive, since) or self._was_halted(drive.node_id, since)

        text = f"{drive.path} ignores its stop, and its node goes on"
        self._owed.append(_Owed(since, since + seconds, is_done, text))

    def ignores(self, drive: Drive, since: float) -> bool:
        """Whether the drive was told to stop since then, and has not said anything but that it is enabled."""
        track = self._oracle.tracks[drive]
        mask, value = drive.family.enabled
        told = any(at > since for at in track.stops)
        return (
            told and bool(track.said) and all(word & mask == value for at, word in track.said if at > since)
        )

    def is_operational(self, node_id: int) -> bool:
        """Whether the node has said so last, and has not been told otherwise by the bridge."""
        return self._states.get(node_id) == _OPERATIONAL and not self.is_halted(node_id)

    def is_halted(self, node_id: int) -> bool:
        """Whether the last word to it is a stop of the bridge's."""
        last = [one for one in self._commands if one[2] in (0, node_id)]
        return bool(last) and last[-1][3] and last[-1][1] in _HALTS

    def _was_halted(self, node_id: int, since: float) -> bool:
        """Whether it was told to stop since then, or has started anew."""
        if self._began_anew.get(node_id, -inf) >= since:
            return True
        return any(
            at >= since and is_ours and command in _HALTS and to in (0, node_id)
            for at, command, to, is_ours in self._commands
        )

    # what it sees

    def frame(self, at: float, can_id: int, data: bytes, who: str) -> None:
        """``who`` is "bridge", "node", or somebody else."""
        if who == "node":
            if can_id in _ERROR_CONTROL:
                self._sign(can_id - 0x700, at, data)
            return
        if can_id == _NMT and len(data) == 2:
            self._commands.append((at, data[0], data[1], who == "bridge"))
            if who == "bridge" and data[0] in _CANCELS:
                self._leaves(at, data[1])
        if who == "bridge":
            self._of_bridge(at, can_id, data)

    def _leaves(self, at: float, node_id: int) -> None:
        """The bridge takes a node out of operation: a stop that waits for SYNC is taken over before."""
        if self._states.get(node_id) != _OPERATIONAL or not self.is_quiet() or self._disturbed_at > at - 1.0:
            return
        for track in self._of_node.get(node_id, []):
            mask, value = track.drive.family.enabled
            is_enabled = track.said and track.said[-1][1] & mask == value and track.said[-1][0] > at - 0.4
            told = next((stop for stop in track.stops if stop > track.enabled_at), inf)
            if track.drive.syncs and is_enabled and self._sync_at < told < inf:
                self._oracle.looks += 1
                self._oracle.wrong(at, f"{track.drive.path} has its node stopped before SYNC brings its stop")

    def _sign(self, node_id: int, at: float, data: bytes) -> None:
        self._signs[node_id] = at
        self._states[node_id] = data[0] & 0x7F if data else 0
        if data[:1] == b"\0":
            self._began_anew[node_id] = at
        if data[:1] == b"\0" and self.is_quiet():
            drives = [track.drive for track in self._of_node.get(node_id, [])]
            ends = self._still_since + _DEADMAN_S if self._still_since < inf else at
            self._oracle.interrupted(at, max(at, ends) + REACTION_S, "its node has started anew", drives)

    def frame_of_other(self, at: float, can_id: int) -> None:
        """A frame of another bridge: it has to listen to one that is in charge, and does."""
        is_there = at < self._ours_at + _HEARD_S and self._ours_at > self._ours_since + _IN_CHARGE_S
        if is_there and self.is_quiet():
            self._oracle.wrong(at, f"another bridge sends {can_id:03X}h beside the one in charge")

    def _of_bridge(self, at: float, can_id: int, data: bytes) -> None:
        if at > self._ours_at + _GONE_S:
            self._ours_since = at
        self._ours_at = at
        if can_id == _SYNC:
            self._sync_at = at
        if self._is_new:
            self._is_new = False
            self._first_frame(at)
        if at > self._still_since + _DEADMAN_S + REACTION_S:
            self._oracle.wrong(at, f"a dead bridge sends {can_id:03X}h")
        track = self._of_rpdo.get(can_id)
        if track is None or not track.drive.enabling(data):
            return
        drive = track.drive
        if at > self._ending_since + REACTION_S:
            self._oracle.wrong(at, f"{drive.path} is enabled by a service that ends")
        sign = self._signs.get(drive.node_id, at)
        lost_at = sign + drive.family.lost_after_ms / 1000
        # One that stood still then has not seen it, and its bursts go on.
        stands_still = self._still_since < lost_at + REACTION_S
        seen_at = self._still_since + _DEADMAN_S if stands_still else max(lost_at, self._went_on_at)
        if at > seen_at + REACTION_S:
            self._oracle.wrong(at, f"{drive.path} is enabled, and its node is silent for {at - sign:.3f} s")

    def _first_frame(self, at: float) -> None:
        """A bridge that has started begins with stops (docs: "A restarted bridge")."""
        for track in self._oracle.tracks.values():
            mask, value = track.drive.family.enabled
            runs = track.said and track.said[-1][1] & mask == value and track.said[-1][0] > at - 1.0
            if runs and self.is_quiet():
                self._owe_stop(track, at, at, "it runs as the bridge starts")

    def look(self, now: float, *, is_still: bool) -> None:
        """Judge what is due by ``now``."""
        if is_still:
            self._disturbed_at = now
        due = [owed for owed in self._owed if owed.due <= now]
        self._owed = [owed for owed in self._owed if owed.due > now]
        for owed in due:
            self._oracle.looks += 1
            if self._disturbed_at <= owed.since and self.is_quiet() and not owed.is_done():
                self._oracle.wrong(owed.due, f"{owed.text}, since {owed.since - 1000.0:.3f} s")


def _is_silenced(track: Track, at: float) -> bool:
    """Whether silence may be what stops it."""
    trips_at = track.last_at + PLANT.fieldbus_timeout_ms / 1000
    return track.drive.reaction == "silence" and at > trips_at - _JUST_S


def _has_followed(track: Track) -> bool:
    """Whether the drive has said that it is not enabled, since the stop that it was told last, or since the
    last word that enables it: it has stopped by itself then."""
    told = next((at for at in track.stops if at > track.enabled_at), track.enabled_at + _STOPS_S)
    mask, value = track.drive.family.enabled
    return any(at > told and word & mask != value for at, word in track.said)
