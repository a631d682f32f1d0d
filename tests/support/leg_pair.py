"""The old command channel and the new one side by side: every call goes to both, and both must agree."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from bridge.command.channel import DriveChannel
from bridge.command.event import Event
from bridge.command.leg.port import LegChannel
from bridge.command.request import Outcome, Reply, Request
from bridge.config import DriveTable
from bridge.mapping.model import Family

_ENTRIES = frozenset(
    (
        "on_own_watch",
        "on_status_word",
        "on_unchanged",
        "on_actual_words",
        "on_pdo",
        "on_emcy",
        "on_drive_fault",
        "on_node",
        "on_time",
        "on_bridge_gap",
        "start_anew",
        "on_refused",
    )
)


class _Both:
    """Sets attributes of both links."""

    def __init__(self, old: object, new: object) -> None:
        object.__setattr__(self, "old", old)
        object.__setattr__(self, "new", new)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.old, name)

    def __setattr__(self, name: str, value: object) -> None:
        setattr(self.old, name, value)
        setattr(self.new, name, value)


class _Authority:
    def __init__(self, pair: LegPair) -> None:
        self._pair = pair

    def __getattr__(self, name: str) -> Any:
        return getattr(self._pair.old.authority, name)

    def on_connection(self, identity: Any, now: float, *, is_there: bool) -> None:
        self._pair.old.authority.on_connection(identity, now, is_there=is_there)
        self._pair.new.on_connection(identity, now, is_there=is_there)


class LegPair:
    """Looks like the old channel."""

    def __init__(
        self, name: str, family: Family, settings: DriveTable, hold_ms: int, report: Callable[[Event], None]
    ) -> None:
        self._events: tuple[list[Event], list[Event]] = ([], [])
        self._report = report

        def told(event: Event) -> None:
            self._events[0].append(event)
            report(event)

        self.old = DriveChannel(name, family, settings, hold_ms, told)
        self.new = LegChannel(name, family, settings, hold_ms, self._events[1].append)
        self._dues: tuple[list[float], list[float]] = ([], [])
        self.old.on_trip(self._dues[0].append)
        self.new.on_trip(self._dues[1].append)
        self._outcomes: tuple[list[Outcome], list[Outcome]] = ([], [])
        self.link = _Both(self.old.link, self.new.link)
        self.authority = _Authority(self)
        self.compares_interlock = True

    def look_up(self, why_lacking: Callable[[frozenset[int], float], str]) -> None:
        self.old.look_up(why_lacking)
        self.new.look_up(why_lacking)

    def __getattr__(self, name: str) -> Any:
        if name in _ENTRIES:

            def entry(*args: Any) -> None:
                self._share()
                getattr(self.old, name)(*args)
                getattr(self.new, name)(*args)
                self.compare(args[-1])

            return entry
        return getattr(self.old, name)

    def _share(self) -> None:
        for ours, theirs in ((self.new.scales, self.old.scales), (self.new.unserved, self.old.unserved)):
            ours.clear()
            ours.update(theirs)

    def handle(self, request: Request, now: float, reply: Reply) -> None:
        self._share()

        def told(outcome: Outcome) -> None:
            self._outcomes[0].append(outcome)
            reply(outcome)

        self.old.handle(request, now, told)
        self.new.handle(request, now, self._outcomes[1].append)
        self.compare(now)

    def compare(self, now: float) -> None:
        old, new = self.old, self.new
        for name in (
            "output",
            "until",
            "control_word",
            "setpoints",
            "silence_stops",
            "owner",
            "trips",
            "refused_writes",
            "is_tripped",
            "drive_status_word",
            "status_word",
            "state",
            "served_state",
            "last_fault",
            "current_fault",
            "fault_text",
        ):
            assert getattr(old, name) == getattr(new, name), name
        if not old.is_tripped:
            assert old.restart_interlock == new.restart_interlock, "restart_interlock"
        if old.until is not None:
            assert old.output_then() == new.output_then(), "output_then"
        watchdog = old.watchdog
        assert watchdog.state == new.watchdog_state, "watchdog_state"
        assert watchdog.left_ms(now) == new.left_ms(now), "left_ms"
        assert watchdog.controller_is_silent == new.controller_is_silent, "is_silent"
        assert watchdog.timeout_ms == new.timeout_ms
        assert watchdog.telegrams == new.telegrams, "telegrams"
        assert old.next_deadline(now) == new.next_deadline(now), "next_deadline"
        for what, (of_old, of_new) in (
            ("events", self._events),
            ("outcomes", self._outcomes),
            ("trips", self._dues),
        ):
            assert of_old == of_new, what
            of_old.clear()
            of_new.clear()
