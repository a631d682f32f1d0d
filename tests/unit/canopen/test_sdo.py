"""SDO client (CiA 301 §7.2.4) against golden frames and against every wrong answer a server can give."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.canopen import abort
from bridge.canopen.frame import Frame
from bridge.canopen.sdo import Priority, Result, SdoChannel, SdoError
from bridge.canopen.sdo_queue import MOST_WAITING
from bridge.canopen.sdo_transfer import MOST_BYTES
from tests.support.sdo_client import REPLY, Client


@pytest.fixture
def client() -> Client:
    return Client()


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


@pytest.mark.parametrize("size", [1 << 20, MOST_BYTES + 1, 0xFFFF_FFFF])
def test_a_server_that_announces_a_megabyte_is_not_believed(client: Client, size: int) -> None:
    client.read(0x1008)
    client.sent()
    client.answer(f"41 08 10 00 {struct.pack('<I', size).hex()}")
    assert str(client.result) == "1008h:00: no valid answer: out of memory (05040005h)"
    assert client.sent() == ["80 08 10 00 05 00 04 05"]


def test_more_bytes_than_announced_are_not_taken(client: Client) -> None:
    client.read(0x1008)
    client.answer("41 08 10 00 05 00 00 00")
    client.answer("00 31 32 33 34 35 36 37")
    assert isinstance(client.result, SdoError)
    assert client.result.code == abort.LENGTH_TOO_HIGH


def test_fewer_bytes_than_announced_are_not_taken_for_the_value(client: Client) -> None:
    client.read(0x1008)
    client.answer("41 08 10 00 08 00 00 00")
    client.answer("01 31 32 33 34 35 36 37")
    assert isinstance(client.result, SdoError)
    assert client.result.code == abort.LENGTH_TOO_LOW


def test_empty_segments_without_an_end_are_no_answer(client: Client) -> None:
    client.read(0x1008)
    client.answer("40 08 10 00 00 00 00 00")
    client.answer("0E 00 00 00 00 00 00 00")
    assert isinstance(client.result, SdoError)
    assert client.result.code == abort.LENGTH_TOO_LOW


def test_a_doubled_segment_is_passed_over(client: Client) -> None:
    client.read(0x5F9C)
    client.answer("41 9C 5F 00 0B 00 00 00")
    client.answer("00 30 31 2E 30 30 2E 30")
    client.answer("00 30 31 2E 30 30 2E 30")
    assert client.channel.unmatched == 1
    client.answer("17 30 2E 30 30 00 00 00")
    assert client.result == b"01.00.00.00"


def test_a_doubled_acknowledge_of_a_segment_is_passed_over(client: Client) -> None:
    client.write(0x1008, 0, b"drivebridge")
    client.answer("60 08 10 00 00 00 00 00")
    client.answer("20 00 00 00 00 00 00 00")
    client.answer("20 00 00 00 00 00 00 00")
    assert (client.results, client.channel.unmatched) == ([], 1)
    client.answer("30 00 00 00 00 00 00 00")
    assert client.result == b""


def test_a_lost_answer_is_asked_for_again_as_often_as_the_site_file_says() -> None:
    client = Client(retries=1)
    client.read(0x2066, 1)
    client.wait(0.6)
    assert client.sent() == ["40 66 20 01 00 00 00 00", "80 66 20 01 00 00 04 05", "40 66 20 01 00 00 00 00"]
    client.answer("4B 66 20 01 67 00 00 00")
    assert client.result == b"\x67\x00"


def test_a_server_that_stays_silent_is_given_up_after_its_retries() -> None:
    client = Client(retries=2)
    client.read(0x2066, 1)
    client.wait(1.4)
    assert client.results == []
    client.wait(0.2)
    assert str(client.result) == "2066h:01: no valid answer: SDO protocol timed out (05040000h)"


def test_what_the_server_refuses_is_not_asked_again() -> None:
    client = Client(retries=3)
    client.read(0x2999)
    client.sent()
    client.answer("80 99 29 00 00 00 02 06")
    assert client.sent() == []
    assert isinstance(client.result, SdoError)


@pytest.mark.parametrize("index", [0x1010, 0x1011])
def test_store_and_restore_may_take_ten_seconds_and_are_never_repeated(index: int) -> None:
    client = Client(retries=3)
    client.write(index, 1, b"save")
    client.wait(9.9)
    assert not client.results
    client.wait(0.2)
    assert isinstance(client.result, SdoError)


@pytest.mark.parametrize("index", [0x1010, 0x1011])
def test_what_is_stored_is_read_in_the_ordinary_time(index: int) -> None:
    client = Client()
    client.read(index, 1)
    client.wait(0.6)
    assert isinstance(client.result, SdoError)


def test_after_a_retry_the_second_answer_is_not_taken_for_the_next_write() -> None:
    """Both answers of a slow server come; the second must not pass for the answer to another value."""
    client = Client(retries=1)
    client.write(0x2066, 1, b"\x01\x00")
    client.wait(0.55)
    client.answer("60 66 20 01 00 00 00 00")
    assert client.result == b""
    client.sent()
    client.write(0x2066, 1, b"\x02\x00")
    assert client.sent() == [], "an answer about 2066h:01 is still owed"
    client.answer("60 66 20 01 00 00 00 00")
    assert len(client.results) == 1
    client.wait(0.0)
    client.channel.on_time(client.now)
    assert client.sent() == ["2B 66 20 01 02 00 00 00"]
    client.answer("80 66 20 01 30 00 09 06")
    assert isinstance(client.results[1], SdoError)


def test_each_request_that_was_given_up_owes_an_answer() -> None:
    """Three questions, three late answers: none of them passes for the answer to a fourth."""
    client = Client(retries=2)
    client.write(0x2066, 1, b"\x01\x00")
    client.wait(1.6)
    assert isinstance(client.result, SdoError)
    client.sent()
    client.write(0x2066, 1, b"\x02\x00")
    for _ in range(3):
        assert client.sent() == [], "an answer about 2066h:01 is still owed"
        client.answer("60 66 20 01 00 00 00 00")
        client.channel.on_time(client.now)
    assert client.channel.late == 3
    assert client.sent() == ["2B 66 20 01 02 00 00 00"]


def test_a_server_that_was_asked_often_owes_eight_answers_at_the_most() -> None:
    client = Client(retries=10)
    client.write(0x2066, 1, b"\x01\x00")
    client.wait(5.6)
    client.sent()
    client.write(0x2066, 1, b"\x02\x00")
    for _ in range(8):
        assert client.sent() == []
        client.answer("60 66 20 01 00 00 00 00")
        client.channel.on_time(client.now)
    assert client.sent() == ["2B 66 20 01 02 00 00 00"]


def test_the_time_for_the_second_answer_begins_with_the_first() -> None:
    """A server that answers the first attempt late may take as long for the second."""
    client = Client(retries=1)
    client.write(0x2066, 1, b"\x01\x00")
    client.wait(0.95)
    client.answer("60 66 20 01 00 00 00 00")
    assert client.result == b""
    client.sent()
    client.write(0x2066, 1, b"\x02\x00")
    client.wait(0.4)
    assert client.sent() == [], "the second answer may still come"
    client.wait(0.11)
    assert client.sent() == ["2B 66 20 01 02 00 00 00"]


def test_an_owed_answer_that_never_comes_delays_only_its_own_object() -> None:
    client = Client()
    client.read(0x2066, 1)
    client.wait(0.5)
    client.sent()
    client.read(0x2066, 1)
    client.read(0x2067, 1)
    assert client.sent() == ["40 67 20 01 00 00 00 00"]
    client.answer("4B 67 20 01 01 00 00 00")
    client.wait(0.5)
    assert client.sent() == ["40 66 20 01 00 00 00 00"]


def test_a_cancelled_transfer_is_ended_on_the_bus_and_the_next_begins(client: Client) -> None:
    first = client.read(0x1008)
    client.read(0x1009)
    waiting = client.read(0x100A)
    client.sent()
    assert client.channel.cancel(first, client.now)
    assert client.sent() == ["80 08 10 00 00 00 00 08", "40 09 10 00 00 00 00 00"]
    assert client.channel.cancel(waiting, client.now)
    client.answer("43 09 10 00 01 00 00 00")
    assert client.results == [b"\x01\x00\x00\x00"]
    assert client.channel.waiting == 0
    assert not client.channel.cancel(first, client.now), "it has ended"


def test_a_full_queue_refuses_polls_before_commands(client: Client) -> None:
    client.read(0x1000)
    for number in range(MOST_WAITING):
        client.read(0x3000 + number, priority=Priority.POLL)
    client.read(0x3FFF, priority=Priority.POLL)
    assert str(client.result).startswith("3FFFh:00: not asked, too many transfers are waiting")
    client.read(0x2066, 1)
    assert [result.index for result in client.results if isinstance(result, SdoError)] == [0x3FFF, 0x303F]
    assert client.channel.waiting == MOST_WAITING + 1


def test_transfers_to_different_nodes_run_side_by_side() -> None:
    """Three servers that need 20 ms each answer all within 20 ms, not one after the other."""
    results: list[tuple[int, Result]] = []
    channels = [SdoChannel(0x600 + node, 0x580 + node, 0.5) for node in (1, 2, 3)]
    for node, channel in enumerate(channels, 1):
        channel.read(0x1000, 0, 0.0, lambda result, node=node: results.append((node, result)))
    requests = [frame for channel in channels for frame in channel.take_frames()]
    assert [frame.can_id for frame in requests] == [0x601, 0x602, 0x603]
    for channel in channels:
        channel.on_frame(Frame(channel.reply_id, bytes.fromhex("4300100092010200"), 0.02))
    assert [node for node, _ in results] == [1, 2, 3]


def test_commands_go_before_the_boot_up_and_that_before_polls(client: Client) -> None:
    client.read(0x1000)
    client.read(0x3005, priority=Priority.POLL)
    client.read(0x1018, 1, priority=Priority.BOOT)
    client.read(0x2066, 1)
    client.sent()
    client.answer("43 00 10 00 00 00 00 00")
    assert client.sent() == ["40 66 20 01 00 00 00 00"]
    client.answer("4B 66 20 01 67 00 00 00")
    assert client.sent() == ["40 18 10 01 00 00 00 00"]
    client.answer("43 18 10 01 00 00 00 00")
    assert client.sent() == ["40 05 30 00 00 00 00 00"]


def test_a_flush_ends_every_transfer_and_sends_nothing(client: Client) -> None:
    client.read(0x1000)
    client.read(0x1001)
    client.channel.flush(0.0)
    assert client.sent() == []
    assert all(isinstance(result, SdoError) for result in client.results)
    assert len(client.results) == 2
    assert client.channel.next_deadline() is None


@pytest.mark.parametrize(("later_s", "is_told"), [(0.1, True), (1.1, False)])
def test_a_server_that_may_still_answer_is_told_of_the_end_before_it_is_asked_again(
    client: Client, later_s: float, is_told: bool
) -> None:
    client.read(0x1000)
    client.sent()
    client.channel.flush(0.0)
    client.channel.read(0x1001, 0, later_s, client.results.append)
    asked = "40 01 10 00 00 00 00 00"
    assert client.sent() == (["80 00 10 00 00 00 00 08", asked] if is_told else [asked])


def serve(data: bytes, client: Client) -> None:
    """A server that sends ``data`` segmented."""
    toggle, rest, pending = 0, data, b""
    for request in client.channel.take_frames():
        pending = request.data
    while client.results == []:
        if pending[0] == 0xA4:  # block upload, which this server does not know
            client.answer((b"\x80" + pending[1:4] + struct.pack("<I", 0x0504_0001)).hex())
            rest = data
        elif pending[0] == 0x40:
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
    client.wait(2.0 * asked + 1)
    assert len(client.results) == asked
    assert client.channel.waiting == 0
