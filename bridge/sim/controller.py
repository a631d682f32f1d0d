"""The demo's controller: an ordinary zenoh client that takes leases on drives and moves them.

It knows only the bridge's keys. It does what any controller has to do: take control, keep writing, and
acknowledge if it was too late.
"""

from __future__ import annotations

import json
import logging
import math
import threading
import time
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

import zenoh

_log = logging.getLogger(__name__)

_CONNECTS_MS: Final = 30_000
"""After which it is said that nobody answers."""

_TTL_MS: Final = 3000
_ANSWER_S: Final = 5.0
"""A start may take three seconds."""
_WAVE_S: Final = 40.0
_MOST_LOOKS: Final = 4
"""Cycles in which a drive that has been started is not enabled; a telegram may have come late."""
_IDENTITY: Final = json.dumps({"controller": "demo"})


@dataclass(frozen=True, slots=True)
class Times:
    """Times in seconds; ``cycle_s`` is the longest silence and shorter than the drive's watchdog time."""

    cycle_s: float = 0.25
    run_s: float = 60.0
    pause_s: float = 8.0
    retry_s: float = 1.0
    away_s: float = 60.0
    """Time in seconds for which a drive that somebody else has stopped is left to others."""


@dataclass(frozen=True, slots=True)
class Move:
    """Movement of one drive: ``drive_key`` is ``<prefix>/<site>/<drive>``, ``value`` its setpoint
    (``frequency``), ``most`` the highest value, in the setpoint's unit."""

    drive_key: str
    value: str
    most: float

    @classmethod
    def from_text(cls, text: str) -> Move:
        """Movement of ``drives/demo/fan/drive/command/velocity=1500``. Raises ValueError for anything
        else."""
        key, _, most = text.rpartition("=")
        drive_key, _, value = key.rpartition("/command/")
        if not drive_key:
            raise ValueError(f"{text!r} is not written as <drive>/command/<value>=<number>")
        return cls(drive_key, value, float(most))

    def __str__(self) -> str:
        return f"{self.drive_key}/command/{self.value}={self.most:g}"


class Controller:
    """Moves one drive."""

    def __init__(self, session: zenoh.Session, move: Move, times: Times | None = None) -> None:
        self._times = times or Times()
        self._session = session
        self._move = move
        self._key = move.drive_key

    def ask(self, leaf: str, **payload: object) -> dict[str, object]:
        """Send one command; returns its outcome, or an error of our own if nobody answered."""
        return self._get(f"{self._key}/command/{leaf}", json.dumps(payload))

    def _get(self, key: str, payload: str | None = None) -> dict[str, object]:
        """A command if it has a payload."""
        for reply in self._session.get(key, payload=payload, attachment=_IDENTITY, timeout=_ANSWER_S):
            answer = reply.ok.payload if reply.ok is not None else reply.err.payload if reply.err else None
            # A query that nobody answers is answered by zenoh itself, in plain text.
            with suppress(json.JSONDecodeError):
                if answer is not None:
                    return json.loads(answer.to_string())
        return {"ok": False, "code": "no_answer", "message": "nobody answered"}

    def run(self) -> None:
        """For ever, round after round."""
        while True:
            self.run_once()

    def run_once(self) -> bool:
        """Take control, run, pause. False: it was too early or something failed, so try again."""
        if not (self._node_is_operational() and self.ask("take_control", ttl_ms=_TTL_MS).get("ok")):
            time.sleep(self._times.retry_s)
            return False
        self.ask("reset_fault")
        self.ask("disable_voltage")
        return self._run() or self._hold(self._times.retry_s)

    def _node_is_operational(self) -> bool:
        node_key = self._key.rpartition("/")[0]
        return self._get(f"{node_key}/node/state").get("s") == "operational"

    def _run(self) -> bool:
        started = self.ask("start", direction=1)
        if not started.get("ok"):
            _log.info("%s: not started: %s", self._key, started.get("message"))
            return False
        begin = time.monotonic()
        looks = 0
        while (elapsed := time.monotonic() - begin) < self._times.run_s:
            wave = 0.6 - 0.4 * math.cos(2 * math.pi * elapsed / _WAVE_S)
            if not self.ask(self._move.value, v=round(self._move.most * wave, 2)).get("ok"):
                return False
            looks = 0 if self._is_enabled() else looks + 1
            if looks == _MOST_LOOKS:
                self._give_way()
                return False
            time.sleep(self._times.cycle_s)
        self.ask("stop")
        return self._hold(self._times.pause_s)

    def _is_enabled(self) -> bool:
        return self._get(f"{self._key}/status/state").get("s") == "operation_enabled"

    def _give_way(self) -> None:
        """Leave a drive alone that somebody else has stopped or that has a fault, while another has it."""
        self.ask("release_control")
        end = time.monotonic() + self._times.away_s
        while time.monotonic() < end:
            if self._get(f"{self._key}/supervision/owner").get("v"):
                end = time.monotonic() + self._times.away_s
            time.sleep(self._times.retry_s)

    def _hold(self, duration_s: float) -> bool:
        """Wait as the drive's owner, which must keep writing lest the watchdog trip."""
        end = time.monotonic() + duration_s
        while time.monotonic() < end:
            if not self.ask("keep_alive").get("ok"):
                time.sleep(self._times.retry_s)
                return False
            time.sleep(self._times.cycle_s)
        return True


def run_controller(endpoint: str, moves: Sequence[Move]) -> None:
    """Connect to the bridge at ``endpoint`` (``tcp/127.0.0.1:7447``) and move the drives until killed.

    Each drive has a thread of its own: one that is slow to start must not delay the others' telegrams.
    """
    session = _connect(endpoint)
    threads = [threading.Thread(target=_keep_moving, args=(session, move), daemon=True) for move in moves]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def _connect(endpoint: str) -> zenoh.Session:
    settings = {
        "mode": "client",
        # The front that serves zenoh starts beside this controller: zenoh tries again by itself.
        "connect": {"endpoints": [endpoint], "timeout_ms": _CONNECTS_MS},
        "scouting": {"multicast": {"enabled": False}},
    }
    config = zenoh.Config.from_json5(json.dumps(settings))
    while True:
        try:
            return zenoh.open(config)
        except zenoh.ZError as error:
            _log.info("%s: %s", endpoint, error)
            time.sleep(1.0)


def _keep_moving(session: zenoh.Session, move: Move) -> None:
    controller = Controller(session, move)
    while True:
        try:
            controller.run()
        except zenoh.ZError as error:
            _log.info("%s: %s", move.drive_key, error)
            time.sleep(1.0)
