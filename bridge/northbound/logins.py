"""The queue of passwords that wait to be checked.

Each check takes 64 MiB and tens of ms, so there is one at a time: guessing must not use all cores, nor may it
delay others.
"""

from __future__ import annotations

import asyncio
import hashlib
import hmac
import secrets
from collections import deque
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from bridge.northbound.passwords import verify_password

Verify = Callable[[str | None, str], bool]


@dataclass(slots=True, eq=False)
class _Check:
    password_hash: str | None
    password: str
    is_right: asyncio.Future[bool]


@dataclass(slots=True)
class _Queue:
    """The checks of one address. Its newest and its oldest take turns: neither does a burst hold up who
    comes after it, nor a stream who came before."""

    checks: deque[_Check]
    takes_newest: bool = True

    def take(self) -> _Check:
        check = self.checks.pop() if self.takes_newest else self.checks.popleft()
        self.takes_newest = not self.takes_newest
        return check


class TooManyChecks(Exception):
    """So many passwords wait to be checked that no further one may."""


class PasswordChecks:
    """Checks passwords, the addresses in turn; ``most`` may wait at a time, None: any number.

    One that was right before is known again without waiting, by a keyed digest that lives as long as the
    process.
    """

    def __init__(self, verify: Verify = verify_password, *, most: int | None = None) -> None:
        self._verify = verify
        self._most = most
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="password")
        self._queues: dict[str, _Queue] = {}
        self._is_busy = self._is_closed = False
        self._key = secrets.token_bytes(32)
        self._right: dict[str, bytes] = {}
        """The digest of the password that was right, by password hash."""

    def close(self) -> None:
        self._is_closed = True
        self._worker.shutdown(wait=False, cancel_futures=True)

    async def is_right(self, password_hash: str | None, password: str, address: str) -> bool:
        """Whether ``password`` is the one behind the hash; None stands for a user that does not exist.

        Raises ``TooManyChecks``.
        """
        digest = hmac.digest(self._key, password.encode("utf-8", "surrogatepass"), hashlib.sha256)
        if password_hash and hmac.compare_digest(self._right.get(password_hash, b""), digest):
            return True
        if self._most is not None and sum(len(one.checks) for one in self._queues.values()) >= self._most:
            raise TooManyChecks
        check = _Check(password_hash, password, asyncio.get_running_loop().create_future())
        self._queues.setdefault(address, _Queue(deque())).checks.append(check)
        self._begin_next()
        try:
            is_right = await check.is_right
        finally:
            self._forget(address, check)
        if is_right and password_hash:
            self._right[password_hash] = digest
        return is_right

    def _forget(self, address: str, check: _Check) -> None:
        """Forget a check whose connection has gone before its turn came."""
        queue = self._queues.get(address)
        if queue and check in queue.checks:
            queue.checks.remove(check)
            if not queue.checks:
                del self._queues[address]

    def _begin_next(self) -> None:
        if self._is_busy or self._is_closed or not self._queues:
            return
        address = next(iter(self._queues))
        queue = self._queues.pop(address)
        check = queue.take()
        if queue.checks:
            self._queues[address] = queue  # behind the others
        self._is_busy = True
        loop = asyncio.get_running_loop()
        done = loop.run_in_executor(self._worker, self._verify, check.password_hash, check.password)
        done.add_done_callback(lambda done: self._end(check, done))

    def _end(self, check: _Check, done: asyncio.Future[bool]) -> None:
        self._is_busy = False
        if not check.is_right.done():
            failed = done.cancelled() or done.exception() is not None
            check.is_right.set_result(not failed and done.result())
        self._begin_next()
