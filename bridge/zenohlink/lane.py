"""A thread that makes calls of one session, one after the other; a call that blocks delays only its own
lane."""

# pyright: reportUnknownMemberType=false
# zenoh's stubs leave out the return types of what returns nothing.

from __future__ import annotations

import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Final

import zenoh

LIMIT: Final = 10_000
"""Jobs that may wait in one lane; further ones are refused."""

Job = Callable[[zenoh.Session], None]


class Lane:
    """``complain`` is called, on the lane's thread, with what a job has raised. The thread is a daemon: if
    zenoh never returns, the process can still end."""

    def __init__(self, name: str, session: zenoh.Session, complain: Callable[[Exception], None]) -> None:
        self.session = session
        self._complain = complain
        self._is_stopping = False
        self._jobs: SimpleQueue[Job | None] = SimpleQueue()
        self._thread = threading.Thread(target=self._work, name=f"zenoh-{name}", daemon=True)
        self._thread.start()

    @property
    def is_alive(self) -> bool:
        return self._thread.is_alive()

    def do(self, job: Job) -> bool:
        """Queue a job, from any thread. False: there is no room, or the lane has ended."""
        if self._is_stopping or self._jobs.qsize() >= LIMIT:
            return False
        self._jobs.put(job)
        return True

    def end(self) -> None:
        """End when all jobs given so far are done."""
        self._jobs.put(None)

    def stop(self) -> None:
        """End without the jobs that still wait."""
        self._is_stopping = True
        self._jobs.put(None)

    def join(self, timeout_s: float) -> None:
        self._thread.join(timeout_s)

    def _work(self) -> None:
        while (job := self._jobs.get()) is not None and not self._is_stopping:
            try:
                job(self.session)
            except Exception as error:  # noqa: BLE001 - one bad job must not end all others
                self._complain(error)
            # Release what the job holds, such as a query, now and not with the next job.
            del job
