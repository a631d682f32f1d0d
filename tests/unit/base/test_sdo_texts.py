"""Failures of SDO transfers as texts: the same as ``canopen`` says in English."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.base.sdo_texts import text_of, text_of_abort, text_of_learned, text_of_request
from bridge.canopen import abort
from bridge.canopen.decode_sdo import SdoListener
from bridge.canopen.sdo_block import Learned
from bridge.canopen.sdo_transfer import SdoError
from bridge.canopen.sdo_ways_back import WAYS_BACK, WayBack
from bridge.text import render


@pytest.mark.parametrize("code", [*abort.TEXTS, 0x1234_5678])
def test_an_abort_code_has_its_text(code: int) -> None:
    assert render(text_of_abort(code)) == abort.text(code)
    assert render(text_of_abort(code), "de") != abort.text(code)


@pytest.mark.parametrize("by_server", [True, False])
@pytest.mark.parametrize("code", [abort.TIMED_OUT, abort.BUSY])
def test_a_failed_transfer_has_its_text(code: int, by_server: bool) -> None:
    error = SdoError(0x1018, 1, code, by_server=by_server)
    assert render(text_of(error)) == str(error)


@pytest.mark.parametrize("way", WAYS_BACK)
def test_each_way_back_from_block_transfer_has_its_text(way: WayBack) -> None:
    learned = Learned(way, SdoError(0x1018, 1, abort.TIMED_OUT, by_server=False))
    assert render(text_of_learned(learned)) == str(learned)
    assert way.says not in render(text_of_learned(learned), "de")


_COMMANDS = st.sampled_from(
    [0x00, 0x01, 0x0E, 0x20, 0x21, 0x2F, 0x40, 0x60, 0x80, 0xA0, 0xA1, 0xA2, 0xA3, 0xC0, 0xC1]
)
_FRAMES = st.binary(max_size=9) | st.tuples(_COMMANDS, st.binary(min_size=7, max_size=7)).map(
    lambda parts: bytes((parts[0],)) + parts[1]
)


@given(st.lists(_FRAMES, max_size=6))
def test_a_request_has_its_text(frames: list[bytes]) -> None:
    listener = SdoListener()
    for data in frames:
        said = listener.request(data)
        assert render(text_of_request(said)) == said.text


@pytest.mark.parametrize(
    ("data", "german"),
    [
        ("2F60600008000000", "schreibt 6060h:00 := 8 (08h)"),
        ("4018100200000000", "liest 1018h:02"),
        ("2100200009010000", "schreibt 2000h:00: 265 Bytes in Segmenten"),
    ],
)
def test_and_in_german(data: str, german: str) -> None:
    assert render(text_of_request(SdoListener().request(bytes.fromhex(data))), "de") == german


def test_segments_of_a_block_have_their_texts() -> None:
    listener = SdoListener()
    listener.request(bytes.fromhex("C200200009000000"))
    listener.reply(bytes.fromhex("A40020007F000000"))
    for data in ("0101020304050607", "8208090000000000"):
        said = listener.request(bytes.fromhex(data))
        assert render(text_of_request(said)) == said.text
