"""The worked examples of ID 441684.06 (§7.3, §8, §9.3, §10), through the simulated drive and our codecs."""

from __future__ import annotations

import pytest

from bridge.canopen import emcy
from bridge.canopen.frame import Frame
from bridge.canopen.pdo import PdoEntry
from bridge.canopen.sdo import SdoChannel
from bridge.mapping import load_family
from bridge.sim.core.dictionary import Dictionary, Domain
from bridge.sim.core.sdo_server import SimulatedSdoServer
from bridge.sim.stoeber.stoeber_5000 import Stoeber5000

SIXTEEN = bytes(range(1, 17))


@pytest.fixture
def make_drive(bench_of):
    """A drive with the address of the examples, 1, in Pre-Operational."""
    return lambda **options: bench_of(Stoeber5000(1, **options))


def ask(drive, request: str, channel: int = 0x601, answer: int = 0x581) -> str:
    frames = [frame for frame in drive.put(channel, request) if frame.can_id == answer]
    assert len(frames) <= 1
    return frames[0].data.hex(" ").upper() if frames else ""


def client(request: int = 0x601) -> SdoChannel:
    return SdoChannel(request, request - 0x80, 0.5)


def sent(channel: SdoChannel) -> list[str]:
    return [frame.data.hex(" ").upper() for frame in channel.take_frames()]


# §7.3 dynamic distribution


def test_7_3_2_a_second_sdo_channel_opens_after_stop_and_pre_operational(make_drive):
    drive = make_drive(bit_31_opens_sdo=True)
    channel = client()
    channel.write(0x1201, 1, bytes.fromhex("41060080"), 0.0, lambda result: None)
    assert sent(channel) == ["23 01 12 01 41 06 00 80"]
    assert ask(drive, "2301120141060080") == "60 01 12 01 00 00 00 00"
    assert ask(drive, "23011202C1050080") == "60 01 12 02 00 00 00 00"
    assert not ask(drive, "4000100000000000", 0x641, 0x5C1), "not before the change of state"
    drive.nmt(0x02, 1)
    drive.nmt(0x80, 1)
    assert ask(drive, "4000100000000000", 0x641, 0x5C1) == "43 00 10 00 92 01 02 00"


@pytest.mark.parametrize("commands", [(0x82,), (0x02, 0x80)], ids=["reset communication", "stop"])
def test_7_3_2_by_ds_301_it_is_opened_with_bit_31_cleared(make_drive, commands):
    drive = make_drive()
    ask(drive, "2301120141060000")
    ask(drive, "23011202C1050000")
    for command in commands:
        drive.nmt(command, 1)
    assert ask(drive, "4000100000000000", 0x641, 0x5C1) == "43 00 10 00 92 01 02 00"


def test_7_3_2_a_saved_channel_is_open_after_power_on(make_drive):
    drive = make_drive()
    ask(drive, "2301120120060000")  # 620h, the bare function code: the drive adds its address
    ask(drive, "23011202A0050000")
    assert ask(drive, "2310100173617665") == "60 10 10 01 00 00 00 00"
    drive.node.power_cycle()
    drive.run(0.1)
    assert ask(drive, "4001120100000000") == "43 01 12 01 21 06 00 00"
    assert ask(drive, "4000100000000000", 0x621, 0x5A1).startswith("43")


def test_7_3_3_pdos_get_a_higher_priority(make_drive):
    drive = make_drive()
    for number, cob_id in ((0, 0xF0), (1, 0xF1), (2, 0xF2)):
        assert ask(drive, f"23{number:02X}1801{cob_id:02X}000000").startswith("60")
    drive.nmt(0x01, 1)
    assert [frame.can_id for frame in drive.put(0x201, "000000")] == [0xF0]


def test_7_3_4_a_node_can_leave_the_sync_to_others(make_drive):
    drive = make_drive()
    for index in ("0014", "0018"):
        assert ask(drive, f"2F{index}0201000000").startswith("60")
    drive.nmt(0x01, 1)
    assert [frame.can_id for frame in drive.put(0x080)] == [0x181]
    drive.nmt(0x80, 1)
    assert ask(drive, "23051000FF070000").startswith("60")
    drive.nmt(0x01, 1)
    assert drive.put(0x080) == []


# §8.1 PDO


def test_8_1_1_a_mapping_entry_on_the_wire(make_drive):
    """E08: 10 00 08 28. The length may be 0 when it is written; reading gives it."""
    assert PdoEntry(0x2808, 0, 16).to_object().to_bytes(4, "little").hex(" ") == "10 00 08 28"
    drive = make_drive(mapped=False)
    assert ask(drive, "23001A0100000828") == "60 00 1A 01 00 00 00 00"
    assert ask(drive, "40001A0100000000") == "43 00 1A 01 10 00 08 28"
    assert ask(drive, "40F1200000000000").startswith("4F F1 20 00 02"), "A241: two bytes"


def test_8_1_3_a_pdo_by_itself_every_100_ms(make_drive):
    """With the sub-index of the event timer put right: 05, not 03."""
    drive = make_drive()
    for request in ("2300180180010000", "23001802FE000000", "2300180564000000"):
        assert ask(drive, request).startswith("60"), request
    assert ask(drive, "4000180100000000") == "43 00 18 01 81 01 00 00", "180h and the address"
    drive.put(0, "0100")
    drive.run(1.0)
    times = [time for time, _ in drive.of(0x181)]
    assert len(times) == 11
    assert times[10] - times[0] == pytest.approx(1.0)


# §8.2 SDO


def test_8_2_2_c01_is_set_to_2500(make_drive):
    results = []
    channel = client()
    channel.write(0x2401, 0, (2500).to_bytes(4, "little"), 0.0, results.append)
    assert sent(channel) == ["23 01 24 00 C4 09 00 00"]
    drive = make_drive()
    answer = ask(drive, "23012400C4090000")
    assert answer == "60 01 24 00 00 00 00 00"
    channel.on_frame(Frame(0x581, bytes.fromhex(answer)))
    assert results == [b""]
    assert drive.node.device.parameters().c01_rpm == 2500
    assert ask(drive, "4001240000000000") == "4B 01 24 00 C4 09 00 00"


def test_8_2_2_the_answers_as_misprinted_are_understood_too():
    """63h to a write, 42h to a read: four bytes."""
    results = []
    channel = client()
    channel.write(0x2401, 0, (2500).to_bytes(4, "little"), 0.0, results.append)
    channel.on_frame(Frame(0x581, bytes.fromhex("6301240000000000")))
    channel.read(0x2401, 0, 0.0, results.append)
    channel.on_frame(Frame(0x581, bytes.fromhex("42012400C4090000")))
    assert results == [b"", (2500).to_bytes(4, "little")]


DOWNLOAD = [
    ("21 01 40 00 10 00 00 00", "60 01 40 00 00 00 00 00"),
    ("00 01 02 03 04 05 06 07", "20 00 00 00 00 00 00 00"),
    ("10 08 09 0A 0B 0C 0D 0E", "30 00 00 00 00 00 00 00"),
    ("0B 0F 10 00 00 00 00 00", "20 00 00 00 00 00 00 00"),
]
UPLOAD = [
    ("40 01 40 00 00 00 00 00", "41 01 40 00 10 00 00 00"),
    ("60 00 00 00 00 00 00 00", "00 01 02 03 04 05 06 07"),
    ("70 00 00 00 00 00 00 00", "10 08 09 0A 0B 0C 0D 0E"),
    ("60 00 00 00 00 00 00 00", "0B 0F 10 00 00 00 00 00"),
]


@pytest.mark.parametrize(
    ("dialogue", "kept"), [(DOWNLOAD, b""), (UPLOAD, SIXTEEN)], ids=["example 1", "example 2"]
)
def test_8_2_3_sixteen_bytes_by_segments(dialogue, kept):
    """Client and server of the program, each against the other's frames of the manual."""
    memory = [kept]
    dictionary = Dictionary()
    dictionary.add(0x4001, 0, Domain(16, lambda: memory[0], lambda data: memory.__setitem__(0, data)))
    server = SimulatedSdoServer(dictionary)
    channel = client()
    results = []
    if dialogue is DOWNLOAD:
        channel.write(0x4001, 0, SIXTEEN, 0.0, results.append)
    else:
        channel.read(0x4001, 0, 0.0, results.append)
    for request, answer in dialogue:
        assert sent(channel) == [request]
        assert [data.hex(" ").upper() for data in server.on_request(bytes.fromhex(request))] == [answer]
        channel.on_frame(Frame(0x581, bytes.fromhex(answer)))
    assert results == [b"" if dialogue is DOWNLOAD else SIXTEEN]
    assert memory == [SIXTEEN]


def test_8_2_3_a_name_comes_by_segments(make_drive):
    drive = make_drive(name="MDS 5015A/L  OK!")
    results = []
    channel = client()
    channel.read(0x1008, 0, 0.0, results.append)
    for _ in range(4):
        for request in sent(channel):
            channel.on_frame(Frame(0x581, bytes.fromhex(ask(drive, request))))
    assert results == [b"MDS 5015A/L  OK!"]


# §9.3 emergency messages


def test_9_3_the_event_comes_before_the_code():
    """The example sends event 41 with code 1000h and register 1; the table has 4310h and 8."""
    family = load_family("stoeber/5000")
    assert family.emcy.event is not None
    for text, name in (("00 10 01 29", "temperature of the motor, sensor"), ("00 00 00 1E", "no event")):
        data = bytes.fromhex(text).ljust(8, b"\0")
        emergency = emcy.decode(data)
        assert emergency is not None
        event = data[family.emcy.event.byte]
        assert family.emcy.events[str(event)] == name
        assert (event == family.emcy.event.gone) is (emergency.code == 0)


def test_9_3_an_event_is_told_once_when_it_comes_and_once_when_it_goes(make_drive):
    drive = make_drive()
    drive.run(0.3)
    drive.put(0, "0101")
    drive.node.fail(41, 3)
    drive.run(1.0)
    assert [data.hex(" ").upper() for _, data in drive.of(0x81)] == ["10 43 08 29 03 00 00 00"]
    drive.put(0x201, "020000")
    drive.run(1.0)
    assert [data.hex(" ").upper() for _, data in drive.of(0x81)][1:] == ["00 00 00 1E 00 00 00 00"]


# §10 first steps


def test_10_boot_up_start_command_and_answer(make_drive):
    drive = make_drive()
    assert [frame for _, frame in drive.sent] == [Frame(0x701, b"\0")]
    drive.run(0.3)
    assert drive.put(0, "0100") == []
    answers = drive.put(0x201, "00 00 00")
    assert [(frame.can_id, frame.data.hex(" ")) for frame in answers] == [(0x181, "02 00 00 00 00 00")]
