"""One SDO channel: what waits, what is asked again, and when (on a virtual clock)."""

from __future__ import annotations

import pytest

from bridge.canopen.sdo import SdoChannel, SdoError
from bridge.canopen.sdo_queue import MOST_WAITING, Priority
from tests.support.sdo_block import INDEX, LONG, Asker
from tests.support.sdo_client import REPLY, REQUEST, Client


def test_the_time_for_an_answer_ends_exactly_then() -> None:
    client = Client()
    client.read(0x2066, 1)
    assert client.channel.next_deadline() == 0.5
    client.channel.on_time(0.499)
    assert client.results == []
    client.channel.on_time(0.5)
    assert str(client.result) == "2066h:01: no valid answer: SDO protocol timed out (05040000h)"


def test_each_answer_of_a_transfer_has_the_whole_time() -> None:
    client = Client()
    client.read(0x1008)
    client.now = 0.4
    client.answer("41 08 10 00 08 00 00 00")
    assert client.channel.next_deadline() == pytest.approx(0.9)
    client.now = 0.8
    client.answer("00 31 32 33 34 35 36 37")
    assert client.channel.next_deadline() == pytest.approx(1.3)


def test_a_channel_that_nobody_waits_for_wants_no_time() -> None:
    client = Client()
    client.channel.on_time(0.0)
    assert client.channel.next_deadline() is None
    client.read(0x2066, 1)
    client.wait(0.5)
    assert isinstance(client.result, SdoError)
    assert client.channel.next_deadline() is None, "an answer is owed, and nobody has to wait for it"
    client.read(0x2067, 1)
    client.answer("4B 67 20 01 01 00 00 00")
    assert client.channel.next_deadline() is None


def test_a_channel_asks_once_unless_it_is_told_otherwise() -> None:
    channel = SdoChannel(REQUEST, REPLY, 0.5)
    results: list[object] = []
    channel.read(0x2066, 1, 0.0, results.append)
    channel.on_time(0.5)
    assert len(results) == 1
    assert [frame.data[0] for frame in channel.take_frames()] == [0x40, 0x80]


def test_a_block_takes_a_millisecond_for_each_segment_unless_it_is_told_otherwise() -> None:
    client = Client()
    client.write(INDEX, 0, LONG)
    client.answer("A4 20 1F 00 7F 00 00 00")
    client.wait(0.1195)
    assert len(client.sent()) == 1 + 15 * 8
    client.wait(0.001)
    assert len(client.sent()) == 7, "127 segments in all"


def test_a_write_whose_effect_would_be_doubled_is_sent_once() -> None:
    client = Client(retries=3)
    client.channel.write(0x2066, 1, b"\x01\x00", 0.0, client.results.append, repeatable=False)
    client.wait(0.5)
    assert client.sent() == ["2B 66 20 01 01 00 00 00", "80 66 20 01 00 00 04 05"]
    assert isinstance(client.result, SdoError)


def test_a_write_is_repeated_unless_it_is_told_otherwise() -> None:
    client = Client(retries=1)
    client.write(0x2066, 1, b"\x01\x00")
    client.wait(0.5)
    assert client.sent()[-1] == "2B 66 20 01 01 00 00 00"
    assert client.results == []


@pytest.mark.parametrize("may", [True, False])
def test_who_asked_may_call_a_transfer_off_when_its_turn_comes(may: bool) -> None:
    client = Client()
    client.read(0x1000)
    client.channel.write(0x2066, 1, b"\x01\x00", 0.0, client.results.append, may_begin=lambda: may)
    client.read(0x1001)
    client.sent()
    client.answer("43 00 10 00 00 00 00 00")
    if may:
        assert client.sent() == ["2B 66 20 01 01 00 00 00"]
    else:
        assert client.sent() == ["40 01 10 00 00 00 00 00"]
        assert str(client.results[1]) == "2066h:01: no valid answer: general error (08000000h)"


@pytest.mark.parametrize(
    "frame",
    [
        "60 67 20 01 00 00 00 00",  # about another index
        "60 66 20 02 00 00 00 00",  # about another sub-index
        "60 66 20 01",  # too short
    ],
)
def test_an_answer_about_something_else_is_not_the_one_that_is_owed(frame: str) -> None:
    client = Client()
    client.write(0x2066, 1, b"\x01\x00")
    client.wait(0.5)
    client.sent()
    client.write(0x2066, 1, b"\x02\x00")
    client.answer(frame)
    assert (client.channel.unmatched, client.channel.late) == (1, 0)
    client.channel.on_time(client.now)
    assert client.sent() == []
    client.answer("60 66 20 01 00 00 00 00")
    assert (client.channel.unmatched, client.channel.late) == (2, 1)
    client.channel.on_time(client.now)
    assert client.sent() == ["2B 66 20 01 02 00 00 00"]


def test_a_cancelled_transfer_owes_its_answer() -> None:
    client = Client()
    first = client.read(0x2066, 1)
    client.sent()
    assert client.channel.cancel(first, 0.1)
    client.now = 0.1
    client.read(0x2066, 1)
    assert client.sent() == ["80 66 20 01 00 00 00 08"]
    client.wait(0.499)
    assert client.sent() == []
    client.wait(0.001)
    assert client.sent() == ["40 66 20 01 00 00 00 00"]


def test_who_is_cancelled_while_waiting_is_never_asked_for() -> None:
    client = Client()
    client.read(0x1000)
    job = client.read(0x1001)
    assert client.channel.cancel(job, 0.0)
    assert not client.channel.cancel(job, 0.0)
    assert client.channel.waiting == 1
    client.sent()
    client.answer("43 00 10 00 00 00 00 00")
    assert client.sent() == []
    assert len(client.results) == 1


def test_after_a_flush_a_transfer_begins_at_once_and_none_of_the_old_comes_back() -> None:
    """A node that did not answer to blocks may do so when it is back."""
    asker = Asker()
    asker.channel.write(INDEX, 0, LONG, 0.0, asker.results.append)
    asker.silence()
    asker.silence()  # by segments, too
    asker.results.clear()
    asker.sent()
    for number in range(2):
        asker.channel.read(0x1000 + number, 0, asker.now, asker.results.append)
    asker.channel.flush(asker.now)
    assert asker.channel.waiting == 0
    assert [str(result) for result in asker.results] == [
        f"100{number}h:00: no valid answer: SDO protocol timed out (05040000h)" for number in range(2)
    ]
    asker.channel.write(0x1F21, 0, LONG, asker.now, asker.results.append)
    assert asker.sent() == ["C6 21 1F 00 00 04 00 00"]
    assert asker.channel.waiting == 1


def test_in_a_full_queue_a_command_takes_the_place_of_the_only_poll() -> None:
    client = Client()
    client.read(0x1000)
    for number in range(MOST_WAITING - 1):
        client.read(0x2000 + number)
    client.read(0x3000, priority=Priority.POLL)
    client.read(0x2066, 1)
    assert [result.index for result in client.results if isinstance(result, SdoError)] == [0x3000]
    client.read(0x2067, 1)
    assert [result.index for result in client.results if isinstance(result, SdoError)] == [0x3000, 0x2067]


def test_an_acknowledge_in_the_middle_of_a_block_begins_the_next_one() -> None:
    """The server tells at once that the fourth segment is missing: what is left of the block is not sent."""
    asker = Asker(segment_s=0.001)
    asker.channel.write(INDEX, 0, LONG, 0.0, asker.results.append)
    asker.sent()
    asker.say("A4 20 1F 00 7F 00 00 00")
    first = asker.sent()
    assert [frame[:2] for frame in first] == [f"{number:02X}" for number in range(1, 9)]
    asker.say("A2 03 7F 00 00 00 00 00")
    again = asker.sent()
    assert [frame[:2] for frame in again] == [f"{number:02X}" for number in range(1, 9)]
    assert [frame[2:] for frame in again[:5]] == [frame[2:] for frame in first[3:]]
    asker.channel.on_time(0.008)
    assert [frame[:2] for frame in asker.sent()] == [f"{number:02X}" for number in range(9, 17)]
