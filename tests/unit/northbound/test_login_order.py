"""In what order passwords are checked; with a check that the test ends."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Iterator

import pytest

from bridge.northbound.logins import PasswordChecks, TooManyChecks

RIGHT = "swordfish"
ATTACKER, CLIENT = "10.0.0.9", "10.0.0.1"
LIMIT_S = 20.0


class Bench:
    """Each check waits until it is let go; ``begun`` are the passwords in the order of their checks."""

    def __init__(self) -> None:
        self.begun: list[str] = []
        self.ended = 0
        self._asked: list[asyncio.Task[bool]] = []
        self._go = threading.Semaphore(0)
        self.checks = PasswordChecks(self._verify)

    def _verify(self, password_hash: str | None, password: str) -> bool:
        self.begun.append(password)
        self._go.acquire()
        if password == "broken":
            raise MemoryError
        return password == RIGHT

    def ask(self, password: str, address: str = ATTACKER, known: str | None = "hash") -> asyncio.Task[bool]:
        task = asyncio.create_task(self.checks.is_right(known, password, address))
        self._asked.append(task)
        return task

    async def end(self, count: int) -> None:
        """End so many checks one after the other, or as many as there are."""
        for _ in range(count):
            if not await self.begins():
                return
            self._go.release()
            self.ended += 1
            await self.begins()

    async def begins(self) -> bool:
        """Wait for a check that goes on; False where nobody waits for one any more."""
        async with asyncio.timeout(LIMIT_S):
            while len(self.begun) == self.ended:
                await asyncio.sleep(0.001)
                if all(task.done() for task in self._asked):
                    return False
        # The one before has ended in the loop, and is told to who asked for it.
        await asyncio.sleep(0)
        return True

    def close(self) -> None:
        self.checks.close()
        self._go.release(len(self._asked))


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.close()


@pytest.mark.parametrize("address", [CLIENT, ATTACKER], ids=["another address", "the same address"])
async def test_twenty_wrong_ones_hold_up_a_right_one_for_two_checks_at_most(
    bench: Bench, address: str
) -> None:
    wrong = [bench.ask(f"wrong {n}") for n in range(20)]
    await bench.end(3)
    right = bench.ask(RIGHT, address)
    await bench.end(3)
    assert right.done()
    assert await right
    assert sum(task.done() for task in wrong) <= 5
    await bench.end(20)
    assert [await task for task in wrong] == [False] * 20


async def test_a_stream_of_new_ones_does_not_hold_up_an_old_one(bench: Bench) -> None:
    bench.ask("first")
    right = bench.ask(RIGHT)
    stream = [bench.ask(f"wrong {n}") for n in range(3)]
    for n in range(6):
        await bench.end(1)
        stream.append(bench.ask(f"later {n}"))
    assert right.done()
    await bench.end(20)
    await asyncio.gather(*stream)


async def test_one_that_was_right_is_known(bench: Bench) -> None:
    first = bench.ask(RIGHT)
    await bench.end(1)
    assert await first
    for n in range(5):
        bench.ask(f"wrong {n}")
    assert await bench.begins()
    assert await asyncio.wait_for(bench.ask(RIGHT), 1)
    again = bench.ask(RIGHT, known="hash of another user")
    await bench.end(1)
    assert not again.done(), "known for one hash is nothing for another"
    await bench.end(10)
    assert RIGHT not in str(vars(bench.checks))


async def test_who_has_gone_is_not_checked(bench: Bench) -> None:
    bench.ask("first")
    assert await bench.begins()
    gone = [bench.ask(f"gone {n}") for n in range(3)]
    await asyncio.sleep(0)
    for task in gone:
        task.cancel()
    await asyncio.gather(*gone, return_exceptions=True)
    await bench.end(3)
    last = bench.ask(RIGHT)
    await bench.end(1)
    assert await last
    assert bench.begun == ["first", RIGHT]


async def test_a_check_that_fails_is_a_wrong_password_and_the_next_one_has_its_turn(bench: Bench) -> None:
    broken, right = bench.ask("broken"), bench.ask(RIGHT)
    await bench.end(2)
    assert not await broken
    assert await right


async def test_no_more_wait_than_may_and_a_known_one_never_does(bench: Bench) -> None:
    bench.checks._most = 8
    right = bench.ask(RIGHT)
    await bench.end(1)
    assert await right
    waiting = [bench.ask(f"wrong {n}") for n in range(9)]  # one of them is being checked
    await bench.begins()
    with pytest.raises(TooManyChecks):
        await bench.checks.is_right("hash", "one too many", CLIENT)
    assert await bench.checks.is_right("hash", RIGHT, CLIENT)
    await bench.end(9)
    assert [await one for one in waiting] == [False] * 9
