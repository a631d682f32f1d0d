"""Requests that are handled before a client has its turn: counted, not timed."""

from __future__ import annotations

import struct
from collections.abc import Callable

import pytest

from bridge.northbound.modbus.connection import Conversation
from bridge.northbound.modbus.rounds import LONE_SLICE, SLICE, Rounds
from tests.support.modbus_site import PLC, READY, Rig


def adu(transaction: int, pdu: bytes) -> bytes:
    return struct.pack(">HHHB", transaction & 0xFFFF, 0, len(pdu) + 1, 1) + pdu


READ = bytes.fromhex("03 0000 0001")


class Loop:
    """An event loop: a pass calls what was to be called, then hands over what its sockets have."""

    def __init__(self) -> None:
        self.rounds = Rounds(self.soon)
        self.handled = 0
        self._calls: list[Callable[[], None]] = []

    def soon(self, call: Callable[[], None]) -> None:
        self._calls.append(call)

    def turn(self, *arrivals: Client) -> None:
        calls, self._calls = self._calls, []
        for call in calls:
            call()
        for client in arrivals:
            client.arrives()

    @property
    def is_idle(self) -> bool:
        return not self._calls


class Client:
    """One connection, which sends ``pipelined`` requests at a time and, if it floods, the next ones as soon
    as it has their answers."""

    def __init__(self, loop: Loop, rig: Rig, source: str, *, floods: bool, pipelined: int = 1) -> None:
        self._loop, self._rig, self._floods, self._pipelined = loop, rig, floods, pipelined
        self.conversation = Conversation(self._handle, lambda: None)
        self.answers = 0
        self.has_asked = False
        loop.rounds.enter(self, source)

    def _handle(self, unit: int, pdu: bytes, answer: Callable[[bytes], None], at: float) -> None:
        self._loop.handled += 1
        self._rig.dispatcher.handle(unit, pdu, PLC, answer)

    def arrives(self) -> None:
        self.conversation.receive(adu(1, READ) * self._pipelined)
        self.has_asked = False
        self._loop.rounds.wish(self)

    def serve(self, most: int) -> int:
        before = self.conversation.handled
        self.conversation.advance(most)
        handled = self.conversation.handled - before
        self.answers += handled
        if self.conversation.backlog:
            self._loop.rounds.wish(self)
        elif self._floods:
            self.has_asked = True
        return handled


@pytest.fixture
def rig() -> Rig:
    rig = Rig()
    rig.runs(READY)
    return rig


def waits(loop: Loop, crowd: list[Client], good: Client) -> list[int]:
    """Numbers of the crowd's requests that are handled while one of the good client's waits, time after time.
    It asks less often than its turn would come."""
    loop.turn(*crowd)
    found: list[int] = []
    every = 2 * len(crowd)
    for number in range(20 * every + 1):
        again = [one for one in crowd if one.has_asked]
        if number % every:
            loop.turn(*again)
            continue
        before, answered = loop.handled, good.answers
        # The kernel tells of its request last.
        loop.turn(*again, good)
        while good.answers == answered:
            loop.turn(*[one for one in crowd if one.has_asked])
        found.append(loop.handled - before - 1)
    return found


@pytest.mark.landing(8)
@pytest.mark.parametrize("count", [10, 100])
@pytest.mark.parametrize("pipelined", [1, 64], ids=["one by one", "pipelined"])
@pytest.mark.parametrize("hosts", [1, 100], ids=["of one address", "of many"])
def test_a_good_client_waits_for_no_crowd(rig: Rig, count: int, pipelined: int, hosts: int) -> None:
    """At most what is under way and one slice, as beside a single flooder: a hundred take no more."""
    loop = Loop()
    crowd = [
        Client(loop, rig, f"10.0.1.{number % hosts}", floods=True, pipelined=pipelined)
        for number in range(count)
    ]
    good = Client(loop, rig, "10.0.0.2", floods=False)
    found = waits(loop, crowd, good)
    assert len(found) > 20
    assert max(found[1:]) <= 2 * SLICE, found


@pytest.mark.landing
def test_beside_others_of_its_own_address_a_client_has_its_turn_as_a_connection(rig: Rig) -> None:
    loop = Loop()
    crowd = [Client(loop, rig, "10.0.0.2", floods=True, pipelined=64) for _ in range(50)]
    good = Client(loop, rig, "10.0.0.2", floods=False)
    assert max(waits(loop, crowd, good)[1:]) <= 2 * LONE_SLICE


def test_the_crowd_is_served_in_equal_parts(rig: Rig) -> None:
    loop = Loop()
    crowd = [Client(loop, rig, f"10.0.1.{number % 4}", floods=True, pipelined=64) for number in range(16)]
    waits(loop, crowd, Client(loop, rig, "10.0.0.2", floods=False))
    served = [one.answers for one in crowd]
    assert min(served) > 0.5 * max(served), served


def test_a_single_request_is_answered_at_once(rig: Rig) -> None:
    loop = Loop()
    good = Client(loop, rig, "10.0.0.2", floods=False)
    good.arrives()
    assert good.answers == 1
    loop.turn()
    assert loop.is_idle, "and nothing is called when nobody asks"


def test_a_connection_that_ends_is_answered_out_of_turn(rig: Rig) -> None:
    loop = Loop()
    crowd = [Client(loop, rig, "10.0.1.1", floods=True, pipelined=64) for _ in range(50)]
    loop.turn(*crowd)
    last = Client(loop, rig, "10.0.0.2", floods=False, pipelined=3)
    last.arrives()
    loop.rounds.serve_now(last, LONE_SLICE)
    assert last.answers == 3
    loop.rounds.leave(last)
    loop.turn()
