"""Turns of messages by zenoh, whatever others send."""

from __future__ import annotations

import asyncio
from functools import partial

from bridge.northbound.zenoh.keys import KeySpace
from bridge.zenohlink.worker import CallQueue

FLOOD = 5000


async def until(came: list[str], count: int) -> None:
    for _ in range(count):
        if len(came) >= count:
            return
        await asyncio.sleep(0)
    raise AssertionError(f"{len(came)} of {count} came")


async def test_who_floods_takes_no_room_of_another_share() -> None:
    inbox = CallQueue()
    came: list[str] = []
    taken = sum(inbox.take_in(partial(came.append, "read"), "reads") for _ in range(FLOOD))
    assert 0 < taken < FLOOD
    assert all(inbox.take_in(partial(came.append, f"command {number}"), "commands") for number in range(10))
    await until(came, taken + 10)
    commands = [place for place, call in enumerate(came) if call != "read"]
    assert commands[-1] <= 20, "their turns come between the others'"
    assert [came[place] for place in commands] == [f"command {number}" for number in range(10)]


async def test_of_many_shares_none_waits_for_another_flood() -> None:
    """More than are handled in one go."""
    inbox = CallQueue()
    came: list[str] = []
    shares = [f"@/controller/plc{number}" for number in range(50)]
    for share in shares:
        for _ in range(20):
            assert inbox.take_in(partial(came.append, share), share)
    await until(came, 50 * 20)
    for begin in range(0, len(came), 200):
        assert len(set(came[begin : begin + 200])) == 50


async def test_shares_are_not_made_without_end() -> None:
    inbox = CallQueue()
    came: list[str] = []
    taken = sum(inbox.take_in(partial(came.append, "x"), f"@/controller/{number}") for number in range(FLOOD))
    assert taken < FLOOD
    await until(came, taken)
    assert inbox.take_in(partial(came.append, "y"), "commands")
    await until(came, taken + 1)


def test_who_reads_who_commands_and_each_user_have_shares_of_their_own() -> None:
    space = KeySpace("drives", "demo", ())
    assert space.share("drives/demo/conveyor/fu3/actual/frequency", None) == "reads"
    assert space.share("drives/demo/**", None) == "reads"
    commands = {
        space.share("drives/demo/conveyor/fu3/command/frequency", b"25.0"),
        space.share("drives/demo/conveyor/fu3/command/stop", None),
        space.share("drives/demo/conveyor/fu3/supervision/fieldbus_timeout_ms", b"500"),
        space.share("drives/demo/conveyor/node/reset", b"{}"),
    }
    assert commands == {"commands"}
    own = "drives/demo/@/controller"
    users = {space.share(f"{own}/{user}/conveyor/fu3/command/stop", None) for user in ("plc", "hmi")}
    assert len(users | commands | {"reads"}) == 4
