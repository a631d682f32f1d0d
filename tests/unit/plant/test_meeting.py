"""The socket between the bus process and its fronts."""

from __future__ import annotations

from collections.abc import Coroutine
from typing import Any

import pytest

from bridge.zenohlink import GetReply, Sample
from tests.plant.machine import Process
from tests.plant.meeting import Meeting, Query
from tests.plant.world import World
from tests.unit.plant.test_machine import Nobody


class Scene:
    """Two ends, each in a process of its own."""

    def __init__(self) -> None:
        self.world = World()
        self.meeting = Meeting(self.world)
        self.processes = [Process(self.world, Nobody(), []) for _ in range(2)]
        self.bus, self.front = (self.meeting.link(process) for process in self.processes)
        self.seen: list[str] = []
        for link in (self.bus, self.front):
            self.does(link.open())

    def does(self, work: Coroutine[Any, Any, object], place: int = 0) -> None:
        def begin() -> None:
            self.processes[place].loop.create_task(work)

        self.processes[place].post(begin)
        self.passes(0.01)

    def passes(self, seconds: float) -> None:
        self.world.run_until(self.world.now + seconds)

    async def ask(self) -> None:
        answers: list[GetReply] = await self.front.get("ask/one", b"?", timeout_s=1.0)
        self.seen.append(" ".join(one.message.payload.decode() for one in answers) or "nothing")


@pytest.fixture
def scene() -> Scene:
    return Scene()


def test_samples_keep_their_order_and_wait_for_a_process_that_hangs(scene: Scene) -> None:
    scene.front.declare_subscriber("told", lambda sample: scene.seen.append(sample.payload.decode()))
    scene.processes[1].hang(1.0, in_turn=False)
    for number in b"123":
        scene.bus.send(Sample("told", bytes((number,))))
    scene.bus.send(Sample("other", b"4"))
    scene.passes(0.9)
    assert scene.seen == []
    scene.passes(0.2)
    assert scene.seen == ["1", "2", "3"]


def test_who_publishes_is_told_of_readers(scene: Scene) -> None:
    scene.bus.follow_readers("told", lambda are_there: scene.seen.append(str(are_there)))
    scene.front.declare_subscriber("told", lambda sample: None)
    scene.passes(0.01)
    scene.front.drop_subscriber("told")
    scene.passes(0.01)
    assert scene.seen == ["True", "False"]


def test_a_query_is_answered(scene: Scene) -> None:
    def answer(query: Query) -> None:
        query.send([Sample(query.key, b"answer")])
        query.finish()

    scene.bus.declare_queryable("ask/*", answer)
    scene.does(scene.ask(), 1)
    assert scene.seen == ["answer"]


def test_one_that_nobody_answers_ends(scene: Scene) -> None:
    scene.does(scene.ask(), 1)
    assert scene.seen == ["nothing"]


def test_one_that_is_not_finished_ends_when_its_time_is_over(scene: Scene) -> None:
    scene.bus.declare_queryable("ask/*", lambda query: None)
    scene.does(scene.ask(), 1)
    scene.passes(0.9)
    assert scene.seen == []
    scene.passes(0.2)
    assert scene.seen == ["nothing"]


@pytest.mark.parametrize("is_killed", [True, False])
def test_an_end_that_is_gone_is_known_to_the_other(scene: Scene, is_killed: bool) -> None:
    def told(key: str, is_alive: bool) -> None:
        scene.seen.append(f"{key} {is_alive}")

    scene.bus.declare_token("here")
    scene.front.follow_liveliness("here", told)
    scene.bus.declare_queryable("ask/*", lambda query: None)
    scene.does(scene.ask(), 1)
    if is_killed:
        scene.bus.drop()
    else:
        scene.does(scene.bus.close())
    scene.passes(0.01)
    assert scene.seen == ["here True", "here False", "nothing"]
    assert scene.meeting.links == [scene.front]
