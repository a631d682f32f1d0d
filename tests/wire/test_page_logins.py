"""Logins at the page by those who have none, or more of them than anybody needs."""

from __future__ import annotations

import asyncio
import json
from collections import Counter
from collections.abc import AsyncGenerator

import pytest

from tests.support.page import Answer, Served, message


@pytest.fixture
async def served() -> AsyncGenerator[Served]:
    async with Served().serving() as page:
        yield page


async def guess(served: Served, user: str, password: str) -> Answer:
    body = json.dumps({"user": user, "password": password}).encode()
    return await served.ask("POST", "/api/login", body)


async def test_guesses_at_once_are_not_looked_at_more_often_than_one_after_the_other(served: Served) -> None:
    answers = await asyncio.gather(*(guess(served, "engineer", f"guess {n}") for n in range(30)))
    statuses = Counter(answer.status for answer in answers)
    assert statuses.keys() == {403, 429}
    assert statuses[403] <= 6
    assert all(one.json["pause_s"] > 0 for one in answers if one.status == 429)


async def test_a_login_of_ones_own_does_not_help_to_guess_another(served: Served) -> None:
    looked_at = 0
    for n in range(5):
        for guessed in range(4):
            looked_at += (await guess(served, "engineer", f"guess {n} {guessed}")).status == 403
        assert (await guess(served, "observer", "observer!")).status == 200
    assert looked_at <= 7


async def test_visitors_without_a_cookie_end_no_tab_that_is_open() -> None:
    async with Served("operator").serving() as served:
        first = await served.ask("GET", "/api/session")
        cookie, token = first.headers["set-cookie"].partition(";")[0], first.json["token"]
        async with served.live(cookie) as tab:
            await tab.send(token)
            await message(tab, "you")
            for _ in range(40):
                await served.ask("GET", "/api/session")
            for _ in range(3):
                await message(tab, "now")
            assert (await served.ask("GET", "/api/site", Cookie=cookie)).status == 200
