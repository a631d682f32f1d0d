"""The worked examples of EDS84DMOTCAN 3.0: the bridge's own SDO client against the simulated drive, and the
frames of the manual between them."""

from __future__ import annotations

import pytest

from bridge.canopen.frame import Frame
from bridge.canopen.sdo import SdoChannel, SdoError
from bridge.mapping import load_family
from bridge.sim.lenze.lenze_motec import LenzeMotec

LENZE = load_family("lenze/8400-motec")


class Wire:
    """One drive, one client, and everything between them as ``(identifier, bytes)``."""

    def __init__(self, node: int) -> None:
        self.drive = LenzeMotec(node)
        self.drive.start(0.0)
        self.drive.take_frames()
        self.client = SdoChannel(0x600 + node, 0x580 + node, 1.0)
        self.log: list[tuple[int, str]] = []

    def _run(self, results: list[bytes | SdoError]) -> bytes | SdoError:
        while not results:
            requests = self.client.take_frames()
            assert requests, "nobody has anything to say"
            for request in requests:
                self._note(request)
                self.drive.on_frame(request, 1.0)
            for reply in self.drive.take_frames():
                self._note(reply)
                if reply.can_id == self.client.reply_id:
                    self.client.on_frame(reply._replace(time=1.0))
        return results[0]

    def _note(self, frame: Frame) -> None:
        self.log.append((frame.can_id, frame.data.hex(" ").upper()))

    def read(self, index: int, sub: int) -> bytes | SdoError:
        results: list[bytes | SdoError] = []
        self.client.read(index, sub, 1.0, results.append)
        return self._run(results)

    def write(self, index: int, sub: int, data: bytes) -> bytes | SdoError:
        results: list[bytes | SdoError] = []
        self.client.write(index, sub, data, 1.0, results.append)
        return self._run(results)


def place(code: str) -> tuple[int, int]:
    """Index and sub-index of a code, by the mapping file."""
    ref = LENZE.object_of(LENZE.parameter_named(code))
    return ref.index, ref.sub


@pytest.mark.parametrize(
    ("code", "index", "sub"),
    [
        ("C00011", 0x5FF4, 0),
        ("C00061", 0x5FC2, 0),
        ("C00088", 0x5FA7, 0),
        ("C00099", 0x5F9C, 0),
        ("C00039/1", 0x5FD8, 1),
        ("C00357/2", 0x5E9A, 2),
        ("C00593/1", 0x5DAE, 1),
        ("C01503/1", 0x5A20, 1),
    ],
)
def test_the_index_is_24575_minus_the_code(code, index, sub):
    """§9.2.2, and the indices printed in §12."""
    assert place(code) == (index, sub)


def test_the_heat_sink_temperature_is_read_from_node_5():
    """§9.3.1."""
    wire = Wire(5)
    assert wire.read(*place("C00061")) == (43).to_bytes(4, "little")
    assert wire.log == [(0x605, "40 C2 5F 00 00 00 00 00"), (0x585, "43 C2 5F 00 2B 00 00 00")]


def test_the_rated_motor_current_is_written_to_node_2():
    """§9.3.2: 10.20 A with two decimal places."""
    wire = Wire(2)
    parameter = LENZE.parameter_named("C00088")
    raw = round(10.20 / parameter.factor)
    assert wire.write(*place("C00088"), raw.to_bytes(4, "little")) == b""
    assert wire.log == [(0x602, "23 A7 5F 00 FC 03 00 00"), (0x582, "60 A7 5F 00 00 00 00 00")]
    assert wire.drive.codes.motor_current_ca == 1020


def test_the_firmware_version_is_read_in_segments_from_node_12():
    """§9.3.3."""
    wire = Wire(12)
    assert wire.read(*place("C00099")) == b"01.00.00.00"
    assert wire.log == [
        (0x60C, "40 9C 5F 00 00 00 00 00"),
        (0x58C, "41 9C 5F 00 0B 00 00 00"),
        (0x60C, "60 00 00 00 00 00 00 00"),
        (0x58C, "00 30 31 2E 30 30 2E 30"),
        (0x60C, "70 00 00 00 00 00 00 00"),
        (0x58C, "17 30 2E 30 30 00 00 00"),
    ]


def test_a_percentage_has_two_decimal_places():
    """§9.2.3: C00039/1 = 123.45 % is 12345 = 3039h."""
    wire = Wire(5)
    raw = round(123.45 / LENZE.parameter_named("C00039/1").factor)
    wire.write(*place("C00039/1"), raw.to_bytes(4, "little"))
    assert wire.log[0] == (0x605, "23 D8 5F 01 39 30 00 00")
    assert wire.drive.codes.fixed_setpoints[0] == 12345


def test_an_object_that_cannot_be_mapped_is_refused_with_the_code_of_the_example():
    """§9.2.4: error 0604 0041h stands as 41 00 04 06 in bytes 5 … 8."""
    wire = Wire(5)
    answer = wire.write(0x1A00, 1, (0x5FF4_0010).to_bytes(4, "little"))
    assert isinstance(answer, SdoError)
    assert answer.code == 0x0604_0041
    assert wire.log[-1] == (0x585, "80 00 1A 01 41 00 04 06")


def test_the_second_channel_of_node_4_is_opened_over_the_first():
    """§13, I-1201, figures 13-9 and 13-10."""
    wire = Wire(4)
    wire.drive.on_frame(Frame(0x644, bytes.fromhex("40C25F0000000000")), 0.5)
    assert not wire.drive.take_frames(), "it is off at factory"
    assert wire.write(0x1201, 1, (0x644).to_bytes(4, "little")) == b""
    assert wire.write(0x1201, 2, (0x5C4).to_bytes(4, "little")) == b""
    assert [frame for frame in wire.log if frame[0] == 0x604] == [
        (0x604, "23 01 12 01 44 06 00 00"),
        (0x604, "23 01 12 02 C4 05 00 00"),
    ]
    wire.client = SdoChannel(0x644, 0x5C4, 1.0)
    assert wire.read(*place("C00061")) == (43).to_bytes(4, "little")
    assert wire.log[-2:] == [(0x644, "40 C2 5F 00 00 00 00 00"), (0x5C4, "43 C2 5F 00 2B 00 00 00")]


def test_an_inhibit_time_of_26_steps_is_two_milliseconds():
    """§13, I-1800, sub-index 3; it can be changed only while the PDO is off."""
    wire = Wire(5)
    refused = wire.write(0x1800, 3, (26).to_bytes(2, "little"))
    assert isinstance(refused, SdoError)
    wire.write(0x1800, 1, (0x8000_0185).to_bytes(4, "little"))
    assert wire.write(0x1800, 3, (26).to_bytes(2, "little")) == b""
    assert wire.read(0x1800, 3) == (20).to_bytes(2, "little")
    assert wire.read(0x5EBB, 2) == (2).to_bytes(2, "little"), "C00324/2 counts in ms"


@pytest.mark.parametrize("index", [0x1400, 0x1401, 0x1800, 0x1801])
def test_the_reserved_sub_index_4_is_refused_both_ways(index):
    """§13: reading or writing it leads to 0609 0011h."""
    wire = Wire(5)
    for answer in (wire.read(index, 4), wire.write(index, 4, b"\0")):
        assert isinstance(answer, SdoError)
        assert answer.code == 0x0609_0011


def test_a_string_can_be_read_by_blocks_too():
    """§4.2 lists SDO block upload; 11 bytes are two segments."""
    wire = Wire(5)
    request = bytes.fromhex("A49C5F000A000000")
    wire.drive.on_frame(Frame(0x605, request), 1.0)
    wire.drive.on_frame(Frame(0x605, b"\xa3" + bytes(7)), 1.0)
    answers = [frame.data.hex(" ").upper() for frame in wire.drive.take_frames()]
    assert answers == ["C6 9C 5F 00 0B 00 00 00", "01 30 31 2E 30 30 2E 30", "82 30 2E 30 30 00 00 00"]
