"""What requests are answered against what the wire carries: each has one answer, and it says what is so.

Written from the docs (outcomes.md, dead-man-chain.md). Where the bridge or its bus failed in between, an
answer may be older than what it says, and is not judged.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import inf
from typing import Final

from bridge.command import Outcome, Request, Write
from tests.plant.oracle import REACTION_S, Oracle, Track
from tests.proof.drives import TPDO_MS, Drive
from tests.proof.settings import PLANT

_ANSWER_S: Final = 10.0
"""Longest time to an answer: a start has 3 s, a parameter two more rounds of SDO."""
_NEVER_S: Final = 3.0
"""So long the wire is watched for what was not forwarded. Numbers of telegrams come again after eleven."""
_PERIOD_S: Final = PLANT.rpdo_period_ms / 1000
_ON_WIRE_S: Final = 0.03
"""A word is handed over a little before it is on the wire."""
_FOLLOWED: Final = 2
_STOPS: Final = ("stop", "quick_stop", "disable_voltage")
_GOT_S: Final = 1.0
"""So far apart are a refusal that is told and the answer that says so."""


Asking = tuple[str, int]
"""A request by the front that it came to, empty for the bus process itself, and its number there."""


@dataclass(frozen=True, slots=True)
class _Asked:
    """A request whose answer is still to come."""

    request: Request
    came: float


@dataclass(frozen=True, slots=True)
class _Claim:
    """What an answer says of the wire; it is judged at ``due``. ``setpoint``: that of a telegram that
    enables, None for a stop."""

    drive: Drive
    came: float
    answered: float
    due: float
    is_forwarded: bool
    said: str
    setpoint: int | None = None
    is_taken: bool = False
    """It was accepted, and not forwarded."""


class Answers:
    """Judge of answers. What is wrong goes to the oracle's violations."""

    def __init__(self, oracle: Oracle, drives: list[Drive]) -> None:
        self._oracle = oracle
        self._drives = {drive.path: drive for drive in drives}
        self._asked: dict[Asking, _Asked] = {}
        self._claims: list[_Claim] = []
        self._disturbed_at = -inf
        """When the bridge last stood still, ended, or lost its bus."""
        self._ended_at = self._front_at = -inf
        self._refused: dict[str, list[float]] = {}
        """When requests to each drive were answered by a refusal."""
        self._told: list[tuple[str, float]] = []
        """Refusals that an event has told, which somebody must have got."""
        self.is_quiet: Callable[[], bool] = lambda: True
        """Whether frames reach everybody."""

    # what happens

    def disturbed(self, at: float) -> None:
        """The bridge or its bus fails, or is back: answers of this moment say nothing of the wire."""
        self._disturbed_at = at

    def ended(self, at: float) -> None:
        """The bus process is gone, and with it the answers that it owed; a front answers for itself, and does
        not know what has become of what it had passed on."""
        self._asked = {asking: asked for asking, asked in self._asked.items() if asking[0]}
        self._ended_at = at
        self.disturbed(at)

    def front_disturbed(self, at: float) -> None:
        """The front stands still, goes on, or ends: answers are late, or lost."""
        self._front_at = at

    def refusal_told(self, target: str, at: float) -> None:
        """An event says that a request by a client of the front was refused."""
        self._told.append((target, at))

    def asked(self, asking: Asking, request: Request, at: float) -> None:
        self._asked[asking] = _Asked(request, at)

    def lost(self, asking: Asking) -> None:
        """Who asked has lost its connection: nobody owes it an answer."""
        self._asked.pop(asking, None)

    def shown(
        self, target: str, written: object, in_front: float | None, in_bridge: float | None, at: float
    ) -> None:
        """What the control word of a drive is in a front and in the bus process, as a telegram that wrote one
        is answered well."""
        self._oracle.looks += 1
        if in_front not in (None, written) and in_bridge == written:
            self._oracle.wrong(
                at, f"{target}: {written} was written, and its front shows {in_front} after the answer"
            )

    def answered(self, asking: Asking, outcome: Outcome, at: float) -> None:
        asked = self._asked.pop(asking, None)
        if asked is None:
            self._oracle.wrong(at, f"request {asking} is answered twice: {outcome.code}")
            return
        if not outcome.ok:
            self._refused.setdefault(asked.request.target, []).append(at)
        drive = self._drives.get(asked.request.target)
        if drive is None or asked.came <= self._ended_at:
            return
        command = asked.request.command
        said = f"{outcome.code}{'' if outcome.forwarded else ', not forwarded'}"
        is_sent = outcome.ok and outcome.forwarded
        if isinstance(command, Write):
            word, setpoint = command.values.get("control_word"), command.values.get("setpoint_1")
            mask, value = drive.family.enabling
            if isinstance(word, int) and isinstance(setpoint, int) and word & mask == value:
                is_taken = outcome.ok and not outcome.forwarded
                self._claim(drive, asked.came, at, is_sent, said, setpoint, is_taken=is_taken)
        elif command.action in _STOPS and outcome.ok and outcome.forwarded:
            self._claim(drive, asked.came, at, True, said, None)

    def refused(self, drive: Drive, setpoint: int, sent: float, at: float, code: int) -> None:
        """A Modbus exception as the answer to a telegram that enables, with this setpoint."""
        self._claim(drive, sent, at, False, f"exception {code:02X}h", setpoint)

    def parameter_read(
        self, drive: Drive, name: str, said: object, had: float, has: float, at: float
    ) -> None:
        """A parameter was read, which the drive had so when it was asked for, and has so now."""
        self._oracle.looks += 1
        if said != had == has:
            self._oracle.wrong(at, f"{drive.path}: {name} is read as {said}, and the drive has {has:g}")

    def _claim(
        self,
        drive: Drive,
        came: float,
        at: float,
        is_forwarded: bool,
        said: str,
        setpoint: int | None,
        *,
        is_taken: bool = False,
    ) -> None:
        due = at + (REACTION_S if is_forwarded else _NEVER_S)
        self._claims.append(_Claim(drive, came, at, due, is_forwarded, said, setpoint, is_taken))

    # judging

    def look(self, now: float, *, is_still: bool) -> None:
        """Judge what is due by ``now``; a bridge that stands still owes nothing."""
        if is_still:
            self._disturbed_at = now
        for asking, asked in list(self._asked.items()):
            if now - max(asked.came, self._disturbed_at) > _ANSWER_S:
                del self._asked[asking]
                self._oracle.wrong(now, f"{asked.request} has no answer for {_ANSWER_S:.0f} s")
        told = [one for one in self._told if one[1] + _GOT_S <= now]
        self._told = self._told[len(told) :]
        for target, at in told:
            self._look_for_refused(target, at)
        due = [claim for claim in self._claims if claim.due <= now]
        self._claims = [claim for claim in self._claims if claim.due > now]
        for claim in due:
            self._oracle.looks += 1
            if wrong := self._judged(claim, self._oracle.tracks[claim.drive]):
                asked = f"{claim.drive.path}, asked at {claim.came - 1000.0:.3f} s"
                self._oracle.wrong(claim.answered, f"{asked}: {claim.said!r}, and {wrong}")

    def _look_for_refused(self, target: str, at: float) -> None:
        self._oracle.looks += 1
        if at < max(self._disturbed_at, self._front_at) + _GOT_S:
            return
        if not any(abs(when - at) <= _GOT_S for when in self._refused.get(target, [])):
            self._oracle.wrong(at, f"{target}: a refusal is told that nobody has got")

    def _judged(self, claim: _Claim, track: Track) -> str:
        if not claim.is_forwarded:
            # What was taken and waits is what a start begins with; what was refused is gone.
            until = track.started_after(claim.came) if claim.is_taken else inf
            sent = track.sent_since(claim.setpoint, claim.came, until)
            return f"its setpoint is on the wire at {sent - 1000.0:.3f} s" if sent > claim.came else ""
        if self._disturbed_at >= claim.came - _PERIOD_S:
            return ""
        if claim.setpoint is None:
            is_there = any(claim.came <= at <= claim.due for at in track.stops)
            return "" if is_there else "no RPDO has told the drive to stop"
        is_overtaken = track.last_at > claim.came or track.since >= claim.came
        is_sent = track.sent_since(claim.setpoint, claim.came) >= claim.came
        if is_overtaken or is_sent or self._is_cut_off(claim, track):
            return ""
        return "its setpoint was not on the wire"

    def _is_cut_off(self, claim: _Claim, track: Track) -> bool:
        """The drive cannot be heard, and was stopped for that before a frame had the setpoint: what is done
        within a round is sent once, at its end."""
        is_told = any(claim.came <= at <= claim.due for at in track.stops)
        heard_at = max((at for at, _ in track.said if at <= claim.answered), default=-inf)
        return is_told and (not self.is_quiet() or heard_at < claim.answered - TPDO_MS / 1000)

    def last_stop(self, drive: Drive, at: float, before: float | None, said: float | None) -> None:
        """``supervision/last_stop`` as it was at the last look, and is now. A drive follows a ramp that it is
        on; what that looks like is its own."""
        if said != _FOLLOWED or before in (None, _FOLLOWED):
            return
        mask, value = drive.family.enabled
        track = self._oracle.tracks[drive]
        takes_voltage, off = drive.family.stops["disable_voltage"]
        if track.stop_word & takes_voltage != off:
            return
        # What it has said last counts however old it is: a bridge that has stood still hears it late.
        latest = [word for when, word in track.said if when >= at - 1.0] or [
            word for _, word in list(track.said)[-1:]
        ]
        if not any(word & mask != value for word in latest):
            self._oracle.wrong(at, f"{drive.path}: followed, and the drive has not said that it is stopped")

    def still_running(self, drive: Drive, told: float, at: float, said: float | None) -> None:
        """``supervision/last_stop`` shortly after the first word that stops the drive, at ``told``: what it
        has said before is no answer to it."""
        if said != _FOLLOWED or self._disturbed_at >= told - _PERIOD_S:
            return
        mask, value = drive.family.enabled
        self._oracle.looks += 1
        if not any(
            when >= told - _ON_WIRE_S and word & mask != value
            for when, word in self._oracle.tracks[drive].said
        ):
            self._oracle.wrong(at, f"{drive.path}: followed, and the drive has said nothing since its stop")
