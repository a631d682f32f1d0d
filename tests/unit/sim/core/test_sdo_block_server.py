"""Block transfer of the simulator's SDO server: frames of CiA 301, and canopen's client as its judge."""

from __future__ import annotations

from types import SimpleNamespace

import canopen
import pytest
from canopen.sdo import SdoAbortedError, SdoClient

from bridge.sim.core.dictionary import Cell, Dictionary, Domain, IntegerType, Number
from bridge.sim.core.sdo_block_server import checksum
from bridge.sim.core.sdo_server import SimulatedSdoServer

DATA = bytes(range(256)) * 5


class Store:
    def __init__(self, data: bytes = DATA, segments: int = 127) -> None:
        self.data = data
        self.cell = Cell(7)
        objects = Dictionary()
        objects.add(0x1F20, 0, Domain(4096, lambda: self.data, self.set))
        objects.add(0x2000, 0, Number(IntegerType.UNSIGNED32, self.cell.get, self.cell.set))
        self.server = SimulatedSdoServer(objects, segments)

    def set(self, data: bytes) -> None:
        self.data = data

    def ask(self, *requests: str) -> list[str]:
        """The answers to the last of ``requests``."""
        answers: list[bytes] = []
        for request in requests:
            answers = self.server.on_request(bytes.fromhex(request))
        return [answer.hex(" ").upper() for answer in answers]


def foreign_client(store: Store) -> SdoClient:
    client = SdoClient(0x605, 0x585, canopen.ObjectDictionary())
    client.RESPONSE_TIMEOUT = 0.01

    def send_message(can_id: int, data: bytes, remote: bool = False) -> None:
        for answer in store.server.on_request(bytes(data)):
            client.on_response(0x585, answer, 0.0)

    client.network = SimpleNamespace(send_message=send_message)
    return client


def test_the_checksum_is_that_of_the_standard():
    assert checksum(b"123456789") == 0x31C3


def test_canopens_client_reads_by_blocks():
    with foreign_client(Store()).open(0x1F20, 0, "rb", block_transfer=True) as file:
        assert file.read() == DATA


@pytest.mark.parametrize("segments", [1, 4, 127])
def test_canopens_client_writes_by_blocks(segments):
    store = Store(b"", segments)
    with foreign_client(store).open(0x1F20, 0, "wb", size=len(DATA), block_transfer=True) as file:
        file.write(DATA)
    assert store.data == DATA


def test_canopens_client_is_told_that_there_is_no_block_transfer():
    with pytest.raises(SdoAbortedError) as caught:
        foreign_client(Store(segments=0)).open(0x1F20, 0, "rb", block_transfer=True)
    assert caught.value.code == 0x0504_0001


def test_a_short_value_is_sent_as_the_client_would_rather_have_it():
    # §7.2.4.3.13: protocol switch threshold of 4 bytes
    assert Store().ask("A4 00 20 00 7F 04 00 00") == ["43 00 20 00 07 00 00 00"]
    assert Store().ask("A4 00 20 00 7F 03 00 00") == ["C6 00 20 00 04 00 00 00"]


def test_a_segment_that_is_missing_stops_the_count():
    store = Store(b"", 3)
    store.ask("C6 20 1F 00 15 00 00 00", "01 11 11 11 11 11 11 11")
    assert store.ask("83 33 33 33 33 33 33 33") == ["A2 01 03 00 00 00 00 00"]


def test_a_segment_may_look_like_an_abort_and_an_abort_is_never_a_segment():
    """The only segment of a transfer begins with 81h; no segment begins with 80h."""
    store = Store(b"")
    assert store.ask("C2 20 1F 00 07 00 00 00", "81 80 80 80 80 80 80 80") == ["A2 01 7F 00 00 00 00 00"]
    assert store.ask("C1 00 00 00 00 00 00 00") == ["A1 00 00 00 00 00 00 00"]
    assert store.data == b"\x80" * 7
    assert store.ask("C2 20 1F 00 07 00 00 00", "80 20 1F 00 00 00 00 08") == []
    assert store.ask("C1 00 00 00 00 00 00 00") == ["80 00 00 00 01 00 04 05"]


@pytest.mark.parametrize(
    ("requests", "code", "why"),
    [
        (["A4 20 1F 00 00 00 00 00"], "02 00 04 05", "no block has 0 segments"),
        (["A4 20 1F 00 80 00 00 00"], "02 00 04 05", "nor 128"),
        (["A4 20 1F 00 02 00 00 00", "A3" + 7 * " 00", "A2 03 02" + 5 * " 00"], "03 00 04 05", "2 were sent"),
        (["A4 20 1F 00 02 00 00 00", "A2 01 02" + 5 * " 00"], "01 00 04 05", "nothing was sent"),
        (["C6 20 1F 00 00 00 01 00"], "12 00 07 06", "longer than the object"),
        (["C6 20 1F 00 08 00 00 00", "81" + 7 * " 00", "C1 00 00" + 5 * " 00"], "10 00 07 06", "8 announced"),
        (["C4 20 1F 00 00 00 00 00", "81" + 7 * " 11", "C1 00 00" + 5 * " 00"], "04 00 04 05", "wrong CRC"),
        (["C6 20 1F 00 07 00 00 00", "01" + 7 * " 00", "05" + 7 * " 00"], None, "not the end of the block"),
    ],
)
def test_a_wrong_request_gets_its_abort_code(requests, code, why):
    store = Store()
    assert store.ask(*requests) == ([] if code is None else [f"80 20 1F 00 {code}"]), why
    assert store.data == DATA
