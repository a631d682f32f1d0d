"""SDO server: golden frames of BU 2500 §6.6, segmented transfer, abort codes §8.3.2."""

from __future__ import annotations

import pytest

from bridge.sim.core.dictionary import Cell, Dictionary, IntegerType, Number, VisibleString
from bridge.sim.core.sdo_server import SimulatedSdoServer


def ask(server: SimulatedSdoServer, request: str) -> str:
    return " / ".join(answer.hex(" ").upper() for answer in server.on_request(bytes.fromhex(request)))


def test_writing_p102_is_acknowledged_as_in_the_manual(bench):
    # §6.6.1: P102 set 1 of FU1 := 1.03 s
    assert bench.sdo("2B 66 20 01 67 00 00 00") == "60 66 20 01 00 00 00 00"
    # §6.6.2 (the request's index bytes are swapped in print)
    assert bench.sdo("40 66 20 01 00 00 00 00") == "4B 66 20 01 67 00 00 00"
    assert bench.node.drives[0].parameters.value(102) == pytest.approx(1.03)


def test_a_refused_cob_id_write_is_aborted_as_in_the_manual(live):
    # §6.6.3: 80h 00h 18h 01h 02h 00h 01h 06h; the node is operational
    assert live.sdo("23 00 18 01 85 01 00 40") == "80 00 18 01 02 00 01 06"


def test_the_device_name_comes_in_segments(bench):
    assert bench.sdo("40 08 10 00 00 00 00 00") == "41 08 10 00 0A 00 00 00"
    assert bench.sdo("60 00 00 00 00 00 00 00") == "00 53 4B 20 54 55 34 2D"  # "SK TU4-"
    assert bench.sdo("70 00 00 00 00 00 00 00") == "19 43 41 4F 00 00 00 00"  # "CAO", last segment
    assert bench.sdo("60 00 00 00 00 00 00 00")[:2] == "80", "the transfer is over"


@pytest.mark.landing(17)
@pytest.mark.parametrize(
    ("request_", "code", "why"),
    [
        ("40 FF 5F 00 00 00 00 00", "00 00 02 06", "object missing"),
        ("40 18 10 05 00 00 00 00", "11 00 09 06", "sub-index missing"),
        ("23 00 10 00 00 00 00 00", "02 00 01 06", "read only"),
        ("2F 17 10 00 0A 00 00 00", "13 00 07 06", "too short"),
        ("23 17 10 00 0A 00 00 00", "12 00 07 06", "too long"),
        ("2B 97 20 01 00 80 00 00", "30 00 09 06", "P151 beyond 32767"),
        ("2B 01 22 00 FE FF 00 00", "30 00 09 06", "P513 below -0.1"),
        ("40 97 20 00 00 00 00 00", "11 00 09 06", "the interface's parameters count from 1"),
        ("40 66 20 00 00 00 00 00", "11 00 09 06", "P102 depends on the parameter set"),
        ("40 01 22 01 00 00 00 00", "11 00 09 06", "P513 is neither array nor set"),
        ("A0 08 10 00 00 00 00 00", "01 00 04 05", "block upload"),
        ("C2 08 10 00 00 00 00 00", "01 00 04 05", "block download"),
        ("E0 08 10 00 00 00 00 00", "01 00 04 05", "command 7"),
        ("2B 02 18 01 00 00 00 00", "13 00 07 06", "a COB-ID has four bytes"),
        ("2F 02 18 02 FC 00 00 00", "30 00 09 06", "transmission type 252"),
        ("23 10 10 01 73 61 76 00", "20 00 00 08", "not the signature of save"),
        ("40 03 10 01 00 00 00 00", "11 00 09 06", "no error in the list"),
    ],
)
def test_a_wrong_request_gets_its_abort_code(bench, request_, code, why):
    answer = bench.sdo(request_)
    assert answer == f"80 {request_[3:11]} {code}", why


def test_an_unchanged_toggle_bit_ends_the_transfer(bench):
    bench.sdo("40 08 10 00 00 00 00 00")
    assert bench.sdo("70 00 00 00 00 00 00 00") == "80 08 10 00 00 00 03 05"


def test_an_abort_by_the_client_is_not_answered(bench):
    bench.sdo("40 08 10 00 00 00 00 00")
    assert bench.sdo("80 08 10 00 00 00 04 05") == ""
    assert bench.sdo("60 00 00 00 00 00 00 00") == "80 00 00 00 01 00 04 05"


def test_a_request_of_less_than_eight_bytes_is_not_heard(bench):
    assert bench.sdo("40 08 10 00") == ""


def test_a_segmented_download_writes_once_it_is_complete():
    cell = Cell()
    objects = Dictionary()
    objects.add(0x2000, 1, Number(IntegerType.UNSIGNED32, cell.get, cell.set))
    server = SimulatedSdoServer(objects)
    assert ask(server, "21 00 20 01 04 00 00 00") == "60 00 20 01 00 00 00 00"
    assert ask(server, "0A 11 22 00 00 00 00 00") == "20 00 00 00 00 00 00 00"
    assert cell.value == 0
    assert ask(server, "1B 33 44 00 00 00 00 00") == "30 00 00 00 00 00 00 00"
    assert cell.value == 0x44332211


@pytest.mark.parametrize(
    ("frames", "code"),
    [
        (["21 00 20 01 08 00 00 00"], "12 00 07 06"),
        (["20 00 20 01 00 00 00 00", "00 01 02 03 04 05 06 07"], "12 00 07 06"),
        (["21 00 20 01 04 00 00 00", "0B 11 22 00 00 00 00 00"], "10 00 07 06"),
        (["20 00 20 01 00 00 00 00", "1B 11 22 00 00 00 00 00"], "00 00 03 05"),
        (["20 00 20 01 00 00 00 00", "0B 11 22 00 00 00 00 00"], "13 00 07 06"),
    ],
)
def test_a_faulty_segmented_download_changes_nothing(frames, code):
    cell = Cell(7)
    objects = Dictionary()
    objects.add(0x2000, 1, Number(IntegerType.UNSIGNED32, cell.get, cell.set))
    server = SimulatedSdoServer(objects)
    assert [ask(server, frame) for frame in frames][-1] == f"80 00 20 01 {code}"
    assert cell.value == 7


def test_reading_a_write_only_object_is_refused():
    objects = Dictionary()
    objects.add(0x2000, 0, Number(IntegerType.UNSIGNED8, None, Cell().set))
    objects.add(0x2001, 0, VisibleString(""))
    server = SimulatedSdoServer(objects)
    assert ask(server, "40 00 20 00 00 00 00 00") == "80 00 20 00 01 00 01 06"
    assert ask(server, "40 01 20 00 00 00 00 00") == "41 01 20 00 00 00 00 00", "an empty string has a size"
    assert ask(server, "60 00 00 00 00 00 00 00") == "0F 00 00 00 00 00 00 00"


def test_the_further_channels_are_off_until_both_halves_are_switched_on(bench):
    # §6.4: SDO2 for FU2, 340h + N in, 2C0h + N out
    assert bench.sdo("40 66 20 01 00 00 00 00", 0x345, 0x2C5) == ""
    assert bench.read(0x1201, 1) == 0x8000_0345
    assert bench.read(0x1201, 2) == 0x8000_02C5
    assert bench.write(0x1201, 1, 0x345, 4) == "60"
    assert bench.sdo("40 66 20 01 00 00 00 00", 0x345, 0x2C5) == ""
    assert bench.write(0x1201, 2, 0x2C5, 4) == "60"
    assert bench.sdo("2B 66 20 01 67 00 00 00", 0x345, 0x2C5) == "60 66 20 01 00 00 00 00"
    assert [drive.parameters.raw(102) for drive in bench.node.drives] == [200, 103, 200, 200]
    assert bench.sdo("40 08 10 00 00 00 00 00", 0x345, 0x2C5) == "80 08 10 00 00 00 02 06"
    assert bench.write(0x1200, 1, 0x600, 4) == "06010002", "the first channel is fixed"


def test_array_and_parameter_set_share_the_sub_index(bench):
    # §6.6.1: sub = 4 · (element - 1) + set
    assert bench.write(0x221F, 0x0A, 9, 2) == "60"  # P543 [-03], set 2
    parameters = bench.node.drives[0].parameters
    assert [parameters.raw(543, 3, one) for one in (1, 2, 3, 4)] == [5, 9, 5, 5]
    assert [parameters.raw(543, 2, one) for one in (1, 2, 3, 4)] == [3, 3, 3, 3]


def test_a_write_goes_to_the_eeprom_unless_p560_says_ram(bench):
    drive = bench.node.drives[0]
    bench.write(0x2066, 1, 300, 2)
    assert drive.parameters.eeprom_writes == 1
    bench.write(0x2230, 0, 0, 2)
    writes = drive.parameters.eeprom_writes
    bench.write(0x2067, 1, 300, 2)
    assert drive.parameters.eeprom_writes == writes
    bench.node.power_cycle()
    bench.run(0.01)
    assert (drive.parameters.raw(102), drive.parameters.raw(103)) == (300, 200)


def test_a_drive_that_is_not_there_has_no_parameters(make_bench):
    bench = make_bench(fitted=(2, 3, 4))
    assert bench.sdo("40 66 20 01 00 00 00 00") == "80 66 20 01 00 00 06 06"
    assert bench.read(0x2097, 1) == 0, "the interface itself is there"
