"""Every way back from a block transfer (CiA 301 §7.2.4.3.9–15) to segments, each row of the table."""

from __future__ import annotations

import pytest

from bridge.canopen import abort
from bridge.canopen.sdo import SdoError
from bridge.canopen.sdo_ways_back import WAYS_BACK, BlockStage, WayBack, way_back
from tests.support.sdo_block import Asker

DATA = bytes.fromhex("11223344556677") * 20
LENGTH = "8C 00 00 00"
ABORT = "80 20 1F 00 00 00 00 08"


def by_segments(asker: Asker) -> None:
    """The server serves an upload by segments from its beginning."""
    assert asker.sent()[-1] == "40 20 1F 00 00 00 00 00"
    asker.say(f"41 20 1F 00 {LENGTH}")
    for place in range(20):
        head = (place % 2) << 4 | (place == 19)
        asker.say(f"{head:02X} 11 22 33 44 55 66 77")


def is_remembered(asker: Asker) -> bool:
    asker.sent()
    asker.channel.read(0x1F20, 0, asker.now, asker.results.append)
    if not asker.sent():
        asker.silence()  # the answer that is owed may still come
        asker.sent()
    asker.say(f"41 20 1F 00 {LENGTH}")
    return asker.sent()[0].startswith("60")


@pytest.mark.parametrize("code", [*abort.TEXTS, 0x0800_0099, 0])
def test_a_block_upload_that_is_refused_with_any_code_goes_on_by_segments(code: int) -> None:
    asker = Asker()
    asker.channel.read(0x1F20, 0, 0.0, asker.results.append)
    asker.say(f"41 20 1F 00 {LENGTH}", "80 20 1F 00 " + code.to_bytes(4, "little").hex(" "))
    by_segments(asker)
    assert asker.results == [DATA]
    assert is_remembered(asker)
    assert "refuses" in str(asker.channel.take_learned())
    assert asker.channel.take_learned() is None, "it is told once"


def test_a_server_that_is_silent_on_a_block_upload_is_read_by_segments() -> None:
    """Without a retry: silence may be its way of not knowing A4h."""
    asker = Asker()
    asker.channel.read(0x1F20, 0, 0.0, asker.results.append)
    asker.say(f"41 20 1F 00 {LENGTH}")
    asker.silence()
    by_segments(asker)
    assert asker.results == [DATA]
    assert is_remembered(asker)


def test_an_answer_to_a4h_that_comes_late_is_no_answer_and_no_other_device() -> None:
    asker = Asker()
    asker.channel.read(0x1F20, 0, 0.0, asker.results.append)
    asker.say(f"41 20 1F 00 {LENGTH}")
    asker.silence()
    asker.say(f"C6 20 1F 00 {LENGTH}")
    assert asker.channel.late == 1
    by_segments(asker)
    assert asker.results == [DATA]


def test_a_block_upload_that_is_aborted_after_its_first_block_goes_on_by_segments() -> None:
    asker = Asker()
    asker.start_upload(140)
    asker.segments(*range(1, 21))
    asker.say(ABORT)
    by_segments(asker)
    assert asker.results == [DATA]


def test_a_block_upload_with_a_wrong_crc_is_read_by_segments() -> None:
    asker = Asker()
    asker.start_upload()
    asker.segments(*range(1, 20), 0x80 | 20)
    asker.sent()
    asker.say("C1 00 00 00 00 00 00 00")
    by_segments(asker)
    assert asker.results == [DATA]
    assert "CRC" in str(asker.channel.take_learned())


def test_a_download_is_repeated_by_segments_where_its_crc_was_refused() -> None:
    asker = Asker()
    asker.start_download()
    asker.say("A2 14 7F 00 00 00 00 00", "80 20 1F 00 04 00 04 05")
    assert asker.sent()[-1] == f"21 20 1F 00 {LENGTH}"


def test_a_download_whose_value_was_refused_is_not_written_again() -> None:
    """0609 0030h: the server has looked at the value."""
    asker = Asker()
    asker.start_download()
    asker.say("A2 14 7F 00 00 00 00 00", "80 20 1F 00 30 00 09 06")
    assert "invalid value" in asker.sentence


def test_a_download_whose_end_is_not_answered_is_not_written_again() -> None:
    """The server may have taken the value."""
    asker = Asker()
    asker.start_download()
    asker.say("A2 14 7F 00 00 00 00 00")
    asker.silence()
    assert "timed out" in asker.sentence


def test_a_server_that_refuses_segments_as_well_is_asked_for_blocks_the_next_time() -> None:
    """It is the object that it refuses, not the block transfer."""
    asker = Asker()
    asker.channel.write(0x1F20, 0, DATA, 0.0, asker.results.append)
    asker.say("80 20 1F 00 02 00 01 06", "80 20 1F 00 02 00 01 06")
    assert "read-only" in asker.sentence
    assert asker.channel.take_learned() is None
    asker.results.clear()
    asker.sent()
    asker.channel.write(0x1F20, 0, DATA, 0.0, asker.results.append)
    assert asker.sent()[-1].startswith("C6")


def test_a_server_that_is_silent_after_a_wrong_crc_is_told_by_its_crc() -> None:
    asker = Asker()
    asker.start_upload()
    asker.segments(*range(1, 20), 0x80 | 20)
    asker.say("C1 00 00 00 00 00 00 00")
    asker.silence()
    assert asker.sentence == "1F20h:00: no valid answer: CRC error (05040004h)"


def test_what_was_learned_outlasts_a_lost_node_and_not_another_device() -> None:
    asker = Asker()
    asker.channel.read(0x1F20, 0, 0.0, asker.results.append)
    asker.say(f"41 20 1F 00 {LENGTH}", ABORT)
    by_segments(asker)
    asker.results.clear()
    asker.channel.flush(asker.now)
    assert is_remembered(asker)
    asker.channel.flush(asker.now)
    asker.channel.forget_block()
    assert not is_remembered(asker)


@pytest.mark.parametrize("row", WAYS_BACK, ids=lambda row: f"{row.stage.name} {row.says}")
def test_every_row_of_the_table_is_reached(row: WayBack) -> None:
    code = min(row.codes, default=abort.GENERAL)
    assert way_back(row.stage, SdoError(0x1F20, 0, code, by_server=row.by_server)) is row


def test_a_value_that_is_too_long_for_the_bridge_has_no_way_back() -> None:
    error = SdoError(0x1F20, 0, abort.OUT_OF_MEMORY, by_server=False)
    assert all(way_back(stage, error) is None for stage in BlockStage)
