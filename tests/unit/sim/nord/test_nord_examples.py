"""The worked examples of BU 2500 §6.5.8, §6.6 and §6.8, by our codecs and through the simulated nodes.

Misprints of the manual that are put right here: frames go to 600h and come from 580h *with the node
address*; the answer to the count of §6.5.8 is that of 1A00h:00, not of 1800h:01; its COB-ID is sub-index 1,
not 2; P102 is 2066h, `66 20` on the wire, in the text of §6.6.1 and in the read example of §6.6.2 too.
"""

from __future__ import annotations

import pytest

from bridge.canopen.frame import Frame
from bridge.canopen.pdo import PdoCodec, PdoEntry
from bridge.canopen.sdo import SdoChannel, SdoError
from bridge.mapping import load_family
from bridge.node.boot import factory_entries
from bridge.sim.nord.nord_single import NordSingle
from bridge.sim.nord.nord_single_settings import RJ45_5XX, RJ45_54X, TU3
from bridge.sim.nord.nord_tu4 import NordTu4

NODES = {
    "nord/sk-tu4-cao": lambda: NordTu4(5),
    "nord/sk-cu4-cao": lambda: NordTu4(5, kind="SK CU4-CAO"),
    "nord/sk-tu3-cao": lambda: NordSingle(5, TU3),
    "nord/sk-5xxe-rj45": lambda: NordSingle(5, RJ45_5XX),
    "nord/sk-54xe-rj45": lambda: NordSingle(5, RJ45_54X),
}


class Client:
    """The bridge's SDO client, talking to a simulated node."""

    def __init__(self, bench) -> None:
        self.channel = SdoChannel(0x605, 0x585, 0.5)
        self.results: list[bytes | SdoError] = []
        self._bench = bench

    def dialogue(self) -> tuple[str, str]:
        """The one frame that the client sends now, and the node's answer."""
        (request,) = self.channel.take_frames()
        (answer,) = [
            frame for frame in self._bench.put(request.can_id, request.data) if frame.can_id == 0x585
        ]
        self.channel.on_frame(Frame(0x585, answer.data))
        return request.data.hex(" ").upper(), answer.data.hex(" ").upper()

    def write(self, index: int, sub: int, data: bytes) -> tuple[str, str]:
        self.channel.write(index, sub, data, self._bench.now, self.results.append)
        return self.dialogue()

    def read(self, index: int, sub: int) -> tuple[str, str]:
        self.channel.read(index, sub, self._bench.now, self.results.append)
        return self.dialogue()


@pytest.fixture(params=NODES)
def bench(request, bench_of):
    return bench_of(NODES[request.param]())


@pytest.fixture
def tu4(bench_of):
    return bench_of(NordTu4(5))


# §6.5.5, §6.5.8


def test_6_5_8_another_mapping_and_identifier_for_tpdo1(tu4):
    client = Client(tu4)
    control, setpoint_3 = PdoEntry(0x3000, 1, 16), PdoEntry(0x3002, 3, 16)
    for index, sub, data, request, answer in (
        (0x1A00, 0, b"\0", "2F 00 1A 00 00 00 00 00", "60 00 1A 00"),
        (0x1A00, 1, control.to_object().to_bytes(4, "little"), "23 00 1A 01 10 01 00 30", "60 00 1A 01"),
        (0x1A00, 2, setpoint_3.to_object().to_bytes(4, "little"), "23 00 1A 02 10 03 02 30", "60 00 1A 02"),
        (0x1A00, 0, b"\2", "2F 00 1A 00 02 00 00 00", "60 00 1A 00"),
        (0x1800, 1, bytes.fromhex("00000080"), "23 00 18 01 00 00 00 80", "60 00 18 01"),
        (0x1800, 3, b"\0\0", "2B 00 18 03 00 00 00 00", "60 00 18 03"),
        (0x1800, 2, b"\3", "2F 00 18 02 03 00 00 00", "60 00 18 02"),
        (0x1800, 1, bytes.fromhex("32040000"), "23 00 18 01 32 04 00 00", "60 00 18 01"),
    ):
        assert client.write(index, sub, data) == (request, f"{answer} 00 00 00 00")
    assert client.results == [b""] * 8
    tu4.run(0.3)
    tu4.nmt(0x01)
    tu4.command(0x047E, 0x0111, 0x0222, 0x0333)
    sent = [tu4.sync() for _ in range(6)]
    assert [len(frames) for frames in sent] == [0, 0, 1, 0, 0, 1]
    frame = sent[2][0]
    assert frame.can_id == 0x432
    assert PdoCodec((control, setpoint_3)).unpack(frame.data) == (0x047E, 0x0333)


@pytest.mark.landing
def test_6_5_5_bit_30_of_an_identifier_reads_1(tu4):
    client = Client(tu4)
    assert client.write(0x1800, 1, (0x4000_0201).to_bytes(4, "little"))[1].startswith("60")
    assert client.read(0x1800, 1)[1] == "43 00 18 01 01 02 00 40"


# §6.6


def test_6_6_1_p102_is_set_to_1_03_s(bench):
    client = Client(bench)
    request, answer = client.write(0x2066, 1, (103).to_bytes(2, "little"))
    assert (request, answer) == ("2B 66 20 01 67 00 00 00", "60 66 20 01 00 00 00 00")
    assert bench.node.drives[0].parameters.value(102) == 1.03
    request, answer = client.read(0x2066, 1)
    assert (request, answer) == ("40 66 20 01 00 00 00 00", "4B 66 20 01 67 00 00 00")
    assert client.results == [b"", b"\x67\x00"]


@pytest.mark.parametrize("name", NODES)
def test_6_6_1_the_name_leads_to_the_object(name):
    family = load_family(name)
    assert str(family.object_of(family.parameter_named("P102"))) == "2066:01"
    assert family.parameter_named("P102").factor == 0.01


def test_6_6_1_a_sub_index_is_element_and_set(tu4):
    """[-02] in set 3 is 07h."""
    client = Client(tu4)
    assert client.write(0x221F, 7, b"\x0a\0")[1].startswith("60")
    assert tu4.node.drives[0].parameters.raw(543, 2, 3) == 10


def test_6_6_3_an_abort_names_its_cause(tu4):
    """1800h:01 in Operational: 0601 0002h."""
    tu4.nmt(0x01)
    client = Client(tu4)
    request, answer = client.write(0x1800, 1, (0x4000_0201).to_bytes(4, "little"))
    assert request == "23 00 18 01 01 02 00 40"
    assert answer == "80 00 18 01 02 00 01 06"
    (error,) = client.results
    assert isinstance(error, SdoError)
    assert error.by_server


def test_6_7_2_save_and_load(bench):
    client = Client(bench)
    assert client.write(0x1010, 1, b"save")[0] == "23 10 10 01 73 61 76 65"
    assert client.write(0x1011, 1, b"load")[0] == "23 11 10 01 6C 6F 61 64"
    assert client.results == [b"", b""]


# §6.8


@pytest.mark.parametrize("name", NODES)
def test_6_8_a_drive_is_switched_on_and_off(name, bench_of):
    """The dialogue in frames that our codecs make from the mapping file."""
    slot = load_family(name).slot[0]
    rpdo, tpdo = slot.rpdo[0], slot.tpdo[0]
    out, back = PdoCodec(factory_entries(rpdo)), PdoCodec(factory_entries(tpdo))
    bench = bench_of(NODES[name]())
    bench.write(0x1800 + tpdo.number - 1, 1, 0x4000_0000 | tpdo.cob_id + 5, 4)
    bench.nmt(0x01)
    assert back.unpack(bench.of(tpdo.cob_id + 5)[-1][1])[:2] == (0, 0), "no mains yet"
    bench.run(0.3)
    told = [back.unpack(bench.of(tpdo.cob_id + 5)[-1][1])[:2]]
    for control, setpoint in ((0x047E, 0), (0x047F, 0x2000), (0x047E, 0x2000), (0x047F, 0x1000)):
        bench.put(rpdo.cob_id + 5, out.pack((control, setpoint, *[0] * (len(out.entries) - 2))))
        bench.run(3.0)
        told.append(back.unpack(bench.of(tpdo.cob_id + 5)[-1][1])[:2])
    assert [(word & 0xFF, value) for word, value in told] == [
        (0x40, 0x0000),
        (0x31, 0x0000),
        (0x37, 0x2000),
        (0x31, 0x0000),
        (0x37, 0x1000),
    ]
    assert bench.node.drives[0].output_hz == 12.5
    assert told[1][0] == 0x0B31, "§6.5.2"
