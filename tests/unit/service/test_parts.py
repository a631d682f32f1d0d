"""Parts of the service: which fail, when they are started again, and what is told of them."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import pytest

from bridge.base.errors import OperationFailed, Unavailable
from bridge.base.notify import Notifier
from bridge.command import Event
from bridge.service.parts import Ports, SupervisedServer, Supervisor
from bridge.text import Text
from tests.support import sites


class Part:
    """Does what ``turns`` say, one after the other, and then serves for ever."""

    name, title = "modbus", Text.of("front.modbus")

    def __init__(self, *turns: Text | Exception) -> None:
        self.turns = list(turns)
        self.serving = asyncio.Event()

    async def run_once(self, serves: Callable[[], None]) -> Text:
        if not self.turns:
            serves()
            self.serving.set()
            await asyncio.Event().wait()
        turn = self.turns.pop(0)
        if isinstance(turn, Exception):
            raise turn
        serves()
        return turn


class Case:
    def __init__(self) -> None:
        plant = sites.plant_of(sites.site(sites.bus(sites.node(sites.drive("fu1", "none", 0)))))
        self.plant = plant
        self.events: list[Event] = []
        plant.on_event(self.events.append)
        self.now = 10.0
        self.supervisor = Supervisor(plant, Notifier(), lambda: self.now, "1 drive")

    @property
    def failing(self) -> object:
        return self.plant.image.read("bridge/fronts_failing").value

    async def fails(self, part: Part) -> None:
        """One turn of ``keep``, without its pause."""
        how = await self.supervisor._run_once(part)
        self.supervisor._fails(part, how, 0.2)


@pytest.fixture
def case(monkeypatch: pytest.MonkeyPatch) -> Case:
    monkeypatch.delenv("NOTIFY_SOCKET", raising=False)
    return Case()


async def test_one_that_fails_is_told_with_its_reason_and_shown(case: Case) -> None:
    await case.fails(Part(OperationFailed("the port is taken")))
    assert case.failing == "modbus: has failed: the port is taken"
    assert case.supervisor.status == "1 drive; not served: modbus: has failed: the port is taken"
    (event,) = case.events
    assert event.message == "the Modbus server has failed: the port is taken; it is started again in 0.2 s"


async def test_what_nobody_has_thought_of_stops_nobody_else(
    case: Case, caplog: pytest.LogCaptureFixture
) -> None:
    await case.fails(Part(ZeroDivisionError("inside")))
    assert "ZeroDivisionError('inside')" in str(case.failing)
    assert "unexpected" in caplog.messages


async def test_it_is_told_once_a_minute_and_again_when_it_serves(case: Case) -> None:
    part = Part(OperationFailed("x"), OperationFailed("x"))
    await case.fails(part)
    await case.fails(part)
    assert len(case.events) == 1
    case.supervisor._serves(part)
    assert case.failing == ""
    assert case.supervisor.status == "1 drive"
    assert case.events[-1].message == "the Modbus server serves again"
    case.supervisor._serves(part)
    assert len(case.events) == 2


async def test_all_are_known_when_each_has_served_or_failed(case: Case) -> None:
    part = Part()
    case.supervisor.expect([part])
    waiting = asyncio.create_task(case.supervisor.all_known())
    await asyncio.sleep(0)
    assert not waiting.done()
    case.supervisor._serves(part)
    await asyncio.wait_for(waiting, 5)
    case.supervisor.expect([])
    await asyncio.wait_for(case.supervisor.all_known(), 5)


async def test_one_that_ends_is_started_again(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bridge.service.parts._FIRST_PAUSE_S", 0.0)
    part = Part(Text.of("front.has_ended"), OperationFailed("no"))
    keeping = asyncio.create_task(case.supervisor.keep(part))
    await asyncio.wait_for(part.serving.wait(), 5)
    assert part.turns == []
    keeping.cancel()
    with pytest.raises(asyncio.CancelledError):
        await keeping


class Server:
    def __init__(self) -> None:
        self.starts = 0

    async def start(self) -> None:
        self.starts += 1

    async def failed(self) -> None: ...


async def test_a_server_that_is_started_already_is_started_from_the_second_time_on() -> None:
    server, served = Server(), list[int]()
    part = SupervisedServer("modbus", Text.of("front.modbus"), server)
    assert await part.run_once(lambda: served.append(server.starts)) == Text.of("front.has_ended")
    await part.run_once(lambda: served.append(server.starts))
    assert served == [0, 1]
    other = Server()
    await SupervisedServer("x", Text.of("front.link"), other, is_started=False).run_once(lambda: None)
    assert other.starts == 1


async def test_a_port_that_is_taken_ends_a_service_that_has_no_other() -> None:
    ports = Ports()

    async def taken() -> None:
        raise Unavailable("port 502 is taken")

    async def free() -> None: ...

    await ports.open("modbus", taken)
    assert not ports.has("modbus")
    with pytest.raises(Unavailable, match="port 502 is taken"):
        ports.check(needs_all=False)
    await ports.open("opcua", free)
    assert ports.has("opcua")
    ports.check(needs_all=False)
    with pytest.raises(Unavailable):
        ports.check(needs_all=True)
