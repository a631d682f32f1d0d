"""SDO client (CiA 301 §7.2.4) against golden frames and against every wrong answer a server can give."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.southbound.bus.frame import Frame
from bridge.southbound.canopen import abort
from bridge.southbound.canopen.sdo import Result, SdoChannel, SdoError

REQUEST, REPLY = 0x605, 0x585


class Client:
    """A channel on a virtual clock, its requests and its results."""

    def __init__(self) -> None:
        self.channel = SdoChannel(REQUEST, REPLY, 0.5)
        self.now = 0.0
        self.results: list[Result] = []

    def read(self, index: int, sub: int = 0, *, urgent: bool = True) -> None:
        self.channel.read(index, sub, self.now, self.results.append, urgent=urgent)

    def write(self, index: int, sub: int, data: bytes) -> None:
        self.channel.write(index, sub, data, self.now, self.results.append)

    def sent(self) -> list[str]:
        return [frame.data.hex(" ").upper() for frame in self.channel.take_frames()]

    def answer(self, text: str) -> None:
        self.channel.on_frame(Frame(REPLY, bytes.fromhex(text), self.now))

    @property
    def result(self) -> Result:
        assert len(self.results) == 1
        return self.results[0]


@pytest.fixture
def client() -> Client:
    return Client()


def test_nord_write_of_p102(client: Client) -> None:
    """BU 2500 §6.6.1: P102 = 1.03 s in parameter set 1."""
    client.write(0x2066, 1, struct.pack("<H", 103))
    assert client.sent() == ["2B 66 20 01 67 00 00 00"]
    client.answer("60 66 20 01 00 00 00 00")
    assert client.result == b""


def test_nord_read_of_p102(client: Client) -> None:
    """BU 2500 §6.6.2; index and sub-index in the order they really have on the wire."""
    client.read(0x2066, 1)
    assert client.sent() == ["40 66 20 01 00 00 00 00"]
    client.answer("4B 66 20 01 67 00 00 00")
    assert client.result == b"\x67\x00"


def test_lenze_read_of_c00061(client: Client) -> None:
    """EDS84DMOTCAN §9.3: heat sink temperature 43 °C."""
    client.read(0x5FC2)
    client.answer("43 C2 5F 00 2B 00 00 00")
    assert client.result == b"\x2b\x00\x00\x00"


def test_lenze_segmented_read_of_c00099(client: Client) -> None:
    """EDS84DMOTCAN §9.3: the firmware version as a string of eleven characters."""
    client.read(0x5F9C)
    assert client.sent() == ["40 9C 5F 00 00 00 00 00"]
    client.answer("41 9C 5F 00 0B 00 00 00")
    assert client.sent() == ["60 00 00 00 00 00 00 00"]
    client.answer("00 30 31 2E 30 30 2E 30")
    assert client.sent() == ["70 00 00 00 00 00 00 00"]
    client.answer("17 30 2E 30 30 00 00 00")
    assert client.result == b"01.00.00.00"


def test_segmented_write(client: Client) -> None:
    client.write(0x1008, 0, b"drivebridge")
    assert client.sent() == ["21 08 10 00 0B 00 00 00"]
    client.answer("60 08 10 00 00 00 00 00")
    assert client.sent() == ["00 64 72 69 76 65 62 72"]
    client.answer("20 00 00 00 00 00 00 00")
    assert client.sent() == ["17 69 64 67 65 00 00 00"]
    client.answer("30 00 00 00 00 00 00 00")
    assert client.result == b""


def test_an_abort_carries_the_text_of_the_standard(client: Client) -> None:
    client.read(0x2999)
    client.answer("80 99 29 00 00 00 02 06")
    assert isinstance(client.result, SdoError)
    assert client.result.by_server
    assert "object does not exist in the object dictionary (06020000h)" in str(client.result)
    assert client.channel.last_abort == 0x0602_0000


def test_a_server_that_does_not_answer_is_told_and_the_next_transfer_begins(client: Client) -> None:
    client.read(0x1000)
    client.read(0x1001)
    client.sent()
    client.now = 0.5
    client.channel.on_time(client.now)
    assert client.sent() == ["80 00 10 00 00 00 04 05", "40 01 10 00 00 00 00 00"]
    assert isinstance(client.results[0], SdoError)
    assert client.results[0].code == abort.TIMED_OUT
    client.answer("4F 01 10 00 07 00 00 00")
    assert client.results[1] == b"\x07"


@pytest.mark.parametrize(
    "foreign",
    [
        "4B 67 20 01 67 00 00 00",  # another index
        "4B 66 20 02 67 00 00 00",  # another sub-index
        "60 66 20 01 00 00 00 00",  # acknowledge of a write
        "80 67 20 01 00 00 02 06",  # abort of something else
        "00 30 31 2E 30 30 2E 30",  # a segment nobody asked for
        "4B 66 20",  # too short
    ],
)
def test_an_answer_to_something_else_is_no_answer(client: Client, foreign: str) -> None:
    client.read(0x2066, 1)
    client.answer(foreign)
    assert client.results == []
    assert client.channel.unmatched == 1
    client.answer("4B 66 20 01 67 00 00 00")
    assert client.result == b"\x67\x00"


def test_a_late_acknowledge_is_not_success_for_the_next_write(client: Client) -> None:
    client.write(0x2066, 1, b"\x01\x00")
    client.now = 0.5
    client.channel.on_time(client.now)
    client.write(0x2067, 1, b"\x02\x00")
    client.answer("60 66 20 01 00 00 00 00")
    assert len(client.results) == 1
    assert isinstance(client.results[0], SdoError)


def test_a_wrong_toggle_bit_ends_the_transfer_on_both_sides(client: Client) -> None:
    client.read(0x5F9C)
    client.answer("41 9C 5F 00 0B 00 00 00")
    client.sent()
    client.answer("10 30 31 2E 30 30 2E 30")
    assert isinstance(client.result, SdoError)
    assert client.result.code == abort.TOGGLE
    assert client.sent() == ["80 9C 5F 00 00 00 03 05"]


def test_a_server_that_announces_a_megabyte_is_not_believed(client: Client) -> None:
    client.read(0x1008)
    client.answer("41 08 10 00 00 00 00 7F")
    assert isinstance(client.result, SdoError)
    assert client.result.code == abort.OUT_OF_MEMORY


def test_commands_go_before_polls(client: Client) -> None:
    client.read(0x1000)
    client.read(0x3005, urgent=False)
    client.read(0x2066, 1)
    client.sent()
    client.answer("43 00 10 00 00 00 00 00")
    assert client.sent() == ["40 66 20 01 00 00 00 00"]


def test_a_flush_ends_every_transfer_and_sends_nothing(client: Client) -> None:
    client.read(0x1000)
    client.read(0x1001)
    client.channel.flush(0.0)
    assert client.sent() == []
    assert all(isinstance(result, SdoError) for result in client.results)
    assert len(client.results) == 2
    assert client.channel.next_deadline() is None


def serve(data: bytes, client: Client) -> None:
    """A server that sends ``data`` segmented."""
    toggle, rest = 0, data
    for request in client.channel.take_frames():
        pending = request.data
    while client.results == []:
        if pending[0] == 0x40:
            client.answer((b"\x41" + pending[1:4] + struct.pack("<I", len(data))).hex())
        else:
            part, rest = rest[:7], rest[7:]
            command = toggle | (7 - len(part)) << 1 | (not rest)
            client.answer((bytes((command,)) + part.ljust(7, b"\0")).hex())
            toggle ^= 0x10
        for request in client.channel.take_frames():
            pending = request.data


@given(st.binary(min_size=1, max_size=200))
def test_whatever_the_server_has_is_read_whole(data: bytes) -> None:
    client = Client()
    client.read(0x1008)
    serve(data, client)
    assert client.result == data


@given(st.lists(st.one_of(st.binary(max_size=8), st.sampled_from(["wait", "read", "write"])), max_size=60))
def test_no_server_can_raise_or_leave_a_transfer_without_an_end(events: list[bytes | str]) -> None:
    client = Client()
    asked = 0
    for event in events:
        client.now += 0.05
        if event == "wait":
            client.now += 1.0
        elif event == "read":
            client.read(0x2066, 1)
            asked += 1
        elif event == "write":
            client.write(0x2067, 0, bytes(9))
            asked += 1
        elif isinstance(event, bytes):
            client.channel.on_frame(Frame(REPLY, event, client.now))
        client.channel.on_time(client.now)
        client.channel.take_frames()
    for _ in range(asked):
        client.now += 1.0
        client.channel.on_time(client.now)
    assert len(client.results) == asked
    assert client.channel.waiting == 0
