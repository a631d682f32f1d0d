"""Requests that take long, a bounded number of them; no server."""

from __future__ import annotations

import asyncio

import pytest
from asyncua import ua

from bridge.uaserver.library import ServiceError
from bridge.uaserver.undertakings import Undertakings, finish

Codes = ua.StatusCodes


async def test_there_is_room_for_so_many_and_then_for_the_next_when_one_has_ended() -> None:
    under_way, gate = Undertakings(), asyncio.Event()

    async def work() -> None:
        await gate.wait()

    for _ in range(32):
        await asyncio.wait_for(under_way.room(), 1)
        under_way.begin(work())
    waiting = asyncio.create_task(under_way.room())
    await asyncio.sleep(0)
    assert not waiting.done()
    gate.set()
    await asyncio.wait_for(waiting, 1)


async def test_what_can_be_cancelled_is_answered_once_and_the_rest_goes_on() -> None:
    under_way, refused = Undertakings(), list[int]()

    async def work() -> None:
        await asyncio.get_running_loop().create_future()

    for handle in (7, 7, 8, None):
        under_way.begin(finish(work(), lambda: True, refused.append), handle)
    await asyncio.sleep(0)
    assert (under_way.cancel(7), under_way.cancel(7), under_way.cancel(9)) == (2, 0, 0)
    await asyncio.sleep(0)
    assert refused == 2 * [Codes.BadRequestCancelledByClient]
    under_way.cancel_all()


@pytest.mark.parametrize("is_open", [True, False])
async def test_a_fault_is_answered_where_somebody_is_there(is_open: bool) -> None:
    refused = list[int]()

    async def work() -> None:
        raise ServiceError(Codes.BadMaxAgeInvalid)

    await finish(work(), lambda: is_open, refused.append)
    assert refused == ([Codes.BadMaxAgeInvalid] if is_open else [])
