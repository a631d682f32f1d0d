"""The zenoh session on its own thread: whatever zenoh does, the event loop goes on."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from bridge.base.errors import OperationFailed, Unavailable
from bridge.can.virtual import VirtualWire
from bridge.mirror import protocol
from bridge.project import load_project
from bridge.service.bus_process import BusProcess
from bridge.zenohlink import IncomingQuery, Sample, ZenohLink, zenoh_config
from bridge.zenohlink import link as link_module
from bridge.zenohlink.publishers import Publishers
from tests.support import sites
from tests.support.zenoh_peer import free_port, until, zenoh_peer

DIES = pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")


@asynccontextmanager
async def link(
    endpoint: str | None = None, *, to: str | None = None, encoding: str = ""
) -> AsyncIterator[ZenohLink]:
    """A session that listens at ``endpoint`` or connects ``to`` one."""
    config = zenoh_config(listen=[endpoint] if endpoint else [], connect=[to] if to else [])
    opened = ZenohLink(config, "test", encoding=encoding)
    await opened.open()
    try:
        yield opened
    finally:
        await opened.close()


@asynccontextmanager
async def pair(encoding: str = "") -> AsyncIterator[tuple[ZenohLink, ZenohLink]]:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    async with link(endpoint, encoding=encoding) as server, link(to=endpoint) as client:
        yield server, client


async def longest_pause(stop: asyncio.Event) -> float:
    """Longest time in seconds for which the loop did nothing else."""
    worst, last = 0.0, time.monotonic()
    while not stop.is_set():
        await asyncio.sleep(0.001)
        now = time.monotonic()
        worst, last = max(worst, now - last), now
    return worst


async def test_a_taken_port_is_one_sentence() -> None:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    async with link(endpoint):
        second = ZenohLink(zenoh_config(listen=[endpoint]), "zenoh")
        with pytest.raises(Unavailable) as caught:
            await second.open()
        assert "Address already in use" in str(caught.value)
        assert ".rs" not in str(caught.value)
        assert await second.close()


def test_what_is_no_endpoint_is_refused() -> None:
    with pytest.raises(Unavailable, match="garbage"):
        zenoh_config(listen=["garbage"])


async def test_a_client_waits_for_its_router_and_can_be_closed_meanwhile() -> None:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    waiting = ZenohLink(zenoh_config(mode="client", connect=[endpoint]), "zenoh")
    assert not await waiting.open(patience_s=0.2)
    waiting.publish([("a/b", b"early", None)])
    got: list[Sample] = []
    async with link(endpoint) as server:
        server.declare_subscriber("a/*", got.append)
        await until(
            lambda: any(m.payload == b"late" for m in got) or not waiting.publish([("a/b", b"late", None)]),
            "late",
        )
    await waiting.close()
    hopeless = ZenohLink(zenoh_config(mode="client", connect=[endpoint]), "zenoh")
    assert not await hopeless.open(patience_s=0.1)
    begin = time.monotonic()
    assert not await hopeless.close(timeout_s=0.3)
    assert time.monotonic() - begin < 1
    async with link(endpoint):
        # Its thread ends when zenoh has come to the end of opening.
        await until(
            lambda: not any(thread.name == "zenoh-zenoh" for thread in threading.enumerate()), "its end"
        )


async def test_queries_are_answered_from_the_loop() -> None:
    async with pair() as (server, client):

        def answer(asked: IncomingQuery) -> None:
            if asked.payload == b"bad":
                asked.fail(b"no", "text/plain")
            else:
                asked.send([Sample(asked.key, b"1"), Sample(asked.key, b"2", "text/plain", b"beside")])
                asked.finish()

        server.declare_queryable("q/**", answer)
        await server.settle()
        await asyncio.sleep(0.1)
        answers = await client.get("q/x", b"good")
        assert [(a.ok, a.message.payload, a.message.attachment) for a in answers] == [
            (True, b"1", None),
            (True, b"2", b"beside"),
        ]
        assert [(a.ok, a.message.payload) for a in await client.get("q/x", b"bad")] == [(False, b"no")]
        assert await client.get("nobody/x", timeout_s=0.3) == []
        assert client.errors == server.errors == 0


async def test_a_hundred_queries_wait_side_by_side() -> None:
    async with pair() as (server, client):
        held: list[IncomingQuery] = []
        server.declare_queryable("q", held.append)
        await server.settle()
        await asyncio.sleep(0.1)
        asking = [asyncio.create_task(client.get("q", str(i).encode())) for i in range(100)]
        await until(lambda: len(held) == 100, "all have arrived")
        for asked in reversed(held):
            asked.send([Sample("q", asked.payload or b"")])
            asked.finish()
        answers = await asyncio.gather(*asking)
        assert [a[0].message.payload for a in answers] == [str(i).encode() for i in range(100)]


async def test_a_handler_that_fails_takes_no_other_with_it() -> None:
    seen: list[bytes] = []
    errors: list[object] = []
    asyncio.get_running_loop().set_exception_handler(lambda _, context: errors.append(context["exception"]))

    def handler(message: Sample) -> None:
        if message.payload == b"1":
            raise LookupError("ours")
        seen.append(message.payload)

    async with pair() as (server, client):
        server.declare_subscriber("a", handler)
        await server.settle()
        await asyncio.sleep(0.1)
        for i in range(5):
            client.send(Sample("a", str(i).encode()))
        await until(lambda: len(seen) == 4, "the others arrive")
        assert len(errors) == 1


async def test_liveliness_comes_and_goes() -> None:
    seen: list[tuple[str, bool]] = []
    async with pair() as (server, client):
        server.declare_token("x/@/one")
        client.follow_liveliness("x/@/**", lambda key, alive: seen.append((key, alive)))
        await until(lambda: seen == [("x/@/one", True)], "the token that was there")
        server.drop_token("x/@/one")
        await until(lambda: seen[1:] == [("x/@/one", False)], "its end")


async def test_each_value_arrives_in_its_order_however_many_keys_there_are() -> None:
    got: dict[str, list[bytes]] = {}
    async with pair("text/plain") as (server, client):
        kinds = set[str]()

        def hear(message: Sample) -> None:
            got.setdefault(message.key, []).append(message.payload)
            kinds.add(message.encoding)

        client.declare_subscriber("v/*", hear)
        await client.settle()
        await asyncio.sleep(0.1)
        # More keys than get a publisher of their own, and more values than it takes to get one.
        for value in range(14):
            assert server.publish([(f"v/{point}", str(value).encode(), None) for point in range(1200)])
            await until(lambda: not server.is_publishing, "they are sent")
            await asyncio.sleep(0.05)
        # A reader who does not keep up loses some, on a busy machine this one, too.
        last = [(f"v/{point}", b"13", None) for point in range(1200)]
        for _ in range(100):
            if len(got) == 1200 and all(values[-1] == b"13" for values in got.values()):
                break
            assert server.publish(last)
            await until(lambda: not server.is_publishing, "they are sent again")
            await asyncio.sleep(0.1)
        assert len(got) == 1200
        assert all(values[-1] == b"13" for values in got.values())
        assert all([int(value) for value in values] == sorted(map(int, values)) for values in got.values())
        assert kinds == {"text/plain"}
        assert server.errors == 0


async def test_who_reads_is_known() -> None:
    told: list[bool] = []
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    async with link(endpoint) as server, zenoh_peer(endpoint) as peer:
        await peer.do("subscribe", "v/a/*")
        server.follow_readers("v/b/**", told.append)
        server.follow_readers("v/a/**", told.append)
        await until(lambda: told == [True], "who was there before is known")
        async with zenoh_peer(endpoint) as other:
            await other.do("subscribe", "**/x")
            await until(lambda: told == [True, True], "who comes to one of the others")
        await until(lambda: told == [True, True, False], "and goes again, without a word")


async def test_a_stalled_subscriber_does_not_hold_up_the_loop() -> None:
    endpoint = f"tcp/127.0.0.1:{free_port()}"
    async with link(endpoint) as server, zenoh_peer(endpoint) as peer, zenoh_peer(endpoint) as other:
        await peer.do("subscribe", "v/**")
        await other.do("subscribe", "v/0")
        await until(lambda: not server.publish([("v/0", b"0", None)]) or peer.samples, "the peer hears")
        peer.stop()
        enough = asyncio.Event()
        pause = asyncio.create_task(longest_pause(enough))
        for value in range(200):
            if not server.is_publishing:
                server.publish([(f"v/{point}", f"{value:01000d}".encode(), None) for point in range(200)])
            await asyncio.sleep(0.01)
        server.publish([("v/0", b"end", None)])
        await until(
            lambda: other.samples and other.samples[-1]["payload"] == "end", "the other one is served"
        )
        enough.set()
        assert await pause < 0.25
        begin = time.monotonic()
        await server.close(timeout_s=1.0)
        assert time.monotonic() - begin < 1.5


async def test_a_flood_of_queries_leaves_the_loop_its_time() -> None:
    handled = 0

    def slow(asked: IncomingQuery) -> None:
        nonlocal handled
        handled += 1
        time.sleep(0.001)
        asked.finish()

    async with pair() as (server, client):
        server.declare_queryable("q", slow)
        await server.settle()
        await asyncio.sleep(0.1)
        flood = [asyncio.create_task(client.get("q", timeout_s=5)) for _ in range(3000)]
        await until(lambda: handled > 10, "it has begun")
        late: list[float] = []
        while handled < 500:
            begin = time.monotonic()
            await asyncio.sleep(0)
            late.append(time.monotonic() - begin)
        assert max(late) < 0.3
        await asyncio.gather(*flood)


async def test_nothing_raises_after_the_end() -> None:
    async with pair() as (server, client):
        await server.close()
        assert not server.publish([("a", b"1", None)])
        assert not server.is_publishing
        assert not server.send(Sample("a", b"1"))
        server.declare_token("a/@/b")
        await server.settle()
        assert await server.get("x") == []
        assert await client.get("x") == []
        assert await server.close()


async def test_a_job_that_raises_costs_nothing_but_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    got: list[Sample] = []
    async with pair() as (server, client):
        client.declare_subscriber("v/*", got.append)
        await client.settle()
        await asyncio.sleep(0.1)
        with monkeypatch.context() as patched:
            patched.setattr(link_module, "_publish", broken)
            patched.setattr(Publishers, "put", broken)
            server.publish([("v/1", b"lost", None)])
            server.send(Sample("v/1", b"lost too"))
            await until(lambda: server.errors == 2, "both are counted")
        server.publish([("v/1", b"later", None)])
        await until(lambda: [message.payload for message in got] == [b"later"], "the later one")


def broken(*_: object) -> None:
    raise KeyError("a fault of our own")


@DIES
async def test_a_worker_that_dies_is_told() -> None:
    async with pair() as (server, client):
        watching = asyncio.create_task(server.failed())
        client_watching = asyncio.create_task(client.failed())
        server.submit(dies)
        with pytest.raises(OperationFailed, match="test: "):
            await asyncio.wait_for(watching, 5)
        assert not client_watching.done()
        await client.close()
        await asyncio.wait_for(client_watching, 5)  # closed by its owner: no failure


def dies(_: object) -> None:
    raise SystemExit


@DIES
async def test_a_link_of_the_service_that_dies_is_opened_again(tmp_path: Path) -> None:
    path = sites.write(tmp_path, sites.bus(sites.node(sites.drive("fu1", "none", 1000))), name="link")
    wire = VirtualWire()
    service = BusProcess(load_project(path), lambda table: wire.end(table.name))
    events: list[str] = []
    service.plant.on_event(lambda event: events.append(event.message))
    ready = asyncio.Event()
    running = asyncio.create_task(service.run(ready.set))
    try:
        await asyncio.wait_for(ready.wait(), 10)
        server = service.mirror
        before = server._link
        server._link.submit(dies)
        await until(lambda: any(message.endswith(" serves again") for message in events), "it is back")
        assert any("mirror: the zenoh session has ended by itself" in message for message in events)
        assert server._link is not before
        client = ZenohLink(zenoh_config(connect=[server._endpoint]), "client")
        await client.open()
        assert [answer.ok for answer in await client.get(protocol.SNAPSHOT, timeout_s=5.0)] == [True]
        await client.close()
        assert not running.done()
    finally:
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)
