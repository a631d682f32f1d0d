"""A thread that makes calls of one session, one after the other: what waits in one lane holds up no other."""

# pyright: reportUnknownMemberType=false
# zenoh's stubs leave out the return types of what returns nothing.

from __future__ import annotations

import threading
from collections.abc import Callable
from queue import SimpleQueue
from typing import Final

import zenoh

LIMIT: Final = 10_000
"""Most jobs that wait in one lane; what comes on top is refused."""

Job = Callable[[zenoh.Session], None]


class Lane:
    """``complain`` is told, on the lane's thread, what a job has raised. The thread is a daemon: where zenoh
    does not come back, the process can end without it."""

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
        """From any thread. False: there is no room, or nobody to do it."""
        if self._is_stopping or self._jobs.qsize() >= LIMIT:
            return False
        self._jobs.put(job)
        return True

    def end(self) -> None:
        """When everything that was given so far is done."""
        self._jobs.put(None)

    def stop(self) -> None:
        """Skip what waits."""
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
            # What the job holds, a query perhaps, ends here and not when the next one comes.
            del job
