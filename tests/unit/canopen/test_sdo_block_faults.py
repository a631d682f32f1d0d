"""SDO block transfer (CiA 301 §7.2.4.3.9–15) against every wrong answer, and whatever the wire does."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.canopen import abort
from bridge.canopen.frame import Frame
from bridge.canopen.sdo import SdoError
from bridge.canopen.sdo_block import crc16
from tests.support.sdo_block import INDEX, REPLY, Asker, Link

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


def test_a_wrong_crc_of_the_server_is_told_to_it_and_it_is_read_by_segments() -> None:
    asker = Asker()
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
    asker.say("A2 14 7F 00 00 00 00 00", "80 20 1F 00 04 00 04 05", "80 20 1F 00 20 00 00 08")
    assert asker.sentence.startswith("1F20h:00: the node aborted: data cannot be transferred or stored")


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


@pytest.mark.parametrize("size", [0, 128, 255])
def test_a_block_size_that_the_standard_does_not_have_ends_the_block_transfer(size: int) -> None:
    asker = Asker()
    asker.start_download(blksize=size)
    assert asker.sent()[-2:] == ["80 20 1F 00 02 00 04 05", "21 20 1F 00 8C 00 00 00"]


def test_too_many_bytes_are_not_taken() -> None:
    asker = Asker()
    asker.start_upload(140)
    asker.segments(*range(1, 128))
    assert asker.sent()[-2:] == ["80 20 1F 00 12 00 07 06", "40 20 1F 00 00 00 00 00"]
    asker.silence()
    assert isinstance(asker.results[0], SdoError)
    assert asker.results[0].code == abort.LENGTH_TOO_HIGH


def test_too_few_bytes_are_not_taken_for_the_value() -> None:
    asker = Asker()
    asker.start_upload(140)
    asker.segments(*range(1, 10), 0x80 | 10)
    asker.say("C1 00 00 00 00 00 00 00")
    asker.silence()
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
    assert asker.sent() == ["80 20 1F 00 00 00 04 05", "40 20 1F 00 00 00 00 00"]
    asker.silence()
    assert asker.sentence == "1F20h:00: no valid answer: SDO protocol timed out (05040000h)"


def test_a_server_that_goes_silent_in_a_download_is_told_its_last_segment_again_and_given_up() -> None:
    asker = Asker()
    asker.start_download()
    last = asker.sent()[-1]
    asker.silence()
    assert asker.sent() == [last]
    asker.silence()
    assert asker.sent() == ["80 20 1F 00 00 00 04 05", "21 20 1F 00 8C 00 00 00"]
    asker.silence()
    assert asker.sentence == "1F20h:00: no valid answer: SDO protocol timed out (05040000h)"


def test_a_server_that_does_not_answer_to_block_transfer_is_asked_by_segments_next() -> None:
    asker = Asker()
    asker.channel.write(INDEX, 0, bytes(140), 0.0, asker.results.append)
    assert asker.sent() == ["C6 20 1F 00 8C 00 00 00"]
    asker.silence()
    assert asker.sent() == ["80 20 1F 00 00 00 04 05", "21 20 1F 00 8C 00 00 00"]


def test_an_abort_in_the_middle_of_a_block_ends_the_block_transfer() -> None:
    asker = Asker()
    asker.start_upload()
    asker.segments(1, 2)
    asker.say("80 21 1F 00 22 00 00 08")
    assert asker.results == [], "that was about another object"
    asker.say("80 20 1F 00 22 00 00 08")
    assert asker.sent() == ["40 20 1F 00 00 00 00 00"]
    asker.segments(3)
    assert asker.channel.unmatched == 2
    asker.say("80 20 1F 00 22 00 00 08")
    assert asker.sentence.startswith(
        "1F20h:00: the node aborted: data cannot be transferred or stored because"
    )
    assert asker.sent() == []


def test_a_block_that_brings_nothing_is_asked_for_three_times_more() -> None:
    asker = Asker()
    asker.start_upload()
    for size in ("3F", "1F", "0F"):
        asker.segments(0x80 | 4)
        assert asker.sent() == [f"A2 00 {size} 00 00 00 00 00"]
    asker.segments(0x80 | 4)
    assert asker.sent() == ["80 20 1F 00 03 00 04 05", "40 20 1F 00 00 00 00 00"]
    asker.silence()
    assert asker.sentence == "1F20h:00: no valid answer: invalid sequence number (05040003h)"


def test_a_segment_that_comes_begins_the_count_of_useless_blocks_anew() -> None:
    asker = Asker()
    asker.start_upload()
    for numbers in ([0x84], [0x84], [0x84], [1, 0x84], [0x84], [0x84], [0x84]):
        asker.segments(*numbers)
    assert asker.results == []
    for numbers in ([*range(1, 5)], [*range(1, 9)], [*range(1, 7), 0x87]):  # blocks of 4, 8 and 16
        asker.segments(*numbers)
    asker.say(END)
    assert asker.results == [DATA]


def test_a_block_that_is_never_acknowledged_is_sent_three_times_more() -> None:
    asker = Asker()
    asker.start_download()
    block = asker.sent()[-20:]
    for _ in range(3):
        asker.say("A2 00 7F 00 00 00 00 00")
        assert asker.sent() == block
    asker.say("A2 00 7F 00 00 00 00 00")
    assert asker.sent() == ["80 20 1F 00 03 00 04 05", "21 20 1F 00 8C 00 00 00"]
    asker.silence()
    assert asker.sentence == "1F20h:00: no valid answer: invalid sequence number (05040003h)"


def test_a_segment_that_is_acknowledged_begins_the_count_of_useless_blocks_anew() -> None:
    asker = Asker()
    asker.start_download()
    for acknowledged in (0, 0, 0, 1, 0, 0, 0):
        asker.say(f"A2 {acknowledged:02X} 7F 00 00 00 00 00")
    asker.say("A2 13 7F 00 00 00 00 00", "A1 00 00 00 00 00 00 00")
    assert asker.results == [b""]


@pytest.mark.parametrize("size", [0, 128])
def test_a_wrong_block_size_is_told_to_the_server(size: int) -> None:
    """In the acknowledge of a block, too."""
    asker = Asker()
    asker.start_download(blksize=1)
    asker.sent()
    asker.say(f"A2 01 {size:02X} 00 00 00 00 00")
    assert asker.sent()[0] == "80 20 1F 00 02 00 04 05"


def test_more_segments_than_announced_are_not_acknowledged() -> None:
    """One too many, with or without unused bytes in it."""
    asker = Asker()
    asker.start_upload(140)
    asker.segments(*range(1, 21), 0x80 | 21)
    assert asker.sent()[0] == "80 20 1F 00 12 00 07 06"
    asker.silence()
    assert asker.sentence.startswith("1F20h:00: no valid answer: ")


def test_a_server_that_does_not_say_how_long_the_object_is_is_read_to_the_end() -> None:
    """§7.2.4.3.13: with s = 0 the bytes for the length are reserved."""
    asker = Asker()
    asker.channel.read(INDEX, 0, 0.0, asker.results.append)
    asker.say("41 20 1F 00 8C 00 00 00", "C4 20 1F 00 07 00 00 00")
    asker.segments(*range(1, 20), 0x80 | 20)
    asker.say(END)
    assert asker.results == [DATA]


def test_a_server_that_is_silent_from_the_first_segment_is_told_to_start_once() -> None:
    """A second start would be a command that it does not expect."""
    asker = Asker()
    asker.start_upload()
    asker.silence()
    assert asker.sent() == ["80 20 1F 00 00 00 04 05", "40 20 1F 00 00 00 00 00"]


def test_an_abort_at_the_start_of_a_second_block_ends_the_block_transfer() -> None:
    asker = Asker()
    asker.start_upload(2000)
    asker.segments(*range(1, 128))
    assert asker.sent() == ["A2 7F 7F 00 00 00 00 00"]
    asker.say("80 20 1F 00 22 00 00 08")
    assert asker.sent() == ["40 20 1F 00 00 00 00 00"]


def test_without_a_crc_a_block_whose_acknowledge_is_missing_is_not_sent_twice() -> None:
    """If it has come twice, nothing would show it."""
    asker = Asker()
    asker.channel.write(INDEX, 0, bytes(140), 0.0, asker.results.append)
    asker.say("A0 20 1F 00 7F 00 00 00")
    asker.sent()
    asker.silence()
    assert asker.sent() == ["80 20 1F 00 00 00 04 05", "21 20 1F 00 8C 00 00 00"]


def test_reserved_bits_and_bytes_of_the_server_say_nothing() -> None:
    asker = Asker()
    asker.channel.write(INDEX, 0, DATA, 0.0, asker.results.append)
    asker.say("BC 20 1F 00 7F FF FF FF", "BE 14 7F FF FF FF FF FF")
    assert bytes.fromhex(asker.sent()[-1]) == bytes.fromhex(END)
    asker.say("BD FF FF FF FF FF FF FF")
    asker.start_upload(command="DE")
    asker.segments(*range(1, 20), 0x80 | 20)
    asker.say(END[:8] + " FF FF FF FF FF")
    assert asker.results == [b"", DATA]


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
