"""The tabs that show the page: what is sent to each, and when."""

from __future__ import annotations

import asyncio
import math
import time
from collections import deque
from collections.abc import AsyncGenerator, Callable, Sequence
from contextlib import asynccontextmanager, suppress
from typing import Any, Final

import msgspec
from starlette.websockets import WebSocket, WebSocketDisconnect

from bridge.command import Event
from bridge.guard import Guard
from bridge.image import Image
from bridge.northbound.page.hearing import Hearings
from bridge.northbound.page.sessions import Session, Sessions
from bridge.northbound.page.topics import Topics
from bridge.northbound.page.troubles import Layout, Troubles
from bridge.northbound.page.viewer import BadMessage, Viewer
from bridge.northbound.view import View

_TICK_S: Final = 0.05
"""A trend has a row for each tick."""
_BEAT: Final = 2
"""Ticks from one message to the next."""
_LOOK: Final = 20
"""Ticks from one look at the sessions of the tabs to the next."""
_MOST_TABS: Final = 64
_MOST_WAITING: Final = 8
"""Messages that a tab has not taken yet; one more, and it gets the state anew."""
_MOST_OUTCOMES: Final = 1000
_EVENTS_KEPT: Final = 200
_TOKEN_S: Final = 5.0
SESSION_OVER: Final = 4401
_NO_TOKEN: Final = 4403
_TOO_MANY: Final = 4429
_encode = msgspec.json.Encoder().encode


class Tabs:
    """Has each open tab shown what it asks for. ``clock`` is monotonic."""

    def __init__(
        self,
        view: View,
        layout: Layout,
        sessions: Sessions,
        hearings: Hearings,
        clock: Callable[[], float],
    ) -> None:
        self._view = view
        self._sessions = sessions
        self._hearings = hearings
        self._clock = clock
        self._topics = Topics(view, layout)
        self._troubles = Troubles(view.image, layout, self._epoch_ms)
        self._events = deque[dict[str, Any]](maxlen=_EVENTS_KEPT)
        self._tabs: list[_Tab] = []
        self._guard = Guard("page")

    @asynccontextmanager
    async def serving(self) -> AsyncGenerator[None]:
        """While this lasts, tabs are told what changes."""
        self._view.on_event(self._on_event)
        beating = asyncio.create_task(self._run(), name="beat of the page")
        try:
            yield
        finally:
            self._view.forget(self._on_event)
            beating.cancel()
            with suppress(asyncio.CancelledError):
                await beating
            self._hearings.close()
            self._topics.close()

    async def serve(self, socket: WebSocket, session: Session | None) -> None:
        """Serve one tab until it is closed; ``session`` is that of its cookie."""
        if session is None or len(self._tabs) >= _MOST_TABS:
            await socket.close(SESSION_OVER if session is None else _TOO_MANY)
            return
        await socket.accept()
        try:
            async with asyncio.timeout(_TOKEN_S):
                token = await socket.receive_text()
        except (TimeoutError, WebSocketDisconnect, KeyError):
            token = ""
        if not session.has(token):
            await socket.close(_NO_TOKEN)
            return
        tab = _Tab(socket, session, self._view, self._epoch_ms())
        self._tabs.append(tab)
        sending = asyncio.create_task(tab.send_all(), name="messages to a tab")
        try:
            self._greet(tab)
            await self._listen(tab)
        except (WebSocketDisconnect, KeyError):
            pass  # closed, or it sent bytes where text is due
        finally:
            self._tabs.remove(tab)
            tab.viewer.leave()
            sending.cancel()

    async def end(self, session: Session) -> None:
        """Close the tabs of this session, which is over."""
        for tab in [tab for tab in self._tabs if tab.session is session]:
            tab.viewer.leave()
            with suppress(RuntimeError):
                await tab.socket.close(SESSION_OVER)

    @property
    def shown(self) -> list[dict[str, Any]]:
        """For JSON: who has the page open, from where, since when in ms since 1970, and what it shows."""
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

    def _greet(self, tab: _Tab) -> None:
        tab.tell(_encode({"you": str(tab.viewer.identity)}))
        tab.tell(self._troubles_told())
        for event in self._events:
            tab.tell(_encode({"event": event}))

    def _troubles_told(self) -> bytes:
        return _encode({"troubles": self._troubles.shown, "waiting": self._troubles.waiting})

    async def _listen(self, tab: _Tab) -> None:
        viewer, known = tab.viewer, self._topics.places.__contains__
        while True:
            data = await tab.socket.receive_text()
            before = viewer.topics
            try:
                viewer.on_message(data.encode("utf-8", "replace"), self._clock(), known)
            except BadMessage as error:
                await tab.socket.close(1008, str(error)[:100])
                return
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
                if tick % _BEAT == 0:
                    self._beat()
                    self._hear(counts=tick % _LOOK == 0)
                if tick % _LOOK == 0:
                    await self._look_at_sessions()

    def _sample(self) -> None:
        now_ms = round(self._epoch_ms())
        for tab in self._tabs:
            if tab.viewer.followed:
                tab.rows.append([now_ms, *_values(self._view.image, tab.viewer.followed)])

    def _beat(self) -> None:
        changes = self._topics.beat({topic for tab in self._tabs for topic in tab.viewer.topics})
        troubles = self._troubles_told() if self._troubles.beat() else None
        for tab in self._tabs:
            if troubles:
                tab.tell(troubles)
            if tab.rows:
                rows, tab.rows = tab.rows, []
                tab.show(_encode({"trend": rows}))
            if tab.has_caught_up():
                for topic in tab.viewer.topics:
                    tab.tell(self._topics.state(topic))
                continue
            for topic in tab.viewer.topics:
                if topic in changes:
                    tab.show(changes[topic])

    def _hear(self, *, counts: bool) -> None:
        wishes = [(tab.viewer.wish, tab.show) for tab in self._tabs if tab.viewer.wish is not None]
        self._hearings.beat(wishes, self._clock(), counts=counts)

    async def _look_at_sessions(self) -> None:
        """A tab that is open uses its session."""
        for session in {tab.session for tab in self._tabs}:
            if self._sessions.find(session.id, self._clock()) is None:
                await self.end(session)

    def _on_event(self, event: Event) -> None:
        shown = {
            "time": self._view.epoch_ns(event.time) // 1_000_000,
            "kind": str(event.kind),
            "source": event.source,
            "severity": event.severity,
            "message": event.message,
        }
        self._events.append(shown)
        data = _encode({"event": shown})
        for tab in self._tabs:
            tab.tell(data)

    def _epoch_ms(self) -> float:
        return time.time() * 1000


class _Tab:
    """A WebSocket with what waits to be sent on it."""

    def __init__(self, socket: WebSocket, session: Session, view: View, since_ms: float) -> None:
        self.since_ms = round(since_ms)
        self.socket = socket
        self.session = session
        address = socket.client.host if socket.client else ""
        self.viewer = Viewer(view, session.user, session.role, address, self.tell)
        self.rows: list[list[Any]] = []
        self._queue = asyncio.Queue[bytes](_MOST_OUTCOMES)
        self._is_behind = False

    def tell(self, data: bytes) -> None:
        """Have it sent in its turn. A tab that has not taken a thousand messages gets no more of them."""
        if self._queue.full():
            self._is_behind = True
            return
        self._queue.put_nowait(data)

    def show(self, data: bytes) -> None:
        """As ``tell``; left out where much waits already: the state will follow instead."""
        if self._queue.qsize() >= _MOST_WAITING:
            self._is_behind = True
        elif not self._is_behind:
            self._queue.put_nowait(data)

    def has_caught_up(self) -> bool:
        """True once where it had been behind and has taken everything."""
        if self._is_behind and self._queue.empty():
            self._is_behind = False
            return True
        return False

    async def send_all(self) -> None:
        with suppress(WebSocketDisconnect, RuntimeError, OSError):
            while True:
                await self.socket.send_text((await self._queue.get()).decode())


def _values(image: Image, places: Sequence[int]) -> list[Any]:
    shown: list[Any] = []
    for place in places:
        value, quality, _, _ = image[place]
        is_shown = quality.has_value and isinstance(value, int | float) and math.isfinite(value)
        shown.append(value if is_shown else None)
    return shown
