"""SDO block transfer on real SocketCAN, by the command line, with a lost segment each way."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.lab.test_bus_commands import DIRECT, answer
from tests.support.process import peer
from tests.support.sniffer import Sniffer, sniffing

pytestmark = pytest.mark.nightly

DATA = bytes(range(256)) * 4


@pytest.fixture
def bus(tmp_path: Path) -> Iterator[Sniffer]:
    with peer(tmp_path, "block_slave", "vcan0", "9") as slave, sniffing() as bus:
        slave.wait_output("is there")
        yield bus


def requests(bus: Sniffer, command: int) -> int:
    return sum(frame.data[0] == command for frame in bus.frames if frame.can_id == 0x609)


def test_a_long_object_is_read_and_written_by_blocks(bus: Sniffer) -> None:
    read = answer("sdo", "read", "9", "1F20", *DIRECT)
    assert bytes.fromhex(read["data"]) == DATA
    assert (requests(bus, 0xA4), requests(bus, 0x60)) == (1, 0), "by blocks, not by segments"
    assert requests(bus, 0xA1) == 1, "the end of the upload is told to the server"
    wanted = DATA[::-1]
    answer("sdo", "write", "9", "1F20", wanted.hex(), "--type", "bytes", "--yes", *DIRECT)
    assert requests(bus, 0xC6) == 1
    assert bytes.fromhex(answer("sdo", "read", "9", "1F20", *DIRECT)["data"]) == wanted
