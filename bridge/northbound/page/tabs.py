"""Open tabs of the page: what is sent to each, and when."""

from __future__ import annotations

import asyncio
import math
import time
from collections import deque
from collections.abc import AsyncGenerator, Callable, Sequence
from contextlib import asynccontextmanager, suppress
from typing import Any, Final

import msgspec
from starlette.websockets import WebSocket

from bridge.base.guard import Guard
from bridge.base.sources import source_of
from bridge.command import Event
from bridge.condition.plant_layout import PlantLayout
from bridge.image import Image
from bridge.northbound.page.sessions import PageSession, PageSessions
from bridge.northbound.page.shares import Seat, admit
from bridge.northbound.page.tab import BAD_MESSAGE, GONE, NO_TOKEN, SESSION_OVER, TOO_MANY, Tab, close
from bridge.northbound.page.topics import Topics
from bridge.northbound.page.traffic import TrafficViews
from bridge.northbound.page.viewer import BadMessage
from bridge.northbound.trouble_reader import TroubleReader
from bridge.northbound.view import View
from bridge.text import as_json

_TICK_S: Final = 0.05
"""Time between two ticks, seconds; a trend has a row for each."""
_BEAT: Final = 2
"""Ticks from one message to the next."""
_TROUBLES: Final = 4
"""Ticks between two updates of the troubles while a tab is open."""
_LOOK: Final = 20
"""Ticks between two checks of the tabs' sessions, and between two messages with the time."""
_EVENTS_KEPT: Final = 200
_TOKEN_S: Final = 5.0
_encode = msgspec.json.Encoder().encode


class Tabs:
    """Sends each open tab what it asks for. ``clock`` is monotonic."""

    def __init__(
        self,
        view: View,
        layout: PlantLayout,
        sessions: PageSessions,
        traffic: TrafficViews,
        clock: Callable[[], float],
    ) -> None:
        self.keep: Callable[[list[PageSession]], None] = lambda sessions: None
        """Keeps the sessions for the front after this one."""
        self._view = view
        self._sessions = sessions
        self._traffic = traffic
        self._clock = clock
        self._topics = Topics(view, layout)
        self._troubles = TroubleReader(view.image, self._epoch_ms)
        self._events = deque[dict[str, Any]](maxlen=_EVENTS_KEPT)
        self._tabs: list[Tab] = []
        self._guard = Guard("page")

    @asynccontextmanager
    async def serving(self) -> AsyncGenerator[None]:
        """While this context lasts, tabs are sent the changes."""
        self._view.on_event(self._on_event)
        self._troubles.beat()
        beating = asyncio.create_task(self._run(), name="beat of the page")
        try:
            yield
        finally:
            self._view.forget(self._on_event)
            beating.cancel()
            with suppress(asyncio.CancelledError):
                await beating
            self.keep_sessions()
            self._traffic.close()
            self._topics.close()

    async def serve(self, socket: WebSocket, session: PageSession | None) -> None:
        """Serve one tab until it is closed; ``session`` is that of its cookie. A tab to be refused is
        accepted first: a browser passes no closing code to its page otherwise."""
        with suppress(*GONE):
            await socket.accept()
        code = await self._refusal(socket, session)
        if code or session is None:
            await close(socket, code)
            return
        tab = Tab(socket, session, self._view, self._epoch_ms())
        self._tabs.append(tab)
        tab.session.tabs += 1
        try:
            self._greet(tab)
            await tab.serve(lambda data: self._on_message(tab, data))
        finally:
            self._tabs.remove(tab)
            tab.session.tabs -= 1

    async def _refusal(self, socket: WebSocket, session: PageSession | None) -> int:
        """The code with which a tab is closed at once; 0 where it is served."""
        if session is None:
            return SESSION_OVER
        if not session.has(await _token(socket)):
            return NO_TOKEN
        if self._sessions.find(session.id, self._clock()) is None:
            return SESSION_OVER  # while its token was awaited
        return 0 if self._finds_room(session, socket) else TOO_MANY

    def _finds_room(self, session: PageSession, socket: WebSocket) -> bool:
        """True where there is a tab left for this session, or one gives way to it."""
        seated = [tab for tab in self._tabs if not tab.is_closing]
        taken = [
            Seat(
                tab.session.user,
                source_of(tab.viewer.identity.address),
                tab.session.role,
                tab.viewer.commands,
                tab.since_ms,
            )
            for tab in seated
        ]
        address = source_of(socket.client.host if socket.client else "")
        admission = admit(taken, Seat(session.user, address, session.role, since=self._epoch_ms()))
        if admission.gives_way is not None:
            seated[admission.gives_way].close(TOO_MANY, "gave way")
        return admission.is_in

    def end(self, session: PageSession) -> None:
        """Close the tabs of this session, which is over."""
        for tab in self._tabs:
            if tab.session is session:
                tab.close(SESSION_OVER)

    @property
    def shown(self) -> list[dict[str, Any]]:
        """Open tabs, for JSON: user, address, time of opening in ms since 1970, and the topics shown."""
        return [
            {
                "who": str(tab.viewer.identity),
                "role": tab.session.role.name.lower(),
                "address": tab.viewer.identity.address,
                "since": tab.since_ms,
                "shows": list(tab.viewer.topics),
            }
            for tab in self._tabs
        ]

    def _greet(self, tab: Tab) -> None:
        tab.tell(_encode({"you": str(tab.viewer.identity)}))
        tab.tell(self._troubles_told())
        tab.tell(_encode({"events": list(self._events)}))

    def _troubles_told(self) -> bytes:
        found = self._troubles
        return _encode({"troubles": found.shown, "waiting": found.waiting, "recent": found.recent})

    def _on_message(self, tab: Tab, data: str) -> None:
        viewer, known = tab.viewer, self._topics.places.__contains__
        before, followed = viewer.topics, (viewer.choice, viewer.followed)
        try:
            viewer.on_message(data.encode("utf-8", "replace"), self._clock(), known)
        except BadMessage as error:
            tab.close(BAD_MESSAGE, str(error)[:100])
            return
        if (viewer.choice, viewer.followed) != followed:
            tab.rows.clear()  # they are those of the choice before
        for topic in viewer.topics:
            if topic not in before:
                tab.tell(self._topics.state(topic))

    # beats

    async def _run(self) -> None:
        tick = 0
        while True:
            await asyncio.sleep(_TICK_S)
            tick += 1
            with self._guard:
                self._sample()
                if tick % (_TROUBLES if self._tabs else _LOOK) == 0:
                    self._look_for_troubles()
                if tick % _BEAT == 0:
                    self._beat()
                    self._hear(counts=tick % _LOOK == 0)
                if tick % _LOOK == 0:
                    self._look_at_sessions()
                    self._tell_time()

    def _sample(self) -> None:
        now_ms = round(self._epoch_ms())
        for tab in self._tabs:
            if tab.viewer.followed:
                tab.rows.append([now_ms, *_values(self._view.image, tab.viewer.followed)])

    def _look_for_troubles(self) -> None:
        """Update the troubles, also while no tab is open: each has the time when it began."""
        if self._troubles.beat():
            told = self._troubles_told()
            for tab in self._tabs:
                tab.tell(told)

    def _beat(self) -> None:
        changes = self._topics.beat({topic for tab in self._tabs for topic in tab.viewer.topics})
        for tab in self._tabs:
            if tab.rows:
                rows, tab.rows = tab.rows, []
                tab.show(_encode({"trend": rows, "number": tab.viewer.choice}))
            if tab.has_caught_up():
                for topic in tab.viewer.topics:
                    tab.tell(self._topics.state(topic))
                continue
            for topic in tab.viewer.topics:
                if topic in changes:
                    tab.show(changes[topic])

    def _hear(self, *, counts: bool) -> None:
        filters = [(tab.viewer.traffic, tab.show) for tab in self._tabs if tab.viewer.traffic is not None]
        self._traffic.beat(filters, self._clock(), counts=counts)

    def _look_at_sessions(self) -> None:
        """Count the sessions of open tabs as used. Nothing here waits for a client."""
        for session in {tab.session for tab in self._tabs}:
            if self._sessions.find(session.id, self._clock()) is None:
                self.end(session)
        self.keep_sessions()

    def keep_sessions(self) -> None:
        """Keep changed sessions for the front after this one."""
        sessions = self._sessions.take_changed(self._clock())
        if sessions is not None:
            self.keep(sessions)

    def _tell_time(self) -> None:
        """Send the time: a tab that gets nothing for some seconds takes its connection, or this front, as
        hung."""
        now = _encode({"now": round(self._epoch_ms())})
        for tab in self._tabs:
            tab.show(now)

    def _on_event(self, event: Event) -> None:
        shown = {
            "time": self._view.epoch_ns(event.time) // 1_000_000,
            "kind": str(event.kind),
            "source": event.source,
            "severity": event.severity,
            "message": event.message,
            "text": as_json(event.said),
            "cause": event.cause,
            "cause_text": as_json(event.because),
        }
        self._events.append(shown)
        data = _encode({"event": shown})
        for tab in self._tabs:
            tab.tell(data)

    def _epoch_ms(self) -> float:
        return time.time() * 1000


async def _token(socket: WebSocket) -> str:
    """The first message of a tab; empty where none comes."""
    try:
        async with asyncio.timeout(_TOKEN_S):
            return await socket.receive_text()
    except (*GONE, KeyError):
        return ""


def _values(image: Image, places: Sequence[int]) -> list[Any]:
    shown: list[Any] = []
    for place in places:
        value, quality, _, _ = image[place]
        is_shown = quality.has_value and isinstance(value, int | float) and math.isfinite(value)
        shown.append(value if is_shown else None)
    return shown
