"""How drives stop: by the reaction of the site file, without setpoints, and for no other reason than one that
the docs name.

Written from the docs (dead-man-chain.md) and the manuals' tables. A plant in which something else goes on is
not judged: a drive whose owner is silent while its bus is cut may have been stopped for either.
"""

from __future__ import annotations

from math import inf
from typing import Final

from tests.plant.oracle import REACTION_S, Oracle, Track
from tests.plant.world import BEGIN_S
from tests.proof.drives import Drive
from tests.proof.settings import PLANT

_TIMEOUT_S: Final = PLANT.fieldbus_timeout_ms / 1000
_EARLY_S: Final = 0.1
"""A telegram may count from a little before it came (docs: 25 ms), and comes between two rounds."""
_BURST_S: Final = 0.1
"""How long a stop breaks a silence."""
_WAY_S: Final = 0.15
"""How much later than its arrival a telegram may count (docs: 25 ms, and 100 ms on zenoh)."""
_NEXT_S: Final = 0.5
"""Words with a longer pause between them are two bursts."""
_CALM_S: Final = 6.0
"""So long after something has gone wrong everything is as usual again: nodes are booted, and drives run."""

_BEGINS_S: Final = 8.0
"""By then every drive moves."""


class Ways:
    """Judge of how drives stop. What is wrong goes to the oracle's violations."""

    def __init__(self, oracle: Oracle) -> None:
        self._oracle = oracle
        tracks = oracle.tracks.values()
        self._of_rpdo = {track.drive.rpdo: track for track in tracks}
        self._of_setpoint = {track.drive.number_id: track for track in tracks}
        self._enables: dict[Drive, bool] = {}
        self._calm_at = BEGIN_S + _BEGINS_S
        self._stop_asked: dict[Drive, float] = {}
        self._words: dict[Drive, dict[bytes, float]] = {}
        """What has broken the silence of each drive, with its times."""

    def excuse(self, until: float) -> None:
        """Something else may stop drives until then."""
        self._calm_at = max(self._calm_at, until + _CALM_S)

    def stop_asked(self, drive: Drive, at: float) -> None:
        """Somebody may have asked for a stop just now, whose answer is on its way."""
        self._stop_asked[drive] = at

    def stop_answered(self, drive: Drive, how: str, came: float, at: float, *, is_forwarded: bool) -> None:
        """``how`` was answered *ok*."""
        track = self._oracle.tracks[drive]
        is_first = not self._words.get(drive)
        if not is_forwarded and is_first and self._is_silenced(track, came) and self._is_silenced(track, at):
            self._oracle.wrong(at, f"{drive.path}: {how} was asked for in its silence, and was not forwarded")

    def frame(self, at: float, can_id: int, data: bytes) -> None:
        """A frame of the bridge."""
        track = self._of_rpdo.get(can_id)
        if track is not None:
            self._command(track, at, data)
        track = self._of_setpoint.get(can_id)
        if track is not None and track.drive.reaction not in ("hold", "silence"):
            is_over = self._is_judged(track, at) and at > track.last_at + _TIMEOUT_S + _WAY_S + REACTION_S
            if is_over and track.drive.setpoint(data):
                self._oracle.wrong(at, f"{track.drive.path} has tripped, and its setpoint is sent on")

    def _is_judged(self, track: Track, at: float) -> bool:
        """Its owner lets it run, or has been silent since it did; and nothing else goes on."""
        if min(track.last_at, at) <= self._calm_at or track.is_strangers or not track.telegrams:
            return False
        mask, value = track.drive.family.enabling
        asks = track.telegrams[-1].word & mask == value
        return asks and track.left_at < track.last_at and track.intruded_at + _CALM_S < track.last_at

    def _is_silenced(self, track: Track, at: float) -> bool:
        """Silence has begun that is to stop it."""
        is_silence = track.drive.reaction == "silence" and _TIMEOUT_S + 0.4 < track.worst_s < inf
        return (
            is_silence
            and self._is_judged(track, at)
            and at > track.last_at + _TIMEOUT_S + _WAY_S + REACTION_S
            and track.enabled_at >= track.last_at
        )

    def _command(self, track: Track, at: float, data: bytes) -> None:
        drive = track.drive
        was, enables = self._enables.get(drive, False), drive.enabling(data)
        self._enables[drive] = enables
        if self._is_silenced(track, at):
            self._in_silence(track, at, data)
            return
        self._words.pop(drive, None)
        stop_at = self._stop_asked.get(drive, -inf)
        if not was or enables or not self._is_judged(track, at) or stop_at > track.last_at - _CALM_S:
            return
        self._oracle.looks += 1
        silent_s = at - track.last_at
        if not self._says_enabled(track):
            return
        if silent_s < _TIMEOUT_S - _EARLY_S:
            self._oracle.wrong(at, f"{drive.path} is stopped for no reason, {data.hex()}")
        elif drive.reaction == "hold":
            self._oracle.wrong(at, f"{drive.path} is to hold, and is stopped, {data.hex()}")
        elif drive.reaction != "silence" and not drive.reacts(data):
            self._oracle.wrong(at, f"{drive.path} is to react by {drive.reaction}, and gets {data.hex()}")

    def _says_enabled(self, track: Track) -> bool:
        mask, value = track.drive.family.enabled
        return bool(track.said) and track.said[-1][1] & mask == value

    def _in_silence(self, track: Track, at: float, data: bytes) -> None:
        drive = track.drive
        self._oracle.looks += 1
        asked = self._stop_asked.get(drive, -inf)
        if at > asked + _BURST_S + REACTION_S + PLANT.deadman_ms / 1000:
            self._oracle.wrong(at, f"{drive.path} is to be silent, and gets {data.hex()}")
            return
        words = self._words.setdefault(drive, {})
        before = words.get(data, at)
        words[data] = at
        if at - before > _NEXT_S:
            self._oracle.wrong(at, f"{drive.path}: its silence is broken again by {data.hex()}")
