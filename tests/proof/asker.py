"""A zenoh client that owns nothing: to it, an answer says whether something was forwarded."""

from __future__ import annotations

import json
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Final, Self

from tests.proof.drives import DRIVES, PORTS, SERVERS

_LIMIT_S: Final = 5.0
_WHO: Final = json.dumps({"controller": "colleague"})


@dataclass(frozen=True, slots=True)
class Answer:
    """Of the bridge: ``code`` where it has refused (docs/reference/outcomes.md), with what it says to it."""

    forwarded: bool
    code: str
    message: str

    def __str__(self) -> str:
        said = self.code or ("forwarded" if self.forwarded else "not forwarded")
        return f"{said}: {self.message}" if self.message else said


class Asker:
    """One session; it is closed at the end of its ``with``."""

    def __init__(self) -> None:
        import zenoh

        settings = {
            "mode": "client",
            "connect": {"endpoints": [f"tcp/{SERVERS['zenoh']}:{PORTS['zenoh']}"], "timeout_ms": 2000},
            "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        }
        self._session: Any = zenoh.open(zenoh.Config.from_json5(json.dumps(settings)))
        self.refusals: list[str] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._session.close()

    def hear_refusals(self) -> None:
        """Events of refused requests are kept in ``refusals`` from now on, once the bridge knows of it."""
        self._refusals = self._session.declare_subscriber(
            "drives/proof/@/event/refused", lambda sample: self.refusals.append(sample.payload.to_string())
        )
        # What it says later comes after what it has said.
        self._ask(f"drives/proof/{DRIVES[0].path}/supervision/follows", None)

    def command(self, path: str, command: str) -> Answer:
        """``path`` is a drive's, or that of a node whose outputs it is."""
        return self._ask(f"drives/proof/{path}/command/{command}", "{}")

    def set_parameter(self, path: str, name: str, value: int) -> Answer:
        return self._ask(f"drives/proof/{path}/parameter/{name}", json.dumps({"v": value}))

    def _ask(self, key: str, payload: str | None) -> Answer:
        for reply in self._session.get(key, payload=payload, attachment=_WHO, timeout=_LIMIT_S):
            said = reply.ok or reply.err
            try:
                answer = json.loads(said.payload.to_string())
            except ValueError:
                # zenoh's own words: nobody has answered in time.
                continue
            if reply.err is not None or "ok" in answer:
                code = "" if answer.get("ok") else answer["code"]
                return Answer(bool(answer.get("forwarded")), code, answer.get("message", ""))
        return Answer(forwarded=False, code="no answer", message="")
