"""The queue of passwords: one check at a time, addresses in turn, and one that was right is known again."""

from __future__ import annotations

import asyncio
import threading

import pytest

from bridge.northbound.logins import PasswordChecks, TooManyChecks


class Gated:
    """Checks that wait until they are let go."""

    def __init__(self) -> None:
        self.order: list[str] = []
        self.go = threading.Event()

    def __call__(self, password_hash: str | None, password: str) -> bool:
        self.go.wait(5)
        self.order.append(password)
        return password_hash == password


async def asked(checks: PasswordChecks, *pairs: tuple[str, str]) -> list[asyncio.Task[bool]]:
    """Tasks that ask for these passwords from these addresses, and wait."""
    tasks: list[asyncio.Task[bool]] = []
    for password, address in pairs:
        tasks.append(asyncio.create_task(checks.is_right("right", password, address)))
        await asyncio.sleep(0)
    return tasks


async def test_addresses_take_turns_and_of_one_the_newest_and_the_oldest() -> None:
    gated = Gated()
    checks = PasswordChecks(gated)
    tasks = await asked(
        checks, ("first", "z"), *((f"a{number}", "a") for number in range(4)), ("b0", "b"), ("b1", "b")
    )
    gated.go.set()
    await asyncio.gather(*tasks)
    assert gated.order == ["first", "a3", "b1", "a0", "b0", "a2", "a1"]
    checks.close()


async def test_one_that_was_right_is_known_again_without_waiting() -> None:
    gated = Gated()
    gated.go.set()
    checks = PasswordChecks(gated)
    assert await checks.is_right("right", "right", "a")
    assert await checks.is_right("right", "right", "b")
    assert gated.order == ["right"]
    assert not await checks.is_right("right", "wrong", "a")
    assert not await checks.is_right("right", "wrong", "a")
    assert gated.order == ["right", "wrong", "wrong"], "a wrong one is checked each time"
    checks.close()


async def test_a_user_that_does_not_exist_is_checked_each_time() -> None:
    gated = Gated()
    gated.go.set()
    checks = PasswordChecks(lambda line, password: gated(line, password) or True)
    for _ in range(2):
        await checks.is_right(None, "x", "a")
    assert gated.order == ["x", "x"]
    checks.close()


async def test_no_more_wait_than_may() -> None:
    gated = Gated()
    checks = PasswordChecks(gated, most=2)
    tasks = await asked(checks, ("under way", "a"), ("1", "a"), ("2", "b"))
    with pytest.raises(TooManyChecks):
        await checks.is_right("right", "3", "c")
    gated.go.set()
    await asyncio.gather(*tasks)
    checks.close()


async def test_who_goes_before_its_turn_is_not_checked() -> None:
    gated = Gated()
    checks = PasswordChecks(gated)
    first, gone, last = await asked(checks, ("first", "a"), ("gone", "b"), ("last", "c"))
    gone.cancel()
    await asyncio.sleep(0)
    gated.go.set()
    assert not await first
    assert not await last
    assert gated.order == ["first", "last"]
    checks.close()


async def test_a_check_that_fails_is_not_right_and_the_next_has_its_turn() -> None:
    def verify(line: str | None, password: str) -> bool:
        if password == "bad":
            raise MemoryError
        return True

    checks = PasswordChecks(verify)
    assert not await checks.is_right("x", "bad", "a")
    assert await checks.is_right("x", "good", "a")
    checks.close()
