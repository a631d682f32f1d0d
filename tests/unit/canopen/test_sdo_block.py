"""SDO block transfer with CRC (CiA 301 §7.2.4.3.9–15), against the simulator's server, which is written
from the standard on its own, over a wire that loses frames."""

from __future__ import annotations

from types import SimpleNamespace

import canopen
import pytest

from bridge.canopen.frame import Frame
from bridge.canopen.sdo import SEGMENTS_AT_ONCE, Result
from bridge.canopen.sdo_block import crc16
from tests.support.sdo_block import INDEX, LONG, REPLY, REQUEST, Asker, Link, once


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


def test_however_much_is_lost_a_block_has_four_segments_and_grows_again() -> None:
    """A block of none would never end; one of a single segment is dearer than no block transfer."""
    initiated = 0x41
    link = Link(lose=lambda way, frame: way == "from" and 5 <= frame[0] <= 127 and frame[0] != initiated)
    assert link.read() == LONG
    asked = [int(line.split()[3], 16) for line in link.log if line.startswith("> a2")]
    assert min(asked) == 4
    link.lose = lambda way, frame: False
    assert link.read() == LONG
    asked = [int(line.split()[3], 16) for line in link.log if line.startswith("> a2")]
    assert asked[-1] > 4


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


@pytest.mark.parametrize(("size", "blocks"), [(15 * 7, 0), (16 * 7 - 1, 0), (16 * 7, 1)])
def test_sixteen_whole_segments_are_worth_a_block(size: int, blocks: int) -> None:
    link = Link(LONG[:size])
    assert link.read() == LONG[:size]
    assert link.write(LONG[:size]) == b""
    assert (link.count("> a4"), link.count("> c6")) == (blocks, blocks)


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
