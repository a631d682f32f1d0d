"""Questions of the witness to the bridge, and readings from the answers, byte by byte."""

from __future__ import annotations

import errno
import socket
import struct
from types import SimpleNamespace

import pytest

from bridge.witness import numbers
from bridge.witness.numbers import Numbers, UnitReading

HOLDING, INPUTS = 3, 4


class Socket:
    """Takes what is sent; ``arrives`` is what ``recv`` gives, one after the other."""

    def __init__(self, connects: OSError | None = None) -> None:
        self._connects = connects
        self.sends: OSError | None = None
        self.sent = b""
        self.arrives: list[bytes | OSError] = []
        self.is_closed = False
        self.address: object = None

    def setblocking(self, blocks: bool) -> None:
        assert not blocks

    def setsockopt(self, *option: int) -> None:
        assert option == (socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)

    def fileno(self) -> int:
        return 7

    def close(self) -> None:
        self.is_closed = True

    def connect(self, address: object) -> None:
        self.address = address
        if self._connects is not None:
            raise self._connects

    def sendall(self, data: bytes) -> None:
        if self.sends is not None:
            raise self.sends
        self.sent += data

    def recv(self, size: int) -> bytes:
        if not self.arrives:
            raise BlockingIOError
        found = self.arrives.pop(0)
        if isinstance(found, OSError):
            raise found
        return found


class Wire:
    """All sockets that were opened."""

    def __init__(self) -> None:
        self.sockets: list[Socket] = []
        self.families: list[int] = []
        self.connects: OSError | None = None

    def open(self, family: int, kind: int) -> Socket:
        assert kind == socket.SOCK_STREAM
        self.families.append(family)
        self.sockets.append(Socket(self.connects))
        return self.sockets[-1]


@pytest.fixture
def wire(monkeypatch: pytest.MonkeyPatch) -> Wire:
    wire = Wire()
    names = ("AF_INET", "AF_INET6", "SOCK_STREAM", "IPPROTO_TCP", "TCP_NODELAY")
    constants = {name: getattr(socket, name) for name in names}
    monkeypatch.setattr(numbers, "socket", SimpleNamespace(socket=wire.open, **constants))
    return wire


def answer(unit: int, function: int, value: int) -> bytes:
    return struct.pack(">HHHBBBH", unit, 0, 5, unit, function, 2, value)


def refusal(unit: int, function: int, code: int) -> bytes:
    return struct.pack(">HHHBBB", unit, 0, 3, unit, function | 0x80, code)


def connected(
    wire: Wire, units: tuple[int, ...] = (1,), outputs: tuple[int, ...] = ()
) -> tuple[Numbers, Socket]:
    """It has asked at 10.05."""
    asks = Numbers("127.0.0.1", 502, units, outputs)
    assert asks.fileno() is None
    asks.on_time(10.0)
    assert asks.fileno() == 7
    asks.on_time(10.05)
    return asks, wire.sockets[-1]


@pytest.mark.parametrize(("host", "family"), [("10.0.0.9", socket.AF_INET), ("fe80::1", socket.AF_INET6)])
def test_it_connects_by_the_family_of_the_address(wire: Wire, host: str, family: int) -> None:
    Numbers(host, 1502, [1]).on_time(10.0)
    assert wire.families == [family]
    assert wire.sockets[0].address == (host, 1502)


def test_the_time_out_is_asked_for_before_the_number(wire: Wire) -> None:
    """MODBUS Application Protocol §6.3, §6.4."""
    _, one = connected(wire, (1,), (9,))
    assert one.sent == bytes.fromhex(
        "0001 0000 0006 01 03 000C 0001  0001 0000 0006 01 04 0018 0001  0009 0000 0006 09 04 0018 0001"
    )


def test_a_reading_has_both_and_when_they_were_asked_for(wire: Wire) -> None:
    asks, one = connected(wire, (1,), (9,))
    one.arrives = [answer(1, HOLDING, 1500) + answer(1, INPUTS, 77) + answer(9, INPUTS, 5)]
    assert asks.receive(10.06) == [
        UnitReading(1, 77, 1500, 10.05, 10.06),
        UnitReading(9, 5, None, 10.05, 10.06),
    ]
    assert asks.receive(10.07) == []


def test_an_answer_may_come_in_parts(wire: Wire) -> None:
    asks, one = connected(wire)
    whole = answer(1, HOLDING, 1500) + answer(1, INPUTS, 77)
    one.arrives = [whole[:3], whole[3:20], whole[20:]]
    assert [len(asks.receive(10.06 + n)) for n in range(3)] == [0, 0, 1]


def test_it_asks_again_when_all_is_answered_and_not_before_50_ms(wire: Wire) -> None:
    asks, one = connected(wire)
    length = len(one.sent)
    one.arrives = [answer(1, HOLDING, 1500)]
    asks.receive(10.06)
    asks.on_time(10.2)
    assert len(one.sent) == length
    one.arrives = [answer(1, INPUTS, 77)]
    asks.receive(10.21)
    asks.on_time(10.22)
    assert len(one.sent) == length
    assert asks.next_deadline() == pytest.approx(10.25)
    asks.on_time(10.25)
    assert len(one.sent) == 2 * length


def test_who_does_not_answer_is_lost_after_a_second_and_called_again_after_two(wire: Wire) -> None:
    asks, one = connected(wire)
    asks.on_time(11.05)
    assert not asks.take_lost()
    asks.on_time(11.11)
    assert (asks.take_lost(), asks.why, one.is_closed, asks.fileno()) == (
        True,
        "it does not answer",
        True,
        None,
    )
    assert not asks.take_lost()
    assert asks.receive(11.2) == []
    asks.on_time(13.1)
    assert len(wire.sockets) == 1
    asks.on_time(13.12)
    assert len(wire.sockets) == 2


def test_what_is_left_of_a_lost_connection_is_forgotten(wire: Wire) -> None:
    asks, one = connected(wire)
    one.arrives = [answer(1, HOLDING, 1500) + answer(1, INPUTS, 77)[:5]]
    asks.receive(10.06)
    asks.on_time(11.2)
    asks.on_time(13.3)
    asks.on_time(13.4)
    two = wire.sockets[1]
    assert two.sent
    two.arrives = [answer(1, INPUTS, 78)]
    assert asks.receive(13.41) == [UnitReading(1, 78, None, 13.4, 13.41)]


def test_a_connection_that_is_refused_is_lost_at_once(wire: Wire) -> None:
    wire.connects = ConnectionRefusedError(errno.ECONNREFUSED, "Connection refused")
    asks = Numbers("127.0.0.1", 502, [1])
    asks.on_time(10.0)
    assert (asks.take_lost(), asks.why) == (True, "Connection refused")


def test_a_connection_may_take_a_second(wire: Wire) -> None:
    wire.connects = BlockingIOError()
    asks = Numbers("127.0.0.1", 502, [1])
    asks.on_time(10.0)
    wire.sockets[0].sends = BlockingIOError()
    asks.on_time(10.9)
    assert not asks.take_lost()
    asks.on_time(11.01)
    assert (asks.take_lost(), asks.why) == (True, "no connection")


def test_what_fails_when_it_asks_is_said(wire: Wire) -> None:
    asks = Numbers("127.0.0.1", 502, [1])
    asks.on_time(10.0)
    wire.sockets[0].sends = BrokenPipeError(errno.EPIPE, "Broken pipe")
    asks.on_time(10.05)
    assert (asks.take_lost(), asks.why) == (True, "Broken pipe")


@pytest.mark.parametrize(
    ("end", "why"),
    [
        (b"", "it ends the connection: this address has to be among its [modbus] allow"),
        (ConnectionResetError(), "it ends the connection: this address has to be among its [modbus] allow"),
        (OSError(errno.EHOSTUNREACH, "No route to host"), "No route to host"),
        (OSError("gone"), "gone"),
    ],
)
def test_the_end_of_a_connection_has_its_reason(wire: Wire, end: bytes | OSError, why: str) -> None:
    asks, one = connected(wire)
    one.arrives = [end]
    assert asks.receive(10.06) == []
    assert (asks.take_lost(), asks.why) == (True, why)


@pytest.mark.parametrize("error", [BlockingIOError(), InterruptedError()])
def test_nothing_there_is_no_end(wire: Wire, error: OSError) -> None:
    asks, one = connected(wire)
    one.arrives = [error]
    assert asks.receive(10.06) == []
    assert not asks.take_lost()


def test_a_refused_question_gives_no_reading_and_says_why(wire: Wire) -> None:
    asks, one = connected(wire)
    one.arrives = [answer(1, HOLDING, 1500), refusal(1, INPUTS, 0x0A)]
    assert [asks.receive(10.06), asks.receive(10.07)] == [[], []]
    assert asks.why == "unit 1 answers exception 0Ah"


def test_a_time_out_that_is_refused_is_told_no_longer(wire: Wire) -> None:
    asks, one = connected(wire)
    one.arrives = [answer(1, HOLDING, 1500), answer(1, INPUTS, 77)]
    asks.receive(10.06)
    asks.receive(10.06)
    asks.on_time(10.2)
    one.arrives = [refusal(1, HOLDING, 2), answer(1, INPUTS, 78)]
    asks.receive(10.21)
    assert asks.receive(10.22) == [UnitReading(1, 78, None, 10.2, 10.22)]


def test_what_was_not_asked_for_gives_no_reading(wire: Wire) -> None:
    asks, one = connected(wire)
    one.arrives = [struct.pack(">HHHB", 1, 0, 1, 1), answer(2, INPUTS, 5)]
    assert [asks.receive(10.06), asks.receive(10.07)] == [[], []]
    assert asks.why == "no answer yet"


def test_an_answer_of_another_length_is_no_modbus(wire: Wire) -> None:
    asks, one = connected(wire)
    one.arrives = [struct.pack(">HHHBBBHH", 1, 0, 7, 1, INPUTS, 4, 5, 6)]
    assert asks.receive(10.06) == []
    assert asks.why == "no Modbus"


def test_who_has_answered_all_is_not_lost(wire: Wire) -> None:
    asks, one = connected(wire)
    one.arrives = [answer(1, HOLDING, 1500) + answer(1, INPUTS, 77)]
    asks.receive(10.06)
    asks.on_time(12.0)
    assert not asks.take_lost()
