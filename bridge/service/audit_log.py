"""The audit log of the service: entries of the plant as JSON lines (``docs/reference/audit-log.md``)."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Final, cast

import msgspec

from bridge.base.guard import Guard
from bridge.base.line_file import LineFile
from bridge.command import Event, EventKind, Plant
from bridge.command.audit import AuditEntry
from bridge.config import Site
from bridge.image import Value
from bridge.text import Text, as_json

_PERIOD_S: Final = 0.5
_LONGEST_TEXT: Final = 300
"""Longest text, characters: callers on the network may send anything, longer ones are cut."""
_encode = msgspec.json.Encoder().encode


def as_line(entry: AuditEntry, epoch_ns: int) -> bytes:
    """One line with its line break, ASCII except for names that clients give themselves."""
    who, ending = entry.identity, entry.ending
    seconds, ns = divmod(epoch_ns, 1_000_000_000)
    at = datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%dT%H:%M:%S")
    line: dict[str, object] = {
        "t": f"{at}.{ns // 1000:06d}Z",
        "mono": round(entry.time, 6),
        "source": who.source.label,
    }
    # Empty where one line stands for several requests that differ in it.
    where_known: dict[str, object] = {
        "user": _cut(who.user),
        "role": who.role.name.lower() if who.user else None,
        "target": _cut(entry.target),
        "action": _cut(entry.action),
        "code": ending.code,
        "forwarded": ending.forwarded,
        "address": _cut(who.address),
        "old": {_cut(leaf): _shown(value) for leaf, value in entry.old.items()},
        "new": {_cut(leaf): _shown(value) for leaf, value in entry.new.items()},
        "message": _cut(ending.message),
        "text": _all_cut(as_json(ending.said)),
        "count": entry.count if entry.count != 1 else None,
    }
    known = {key: value for key, value in where_known.items() if value or value is False}
    return _encode(line | known) + b"\n"


def _cut(text: str) -> str:
    # A lone surrogate has no UTF-8.
    text = text.encode("utf-8", "replace").decode("utf-8")
    return text if len(text) <= _LONGEST_TEXT else f"{text[:_LONGEST_TEXT]}…"


def _all_cut(told: object) -> object:
    """JSON with each of its strings cut."""
    match told:
        case str():
            return _cut(told)
        case dict():
            facts = cast("dict[str, object]", told)
            return {name: _all_cut(one) for name, one in facts.items()}
        case list():
            return [_all_cut(one) for one in cast("list[object]", told)]
        case _:
            return told


def _shown(value: Value) -> Value:
    return _cut(value) if isinstance(value, str) else value


class AuditLog:
    """Writes all requests to ``plant``. ``clock`` is monotonic, ``epoch`` turns such a time into ns since
    1970 UTC. Lost lines are counted in ``bridge/audit_lost``.

    ``refused`` takes what was refused, so that a client that is refused again and again pushes nothing out of
    ``file``.
    """

    def __init__(
        self, plant: Plant, site: Site, clock: Callable[[], float], epoch: Callable[[float], int]
    ) -> None:
        settings = site.audit
        self._plant = plant
        self._clock = clock
        self._epoch = epoch
        self._guard = Guard("audit log")
        path = Path(settings.file) if settings.file else Path(site.site.state_dir) / "audit.jsonl"
        self.file = LineFile(path, settings.max_bytes, settings.keep)
        refused = path.with_name(f"{path.stem}-refused{path.suffix}")
        self.refused = LineFile(refused, settings.max_bytes, settings.keep)
        self._files = (self.file, self.refused)
        self._faults = ["" for _ in self._files]
        self._settings = settings
        plant.set("bridge/audit_lost", 0, plant.began)

    def start(self) -> None:
        if self._settings.enabled:
            for file in self._files:
                file.start()
            every = self._settings.every_telegram
            self._plant.audit.tell_to(self._on_entry, every_telegram=every)

    def close(self) -> None:
        if self._settings.enabled:
            self._plant.audit.sum_up(self._clock())
            self._plant.audit.tell_to(None)
            for file in self._files:
                file.close()

    async def run(self) -> None:
        """Write summaries and report lost lines, until cancelled."""
        while True:
            await asyncio.sleep(_PERIOD_S)
            self.look(self._clock())

    def look(self, now: float) -> None:
        self._plant.audit.on_time(now)
        self._plant.set(
            "bridge/audit_lost", sum(file.all_lost for file in self._files) + self._guard.faults, now
        )
        for place, file in enumerate(self._files):
            fault = file.fault
            if fault != self._faults[place]:
                self._faults[place] = fault
                self._tell(file, fault, now)

    def _tell(self, file: LineFile, fault: str, now: float) -> None:
        severity, said = 300, Text.of("audit.written_again", lost=file.all_lost)
        if fault:
            severity = 600
            said = Text.of("audit.not_written", file=str(file.path), error=Text.plain(fault))
        self._plant.report(Event(now, EventKind.CONFIGURATION, "bridge", severity, said))

    def _on_entry(self, entry: AuditEntry) -> None:
        file = self.refused if entry.is_refused else self.file
        # The caller gets its outcome, whatever becomes of the line.
        with self._guard:
            file.put(as_line(entry, self._epoch(entry.time)))
