"""The thread that makes all calls of one zenoh session."""

# pyright: reportUnknownMemberType=false, reportUnknownArgumentType=false
# zenoh's stubs leave out the return types of what returns nothing.

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from queue import SimpleQueue
from typing import Final, Protocol

import zenoh

from bridge.zenohlink.message import sentence

_log = logging.getLogger(__name__)

ZENOH_ERRORS: Final = (zenoh.ZError, RuntimeError, ValueError, TypeError, AttributeError)
"""What zenoh's calls raise: ZError for what goes wrong, the others for what is closed meanwhile."""


class Declared(Protocol):
    def undeclare(self) -> object: ...


class Worker:
    """Opens a session, does jobs one after the other, closes the session.

    ``opened`` (None, or the error) and ``closed`` are called on the worker's thread. The thread is a
    daemon: where zenoh does not come back, the process can end without it.
    """

    def __init__(
        self,
        config: zenoh.Config,
        name: str,
        opened: Callable[[Exception | None], None],
        closed: Callable[[], None],
    ) -> None:
        self.name = name
        self.errors = 0
        self.is_stopping = False
        self.declared: list[Declared] = []
        """What is undeclared before the session is closed; only jobs touch it."""
        self.tokens: dict[str, zenoh.LivelinessToken] = {}
        self._config = config
        self._opened = opened
        self._closed = closed
        self._jobs: SimpleQueue[Callable[[zenoh.Session], None]] = SimpleQueue()
        self._last_complaint = float("-inf")
        self._thread = threading.Thread(target=self._work, name=f"zenoh-{name}", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def do(self, job: Callable[[zenoh.Session], None]) -> None:
        """From any thread."""
        self._jobs.put(job)

    @property
    def waiting(self) -> int:
        return self._jobs.qsize()

    @property
    def is_alive(self) -> bool:
        return self._thread.is_alive()

    def stop(self) -> None:
        """Skip what waits and close the session."""
        self.is_stopping = True
        self._jobs.put(lambda _: None)

    def complain(self, error: Exception) -> None:
        """Count an error and log it at most once a minute, with its place where it is none of zenoh's."""
        self.errors += 1
        now = time.monotonic()
        if now - self._last_complaint >= 60:
            self._last_complaint = now
            ours = None if isinstance(error, ZENOH_ERRORS) else error
            _log.warning("%s: %s (%d so far)", self.name, sentence(error), self.errors, exc_info=ours)

    def _work(self) -> None:
        try:
            self._serve()
        finally:
            # Also where the thread dies of something: the loop has to know.
            self._closed()

    def _serve(self) -> None:
        try:
            session = zenoh.open(self._config)
        except ZENOH_ERRORS as error:
            self._opened(error)
            return
        self._opened(None)
        try:
            while not self.is_stopping:
                job = self._jobs.get()
                self._try(lambda job=job: job(session))
        finally:
            # Undeclared first: zenoh-python issue 624.
            for declared in (*self.tokens.values(), *self.declared):
                self._try(declared.undeclare)
            self._try(session.close)

    def _try(self, call: Callable[[], object]) -> None:
        try:
            call()
        except Exception as error:  # noqa: BLE001 - one bad job must not end all others
            self.complain(error)
