"""The bridge's alarms: from its troubles to conditions, and what is kept of them.

An alarm is active while a trouble is at its place that nothing else explains; the worst of them speaks. What
a cause explains stands in the cause's alarm alone.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from datetime import datetime
from typing import Any, Final

import msgspec

from bridge.base.guard import Guard
from bridge.base.publishing_clock import next_publish
from bridge.condition.causes import SILENT_NODE
from bridge.condition.told import MOST
from bridge.northbound.opcua.alarms.alarm_contents import AlarmContents
from bridge.northbound.opcua.alarms.alarm_file import AlarmFile, is_worth_keeping, kept_alarm, state_of
from bridge.northbound.opcua.alarms.alarm_nodes import Alarm
from bridge.northbound.opcua.alarms.alarm_places import BRIDGE, CERTIFICATE, FRONT
from bridge.northbound.trouble_reader import TroubleReader
from bridge.uaserver.conditions.conditions import Conditions
from bridge.uaserver.filters.where import Fields

_SETTLE_S: Final = 10.0
"""Least time after a start, of this front or the bus process, for which an alarm that was active before stays
so although nothing is told of it yet."""
_LONGEST_SETTLE_S: Final = 120.0
_UPDATE_S: Final = 1.0
"""Least time between two events of an alarm that only says something else."""
_CAUSE_S: Final = 2.0
"""Age in seconds at which what is not heard is told: by then it is known whether its node or its bus is
silent, which explains it. Process data are missed before a node is."""
_SAVE_AFTER_S: Final = 2.0
_SAVE_AFTER_CALL_S: Final = 0.1
_LONG_AGO: Final = -1e9
_DEAD: Final = "bridge_dead"
_UNKNOWN: Final[dict[str, Any]] = {"kind": "", "facts": {}}
"""Trouble of an alarm whose file does not tell what it was."""
_CHECK_CERTIFICATE_S: Final = 3600.0
EXPIRATION_LIMIT_MS: Final = 30 * 86_400_000.0
"""Time for which an alarm says that the certificate runs out."""

_log = logging.getLogger(__name__)
_encode = msgspec.json.Encoder().encode
_decode = msgspec.json.Decoder(dict[str, Any]).decode

Trouble = Mapping[str, Any]


class _Speaking:
    """Trouble that an alarm was raised for. ``is_restored``: before this start, and not told again yet."""

    __slots__ = ("is_restored", "reason", "since", "told_at", "trouble")

    def __init__(self, trouble: Trouble, told_at: float, *, is_restored: bool) -> None:
        self.trouble = trouble
        self.reason = reason_of(trouble)
        self.since = trouble.get("since", 0)
        self.told_at = told_at
        self.is_restored = is_restored

    def is_for(self, trouble: Trouble) -> bool:
        """Whether ``trouble`` is what it was raised for, and not another time of it."""
        return self.reason == reason_of(trouble) and (
            self.is_restored or self.since == trouble.get("since", 0)
        )


def reason_of(trouble: Trouble) -> str:
    """Subject of an acknowledgement: another kind of trouble, or another fault, is to be seen anew."""
    return f"{trouble['kind']}:{trouble['facts'].get('number', '')}"


class Alarms:
    """``expires`` is the end of the server's certificate. ``clock`` is monotonic, in seconds; ``now_ms`` is
    the time of day in ms since 1970."""

    def __init__(
        self,
        reader: TroubleReader,
        conditions: Conditions,
        contents: AlarmContents,
        alarms: Sequence[Alarm],
        expires: datetime,
        clock: Callable[[], float],
        now_ms: Callable[[], float],
    ) -> None:
        self._reader = reader
        self._conditions = conditions
        self._contents = contents
        self._clock = clock
        self._now_ms = now_ms
        self._alarms = {one.place.id: one for one in alarms}
        self._by_owner = {one.place.owner: one for one in alarms if not one.place.what}
        self._fronts = {one.place.what: one for one in alarms if one.place.kind == FRONT}
        (self._certificate,) = (one for one in alarms if one.place.kind == CERTIFICATE)
        self._expires = expires
        self._check_at = clock()
        self._speaking: dict[str, _Speaking] = {}
        self._unheard: dict[str, float] = {}
        """Times since which places are not heard, by their alarms' ids."""
        self._pending = True
        self._settling_since = clock()
        self._was_dead = False

    def restore(self, file: AlarmFile) -> None:
        """Take over what was kept of alarms that there still are."""
        for name, kept in file.load().items():
            alarm = self._alarms.get(name)
            if alarm is None:
                continue
            condition = alarm.condition
            condition.state = state_of(kept, self._now_ms())
            condition.event_id = kept.event_ids[-1] if kept.event_ids else b""
            condition.time_ms = max(kept.active_ms, kept.acked_ms, kept.confirmed_ms, kept.enabled_ms)
            if kept.active and alarm.place.kind != CERTIFICATE:
                self._restore_trouble(alarm, bytes(kept.trouble))

    def _restore_trouble(self, alarm: Alarm, kept: bytes) -> None:
        speaking = _Speaking(_UNKNOWN, _LONG_AGO, is_restored=True)
        # The file may be anybody's: what is no trouble is told when the bus process tells of it.
        with suppress(msgspec.MsgspecError, KeyError, TypeError, ValueError, AttributeError):
            told = _decode(kept)
            alarm.condition.content = self._contents.of(told, alarm.place)
            speaking = _Speaking(told, _LONG_AGO, is_restored=True)
        self._speaking[alarm.place.id] = speaking

    def kept(self) -> Mapping[str, Any]:
        """States to be kept, by the alarms' ids."""
        return {
            name: kept_alarm(one.condition.state, self._trouble_of(name))
            for name, one in self._alarms.items()
            if is_worth_keeping(one.condition.state)
        }

    def _trouble_of(self, name: str) -> bytes:
        found = self._speaking.get(name)
        return _encode(found.trouble) if found else b"null"

    def look(self) -> None:
        """Look at the troubles again, and at the time."""
        if self._clock() >= self._check_at:
            self._check_at = self._clock() + _CHECK_CERTIFICATE_S
            self._check_certificate()
        if self._reader.beat() or self._pending:
            self._pending = False
            self._follow(self._reader.shown)
        self._conditions.look()

    def renewed(self, expires: datetime, fields: Fields) -> None:
        """The server has another certificate; ``fields`` are those of its alarm."""
        self._expires, self._check_at = expires, self._clock()
        condition = self._certificate.condition
        condition.place = replace(condition.place, common={**condition.place.common, **fields})

    def _check_certificate(self) -> None:
        condition = self._certificate.condition
        content = self._contents.expiry(self._expires)
        if self._expires.timestamp() * 1000 - EXPIRATION_LIMIT_MS <= self._now_ms():
            self._conditions.raised(condition, content, anew=False)
        elif condition.state.active:
            self._conditions.cleared(condition, self._contents.over(content))

    def _follow(self, shown: Sequence[Trouble]) -> None:
        is_dead = bool(shown) and shown[0]["kind"] == _DEAD
        if self._was_dead and not is_dead:
            self._expect_again()
        self._was_dead = is_dead
        worst: dict[str, tuple[Alarm, Trouble]] = {}
        for trouble in shown:
            for alarm, told in self._targets(trouble):
                worst.setdefault(alarm.place.id, (alarm, told))
        self._unheard = {name: since for name, since in self._unheard.items() if name in worst}
        for alarm, trouble in worst.values():
            self._raise(alarm, trouble)
        # Of the rest nothing is known while the bus process does not answer, or tells only the worst.
        is_whole = not is_dead and len(shown) < MOST
        for name in list(self._speaking) if is_whole else ():
            if name not in worst:
                self._clear(name)

    def _expect_again(self) -> None:
        """The bus process has begun anew: what it tells of at first is not all that is wrong."""
        self._settling_since = self._clock()
        for name, found in self._speaking.items():
            found.is_restored = name != self._by_owner[BRIDGE].place.id

    def _targets(self, trouble: Trouble) -> list[tuple[Alarm, Trouble]]:
        """Alarms that it is for, each with what of it belongs there."""
        parts = trouble.get("texts", {}).get("fronts", {}).get("facts", {}).get("parts", ())
        fronts: list[tuple[Alarm, Trouble]] = [
            (alarm, {**trouble, "texts": {"fronts": part}})
            for part in parts
            if (alarm := self._fronts.get(part["facts"]["front"]))
        ]
        if fronts:
            return fronts
        alarm = self._by_owner.get(trouble["place"]) or self._by_owner[BRIDGE]
        return [(alarm, trouble)]

    def _raise(self, alarm: Alarm, trouble: Trouble) -> None:
        name, now = alarm.place.id, self._clock()
        before = self._speaking.get(name)
        if before is None and self._may_have_a_cause(name, trouble):
            self._pending = True
            return
        is_same = before is not None and before.is_for(trouble)
        if before is not None and is_same:
            if before.trouble == trouble and not before.is_restored:
                return
            if now - before.told_at < _UPDATE_S:
                self._pending = True
                return
        self._speaking[name] = _Speaking(trouble, now, is_restored=False)
        content = self._contents.of(trouble, alarm.place)
        self._conditions.raised(alarm.condition, content, anew=not is_same)

    def _may_have_a_cause(self, name: str, trouble: Trouble) -> bool:
        if trouble["kind"] not in SILENT_NODE:
            return False
        now = self._clock()
        return now - self._unheard.setdefault(name, now) < _CAUSE_S

    def _clear(self, name: str) -> None:
        if self._speaking[name].is_restored and not self._is_settled:
            self._pending = True
            return
        del self._speaking[name]
        condition = self._alarms[name].condition
        self._conditions.cleared(condition, self._contents.over(condition.content))

    @property
    def _is_settled(self) -> bool:
        since = self._clock() - self._settling_since
        return since > _LONGEST_SETTLE_S or (since > _SETTLE_S and not self._reader.waiting)


class AlarmTask:
    """Follows the troubles while it runs, tells clients, and keeps the state in ``file``."""

    def __init__(self, alarms: Alarms, conditions: Conditions, file: AlarmFile) -> None:
        self._alarms = alarms
        self._conditions = conditions
        self._file = file
        self._guard = Guard("OPC UA alarms")
        self._save_at: float | None = None
        self._fault = ""
        conditions.on_change = self._on_change

    def renewed(self, expires: datetime, fields: Fields) -> None:
        """The server has another certificate: as ``Alarms.renewed``."""
        self._alarms.renewed(expires, fields)

    async def run(self) -> None:
        loop = asyncio.get_running_loop()
        while True:
            with self._guard:
                self._alarms.look()
                await self._conditions.send_waiting()
            if self._save_at is not None and loop.time() >= self._save_at:
                await self.save()
            await asyncio.sleep(next_publish(loop.time()) - loop.time())

    def _on_change(self, is_by_user: bool) -> None:
        after = _SAVE_AFTER_CALL_S if is_by_user else _SAVE_AFTER_S
        at = asyncio.get_running_loop().time() + after
        self._save_at = at if self._save_at is None else min(at, self._save_at)

    async def end(self) -> None:
        """Keep what is not kept yet."""
        if self._save_at is not None:
            await self.save()

    async def save(self) -> None:
        """Write the file. What cannot be written is in the log, once."""
        self._save_at = None
        try:
            await asyncio.to_thread(self._file.save, self._alarms.kept())
            self._fault = ""
        except OSError as error:
            if str(error) != self._fault:
                self._fault = str(error)
                _log.warning("%s: %s: alarms are not kept", self._file.path, error)
