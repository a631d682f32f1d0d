"""Times at which requests came."""

from __future__ import annotations

import asyncio

from bridge.uaserver.arrivals import NEVER, received_at


async def test_each_request_has_its_own_also_in_the_tasks_that_are_made_for_it() -> None:
    async def carried_out() -> float | None:
        await asyncio.sleep(0)
        return received_at.get()

    async def request(at: float) -> float | None:
        received_at.set(at)
        return await asyncio.create_task(carried_out())

    times = [1.0, NEVER, 2.0]
    assert await asyncio.gather(*(asyncio.create_task(request(at)) for at in times)) == times
    assert received_at.get() is None


def test_what_may_have_waited_for_ever_is_older_than_anything() -> None:
    assert min(-1e300, NEVER) == NEVER
