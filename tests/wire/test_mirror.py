"""The image of the bus process in another one, and requests back."""

from __future__ import annotations

import asyncio
import random
import signal
import stat
import sys
import tempfile
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager
from dataclasses import replace
from functools import partial
from pathlib import Path

import pytest
import zenoh

from bridge.base.errors import Unavailable
from bridge.command import (
    Action,
    Code,
    Command,
    Do,
    Event,
    EventKind,
    Identity,
    Outcome,
    Plant,
    Request,
    Role,
    Source,
    Start,
    TakeControl,
    Write,
)
from bridge.command.drive_link import NodeState
from bridge.image import Image, Quality, Value
from bridge.mirror import MirrorClient, MirrorPublisher, PointsChanged, protocol, socket_endpoint
from bridge.mirror import client as mirror_client
from bridge.mirror.client import UNREACHABLE
from bridge.mirror.endpoint import socket_path
from bridge.northbound.view import View
from bridge.text import Text
from bridge.zenohlink import IncomingQuery, Sample, ZenohLink, zenoh_config
from tests.support.outcomes import in_english
from tests.support.views import view_of
from tests.support.zenoh_peer import until
from tests.support.zenoh_site import ENABLED, READY, drive_says, epoch, make_plant, node_is

BUS = Path(__file__).parent / "peers" / "mirror_bus.py"
SCADA = Identity(Source.OPCUA, "ann", Role.OPERATOR, "10.0.0.7:5123")


@pytest.fixture
def endpoint() -> Iterator[str]:
    # Not tmp_path: pytest's folders can be too deep for a socket.
    with tempfile.TemporaryDirectory(prefix="db-") as folder:
        yield socket_endpoint(Path(folder) / "run", "demo")


@asynccontextmanager
async def publishing(endpoint: str, plant: Plant) -> AsyncIterator[MirrorPublisher]:
    publisher = MirrorPublisher(view_of(plant, epoch_ns=epoch), endpoint, time.monotonic)
    await publisher.start()
    try:
        yield publisher
    finally:
        await publisher.close()


@asynccontextmanager
async def front(endpoint: str) -> AsyncIterator[MirrorClient]:
    client = MirrorClient(endpoint)
    await asyncio.wait_for(client.open(), 20)
    running = asyncio.create_task(client.run())
    try:
        yield client
    finally:
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)
        await client.close()


@asynccontextmanager
async def bus_process(endpoint: str, *node: str) -> AsyncIterator[asyncio.subprocess.Process]:
    process = await asyncio.create_subprocess_exec(
        sys.executable, str(BUS), endpoint, *node, stdout=asyncio.subprocess.PIPE
    )
    assert process.stdout
    assert await asyncio.wait_for(process.stdout.readline(), 20) == b"ready\n"
    try:
        yield process
    finally:
        if process.returncode is None:
            process.kill()
        await process.wait()


def in_step(client: MirrorClient) -> bool:
    return client._in_step and not client._is_dead


def shown(image: Image) -> list[tuple[Value, Quality, str]]:
    return [(r.value, r.quality, r.reason) for r in (image[i] for i in range(len(image.points)))]


async def test_the_front_sees_what_the_bus_process_sees(endpoint: str) -> None:
    plant = make_plant()
    node_is(plant, NodeState.OPERATIONAL)
    async with publishing(endpoint, plant), front(endpoint) as client:
        view: View = client
        assert view.image.points == plant.image.points
        assert shown(view.image) == shown(plant.image)
        before = time.time()
        drive_says(plant.drives["conveyor/fu1"], ENABLED, 0x2000)
        await until(lambda: view.image.read("conveyor/fu1/actual/frequency").value == 25.0, "25 Hz")
        reading = view.image.read("conveyor/fu1/actual/frequency")
        assert reading.quality is Quality.GOOD
        assert abs(reading.time - before) < 5
        assert abs(view.epoch_ns(reading.time) / 1e9 - reading.time) < 1e-6


async def test_a_front_that_hurries_need_not_wait_for_the_next_delta(endpoint: str) -> None:
    plant = make_plant()
    node_is(plant, NodeState.OPERATIONAL)
    async with publishing(endpoint, plant) as publisher, front(endpoint) as client:
        client.hurry(is_wanted=True)
        await until(lambda: publisher._prompt_feed is not None, "it is known that it hurries")
        publisher._pace.stop()
        for hz in (25.0, 12.5):
            drive_says(plant.drives["conveyor/fu1"], ENABLED, round(hz / 50 * 0x4000))
            await until(
                lambda hz=hz: client.image.read("conveyor/fu1/actual/frequency").value == hz, "the value"
            )
        client.hurry(is_wanted=False)
        await until(lambda: publisher._prompt_feed is None, "and that it does no more")
        publisher._pace.start()
        await until(
            lambda: in_step(client) and shown(client.image) == shown(plant.image), "the deltas have it all"
        )
        assert client.gaps == 0


async def test_what_is_told_in_a_hurry_and_lost_comes_with_the_next_delta(endpoint: str) -> None:
    plant = make_plant()
    node_is(plant, NodeState.OPERATIONAL)
    async with publishing(endpoint, plant) as publisher, front(endpoint) as client:
        client.hurry(is_wanted=True)
        await until(lambda: publisher._prompt_feed is not None, "it is known that it hurries")
        publisher._prompt_pace._turn = lambda: None
        drive_says(plant.drives["conveyor/fu1"], ENABLED, 0x2000)
        await until(lambda: client.image.read("conveyor/fu1/actual/frequency").value == 25.0, "25 Hz")


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


async def test_the_socket_is_for_us_alone(endpoint: str) -> None:
    async with publishing(endpoint, make_plant()):
        path = socket_path(endpoint)
        assert mode(path) == 0o600
        assert mode(path.parent) == 0o700


async def test_ten_thousand_changes_lead_to_the_same_image(endpoint: str) -> None:
    plant = make_plant()
    chance, whys = random.Random(7), ("", Text.plain("because"))
    async with publishing(endpoint, plant), front(endpoint) as client, front(endpoint) as second:
        followed = client.image.feed()
        followed.take(10**6)
        for count in range(10_000):
            index = chance.randrange(len(plant.image.points))
            zero = plant.image.points[index].data_type.zero
            value = type(zero)(chance.randrange(2 if isinstance(zero, bool) else 200))
            quality = chance.choice(list(Quality))
            plant.image.set(index, value, time.monotonic(), quality, chance.choice(whys))
            if count % 100 == 0:
                await asyncio.sleep(0.001)
        for other in (client, second):
            await until(lambda other=other: shown(other.image) == shown(plant.image), "the same image")
        assert client.gaps == 0 and client.malformed == 0
        assert len(followed) > 50
        times = [abs(client.image[i].time - time.time()) for i in range(len(plant.image.points))]
        assert min(times) < 60


async def test_a_request_carries_its_identity_and_brings_one_outcome(endpoint: str) -> None:
    plant = make_plant()
    node_is(plant, NodeState.OPERATIONAL)
    drive_says(plant.drives["conveyor/fu4"], READY)
    async with publishing(endpoint, plant), front(endpoint) as client:
        take = Request(SCADA, "conveyor/fu4", TakeControl(ttl_ms=5000))
        assert await client.request(take) == Outcome(Code.OK)
        assert plant.drives["conveyor/fu4"].channel.owner == SCADA
        write = Request(SCADA, "conveyor/fu4", Write({"control_word": 0x047E, "setpoint_1": 0x1000}))
        assert (await client.request(write)).ok
        assert plant.drives["conveyor/fu4"].channel.output.words == (0x047E, 0x1000, 0, 0, 0)
        refused = await client.request(Request(SCADA, "conveyor/fu1", Write({"control_word": 0x047E})))
        assert in_english(refused) == Outcome(
            Code.NOT_ALLOWED, "the drive is controlled by modbus", forwarded=False
        )
        engineer = Identity(Source.OPCUA, "eve", Role.ENGINEER)
        assert (await client.request(Request(engineer, "conveyor/fu4", TakeControl(ttl_ms=500)))).ok


async def test_when_an_outcome_comes_the_front_shows_what_it_is_about(endpoint: str) -> None:
    plant = make_plant()
    node_is(plant, NodeState.OPERATIONAL)
    drive_says(plant.drives["conveyor/fu4"], READY)
    async with publishing(endpoint, plant), front(endpoint) as client:
        assert (await client.request(Request(SCADA, "conveyor/fu4", TakeControl(ttl_ms=60_000)))).ok
        assert client.image.read("conveyor/fu4/supervision/owner").value == "opcua:ann"
        for setpoint in range(0x1000, 0x1000 + 300):
            write = Write({"control_word": 0x047E, "setpoint_1": setpoint})
            assert (await client.request(Request(SCADA, "conveyor/fu4", write))).ok
            assert client.image.read("conveyor/fu4/command/setpoint_1").value == setpoint
        assert (await client.request(Request(SCADA, "conveyor/fu4", Do(Action.RELEASE_CONTROL)))).ok
        assert client.image.read("conveyor/fu4/supervision/owner").value == ""
        assert client.gaps == 0


async def test_a_start_that_takes_its_time_holds_up_no_other_request(endpoint: str) -> None:
    plant = make_plant()
    node_is(plant, NodeState.OPERATIONAL)
    fu4 = plant.drives["conveyor/fu4"]
    drive_says(fu4, READY)
    async with publishing(endpoint, plant), front(endpoint) as client:
        assert (await client.request(Request(SCADA, "conveyor/fu4", TakeControl(ttl_ms=9000)))).ok
        start = asyncio.create_task(client.request(Request(SCADA, "conveyor/fu4", Start())))
        keep = Request(SCADA, "conveyor/fu4", Do(Action.KEEP_ALIVE))
        begin = time.monotonic()
        outcomes = await asyncio.gather(*(client.request(keep) for _ in range(300)))
        assert all(outcome.ok for outcome in outcomes), outcomes
        assert time.monotonic() - begin < 3
        assert not start.done()
        drive_says(fu4, ENABLED)
        plant.deliver_outcomes()
        assert await start == Outcome(Code.OK)


async def test_what_a_front_submits_after_a_session_has_ended_finds_it_ended(endpoint: str) -> None:
    """One session after the other of one user: each goes on where the one before was."""
    plant = make_plant()
    node_is(plant, NodeState.OPERATIONAL)
    fu4 = plant.drives["conveyor/fu4"]
    drive_says(fu4, READY)
    outcomes: list[Outcome] = []
    async with publishing(endpoint, plant), front(endpoint) as client:
        sessions = [replace(SCADA, connection=f"session {number}") for number in range(100)]
        assert (await client.request(Request(sessions[0], "conveyor/fu4", TakeControl(60_000)))).ok
        stranger = Request(sessions[1], "conveyor/fu4", Do(Action.KEEP_ALIVE))
        refused = await client.request(stranger)
        assert refused.message == "the drive is controlled by opcua:ann session 0"
        for session in sessions:
            client.on_connection(session, is_there=True)
            client.submit(Request(session, "conveyor/fu4", Do(Action.KEEP_ALIVE)), outcomes.append)
            client.on_connection(session, is_there=False, has_others=True)
        await until(lambda: len(outcomes) == len(sessions), "every answer")
        assert all(outcome.ok for outcome in outcomes), outcomes


async def test_a_request_that_waited_too_long_moves_nothing_but_may_stop(endpoint: str) -> None:
    plant = make_plant()
    node_is(plant, NodeState.OPERATIONAL)
    fu4 = plant.drives["conveyor/fu4"]
    drive_says(fu4, READY)
    async with publishing(endpoint, plant):
        late = MirrorClient(endpoint, clock=lambda: time.monotonic() - 60)
        await late.open()
        outcome = await late.request(Request(SCADA, "conveyor/fu4", TakeControl(ttl_ms=5000)))
        assert outcome.code is Code.TIMED_OUT and fu4.channel.owner is None
        assert (await late.request(Request(SCADA, "conveyor/fu4", Do(Action.STOP)))).ok
        await late.close()


async def test_an_owner_stops_its_drive_however_late_it_comes(endpoint: str) -> None:
    """Its control word that does not enable, and its release; one that enables comes too late."""
    plant = make_plant()
    node_is(plant, NodeState.OPERATIONAL)
    fu4 = plant.drives["conveyor/fu4"]
    drive_says(fu4, READY)

    def asks(command: Command) -> Request:
        return Request(SCADA, "conveyor/fu4", command)

    stop, run = Write({"control_word": 0x047E}), Write({"control_word": 0x047F})
    async with publishing(endpoint, plant), front(endpoint) as client:
        late = MirrorClient(endpoint, clock=lambda: time.monotonic() - 60)
        await late.open()
        for command in (TakeControl(ttl_ms=5000), stop, run):
            assert (await client.request(asks(command))).forwarded
        assert fu4.channel.output.words[0] == 0x047F
        assert (await late.request(asks(stop))).ok
        assert fu4.channel.output.words[0] == 0x047E
        assert not (await late.request(asks(run))).ok
        assert fu4.channel.output.words[0] == 0x047E
        assert (await late.request(asks(Do(Action.RELEASE_CONTROL)))).ok
        assert fu4.channel.owner is None
        await late.close()


async def test_events_arrive_with_wall_clock_time(endpoint: str) -> None:
    plant = make_plant()
    heard: list[Event] = []
    async with publishing(endpoint, plant), front(endpoint) as client:
        client.on_event(heard.append)
        plant.report(Event(time.monotonic(), EventKind.BUS, "can0", 900, Text.plain("bus-off")))
        await until(lambda: heard, "the event")
        assert (heard[0].kind, heard[0].source, heard[0].message) == (EventKind.BUS, "can0", "bus-off")
        assert abs(heard[0].time - time.time()) < 5


async def test_a_missed_delta_is_made_good_by_a_snapshot(endpoint: str) -> None:
    plant = make_plant()
    async with publishing(endpoint, plant) as publisher, front(endpoint) as client:
        publisher._sequence += 1  # as if one had been dropped on the way
        plant.set("bridge/drives_good", 2, time.monotonic())
        await until(lambda: client.gaps == 1, "the gap is noticed")
        await until(lambda: in_step(client) and shown(client.image) == shown(plant.image), "in step again")


async def test_a_front_that_gets_no_snapshot_after_a_gap_passes_no_old_value_off_as_good(
    endpoint: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    plant = make_plant()
    async with publishing(endpoint, plant) as publisher, front(endpoint) as client:

        async def no_answer(asked: IncomingQuery) -> None:
            asked.finish()

        monkeypatch.setattr(publisher, "_answer_snapshot", no_answer)
        publisher._sequence += 1  # as if one had been dropped on the way; those after it do arrive
        plant.set("bridge/drives_good", 2, time.monotonic())
        drives_good = partial(client.image.read, "bridge/drives_good")
        await until(lambda: drives_good().quality is Quality.DEAD, "dead", 2.5)
        assert not in_step(client)
        monkeypatch.undo()
        await until(lambda: shown(client.image) == shown(plant.image), "in step again")


async def test_garbage_on_the_link_does_no_harm(endpoint: str) -> None:
    plant = make_plant()
    async with publishing(endpoint, plant) as publisher, front(endpoint) as client:
        other = ZenohLink(zenoh_config(connect=[endpoint]), "other")
        await other.open()
        (answer,) = await other.get(protocol.key_of(protocol.REQUESTS, "front"), b"\x93\x01\x02")
        assert not answer.ok
        assert not (await other.get(protocol.key_of(protocol.REQUESTS, "front")))[0].ok
        assert publisher.malformed == 2
        await other.close()
        publisher._link.send(Sample(protocol.DELTA, b"nonsense"))
        publisher._link.send(Sample(protocol.EVENT, b"\x91\xc1"))
        await until(lambda: client.malformed == 2, "both are counted")
        plant.set("bridge/drives_good", 1, time.monotonic())
        await until(lambda: shown(client.image) == shown(plant.image), "the client goes on")


async def test_a_second_publisher_is_told_that_the_site_is_run_already(endpoint: str) -> None:
    async with publishing(endpoint, make_plant()):
        second = MirrorPublisher(view_of(make_plant(), epoch_ns=epoch), endpoint, time.monotonic)
        with pytest.raises(Unavailable, match="already being run"):
            await second.start()
        await second.close()


@pytest.mark.landing
async def test_a_killed_bus_process_leaves_every_point_dead_until_it_is_back(endpoint: str) -> None:
    async with bus_process(endpoint) as first, front(endpoint) as client:
        frequency = "conveyor/fu1/actual/frequency"
        await until(lambda: client.image.read(frequency).quality is Quality.GOOD, "values")
        first.kill()
        begin = time.monotonic()
        await until(
            lambda: all((r[1], r[2]) == (Quality.DEAD, str(UNREACHABLE)) for r in shown(client.image)),
            "dead",
            2.0,
        )
        assert time.monotonic() - begin < 2
        assert not in_step(client)
        outcome = await client.request(Request(SCADA, "conveyor/fu1", Do(Action.STOP)), timeout_s=0.5)
        assert in_english(outcome) == Outcome(
            Code.TIMED_OUT, "the bus process did not answer", forwarded=False
        )
        await first.wait()
        # its socket is still there; the next one takes the place
        async with bus_process(endpoint):
            await until(lambda: client.image.read(frequency).quality is Quality.GOOD, "values again", 5)
            assert in_step(client)
            stop = Request(SCADA, "conveyor/fu1", Do(Action.STOP))
            assert (await client.request(stop)).ok


@pytest.mark.landing
async def test_a_hung_bus_process_counts_as_gone_after_a_second(endpoint: str) -> None:
    async with bus_process(endpoint) as process, front(endpoint) as client:
        frequency = "conveyor/fu1/actual/frequency"
        await until(lambda: client.image.read(frequency).quality is Quality.GOOD, "values")
        process.send_signal(signal.SIGSTOP)
        await until(lambda: client.image.read(frequency).quality is Quality.DEAD, "dead", 2.5)
        process.send_signal(signal.SIGCONT)
        await until(lambda: client.image.read(frequency).quality is Quality.GOOD, "good again", 5)


@pytest.mark.landing
async def test_what_is_asked_of_a_bus_process_that_stands_still_is_answered_when_it_goes_on(
    endpoint: str,
) -> None:
    """For as long as neither systemd nor the bus process ends the one that hangs."""
    async with bus_process(endpoint) as process, front(endpoint) as client:
        process.send_signal(signal.SIGSTOP)
        stop = Request(SCADA, "conveyor/fu1", Do(Action.STOP))
        asked = asyncio.create_task(client.request(stop, timeout_s=8))
        await asyncio.sleep(2.5)
        process.send_signal(signal.SIGCONT)
        assert (await asyncio.wait_for(asked, 1)).ok


class HalfOpen(MirrorPublisher):
    """A bus process as zenoh sometimes leaves it after a pause: sessions of before are told of what it
    declares, and get no answer."""

    unanswered: frozenset[str] = frozenset()

    async def peers(self) -> frozenset[str]:
        loop = asyncio.get_running_loop()
        found: asyncio.Future[frozenset[str]] = loop.create_future()

        def look(session: zenoh.Session) -> None:
            peers = frozenset(str(peer) for peer in session.info.peers_zid())
            loop.call_soon_threadsafe(found.set_result, peers)

        self._link.submit(look)
        return await found

    def _on_snapshot(self, asked: IncomingQuery) -> None:
        self._snapshots.add(asyncio.create_task(self._unless_before(asked, super()._on_snapshot)))

    def _on_request(self, asked: IncomingQuery) -> None:
        self._snapshots.add(asyncio.create_task(self._unless_before(asked, super()._on_request)))

    async def _unless_before(self, asked: IncomingQuery, answer: Callable[[IncomingQuery], None]) -> None:
        if await self.peers() - self.unanswered:
            answer(asked)
        else:
            # Kept, and so neither answered nor ended.
            await asyncio.sleep(60)


@pytest.mark.parametrize("deltas_come", [True, False])
async def test_a_front_that_is_never_answered_connects_anew(
    endpoint: str, monkeypatch: pytest.MonkeyPatch, deltas_come: bool
) -> None:
    monkeypatch.setattr(mirror_client, "_RENEW_S", 0.5)
    monkeypatch.setattr(mirror_client, "_SNAPSHOT_TIMEOUT_S", 0.3)
    plant = make_plant()
    node_is(plant, NodeState.OPERATIONAL)
    publisher = HalfOpen(view_of(plant, epoch_ns=epoch), endpoint, time.monotonic)
    await publisher.start()
    stop = Request(SCADA, "conveyor/fu1", Do(Action.STOP))
    async with front(endpoint) as client:
        ended = asyncio.create_task(client.failed())
        assert (await client.request(stop)).ok
        publisher.unanswered = await publisher.peers()
        if not deltas_come:
            client._in_step = False
        assert (await client.request(stop, timeout_s=0.3)).code is Code.TIMED_OUT
        await until(lambda: in_step(client), "in step again", 10)
        assert (await client.request(stop)).ok
        drive_says(plant.drives["conveyor/fu1"], ENABLED, 0x2000)
        await until(lambda: client.image.read("conveyor/fu1/actual/frequency").value == 25.0, "25 Hz")
        assert not ended.done()
    await asyncio.wait_for(ended, 5)
    await publisher.close()


@pytest.mark.landing
async def test_another_site_ends_the_front(endpoint: str) -> None:
    async with bus_process(endpoint):
        client = MirrorClient(endpoint)
        await client.open()
        running = asyncio.create_task(client.run())
    async with bus_process(endpoint, "lift"):
        with pytest.raises(PointsChanged):
            await asyncio.wait_for(running, 10)
    await client.close()


async def test_a_front_waits_for_its_bus_process(endpoint: str) -> None:
    client = MirrorClient(endpoint)
    opening = asyncio.create_task(client.open())
    await asyncio.sleep(1.0)
    assert not opening.done()
    with pytest.raises(RuntimeError):
        _ = client.image
    async with publishing(endpoint, make_plant()):
        await asyncio.wait_for(opening, 5)
        assert client.image.points
    await client.close()


async def test_what_a_front_counts_is_a_point(endpoint: str) -> None:
    plant = make_plant()
    async with publishing(endpoint, plant), front(endpoint) as client:
        for _ in range(3):
            client.count("opcua_refused_connections")
        client.count("opcua_broken_connections")

        def counts(name: str) -> tuple[object, ...]:
            images = plant.image, client.image
            return tuple(image.read(f"bridge/opcua_{name}_connections").value for image in images)

        await until(lambda: (counts("refused"), counts("broken")) == ((3, 3), (1, 1)), "the counts")
