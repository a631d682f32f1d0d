"""One SK 5xxE to a node: SK TU3-CAO and RJ45 (BU 2500 §6.5.7, §7.2, §8.1, §8.4)."""

from __future__ import annotations

import pytest

from bridge.canopen.frame import Frame
from bridge.sim.nord.nord_single import NordSingle
from bridge.sim.nord.nord_single_settings import RJ45_5XX, RJ45_54X, TU3
from bridge.sim.nord.nord_states import NordState

P509, P513, P543, P544, P700, P701, P746 = 0x21FD, 0x2201, 0x221F, 0x2220, 0x22BC, 0x22BD, 0x22EA
READY, RUN, ACKNOWLEDGE = "7E04", "7F04", "8004"


@pytest.fixture
def make(bench_of):
    def make(variant=TU3, **options):
        bench = bench_of(NordSingle(5, variant, **options))
        bench.run(0.3)
        bench.nmt(1)
        return bench

    return make


def turning(bench, cob_id: int = 0x205, words: str = "") -> None:
    """Half speed by this RPDO."""
    bench.put(cob_id, READY + "0000" + words)
    bench.put(cob_id, RUN + "0020" + words)
    bench.run(2.5)
    assert bench.node.drive.output_hz == 25.0


def watched(make, variant=TU3):
    bench = make(variant, p513_s=0.5)
    cob_id, words = (0x305, "00000000") if variant is TU3 else (0x205, "00000000")
    bench.put(cob_id, READY + "0000" + words)
    for _ in range(30):
        bench.put(cob_id, RUN + "0020" + words)
        bench.run(0.1)
    assert bench.node.drive.state is NordState.ENABLED
    return bench


VARIANTS = pytest.mark.parametrize("variant", [TU3, RJ45_5XX, RJ45_54X], ids=lambda one: one.device_name)


# Views


def test_at_factory_all_rpdos_of_a_tu3_are_on_and_one_tpdo(make):
    bench = make()
    on = [bench.read(0x1400 + number, 1) for number in range(4)]
    assert on == [0x4000_0205, 0x4000_0305, 0x4000_0405, 0x4000_0505]
    on = [bench.read(0x1800 + number, 1) for number in range(4)]
    assert on == [0x4000_0185, 0xC000_0285, 0xC000_0385, 0xC000_0485]
    assert [bench.read(0x1A00 + number, 0) for number in range(4)] == [2, 4, 4, 1]
    bench.run(1.0)
    assert {frame.can_id for _, frame in bench.sent if 0x180 <= frame.can_id < 0x580} == {0x185}


def test_6_5_7_the_second_tpdo_is_switched_on_and_the_first_off(make):
    bench = make()
    bench.nmt(0x80)
    assert bench.sdo("23001801850100C0") == "60 00 18 01 00 00 00 00"
    assert bench.sdo("2301180185020040") == "60 01 18 01 00 00 00 00", "40000285h: one zero less than printed"
    frames = bench.nmt(0x01)
    assert [(frame.can_id, len(frame.data)) for frame in frames] == [(0x285, 8)]


@pytest.mark.parametrize(
    ("cob_id", "words", "evaluated"),
    [
        (0x205, "0111", (0x1101, 0, 0)),
        (0x305, "011102220333", (0x1101, 0x2202, 0x3303)),
        (0x405, "011102220333", (0x1101, 0x2202, 0x3303)),
        (0x505, "", (0, 0, 0)),
    ],
)
def test_the_rpdo_that_is_sent_says_how_many_setpoints_are_evaluated(make, cob_id, words, evaluated):
    bench = make()
    bench.put(0x305, READY + "999999999999")
    bench.put(cob_id, READY + words)
    assert bench.node.drive.setpoints[:3] == evaluated
    assert bench.node.drive.state is NordState.READY


@pytest.mark.parametrize("variant", [RJ45_5XX, RJ45_54X])
def test_by_rj45_there_is_one_pdo_with_three_values(make, variant):
    bench = make(variant)
    turning(bench, 0x205, "11112222")
    assert bench.node.drive.setpoints[:3] == (0x2000, 0x1111, 0x2222)
    assert bench.of(0x185)[-1][1][:4].hex() == "370b0020"


def test_54xe_has_values_4_and_5_in_its_second_pdos(make):
    bench = make(RJ45_54X)
    bench.put(0x305, "44445555")
    bench.put(0x205, READY + "111122223333")
    assert bench.node.drive.setpoints == (0x1111, 0x2222, 0x3333, 0x4444, 0x5555)
    bench.put(0x305, "66667777")
    assert bench.node.drive.setpoints[3:] == (0x6666, 0x7777), "at once, with the control word there is"
    assert len(bench.of(0x285)[-1][1]) == 4


@pytest.mark.parametrize(("variant", "cob_id"), [(RJ45_5XX, 0x305), (RJ45_54X, 0x405)])
def test_an_encoder_tells_the_drive_its_position(make, variant, cob_id):
    bench = make(variant)
    for number, meaning in ((543, 10), (544, 15)) if variant is RJ45_5XX else ((543, 10),):
        bench.node.drive.parameters.commission(number, meaning)
    bench.put(cob_id, "76BC2A00")
    bench.run(0.3)
    assert bench.of(0x185)[-1][1][2:4].hex() == "76bc"
    if variant is RJ45_5XX:
        assert bench.of(0x185)[-1][1][4:6].hex() == "2a00"


def test_the_shaft_turns_and_its_position_counts(make):
    bench = make()
    turning(bench)
    before = bench.node.drive.position_increments
    bench.run(2.0)
    assert bench.node.drive.position_increments - before == pytest.approx(25_000), "12.5 rev/s, four poles"


def test_a_position_runs_over_its_32_bits(make):
    bench = make()
    bench.node.drive.position_increments = 0x7FFF_FFF0
    turning(bench)
    assert -0x8000_0000 <= bench.node.drive.position_increments < 0


def test_meanings_of_values_are_single_parameters(make):
    """§6.5.4: P543, P544, P545 of an SK 500E … 535E."""
    bench = make()
    assert (bench.read(P543, 1), bench.read(P544, 1)) == (1, 3)
    assert bench.sdo("401F220500000000").endswith("11 00 09 06"), "P543 has no second element"
    assert bench.read(P509, 0) == 6
    assert bench.sdo("4097200100000000") == "80 97 20 01 00 00 02 06", "P151: it has no parameters of its own"


# P513, the only watch


@VARIANTS
def test_p513_trips_the_drive_when_the_telegrams_stop(make, variant):
    bench = watched(make, variant)
    bench.run(0.39)
    assert bench.node.drive.state is NordState.ENABLED
    bench.run(0.02)
    assert (bench.node.drive.fault_tenths, bench.node.drive.output_hz) == (102, 0.0)
    bench.run(0.1)
    assert bench.of(0x085)[-1][1].hex() == "0081110000000000"
    assert (bench.read(P700, 1), bench.read(P701, 1)) == (102, 102)
    assert bench.read(0x1002, 0) & 0x20


@VARIANTS
def test_the_acknowledge_works_when_telegrams_come_again(make, variant):
    bench = watched(make, variant)
    bench.run(1.0)
    cob_id = 0x305 if variant is TU3 else 0x205
    bench.put(cob_id, ACKNOWLEDGE + "000000000000")
    assert bench.node.drive.state is NordState.SWITCH_ON_INHIBITED
    assert bench.of(0x085)[-1][1].hex() == "0000000000000000"


@pytest.mark.parametrize("raw", [0, -1])
def test_p513_off_or_ignoring_lets_the_drive_run_on(make, raw):
    bench = watched(make)
    assert bench.write(P513, 0, raw, 2) == "60"
    bench.run(60.0)
    assert bench.node.drive.output_hz == 25.0


def test_p513_takes_its_range_only(make):
    bench = make()
    assert bench.write(P513, 0, -2, 2) == "06090030"
    assert bench.write(P513, 0, 1001, 2) == "06090030"


@pytest.mark.parametrize(
    "frame",
    [
        Frame(0x305, bytes.fromhex("7F00002000000000")),  # "control data valid" is 0
        Frame(0x305, bytes.fromhex("7F0400")),
        Frame(0x080, b""),
        Frame(0x605, bytes.fromhex("4008100000000000")),
        Frame(0x605, bytes.fromhex("2B0030007F040000")),  # control word by SDO
    ],
    ids=["invalid", "three bytes", "sync", "sdo", "control word by sdo"],
)
def test_other_traffic_does_not_restart_p513(make, frame):
    bench = watched(make)
    for _ in range(6):
        bench.run(0.1)
        bench.put(frame.can_id, frame.data)
    assert bench.node.drive.fault_tenths == 102


def test_setpoints_without_a_control_word_do_not_restart_p513(make):
    bench = watched(make, RJ45_54X)
    for _ in range(6):
        bench.run(0.1)
        bench.put(0x305, "00000000")
    assert bench.node.drive.fault_tenths == 102


def test_any_view_restarts_p513(make):
    bench = watched(make)
    for cob_id, words in ((0x205, "0020"), (0x405, "002000000000"), (0x505, ""), (0x205, "0020")):
        bench.run(0.35)
        bench.put(cob_id, RUN + words)
    assert bench.node.drive.fault_tenths == 0


@pytest.mark.parametrize("command", [0x80, 0x02, 0x82], ids=["pre-op", "stop", "reset communication"])
def test_leaving_operational_lets_p513_run_out(make, command):
    bench = watched(make)
    bench.nmt(command)
    bench.run(0.6)
    assert bench.node.drive.fault_tenths == 102


def test_life_guarding_trips_with_10_2(make):
    bench = make()
    bench.write(0x100C, 0, 100, 2)
    bench.write(0x100D, 0, 3, 1)
    turning(bench)
    bench.guard()
    bench.run(0.31)
    assert bench.node.drive.fault_tenths == 102
    assert bench.node.slave.state == 127


# Link and power


def test_a_broken_link_is_10_8_whatever_p120_would_say(make):
    """§8.1, note 4: this watch cannot be set."""
    bench = make()
    turning(bench)
    bench.node.drop_drive()
    bench.run(0.3)
    assert (bench.node.drive.fault_tenths, bench.node.drive.output_hz) == (108, 0.0)
    assert bench.of(0x185)[-1][1].hex() == "00000000"
    assert bench.sdo("4066200100000000") == "80 66 20 01 00 00 06 06"
    bench.put(0x205, ACKNOWLEDGE + "0000")
    assert bench.node.drive.state is NordState.FAULT
    bench.node.restore_drive()
    bench.run(0.1)
    assert bench.of(0x085)[-1][1].hex() == "0050010000000000"
    assert bench.read(P746, 0) == 0x0C03
    bench.put(0x205, "0004" + "0000")
    bench.put(0x205, ACKNOWLEDGE + "0000")
    assert bench.node.drive.state is NordState.SWITCH_ON_INHIBITED


def test_by_rj45_there_is_no_link_to_lose(make):
    with pytest.raises(ValueError, match="no interface"):
        make(RJ45_5XX).node.drop_drive()
    assert make(RJ45_5XX).sdo("40EA220000000000") == "80 EA 22 00 00 00 02 06", "P746 is the SK TU3-CAO's"


@pytest.mark.parametrize(("variant", "fault"), [(TU3, 108), (RJ45_5XX, 102)])
def test_a_reset_of_the_node_stops_a_running_drive(make, variant, fault):
    bench = watched(make, variant)
    bench.nmt(0x81)
    assert bench.node.drive.fault_tenths == fault


def test_communication_settings_survive_only_when_saved(make):
    bench = make()
    bench.nmt(0x80)
    bench.write(0x1801, 1, 0x4000_0285, 4)
    bench.node.power_cycle()
    bench.run(0.1)
    assert bench.read(0x1801, 1) == 0xC000_0285
    bench.write(0x1801, 1, 0x4000_0285, 4)
    assert bench.write(0x1010, 1, int.from_bytes(b"save", "little"), 4) == "60"
    bench.node.power_cycle()
    bench.run(0.1)
    assert bench.read(0x1801, 1) == 0x4000_0285
    assert bench.node.drive.state is NordState.NOT_READY


@pytest.mark.parametrize(
    ("fault", "code", "register"), [(30, 0x2310, 0x03), (21, 0x4310, 0x09), (999, 0x1000, 0x01)]
)
@VARIANTS
def test_a_fault_of_the_drive_is_told(make, variant, fault, code, register):
    bench = make(variant)
    bench.node.fail_drive(fault)
    bench.run(0.1)
    assert bench.of(0x085)[-1][1] == code.to_bytes(2, "little") + bytes([register, 0, 0, 0, 0, 0])
    assert bench.read(P700, 1) == fault
