"""SDO (CiA 301 §7.2.4.3) by segments and at the start of blocks: what is wrong in an answer is told to the
server, what says nothing is not looked at."""

from __future__ import annotations

import struct

import pytest

from bridge.canopen.sdo import SdoError
from bridge.canopen.sdo_transfer import MOST_BYTES
from tests.support.sdo_block import Asker
from tests.support.sdo_client import Client

READ = None
ELEVEN = b"drivebridge"


@pytest.mark.parametrize(
    ("data", "answers", "code"),
    [
        (READ, ["41 20 1F 00 08 00 00 00", "10 31 32 33 34 35 36 37"], "00 00 03 05"),
        (READ, ["41 20 1F 00 05 00 00 00", "00 31 32 33 34 35 36 37"], "12 00 07 06"),
        (READ, ["41 20 1F 00 08 00 00 00", "01 31 32 33 34 35 36 37"], "13 00 07 06"),
        (READ, ["40 20 1F 00 00 00 00 00", "0E 00 00 00 00 00 00 00"], "13 00 07 06"),
        (READ, ["41 20 1F 00 00 00 10 00"], "05 00 04 05"),
        (ELEVEN, ["60 20 1F 00 00 00 00 00", "30 00 00 00 00 00 00 00"], "00 00 03 05"),
    ],
    ids=["toggle", "too long", "too short", "empty", "a megabyte", "toggle of a write"],
)
def test_a_wrong_answer_is_told_to_the_server(data: bytes | None, answers: list[str], code: str) -> None:
    asker = Asker()
    if data is None:
        asker.channel.read(0x1F20, 0, 0.0, asker.results.append)
    else:
        asker.channel.write(0x1F20, 0, data, 0.0, asker.results.append)
    asker.say(*answers[:-1])
    asker.sent()
    asker.say(answers[-1])
    assert asker.sent() == [f"80 20 1F 00 {code}"]
    assert asker.sentence.startswith("1F20h:00: no valid answer: ")


def test_reserved_bits_and_bytes_of_an_answer_say_nothing() -> None:
    client = Client()
    client.write(0x1008, 0, ELEVEN)
    client.answer("7F 08 10 00 FF FF FF FF")
    client.answer("2F FF FF FF FF FF FF FF")
    client.answer("3F FF FF FF FF FF FF FF")
    assert client.result == b""


def test_the_longest_value_that_is_accepted_is_asked_for() -> None:
    client = Client()
    client.read(0x1008)
    client.sent()
    client.answer(f"41 08 10 00 {struct.pack('<I', MOST_BYTES).hex()}")
    assert client.sent() == ["80 08 10 00 00 00 00 08", "A4 08 10 00 7F 00 00 00"]


def start_of_blocks() -> Asker:
    """140 bytes, up to the question for a block upload."""
    asker = Asker()
    asker.channel.read(0x1F20, 0, 0.0, asker.results.append)
    asker.say("41 20 1F 00 8C 00 00 00")
    assert asker.sent()[1:] == ["80 20 1F 00 00 00 00 08", "A4 20 1F 00 7F 00 00 00"]
    return asker


@pytest.mark.parametrize(
    "foreign",
    [
        "C6 21 1F 00 8C 00 00 00",  # another index
        "C6 20 1F 01 8C 00 00 00",  # another sub-index
        "41 21 1F 00 8C 00 00 00",  # that, by segments
        "C1 20 1F 00 00 00 00 00",  # the end of an upload by blocks
        "A4 20 1F 00 7F 00 00 00",  # to the start of a download by blocks
        "60 20 1F 00 00 00 00 00",  # acknowledge of a write
        "00 20 1F 00 00 00 00 00",  # a segment
    ],
)
def test_an_answer_to_something_else_does_not_start_blocks(foreign: str) -> None:
    asker = start_of_blocks()
    asker.say(foreign)
    assert (asker.sent(), asker.channel.unmatched) == ([], 1)
    asker.say("C6 20 1F 00 8C 00 00 00")
    assert asker.sent() == ["A3 00 00 00 00 00 00 00"]


def test_an_object_that_the_server_refuses_by_segments_too_says_nothing_of_its_blocks() -> None:
    """It knows the command and refuses the object; the next long object is asked for by blocks again."""
    asker = start_of_blocks()
    asker.say("80 20 1F 00 01 00 01 06")
    assert asker.sent() == ["40 20 1F 00 00 00 00 00"]
    asker.say("80 20 1F 00 01 00 01 06")
    assert asker.sentence == "1F20h:00: the node aborted: attempt to read a write-only object (06010001h)"
    asker.channel.write(0x1F20, 0, bytes(140), 0.0, asker.results.append)
    assert asker.sent() == ["C6 20 1F 00 8C 00 00 00"]
    asker.say("80 20 1F 00 02 00 01 06", "80 20 1F 00 02 00 01 06")
    assert asker.sent() == ["21 20 1F 00 8C 00 00 00"]
    assert isinstance(asker.results[1], SdoError)


def test_a_server_that_answered_blocks_with_segments_is_not_asked_for_blocks_again() -> None:
    asker = start_of_blocks()
    asker.say("41 20 1F 00 8C 00 00 00", "43 20 1F 00 11 22 33 44")
    assert asker.results == [bytes.fromhex("11223344")]
    asker.sent()
    asker.channel.read(0x1F20, 0, 0.0, asker.results.append)
    asker.say("41 20 1F 00 8C 00 00 00")
    assert asker.sent() == ["40 20 1F 00 00 00 00 00", "60 00 00 00 00 00 00 00"]


def test_an_object_that_has_become_short_is_read_without_blocks() -> None:
    """The server refuses blocks; asked again, it has the value in its first answer."""
    asker = start_of_blocks()
    asker.say("80 20 1F 00 01 00 04 05")
    assert asker.sent() == ["40 20 1F 00 00 00 00 00"]
    asker.say("4F 20 1F 00 07 00 00 00")
    assert asker.results == [b"\x07"]
