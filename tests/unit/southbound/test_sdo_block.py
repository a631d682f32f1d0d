"""SDO block transfer with CRC (CiA 301 §7.2.4.3.9–15): against the simulator's server, which is written
from the standard on its own, over a wire that loses frames; and against every wrong answer."""

from __future__ import annotations

import struct
from collections.abc import Callable
from types import SimpleNamespace

import canopen
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.sim.dictionary import Dictionary, Domain
from bridge.sim.sdo_server import SdoServer
from bridge.southbound.bus.frame import Frame
from bridge.southbound.canopen import abort
from bridge.southbound.canopen.sdo import SEGMENTS_AT_ONCE, Result, SdoChannel, SdoError
from bridge.southbound.canopen.sdo_block import crc16

REQUEST, REPLY = 0x605, 0x585
LONG = bytes(range(256)) * 4
INDEX = 0x1F20

Lose = Callable[[str, bytes], bool]
"""Whether a frame ("to" or "from" the server) is lost."""


class Link:
    """A channel and a server, joined by a wire on a virtual clock."""

    def __init__(
        self,
        data: bytes = LONG,
        *,
        block: int = 127,
        lose: Lose = lambda way, frame: False,
        retries: int = 0,
        segment_s: float = 0.0,
    ) -> None:
        self.stored = data
        objects = Dictionary()
        objects.add(INDEX, 0, Domain(1 << 16, lambda: self.stored, self._store))
        self.server = SdoServer(objects, block)
        self.channel = SdoChannel(REQUEST, REPLY, 0.5, retries=retries, segment_s=segment_s)
        self.lose = lose
        self.now = 0.0
        self.log: list[str] = []
        self.results: list[Result] = []

    def _store(self, data: bytes) -> None:
        self.stored = data

    def read(self) -> Result:
        self.channel.read(INDEX, 0, self.now, self.results.append)
        return self._finish()

    def write(self, data: bytes) -> Result:
        self.channel.write(INDEX, 0, data, self.now, self.results.append)
        return self._finish()

    def _finish(self) -> Result:
        for _ in range(10_000):
            self.exchange()
            if self.results:
                return self.results.pop()
            deadline = self.channel.next_deadline()
            assert deadline is not None, "a transfer without an end"
            self.now = max(self.now, deadline)
            self.channel.on_time(self.now)
        raise AssertionError("a transfer without an end")

    def exchange(self) -> None:
        """Carry frames both ways until nobody has anything to say at this moment."""
        while frames := self.channel.take_frames():
            for request in frames:
                self.log.append(f"> {request.data.hex(' ')}")
                if self.lose("to", request.data):
                    continue
                for answer in self.server.on_request(request.data):
                    self.log.append(f"< {answer.hex(' ')}")
                    if not self.lose("from", answer):
                        self.channel.on_frame(Frame(REPLY, answer, self.now))

    def count(self, start: str) -> int:
        return sum(line.startswith(start) for line in self.log)


def once(way: str, first: int) -> Lose:
    """Lose the first frame of one direction that begins with this byte."""
    lost: list[bytes] = []

    def lose(direction: str, frame: bytes) -> bool:
        if direction != way or frame[0] != first or lost:
            return False
        lost.append(frame)
        return True

    return lose


def test_the_checksum_is_that_of_the_standard() -> None:
    """CiA 301 §7.2.4.3.16: the CRC of "123456789" is 31C3h."""
    assert crc16(b"123456789") == 0x31C3


def test_a_long_object_is_read_by_blocks() -> None:
    link = Link()
    assert link.read() == LONG
    assert link.count("> 60") == 0, "no segmented upload"
    assert link.count("> a2") == 2, "147 segments are two blocks of up to 127"
    assert link.log[-1] == "> a1 00 00 00 00 00 00 00"
    assert link.channel.unmatched == 0


def test_a_long_object_is_written_by_blocks() -> None:
    link = Link(b"")
    assert link.write(LONG) == b""
    assert link.stored == LONG
    assert link.count("< a2") == 2
    assert link.log[0] == "> c6 20 1f 00 00 04 00 00"


def test_a_server_without_block_transfer_is_served_by_segments() -> None:
    link = Link(block=0)
    assert link.read() == LONG
    assert link.write(LONG[::-1]) == b""
    assert link.stored == LONG[::-1]
    link.read()
    assert link.count("> a4") + link.count("> c6") == 1, "it is asked for block transfer once"


def test_a_server_that_answers_block_transfer_with_segments_is_served_by_segments() -> None:
    """canopen's LocalNode does; with a threshold of 0 the standard does not allow it (§7.2.4.3.13)."""
    asker = Asker()
    asker.channel.read(INDEX, 0, 0.0, asker.results.append)
    asker.say("41 20 1F 00 8C 00 00 00", "41 20 1F 00 8C 00 00 00")
    assert asker.sent()[-2:] == ["80 20 1F 00 00 00 00 08", "40 20 1F 00 00 00 00 00"]
    asker.say("41 20 1F 00 07 00 00 00", "01 11 22 33 44 55 66 77")
    assert asker.results == [bytes.fromhex("11223344556677")]


def test_canopens_slave_is_read_and_written() -> None:
    """A server that we did not write."""
    node = canopen.LocalNode(5, canopen.ObjectDictionary())
    entry = canopen.objectdictionary.ODVariable("text", 0x2000, 0)
    entry.data_type, entry.access_type = canopen.objectdictionary.OCTET_STRING, "rw"
    node.object_dictionary.add_object(entry)
    node.set_data(0x2000, 0, LONG)
    asker = Asker()

    def serve() -> Result:
        while not asker.results:
            for frame in asker.channel.take_frames():
                node.sdo.on_request(REQUEST, frame.data, 0.0)
        return asker.results.pop()

    def send_message(can_id: int, data: bytes, remote: bool = False) -> None:
        asker.channel.on_frame(Frame(REPLY, bytes(data), 0.0))

    node.sdo.network = SimpleNamespace(send_message=send_message)
    asker.channel.read(0x2000, 0, 0.0, asker.results.append)
    assert serve() == LONG
    asker.channel.flush(0.0)  # forget that block transfer was refused
    asker.channel.write(0x2000, 0, LONG[::-1], 0.0, asker.results.append)
    assert serve() == b""
    assert node.get_data(0x2000, 0) == LONG[::-1]


def test_a_short_object_takes_no_block_transfer() -> None:
    link = Link(b"01.00.00.00")
    assert link.read() == b"01.00.00.00"
    assert link.write(b"02.00.00.00") == b""
    assert link.count("> a4") + link.count("> c6") == 0


@pytest.mark.parametrize("segment", [1, 5, 126, 127])
def test_a_segment_lost_on_the_way_here_is_sent_again(segment: int) -> None:
    link = Link(lose=once("from", segment))
    assert link.read() == LONG


@pytest.mark.parametrize("segment", [1, 5, 126, 127])
def test_a_segment_lost_on_the_way_there_is_sent_again(segment: int) -> None:
    link = Link(b"", lose=once("to", segment))
    assert link.write(LONG) == b""
    assert link.stored == LONG


def test_after_a_loss_smaller_blocks_are_asked_for_and_larger_ones_later() -> None:
    link = Link(LONG * 8, lose=once("from", 100))
    assert link.read() == LONG * 8
    sizes = [int(line.split()[3], 16) for line in link.log if line.startswith("> a2")]
    assert sizes[:3] == [63, 126, 127]


def test_the_servers_block_size_counts_for_a_download() -> None:
    link = Link(b"", block=4)
    assert link.write(LONG) == b""
    assert link.stored == LONG
    assert link.count("< a2") == 37, "147 segments in blocks of four"


def test_a_block_leaves_room_on_the_bus() -> None:
    """At 250 kbit/s a segment takes half a millisecond: eight go out together, then others may send."""
    link = Link(b"", segment_s=0.001)
    link.channel.write(INDEX, 0, LONG, 0.0, link.results.append)
    (initiate,) = link.channel.take_frames()
    (answer,) = link.server.on_request(initiate.data)
    link.channel.on_frame(Frame(REPLY, answer, 0.001))
    assert len(link.channel.take_frames()) == SEGMENTS_AT_ONCE
    link.channel.on_time(0.005)
    assert link.channel.take_frames() == []
    due = link.channel.next_deadline()
    assert due is not None and due == pytest.approx(0.009)
    link.channel.on_time(due)
    assert len(link.channel.take_frames()) == SEGMENTS_AT_ONCE


def test_an_acknowledge_of_segments_that_have_not_been_sent_is_no_answer() -> None:
    """The acknowledge of the block before, doubled by the bus, while the next block goes out."""
    link = Link(b"", segment_s=0.001)
    link.channel.write(INDEX, 0, LONG, 0.0, link.results.append)
    link.channel.take_frames()
    link.channel.on_frame(Frame(REPLY, bytes.fromhex("A4201F007F000000"), 0.001))
    link.channel.on_frame(Frame(REPLY, bytes.fromhex("A27F7F0000000000"), 0.002))
    assert link.channel.unmatched == 1


# wrong answers: what the user sees


class Asker:
    """A channel whose server is the test."""

    def __init__(self, retries: int = 0) -> None:
        self.channel = SdoChannel(REQUEST, REPLY, 0.5, retries=retries, segment_s=0.0)
        self.results: list[Result] = []
        self.now = 0.0

    def start_upload(self, size: int = 140, command: str = "C6") -> None:
        """Read, up to the start of the first block."""
        self.channel.read(INDEX, 0, self.now, self.results.append)
        length = struct.pack("<I", size).hex()
        self.say(f"41 20 1F 00 {length}")
        self.say(f"{command} 20 1F 00 {length}")
        self.sent()

    def start_download(self, size: int = 140, blksize: int = 127) -> None:
        """Write, up to the first block."""
        self.channel.write(INDEX, 0, bytes(size), self.now, self.results.append)
        self.say(f"A4 20 1F 00 {blksize:02X} 00 00 00")

    def say(self, *frames: str) -> None:
        for text in frames:
            self.channel.on_frame(Frame(REPLY, bytes.fromhex(text), self.now))

    def segments(self, *numbers: int) -> None:
        for number in numbers:
            self.say(f"{number:02X} 11 22 33 44 55 66 77")

    def sent(self) -> list[str]:
        return [frame.data.hex(" ").upper() for frame in self.channel.take_frames()]

    def silence(self) -> None:
        """Nothing is heard for as long as the channel waits."""
        deadline = self.channel.next_deadline()
        assert deadline is not None
        self.now = deadline
        self.channel.on_time(self.now)

    @property
    def sentence(self) -> str:
        (result,) = self.results
        assert isinstance(result, SdoError)
        return str(result)


DATA = bytes.fromhex("11223344556677") * 20
END = f"C1 {crc16(DATA).to_bytes(2, 'little').hex()} 00 00 00 00 00"


def test_a_right_upload_is_acknowledged_and_ended() -> None:
    asker = Asker()
    asker.start_upload()
    asker.segments(*range(1, 20), 0x80 | 20)
    assert asker.sent() == ["A2 14 7F 00 00 00 00 00"]
    asker.say(END)
    assert asker.sent() == ["A1 00 00 00 00 00 00 00"]
    assert asker.results == [DATA]


def test_a_wrong_crc_of_the_server_is_told_to_both_sides() -> None:
    asker = Asker()
    asker.start_upload()
    asker.segments(*range(1, 20), 0x80 | 20)
    asker.sent()
    asker.say("C1 00 00 00 00 00 00 00")
    assert asker.sentence == "1F20h:00: no valid answer: CRC error (05040004h)"
    assert asker.sent() == ["80 20 1F 00 04 00 04 05"]


def test_a_wrong_crc_is_read_again_where_retries_are_left() -> None:
    asker = Asker(retries=1)
    asker.start_upload()
    asker.segments(*range(1, 20), 0x80 | 20)
    asker.sent()
    asker.say("C1 00 00 00 00 00 00 00")
    assert asker.sent() == ["80 20 1F 00 04 00 04 05", "40 20 1F 00 00 00 00 00"]
    assert asker.results == []


def test_a_server_without_crc_is_believed_by_its_length() -> None:
    asker = Asker()
    asker.start_upload(command="C2")
    asker.segments(*range(1, 20), 0x80 | 20)
    asker.say("C1 00 00 00 00 00 00 00")
    assert asker.results == [DATA]


def test_a_crc_that_the_server_finds_wrong_is_an_abort() -> None:
    asker = Asker()
    asker.start_download()
    asker.say("A2 14 7F 00 00 00 00 00", "80 20 1F 00 04 00 04 05")
    assert asker.sentence == "1F20h:00: the node aborted: CRC error (05040004h)"


def test_doubled_segments_are_counted_and_passed_over() -> None:
    asker = Asker()
    asker.start_upload()
    asker.segments(1, 2, 2, 1, *range(3, 20), 0x80 | 20)
    asker.say(END)
    assert asker.results == [DATA]
    assert asker.channel.unmatched == 2


def test_the_last_segment_once_more_is_not_the_end() -> None:
    """Segment 65 with the bit for "last" begins with C1h, as the end of an upload does."""
    data = bytes.fromhex("11223344556677") * 65
    asker = Asker()
    asker.start_upload(len(data))
    asker.segments(*range(1, 65), 0xC1, 0xC1)
    assert (asker.results, asker.channel.unmatched) == ([], 1)
    asker.say(f"C1 {crc16(data).to_bytes(2, 'little').hex()} 00 00 00 00 00")
    assert asker.results == [data]


def test_segments_out_of_sequence_are_asked_for_again() -> None:
    asker = Asker()
    asker.start_upload()
    asker.segments(1, 2, 9, 5, 3, 0x80 | 20)
    assert asker.sent() == ["A2 03 3F 00 00 00 00 00"], "3 came in sequence, and half as many next time"
    asker.segments(*range(1, 17), 0x80 | 17)
    asker.say(END)
    assert asker.results == [DATA]


def test_a_server_that_only_sends_wrong_sequence_numbers_is_given_up() -> None:
    asker = Asker()
    asker.start_upload()
    for _ in range(10):
        asker.segments(0x80 | 4)
    assert asker.sentence == "1F20h:00: no valid answer: invalid sequence number (05040003h)"


def test_a_server_that_never_acknowledges_anything_is_given_up() -> None:
    asker = Asker()
    asker.start_download()
    for _ in range(10):
        asker.say("A2 00 7F 00 00 00 00 00")
    assert asker.sentence == "1F20h:00: no valid answer: invalid sequence number (05040003h)"


@pytest.mark.parametrize("size", [0, 128, 255])
def test_a_block_size_that_the_standard_does_not_have_ends_the_transfer(size: int) -> None:
    asker = Asker()
    asker.start_download(blksize=size)
    assert asker.sentence == "1F20h:00: no valid answer: invalid block size (05040002h)"


def test_too_many_bytes_are_not_taken() -> None:
    asker = Asker()
    asker.start_upload(140)
    asker.segments(*range(1, 128))
    assert isinstance(asker.results[0], SdoError)
    assert asker.results[0].code == abort.LENGTH_TOO_HIGH


def test_too_few_bytes_are_not_taken_for_the_value() -> None:
    asker = Asker()
    asker.start_upload(140)
    asker.segments(*range(1, 10), 0x80 | 10)
    asker.say("C1 00 00 00 00 00 00 00")
    assert isinstance(asker.results[0], SdoError)
    assert asker.results[0].code == abort.LENGTH_TOO_LOW


def test_a_megabyte_announced_by_blocks_is_not_believed() -> None:
    asker = Asker()
    asker.channel.read(INDEX, 0, 0.0, asker.results.append)
    asker.say("41 20 1F 00 8C 00 00 00", "C6 20 1F 00 00 00 10 00")
    assert asker.sentence == "1F20h:00: no valid answer: out of memory (05040005h)"


def test_a_server_that_goes_silent_in_an_upload_is_asked_once_more_and_given_up() -> None:
    asker = Asker()
    asker.start_upload()
    asker.segments(1, 2, 3)
    asker.silence()
    assert asker.sent() == ["A2 03 3F 00 00 00 00 00"]
    asker.silence()
    assert asker.sent() == ["A2 03 3F 00 00 00 00 00"]
    asker.silence()
    assert asker.sentence == "1F20h:00: no valid answer: SDO protocol timed out (05040000h)"
    assert asker.sent() == ["80 20 1F 00 00 00 04 05"]


def test_a_server_that_goes_silent_in_a_download_is_told_its_last_segment_again_and_given_up() -> None:
    asker = Asker()
    asker.start_download()
    last = asker.sent()[-1]
    asker.silence()
    assert asker.sent() == [last]
    asker.silence()
    assert asker.sentence == "1F20h:00: no valid answer: SDO protocol timed out (05040000h)"


def test_a_server_that_does_not_answer_to_block_transfer_is_asked_by_segments_next() -> None:
    asker = Asker(retries=1)
    asker.channel.write(INDEX, 0, bytes(140), 0.0, asker.results.append)
    assert asker.sent() == ["C6 20 1F 00 8C 00 00 00"]
    asker.silence()
    assert asker.sent() == ["80 20 1F 00 00 00 04 05", "21 20 1F 00 8C 00 00 00"]


def test_an_abort_in_the_middle_of_a_block_ends_the_transfer() -> None:
    asker = Asker()
    asker.start_upload()
    asker.segments(1, 2)
    asker.say("80 21 1F 00 22 00 00 08")
    assert asker.results == [], "that was about another object"
    asker.say("80 20 1F 00 22 00 00 08")
    assert asker.sentence.startswith(
        "1F20h:00: the node aborted: data cannot be transferred or stored because"
    )
    asker.segments(3)
    assert asker.channel.unmatched == 2
    assert asker.sent() == []


# whatever the wire does


@given(st.integers(112, 2000), st.integers(0, 2**32), st.floats(0.0, 0.05), st.integers(1, 127))
def test_what_arrives_is_right_or_named_as_lost(size: int, seed: int, loss: float, block: int) -> None:
    """No loss of frames makes a wrong value look right, here or in the server."""
    import random

    chance = random.Random(seed)
    data = chance.randbytes(size)
    link = Link(data, block=block, retries=1, lose=lambda way, frame: chance.random() < loss)
    result = link.read()
    assert result == data or isinstance(result, SdoError)
    wanted = chance.randbytes(size)
    result = link.write(wanted)
    assert link.stored == wanted or (isinstance(result, SdoError) and link.stored == data)
    if not loss:
        assert not isinstance(result, SdoError)


@given(
    st.integers(0, 300),
    st.booleans(),
    st.lists(st.one_of(st.binary(min_size=8, max_size=8), st.just(b"")), max_size=200),
)
def test_no_server_can_raise_or_keep_a_block_transfer_for_ever(
    size: int, reads: bool, answers: list[bytes]
) -> None:
    asker = Asker(retries=1)
    if reads:
        asker.start_upload(size)
    else:
        asker.start_download(max(size, 112))
    for answer in answers:
        if answer:
            asker.channel.on_frame(Frame(REPLY, answer, asker.now))
        elif asker.channel.next_deadline() is not None:
            asker.silence()
        asker.sent()
    for _ in range(200):
        if asker.results:
            break
        asker.silence()
        assert len(asker.sent()) <= 200
    assert len(asker.results) == 1
    assert asker.channel.waiting == 0
