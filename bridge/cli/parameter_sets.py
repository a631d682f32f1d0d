"""Reading and writing whole sets of parameters, also over a connection that breaks."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from typing import Final

from bridge.base import clock
from bridge.base.errors import OperationFailed
from bridge.cli.bus_runner import tell
from bridge.cli.parameter_drive import Target
from bridge.cli.terminal import Show
from bridge.image import Value
from bridge.parameter import ObjectRef, ParameterError, Why, backups
from bridge.parameter.protection import Gate

_PAUSE_S: Final = 1.0
"""Between two attempts at a node that does not answer."""


def read_all(target: Target, wait_s: float, also: Sequence[ObjectRef], *, scan: bool) -> backups.Backup:
    """All settings of a drive, and what is at ``also``. Raises ``OperationFailed`` if the node does not
    answer for ``wait_s``, or if another device answers meanwhile."""
    access, found = target.access, backups.Backup()

    def watch(show: Show) -> None:
        count = len(found.values) + len(found.objects)
        total = len(access.names.settings) if scan else None
        show(found.indices_done, total, f"{count} parameters, {len(found.unreadable)} refused")

    def steps(now: float) -> backups.Steps:
        yield from backups.identify(found.identity)
        yield from backups.back_up(access, found, now)
        if scan:
            yield from backups.scan(access, found, now)
        yield from backups.read_objects(access, also, found, now)

    patience = _Patience(wait_s)
    while error := target.attempt(steps, watch=watch):
        if not patience.wait(error, found.answers):
            raise OperationFailed(f"{target.name}: {error}; no file was written")
    return found


def write_all(
    target: Target,
    values: Mapping[str, Value],
    identity: dict[str, int],
    into: backups.Restored,
    gate: Gate,
    wait_s: float,
) -> None:
    """Restore a set to the node that has told ``identity``; ``into`` has what was done in all attempts.

    Raises ``OperationFailed`` where the set does not fit, and where another device answers than before.
    """

    def steps(now: float) -> backups.Steps:
        yield from backups.identify(identity)
        yield from backups.restore(target.access, values, into, now, gate)

    patience = _Patience(wait_s)
    while True:
        error = target.attempt(steps, writes=True) or into.error
        if error is None or not patience.wait(error, len(values) - len(into.left)):
            break
        target.access.forget()
    if error is not into.error:
        raise OperationFailed(f"{target.name}: {error}; {len(into.written)} written")


class _Patience:
    """Waits for a node that does not answer, no longer than ``wait_s`` since it last got on."""

    def __init__(self, wait_s: float) -> None:
        self._wait_s = wait_s
        self._until: float | None = None
        self._done = 0

    def wait(self, error: ParameterError, done: int) -> bool:
        """False where the time is up, and where waiting mends nothing. ``done``: how far it has got."""
        if error.why is not Why.NO_ANSWER or not self._wait_s:
            return False
        now = clock.now()
        if self._until is None or done > self._done:
            self._until, self._done = now + self._wait_s, done
            tell(f"{error}; it is waited for, {self._wait_s:g} s")
        if now >= self._until:
            return False
        time.sleep(min(_PAUSE_S, self._until - now))
        return True
