"""The frames that the drives' manuals print, through our codecs: what they say, we send and understand.

NORD: BU 2500 de-4319. Lenze: EDS84DMOTCAN 3.0. STÖBER: CAN 5000, ID 441684.06.
"""

from __future__ import annotations

import struct

import pytest

from bridge.canopen import emcy
from bridge.canopen.emcy import Emergency
from bridge.canopen.frame import Frame
from bridge.canopen.pdo import PdoEntry
from tests.support.sdo_client import Client

Exchange = tuple[str, str]
"""Request of the client in the manual, and answer of the drive."""


def play(client: Client, *exchanges: Exchange) -> None:
    """Every frame is sent, with COB-ID and data, before its answer comes."""
    for request, answer in exchanges:
        assert client.channel.take_frames() == [Frame(client.channel.request_id, bytes.fromhex(request))]
        client.answer(answer)


# NORD


def test_nord_writes_p102() -> None:
    """§6.6.1: 1.03 s in parameter set 1. The answer is printed by its first byte only."""
    client = Client()
    client.write(0x2066, 1, struct.pack("<H", 103))
    play(client, ("2B 66 20 01 67 00 00 00", "60 66 20 01 00 00 00 00"))
    assert client.result == b""


def test_nord_reads_p102() -> None:
    """§6.6.2, with index and sub-index in the order they have on the wire: its table swaps the bytes of the
    index, that of §6.6.1 does not."""
    client = Client()
    client.read(0x2066, 1)
    play(client, ("40 66 20 01 00 00 00 00", "4B 66 20 01 67 00 00 00"))
    assert client.result == struct.pack("<H", 103)


# Lenze: index = 5FFFh − code


def code(number: int) -> int:
    """§9.2: the object of a code."""
    return 0x5FFF - number


def test_lenze_reads_c00061() -> None:
    """§9.3.1: the heat sink of node 5 has 43 °C."""
    client = Client(node_id=5)
    client.read(code(61))
    assert (client.channel.request_id, client.channel.reply_id) == (0x605, 0x585)
    play(client, ("40 C2 5F 00 00 00 00 00", "43 C2 5F 00 2B 00 00 00"))
    assert client.result == struct.pack("<i", 43)


def test_lenze_writes_c00088() -> None:
    """§9.3.2: rated motor current of node 2, 10.20 A at a scaling factor of 100."""
    client = Client(node_id=2)
    client.write(code(88), 0, struct.pack("<I", 1020))
    assert (client.channel.request_id, client.channel.reply_id) == (0x602, 0x582)
    play(client, ("23 A7 5F 00 FC 03 00 00", "60 A7 5F 00 00 00 00 00"))
    assert client.result == b""


def test_lenze_reads_c00099_in_segments() -> None:
    """§9.3.3: the firmware version of node 12 as eleven characters."""
    client = Client(node_id=12)
    client.read(code(99))
    assert (client.channel.request_id, client.channel.reply_id) == (0x60C, 0x58C)
    play(
        client,
        ("40 9C 5F 00 00 00 00 00", "41 9C 5F 00 0B 00 00 00"),
        ("60 00 00 00 00 00 00 00", "00 30 31 2E 30 30 2E 30"),
        ("70 00 00 00 00 00 00 00", "17 30 2E 30 30 00 00 00"),
    )
    assert client.result == b"01.00.00.00"


def test_lenze_opens_sdo2() -> None:
    """§13, I-1201: SDO2 of node 4, 640h and 5C0h + node id with bit 31 clear."""
    client = Client(node_id=4)
    client.write(0x1201, 1, struct.pack("<I", 0x640 + 4))
    play(client, ("23 01 12 01 44 06 00 00", "60 01 12 01 00 00 00 00"))
    client.write(0x1201, 2, struct.pack("<I", 0x5C0 + 4))
    play(client, ("23 01 12 02 C4 05 00 00", "60 01 12 02 00 00 00 00"))
    assert client.results == [b"", b""]


@pytest.mark.parametrize(
    ("data", "told"),
    [
        ("00 F0 01 00 78 56 34 12", Emergency(0xF000, 0x01, bytes.fromhex("00 78 56 34 12"))),
        ("30 81 11 00 00 00 00 00", Emergency(0x8130, 0x11, bytes(5))),
        ("10 82 11 00 00 00 00 00", Emergency(0x8210, 0x11, bytes(5))),
        ("00 00 00 00 00 00 00 00", Emergency(0x0000, 0x00, bytes(5))),
    ],
)
def test_lenze_emergency_messages(data: str, told: Emergency) -> None:
    """§10.4: code, register, a reserved 0, then Lenze's own error number, low word first. (The example
    prints no number; the one here shows the order of the bytes.)"""
    assert emcy.decode(bytes.fromhex(data)) == told


# STÖBER


@pytest.mark.parametrize("answer", ["60", "63"])
def test_stoeber_writes_c01(answer: str) -> None:
    """§8.2.2, the example at its end: n-max = 2500. Its tables print 63 as the answer, where CiA 301 and
    §8.2.3 have 60: bits 4…0 say nothing."""
    client = Client()
    client.write(0x2401, 0, struct.pack("<I", 2500))
    play(client, ("23 01 24 00 C4 09 00 00", f"{answer} 01 24 00 00 00 00 00"))
    assert client.result == b""


@pytest.mark.parametrize("answer", ["42", "43"])
def test_stoeber_reads_c01(answer: str) -> None:
    """§8.2.2: its table prints 42, expedited without a length, which is four bytes."""
    client = Client()
    client.read(0x2401)
    play(client, ("40 01 24 00 00 00 00 00", f"{answer} 01 24 00 C4 09 00 00"))
    assert client.result == struct.pack("<I", 2500)


SIXTEEN = bytes(range(1, 17))


def test_stoeber_writes_sixteen_bytes_in_segments() -> None:
    """§8.2.3, example 1. The manual leaves the object open ("idx x")."""
    client = Client()
    client.write(0x1008, 0, SIXTEEN)
    play(
        client,
        ("21 08 10 00 10 00 00 00", "60 08 10 00 00 00 00 00"),
        ("00 01 02 03 04 05 06 07", "20 00 00 00 00 00 00 00"),
        ("10 08 09 0A 0B 0C 0D 0E", "30 00 00 00 00 00 00 00"),
        ("0B 0F 10 00 00 00 00 00", "20 00 00 00 00 00 00 00"),
    )
    assert client.result == b""


def test_stoeber_reads_sixteen_bytes_in_segments() -> None:
    """§8.2.3, example 2."""
    client = Client()
    client.read(0x1008)
    play(
        client,
        ("40 08 10 00 00 00 00 00", "41 08 10 00 10 00 00 00"),
        ("60 00 00 00 00 00 00 00", "00 01 02 03 04 05 06 07"),
        ("70 00 00 00 00 00 00 00", "10 08 09 0A 0B 0C 0D 0E"),
        ("60 00 00 00 00 00 00 00", "0B 0F 10 00 00 00 00 00"),
    )
    assert client.result == SIXTEEN


def test_stoeber_maps_e08() -> None:
    """§8.1.1: E08 (2808h:00, 16 bits) as the first object of RPDO1: length, sub-index, index."""
    entry = PdoEntry(0x2808, 0, 16)
    client = Client()
    client.write(0x1600, 1, struct.pack("<I", entry.to_object()))
    play(client, ("23 00 16 01 10 00 08 28", "60 00 16 01 00 00 00 00"))
    assert PdoEntry.from_object(struct.unpack("<I", bytes.fromhex("10 00 08 28"))[0]) == entry


@pytest.mark.parametrize(
    ("data", "code", "register", "event"),
    [("00 10 01 29 00 00 00 00", 0x1000, 1, 41), ("00 00 00 1E 00 00 00 00", 0, 0, 30)],
)
def test_stoeber_emergency_messages(data: str, code: int, register: int, event: int) -> None:
    """§9.3, table 9-2: motor temperature, and that the fault has gone; byte 3 is the event (E82)."""
    told = emcy.decode(bytes.fromhex(data))
    assert told is not None
    assert (told.code, told.register, told.vendor[0]) == (code, register, event)
