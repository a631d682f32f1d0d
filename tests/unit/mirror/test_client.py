"""Reads after an outcome: it names the delta that shows the change."""

from __future__ import annotations

import asyncio
import time
from dataclasses import dataclass, field
from typing import cast

import pytest

from bridge.command import Action, Code, Command, Do, Identity, Outcome, Plant, Request, Source, TakeControl
from bridge.command.drive_link import NodeState
from bridge.image import Point, Quality
from bridge.mirror import MirrorClient, MirrorPublisher, protocol
from bridge.mirror import client as mirror_client
from bridge.mirror.protocol import Answered, Changed, Delta, Snapshot
from bridge.text import Text
from bridge.zenohlink import IncomingQuery, Sample
from tests.support.views import view_of
from tests.support.zenoh_site import READY, drive_says, epoch, make_plant, node_is

SCADA = Identity(Source.OPCUA, "ann")
INSTANCE = 7


@dataclass
class Query:
    """A front's query; ``sent`` is what it is answered."""

    payload: bytes
    key: str = protocol.key_of(protocol.REQUESTS, "opcua")
    sent: list[Sample] = field(default_factory=list[Sample])
    is_finished: bool = False

    def send(self, messages: list[Sample]) -> None:
        self.sent += messages

    def finish(self) -> None:
        self.is_finished = True

    def answered(self) -> Answered:
        (message,) = self.sent
        return protocol.decode(Answered, message.payload)


class Bus:
    """A bus process; ``deltas`` is what it has published. All points have been seen."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, further: int = 0) -> None:
        self.plant: Plant = make_plant(further=further)
        node_is(self.plant, NodeState.OPERATIONAL)
        drive_says(self.plant.drives["conveyor/fu4"], READY)
        self.deltas: list[Delta] = []
        self.publisher = MirrorPublisher(
            view_of(self.plant, epoch_ns=epoch), "unixsock-stream/none", time.monotonic
        )
        monkeypatch.setattr(self.publisher._link, "send", self._on_message)
        self.count = len(self.plant.image.points)
        self.publisher._feed.take(self.count)

    def _on_message(self, message: Sample) -> bool:
        self.deltas.append(protocol.decode_delta(message.payload, self.count))
        return True

    def ask(self, target: str, command: Command) -> Query:
        request = Request(SCADA, target, command, time.monotonic())
        query = Query(protocol.encode_request(request, time.monotonic() + 5))
        self.publisher._on_request(cast("IncomingQuery", query))
        return query

    def names(self) -> list[str]:
        points = self.plant.image.points
        return [points[changed.index].name for delta in self.deltas for changed in delta.readings]


@pytest.fixture
def bus(monkeypatch: pytest.MonkeyPatch) -> Bus:
    return Bus(monkeypatch)


async def test_an_outcome_names_the_delta_that_shows_what_it_has_changed(bus: Bus) -> None:
    answered = bus.ask("conveyor/fu4", TakeControl(ttl_ms=5000)).answered()
    assert answered.outcome.ok
    assert "conveyor/fu4/supervision/owner" in bus.names()
    assert (answered.instance, answered.sequence) == (bus.deltas[-1].instance, bus.deltas[-1].sequence)


async def test_a_telegram_is_counted_where_it_is_answered(bus: Bus) -> None:
    bus.ask("conveyor/fu4", TakeControl(ttl_ms=5000))
    bus.deltas.clear()
    bus.ask("conveyor/fu4", Do(Action.KEEP_ALIVE))
    assert "conveyor/fu4/supervision/telegrams" in bus.names()


async def test_a_request_does_not_publish_what_is_not_its_target_s(bus: Bus) -> None:
    """Else a busy client would have everything published that often."""
    everything = range(bus.count)
    bus.plant.image.judge(everything, Quality.STALE, time.monotonic())
    bus.ask("conveyor/fu4", Do(Action.KEEP_ALIVE))
    assert all(name.startswith(("conveyor/fu4/", "conveyor/node/")) for name in bus.names())
    assert len(bus.publisher._feed) == bus.count - len(bus.names()), "the others wait for their turn"


async def test_where_nothing_has_changed_an_answer_costs_no_delta(bus: Bus) -> None:
    query = bus.ask("nobody/fu9", Do(Action.KEEP_ALIVE))
    assert query.answered().outcome.code is Code.UNKNOWN_TARGET
    assert query.is_finished
    assert not bus.deltas


async def test_a_command_for_a_whole_bus_is_answered_behind_all_that_waits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    bus = Bus(monkeypatch, further=4)
    bus.plant.image.judge(range(bus.count), Quality.STALE, time.monotonic())
    query = bus.ask("bus/can0", Do(Action.RESET))
    assert not query.sent, "the bus has its turn between two deltas"
    for _ in range(20):
        await asyncio.sleep(0)
    assert len(bus.names()) == bus.count
    assert query.answered().sequence == bus.deltas[-1].sequence


# in the front


def read(value: int) -> tuple[Changed, ...]:
    return (Changed(0, value, Quality.GOOD, 1.0, ""),)


def delta(sequence: int, value: int) -> Sample:
    return Sample(protocol.DELTA, protocol.encode(Delta(INSTANCE, sequence, read(value))))


@pytest.fixture
def front() -> MirrorClient:
    """In step with delta 1."""
    point = Point(name="bridge/drives_good", data_type=make_plant().image.points[0].data_type)
    client = MirrorClient("unixsock-stream/none")
    client._apply_snapshot(Snapshot(INSTANCE, 1, (point,), read(1)))
    return client


async def waiting(front: MirrorClient, sequence: int, instance: int = INSTANCE) -> asyncio.Task[None]:
    answered = Answered(Outcome(Code.OK), instance, sequence)
    task = asyncio.create_task(front._follow_to(answered))
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    return task


async def test_what_the_image_shows_already_is_answered_at_once(front: MirrorClient) -> None:
    assert (await waiting(front, 1)).done()


async def test_a_value_that_was_read_again_has_the_later_time(front: MirrorClient) -> None:
    told = Delta(INSTANCE, 2, (Changed(0, 1, Quality.GOOD, 5.0, ""),))
    front._on_delta(Sample(protocol.DELTA, protocol.encode(told)))
    assert (front.image[0].value, front.image[0].time) == (1, 5.0)


async def test_a_text_is_shown_in_words_and_known_as_what_it_is(front: MirrorClient) -> None:
    said = Text.of("node.lost")
    told = Delta(INSTANCE, 2, (Changed(0, said, Quality.GOOD, 1.0, ""),))
    front._on_delta(Sample(protocol.DELTA, protocol.encode(told)))
    assert (front.image[0].value, front.image.said(0)) == ("node lost", said)


async def test_an_answer_waits_for_its_delta_and_no_longer(front: MirrorClient) -> None:
    answer = await waiting(front, 3)
    front._on_delta(delta(2, 2))
    await asyncio.sleep(0)
    assert not answer.done()
    front._on_delta(delta(3, 3))
    await answer
    assert front.image[0].value == 3


async def test_a_snapshot_brings_what_a_missed_delta_would_have(front: MirrorClient) -> None:
    answer = await waiting(front, 3)
    front._on_delta(delta(4, 4))
    assert front.gaps == 1
    await asyncio.sleep(0)
    assert not answer.done()
    front._apply_snapshot(Snapshot(INSTANCE, 4, front.image.points, read(4)))
    await answer


async def test_where_nothing_follows_no_value_looks_current_when_the_answer_comes(
    front: MirrorClient, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mirror_client, "_MOST_BEHIND_S", 0.01)
    await front._follow_to(Answered(Outcome(Code.OK), INSTANCE, 9))
    assert front.image[0].quality is Quality.DEAD


async def test_an_answer_of_a_bus_process_that_has_started_anew_waits_for_its_snapshot(
    front: MirrorClient,
) -> None:
    answer = await waiting(front, 1, instance=INSTANCE + 1)
    assert not answer.done()
    front._apply_snapshot(Snapshot(INSTANCE + 1, 2, front.image.points, read(5)))
    await answer
    assert front.image[0].value == 5


async def test_who_waits_is_answered_when_the_bus_process_has_gone(front: MirrorClient) -> None:
    answer = await waiting(front, 2)
    front._on_token("", False)
    await answer
    assert front.image[0].quality is Quality.DEAD
