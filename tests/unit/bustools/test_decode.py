"""Texts of the monitor for frames: those of the three manuals, and others."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridge.bustools.decode import Decoder, FrameKind, FrameMeaning
from bridge.bustools.statistics import Statistics
from bridge.canopen.frame import REMOTE, Frame
from bridge.config import NodeTable
from bridge.mapping import load_family

CONVEYOR = NodeTable.model_validate(
    {
        "name": "conveyor",
        "id": 5,
        "mapping": "nord/sk-tu4-cao",
        "drive": [{"slot": "fu1", "parameters": {"P105": 50.0}}, {"slot": "fu2"}],
    }
)


def site() -> Decoder:
    return Decoder([CONVEYOR], {"nord/sk-tu4-cao": load_family("nord/sk-tu4-cao")})


def heard(decoder: Decoder, *frames: tuple[int, str]) -> FrameMeaning:
    """The meaning of the last of these frames."""
    return [decoder.decode(Frame(can_id, bytes.fromhex(data))) for can_id, data in frames][-1]


@pytest.mark.parametrize(
    ("frames", "text"),
    [
        # Lenze EDS84DMOTCAN §9.3.1: C00061 of node 5 is 43 °C
        ([(0x605, "40C25F0000000000")], "read 5FC2h:00"),
        ([(0x605, "40C25F0000000000"), (0x585, "43C25F002B000000")], "5FC2h:00 = 43 (0000002Bh)"),
        # Lenze EDS84DMOTCAN §9.3.2: C00088 of node 2 := 10.20 A
        ([(0x602, "23A75F00FC030000")], "write 5FA7h:00 := 1020 (000003FCh)"),
        ([(0x602, "23A75F00FC030000"), (0x582, "60A75F0000000000")], "5FA7h:00 written"),
        # BU 2500 §6.6.2: P102 in parameter set 1 := 1.03 s, and read back
        ([(0x605, "2B66200167000000")], "write 2066h:01 := 103 (0067h)"),
        ([(0x605, "4066200100000000"), (0x585, "4B66200167000000")], "2066h:01 = 103 (0067h)"),
        # STÖBER CAN 5000 §8.2.2: C01 := 2500
        ([(0x601, "23012400C4090000")], "write 2401h:00 := 2500 (000009C4h)"),
        # BU 2500 §8.3.2, CiA 301: aborts in words
        (
            [(0x585, "8018100500000206")],
            "1018h:05: the node aborts: object does not exist in the object dictionary (06020000h)",
        ),
    ],
)
def test_the_manuals_sdo_frames(frames: list[tuple[int, str]], text: str) -> None:
    meaning = heard(Decoder(), *frames)
    assert (meaning.kind, meaning.text) == (FrameKind.SDO, text)


def test_a_string_in_segments() -> None:
    """Lenze EDS84DMOTCAN §9.3.3: C00099 of node 12 is 01.00.00.00."""
    meaning = heard(
        Decoder(),
        (0x60C, "409C5F0000000000"),
        (0x58C, "419C5F000B000000"),
        (0x60C, "6000000000000000"),
        (0x58C, "0030312E30302E30"),
        (0x60C, "7000000000000000"),
        (0x58C, "17302E3030000000"),
    )
    assert meaning.text == '5F9Ch:00 = "01.00.00.00"'
    assert dict(meaning.values)["data"] == b"01.00.00.00".hex()


def test_block_segments_are_not_taken_for_commands() -> None:
    decoder = Decoder()
    frames = [(0x605, "C600200010000000"), (0x585, "A400200002000000"), (0x605, "0140414243444546")]
    assert heard(decoder, *frames).text == "2000h:00: block segment 1"
    assert heard(decoder, (0x605, "8240414243444546")).text == "2000h:00: block segment 2, the last"
    heard(decoder, (0x585, "A202020000000000"))
    assert heard(decoder, (0x605, "C100000000000000")).text == "block write 2000h:00: end"
    assert heard(decoder, (0x605, "4000100000000000")).text == "read 1000h:00"


@pytest.mark.parametrize(
    ("can_id", "data", "kind", "label", "text"),
    [
        (0x000, "0105", FrameKind.NMT, "NMT", "start: conveyor"),
        (0x000, "8200", FrameKind.NMT, "NMT", "reset communication: all nodes"),
        (0x000, "0707", FrameKind.NMT, "NMT", "unknown command 07h: node 7"),
        (0x080, "", FrameKind.SYNC, "SYNC", ""),
        (0x080, "03", FrameKind.SYNC, "SYNC", "counter 3"),
        (0x100, "E80300000100", FrameKind.TIME, "TIME", "1984-01-02 00:00:01.000"),
        (0x705, "00", FrameKind.HEARTBEAT, "boot-up conveyor", "has started"),
        (0x705, "05", FrameKind.HEARTBEAT, "heartbeat conveyor", "operational"),
        (0x705, "FF", FrameKind.HEARTBEAT, "heartbeat conveyor", "pre operational, toggle bit 1"),
        (0x705 | REMOTE, "00", FrameKind.HEARTBEAT, "guarding conveyor", "asked for its NMT state"),
        (0x7E5, "0401000000000000", FrameKind.LSS, "LSS master", "switch state global: configuration"),
        (0x6F0, "01", FrameKind.OTHER, "unknown", "01"),
        (0x001, "", FrameKind.OTHER, "global fail-safe command", "(the bridge has no part in it)"),
        (0x071, "00", FrameKind.OTHER, "flying master", "00 (the bridge has no part in it)"),
        (0x076, "00", FrameKind.OTHER, "flying master", "00 (the bridge has no part in it)"),
        (0x077, "00", FrameKind.OTHER, "unknown", "00"),
        (0x101, "01", FrameKind.OTHER, "SRDO", "01 (the bridge has no part in it)"),
        (0x180, "01", FrameKind.OTHER, "SRDO", "01 (the bridge has no part in it)"),
        (0x6E0, "01", FrameKind.OTHER, "SDO manager", "01 (the bridge has no part in it)"),
    ],
)
def test_everything_has_a_name(can_id: int, data: str, kind: FrameKind, label: str, text: str) -> None:
    meaning = heard(site(), (can_id, data))
    assert (meaning.kind, meaning.label, meaning.text) == (kind, label, text)


def test_an_emergency_in_the_words_of_its_family() -> None:
    """BU 2500 §8.3: byte 3 is the drive, 0…3."""
    text = heard(site(), (0x085, "1023090100000000")).text
    assert text.startswith("2310h 3.0 overcurrent of the inverter (fu2), register 09h")


def test_an_emergency_of_a_stranger_in_those_of_cia_301() -> None:
    text = heard(Decoder(), (0x087, "3081110000000000")).text
    assert text.startswith("8130h life guard error or heartbeat error, register 11h")
    assert heard(Decoder(), (0x087, "1023010000000000")).text.startswith("2310h current, device output side")
    assert "no emergency" in heard(Decoder(), (0x087, "30")).text


@given(st.lists(st.tuples(st.integers(0, 0xFFFF_FFFF), st.binary(max_size=8)), max_size=40))
def test_no_frame_is_too_odd(frames: list[tuple[int, bytes]]) -> None:
    decoder = site()
    for can_id, data in frames:
        assert decoder.decode(Frame(can_id, data)).label


@given(st.lists(st.tuples(st.sampled_from([0x605, 0x585]), st.binary(min_size=8, max_size=8)), max_size=60))
def test_no_sdo_conversation_is_too_odd(frames: list[tuple[int, bytes]]) -> None:
    decoder = Decoder()
    for can_id, data in frames:
        assert decoder.decode(Frame(can_id, data)).kind is FrameKind.SDO


def test_statistics_by_identifier() -> None:
    tally = Statistics(250_000)
    for n in range(11):
        tally.on_frame(Frame(0x185, bytes(8), n * 0.01), "TPDO1")
    [count] = tally.counts()
    assert (count.frames, count.mean_s) == (11, pytest.approx(0.01))
    assert tally.load_percent(count, 0.1) == pytest.approx(100 * count.bits / 25_000)
    assert 111 <= count.bits / 11 <= 135
