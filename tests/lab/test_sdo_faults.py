"""SDO answers that are late, another's or damaged, from a peer that speaks bare frames."""

from __future__ import annotations

import json
from collections.abc import Iterator

import pytest

from tests.support.process import drivebridge_called, peer
from tests.support.sniffer import Sniffer, sniffing

pytestmark = pytest.mark.nightly

DIRECT = ("--interface", "socketcan", "--channel", "vcan0")
TIMED_OUT, CRC = "05040000", "05040004"


@pytest.fixture(scope="module")
def bus(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Sniffer]:
    folder = tmp_path_factory.mktemp("peer")
    with sniffing() as bus, peer(folder, "odd_sdo_server", "vcan0") as server:
        server.wait_output("is there")
        yield bus


def read(name: str) -> tuple[int, dict[str, object], str]:
    done = drivebridge_called("sdo", "read", "5", name, "--json", *DIRECT)
    return done.returncode, json.loads(done.stdout), done.stderr


def test_silence_is_told_to_the_node_and_to_the_user(bus: Sniffer) -> None:
    code, answer, error = read("2000")
    assert (code, answer["ok"], answer["abort_code"]) == (1, False, TIMED_OUT)
    assert "no valid answer" in error
    assert bus.of(0x605)[-1].data == bytes.fromhex("8000200000000405")


def test_only_the_answer_to_what_was_asked_is_taken(bus: Sniffer) -> None:
    """A late answer, another object's, and another object's abort come before it."""
    code, answer, _ = read("2001")
    assert (code, answer["ok"], answer["data"]) == (0, True, "eeffc000")
    assert [frame.data[0] for frame in bus.of(0x585)[-4:]] == [0x43, 0x43, 0x80, 0x43]


def test_a_block_with_a_wrong_crc_is_no_value(bus: Sniffer) -> None:
    code, answer, error = read("2002")
    assert (code, answer["ok"], answer["abort_code"]) == (1, False, CRC)
    assert "CRC" in error
    assert bus.of(0x605)[-1].data == bytes.fromhex("8002200004000405")
