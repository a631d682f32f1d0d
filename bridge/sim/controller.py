"""The demo's controller: an ordinary zenoh client that takes a lease on a drive and moves it.

It knows nothing of the bridge but its keys. What it does is what any controller has to do: take
control, keep saying so, acknowledge when it was too late.
"""

from __future__ import annotations

import json
import logging
import math
import time
from typing import Final

import zenoh

_log = logging.getLogger(__name__)

_CYCLE_S: Final = 0.25
_TTL_MS: Final = 3000
_ANSWER_S: Final = 2.0
_WAVE_S: Final = 40.0
_RUN_S: Final = 60.0
_PAUSE_S: Final = 8.0
_IDENTITY: Final = json.dumps({"controller": "demo"})


class Controller:
    """Moves one drive, ``<prefix>/<site>/<drive>``, up to ``frequency_hz``."""

    def __init__(self, session: zenoh.Session, drive_key: str, frequency_hz: float) -> None:
        self._session = session
        self._key = drive_key
        self._frequency_hz = frequency_hz

    def ask(self, leaf: str, **payload: object) -> dict[str, object]:
        """One command; its outcome, or an error of our own where nobody answered."""
        replies = self._session.get(
            f"{self._key}/command/{leaf}",
            payload=json.dumps(payload),
            attachment=_IDENTITY,
            timeout=_ANSWER_S,
        )
        for reply in replies:
            answer = reply.ok.payload if reply.ok is not None else reply.err.payload if reply.err else None
            if answer is not None:
                return json.loads(answer.to_string())
        return {"ok": False, "code": "no_answer", "message": "nobody answered"}

    def run(self) -> None:
        """For ever: take control, run, pause. Whatever fails is tried again."""
        while True:
            if not self.ask("take_control", ttl_ms=_TTL_MS).get("ok"):
                time.sleep(1.0)
                continue
            self.ask("reset_fault")
            self.ask("control_word", v=0x047E)
            self._move()
            time.sleep(1.0)

    def _move(self) -> None:
        started = self.ask("start", direction=1)
        if not started.get("ok"):
            _log.info("%s: not started: %s", self._key, started.get("message"))
            return
        begin = time.monotonic()
        while (elapsed := time.monotonic() - begin) < _RUN_S:
            wave = 0.6 - 0.4 * math.cos(2 * math.pi * elapsed / _WAVE_S)
            if not self.ask("frequency", v=round(self._frequency_hz * wave, 2)).get("ok"):
                return
            time.sleep(_CYCLE_S)
        self.ask("stop")
        for _ in range(round(_PAUSE_S / _CYCLE_S)):
            if not self.ask("keep_alive").get("ok"):
                return
            time.sleep(_CYCLE_S)


def run_controller(endpoint: str, drive_key: str, frequency_hz: float) -> None:
    """Connect to the bridge at ``endpoint`` (``tcp/127.0.0.1:7447``) and move the drive until killed."""
    settings = {
        "mode": "client",
        "connect": {"endpoints": [endpoint]},
        "scouting": {"multicast": {"enabled": False}},
    }
    config = zenoh.Config.from_json5(json.dumps(settings))
    while True:
        try:
            with zenoh.open(config) as session:
                Controller(session, drive_key, frequency_hz).run()
        except zenoh.ZError as error:
            _log.info("%s: %s", endpoint, error)
            time.sleep(1.0)
