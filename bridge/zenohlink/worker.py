"""The thread that opens and closes one zenoh session, and declares and publishes with it; and the way from
zenoh's threads to the event loop.
"""

# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false
# zenoh's stubs leave out the return types of what returns nothing.

from __future__ import annotations

import asyncio
import logging
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from itertools import islice
from queue import Empty, SimpleQueue
from typing import Final, Protocol, TypeVarTuple

import zenoh

from bridge.base.ratelimit import Pauses
from bridge.zenohlink.lane import Job, Lane
from bridge.zenohlink.message import sentence
from bridge.zenohlink.sockets import TcpConnections
from bridge.zenohlink.strangers import Strangers

_log = logging.getLogger(__name__)

Arguments = TypeVarTuple("Arguments")

_LANES_END_S: Final = 1.0
"""Time within which the lanes of a closed session have to end."""
_LOOK_S: Final = 0.5
"""Interval at which to look for connections that have not become a session: less than the time they have for
that."""

_LIMIT: Final = 1000
"""Queries and samples of one share that may wait for the loop; further ones are refused."""
_MOST_SHARES: Final = 64
"""Shares beyond this number count as the first one."""
_AT_ONCE: Final = 32
"""Calls made before the loop gets its turn for other work."""
ZENOH_ERRORS: Final = (zenoh.ZError, RuntimeError, ValueError, TypeError, AttributeError)
"""Exceptions of zenoh's calls: ZError for failures, the others for objects that have been closed
meanwhile."""


class Declared(Protocol):
    def undeclare(self) -> object: ...


class Worker:
    """Opens a session, does jobs one after the other, closes the session.

    ``opened`` (None, or the error) and ``closed`` are called on the worker's thread. The thread is a daemon:
    if zenoh never returns, the process can still end.

    ``on_strangers``, given if strangers connect, is called on the worker's thread with the connections that
    did not become a session. Strangers may hang, and must not delay the others (``sockets.py``). Between our
    own processes, the supervisor ends a front that hangs.
    """

    def __init__(
        self,
        config: zenoh.Config,
        name: str,
        opened: Callable[[Exception | None], None],
        closed: Callable[[], None],
        on_strangers: Callable[[list[str]], object] | None = None,
    ) -> None:
        self.name = name
        self.errors = 0
        self.is_stopping = False
        self.declared: list[Declared] = []
        """Undeclared before the session is closed; only jobs touch it."""
        self.tokens: dict[str, zenoh.LivelinessToken] = {}
        self.subscribers: dict[str, Declared] = {}
        self._config = config
        self._on_strangers = on_strangers
        self._connections = TcpConnections()
        self._strangers = Strangers()
        self._look_at = time.monotonic()
        self._opened = opened
        self._closed = closed
        self._jobs: SimpleQueue[Job] = SimpleQueue()
        self._lanes: set[Lane] = set()
        self._answers: tuple[Lane, Lane] | None = None
        self._lanes_lock = threading.Lock()
        self._pauses = Pauses()
        self._thread = threading.Thread(target=self._work, name=f"zenoh-{name}", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def do(self, job: Job) -> None:
        """Queue a job, from any thread."""
        self._jobs.put(job)

    def lane(self, session: zenoh.Session) -> Lane:
        """Another thread for calls of the session. It ends with the session at the latest."""
        lane = Lane(self.name, session, self.complain)
        with self._lanes_lock:
            self._lanes = {one for one in self._lanes if one.is_alive} | {lane}
            if self.is_stopping:
                lane.stop()
        return lane

    def answers(self, session: zenoh.Session) -> tuple[Lane, Lane]:
        """The lanes for answers: one for those that never wait, one for all others. Only jobs call this."""
        if self._answers is None:
            self._answers = self.lane(session), self.lane(session)
        return self._answers

    @property
    def waiting(self) -> int:
        return self._jobs.qsize()

    @property
    def is_alive(self) -> bool:
        return self._thread.is_alive()

    def stop(self) -> None:
        """Close the session without the jobs that still wait."""
        self.is_stopping = True
        self._jobs.put(lambda _: None)

    def complain(self, error: Exception) -> None:
        """Count an error and log it at most once a minute, with a traceback if it is not one of zenoh's."""
        self.errors += 1
        now = time.monotonic()
        if self._pauses.take(now) is not None:
            ours = None if isinstance(error, ZENOH_ERRORS) else error
            _log.warning("%s: %s (%d so far)", self.name, sentence(error), self.errors, exc_info=ours)

    def _work(self) -> None:
        try:
            self._serve()
        finally:
            # Also if the thread dies of an error: the loop has to know.
            self._closed()

    def _serve(self) -> None:
        try:
            session = zenoh.open(self._config)
        except ZENOH_ERRORS as error:
            self._opened(error)
            return
        self._opened(None)
        if self._on_strangers:
            self._try(lambda: self._watch_links(session))
        try:
            while not self.is_stopping:
                self._do_next(session)
        finally:
            self._close(session)

    def _do_next(self, session: zenoh.Session) -> None:
        with suppress(Empty):
            job = self._jobs.get(timeout=_LOOK_S if self._on_strangers else None)
            self._try(lambda: job(session))
        if self._on_strangers and time.monotonic() >= self._look_at:
            self._try(self._settle_sockets)

    def _watch_links(self, session: zenoh.Session) -> None:
        def on_link(event: zenoh.LinkEvent) -> None:
            _, _, place = str(event.link.dst).partition("/")
            if event.kind == zenoh.SampleKind.PUT:
                self._strangers.came(place)  # now: jobs may be late
                self.do(lambda _: self._settle_sockets())
            else:
                self.do(lambda _: self._strangers.went(place))

        callback = zenoh.handlers.Callback(on_link, indirect=False)
        self.declared.append(session.info.declare_link_events_listener(callback, history=True))

    def _settle_sockets(self) -> None:
        now = time.monotonic()
        self._look_at = now + _LOOK_S
        self._strangers.on_connections(self._connections.settle(), now)
        strangers = self._strangers.take(now)
        if strangers and self._on_strangers:
            self._on_strangers(strangers)

    def _close(self, session: zenoh.Session) -> None:
        with self._lanes_lock:
            lanes = tuple(self._lanes)
        for lane in lanes:
            lane.stop()
        # Undeclared first: zenoh-python issue 624.
        for declared in (*self.tokens.values(), *self.subscribers.values(), *self.declared):
            self._try(declared.undeclare)
        self._try(session.close)
        end = time.monotonic() + _LANES_END_S
        for lane in lanes:
            lane.join(max(0.0, end - time.monotonic()))

    def _try(self, call: Callable[[], object]) -> None:
        try:
            call()
        except Exception as error:  # noqa: BLE001 - one bad job must not end all others
            self.complain(error)


class CallQueue:
    """Calls that other threads hand over to be made in the loop. Belongs to the loop it is created in.

    Calls of one share keep their order; shares take turns, so that a full one delays no other.
    """

    def __init__(self) -> None:
        self.is_closed = False
        self._loop = asyncio.get_running_loop()
        self._shares: dict[str, deque[Callable[[], None]]] = {"": deque()}
        self._next = 0
        self._drain_is_due = False

    def take_in(self, call: Callable[[], None], share: str = "") -> bool:
        """Queue a call for the loop, from any thread. False: there is no room. One wake-up of the loop serves
        all waiting calls."""
        if share not in self._shares and len(self._shares) >= _MOST_SHARES:
            share = ""
        waiting = self._shares.setdefault(share, deque())
        if self.is_closed or len(waiting) >= _LIMIT:
            return False
        waiting.append(call)
        if not self._drain_is_due:
            self._drain_is_due = True
            self.tell(self._drain)
        return True

    def tell(self, call: Callable[[*Arguments], object], *arguments: *Arguments) -> None:
        """Queue a call for the loop, from any thread and without a limit: for the completion of what the loop
        itself has begun."""
        try:
            self._loop.call_soon_threadsafe(call, *arguments)
        except RuntimeError:
            _log.debug("the event loop has ended; nobody is left to be told")

    def _drain(self) -> None:
        # Cleared before the queues are read: an append after that wakes the loop again.
        self._drain_is_due = False
        try:
            for call in islice(self._in_turn(), _AT_ONCE):
                call()
        finally:
            if any(tuple(self._shares.values())) and not self._drain_is_due:
                self._drain_is_due = True
                self._loop.call_soon(self._drain)

    def _in_turn(self) -> Iterator[Callable[[], None]]:
        """One call of each share in turn, continuing where it stopped."""
        while any(shares := tuple(self._shares.values())):
            for place in (*range(self._next, len(shares)), *range(self._next)):
                if shares[place]:
                    self._next = place + 1
                    yield shares[place].popleft()
