"""The simulated STÖBER 5000: NMT, PDO, SDO, supervision, events and axes (ID 441684.06)."""

from __future__ import annotations

import pytest

from bridge.canopen.frame import Frame
from bridge.sim.core.nmt_slave import SlaveState
from bridge.sim.stoeber.stoeber_5000 import Stoeber5000
from bridge.sim.stoeber.stoeber_axis import AxisState
from bridge.sim.stoeber.stoeber_settings import coordinate

ENABLE, ACKNOWLEDGE, QUICK_STOP = 1, 2, 4
WRONG_STATE = "08000022"


@pytest.fixture
def make_drive(bench_of):
    """Node 5, its self-test done; operational where asked."""

    def make(*, operational: bool = True, **options):
        drive = bench_of(Stoeber5000(5, **options))
        drive.run(0.3)
        if operational:
            drive.nmt(1)
        return drive

    return make


@pytest.fixture
def drive(make_drive):
    return make_drive()


def command(drive, control: int, setpoint: int = 0, channel: int = 1) -> list[Frame]:
    data = bytes([control]) + (setpoint & 0xFFFF).to_bytes(2, "little")
    return drive.put(0x105 + 0x100 * channel, data)


def start(drive, setpoint: int = 500, seconds: float = 1.0, channel: int = 1) -> None:
    command(drive, 0, 0, channel)
    command(drive, ENABLE, setpoint, channel)
    drive.run(seconds)


def emcys(drive) -> list[str]:
    return [data.hex(" ").upper() for _, data in drive.of(0x085)]


def states(drive) -> list[AxisState]:
    return [axis.state for axis in drive.node.axes]


# Coordinates


@pytest.mark.parametrize(
    ("name", "index"),
    [("A00", 0x2000), ("B00", 0x2200), ("C01", 0x2401), ("E08", 0x2808), ("A180", 0x20B4), ("Z00", 0x5200)],
)
def test_a_coordinate_is_an_index(name, index):
    """§11.2."""
    assert coordinate(name) == index


# States and motion


def test_a_start_goes_through_all_states_and_up_the_ramp(drive):
    command(drive, 0)
    assert states(drive) == [AxisState.READY]
    command(drive, ENABLE, 500)
    assert states(drive) == [AxisState.SWITCHED_ON]
    drive.run(0.03)
    assert states(drive) == [AxisState.ENABLED]
    drive.run(0.1)
    assert 0 < drive.node.axes[0].speed_rpm < 1500
    drive.run(1.0)
    assert drive.node.axes[0].speed_rpm == 1500, "50 % of C01"
    answer = command(drive, ENABLE, 500)[0].data
    assert answer.hex(" ") == "04 21 dc 05 1b 00", "E48, E200, 1500 1/min, 2.7 A"


def test_an_enable_that_was_there_before_starts_nothing(make_drive):
    drive = make_drive(operational=False)
    drive.write(0x20B4, 0, ENABLE, 1)
    drive.node.power_cycle()
    drive.run(0.0)
    drive.nmt(1)
    command(drive, ENABLE, 500)
    drive.run(1.0)
    assert states(drive) == [AxisState.INHIBITED]
    start(drive)
    assert states(drive) == [AxisState.ENABLED]


def test_without_the_enable_the_motor_runs_down(drive):
    start(drive)
    command(drive, 0, 500)
    assert states(drive) == [AxisState.READY]
    drive.run(0.1)
    assert 1000 < drive.node.axes[0].speed_rpm < 1500
    drive.run(1.0)
    assert drive.node.axes[0].speed_rpm == 0


def test_a_quick_stop_brakes_and_wants_a_new_enable(drive):
    start(drive)
    command(drive, ENABLE | QUICK_STOP, 500)
    assert states(drive) == [AxisState.QUICK_STOP]
    drive.run(0.15)
    assert states(drive) == [AxisState.INHIBITED]
    command(drive, ENABLE, 500)
    drive.run(0.5)
    assert states(drive) == [AxisState.INHIBITED]
    start(drive, -200)
    assert drive.node.axes[0].speed_rpm == -600


def test_the_setpoint_is_limited_to_c01(drive):
    start(drive, 1900)
    assert drive.node.axes[0].speed_rpm == 3000


# NMT: which telegrams work in which state, §7.1


def test_what_works_in_each_nmt_state(make_drive):
    drive = make_drive(operational=False)
    assert command(drive, ENABLE, 500) == []
    assert drive.sdo("4000100000000000")
    drive.nmt(1)
    assert [frame.can_id for frame in command(drive, 0)] == [0x185]
    assert drive.sdo("4000100000000000")
    drive.nmt(2)
    assert command(drive, 0) == []
    assert not drive.sdo("4000100000000000")
    assert drive.guard()[0].data == b"\x04"
    drive.node.fail(44)
    assert [frame.can_id for frame in drive.run(0.1)] == [0x085], "emergency messages in Stopped too"


def test_reset_communication_keeps_what_was_written_and_reset_node_does_not(make_drive):
    drive = make_drive()
    start(drive)
    drive.write(0x100C, 0, 250, 2)
    assert drive.nmt(0x82)[0] == Frame(0x705, b"\0")
    assert drive.read(0x100C, 0) == 250
    assert states(drive) == [AxisState.ENABLED], "the drive itself is not touched"
    assert drive.nmt(0x81)[0] == Frame(0x705, b"\0")
    assert drive.read(0x100C, 0) == 0
    assert states(drive) == [AxisState.SELF_TEST]


# PDO, §8.1


def test_an_rpdo_that_is_too_short_writes_what_it_covers_and_surplus_is_left_out(drive):
    command(drive, 0)
    drive.put(0x205, "01 F4")
    assert (drive.node.axes[0].control, drive.node.axes[0].setpoint) == (ENABLE, 0)
    drive.put(0x205, "00 F4 01 FF FF FF FF FF")
    assert (drive.node.axes[0].control, drive.node.axes[0].setpoint) == (0, 500)
    drive.put(0x205, "")
    assert (drive.node.axes[0].control, drive.node.axes[0].setpoint) == (0, 500)


def test_type_254_answers_every_rpdo_and_nothing_else(drive):
    assert len(command(drive, 0)) == 1
    assert len(command(drive, 0)) == 1
    command(drive, ENABLE, 500)
    before = len(drive.of(0x185))
    drive.run(1.0)
    assert len(drive.of(0x185)) == before, "a change sends nothing"


def test_the_answer_keeps_to_the_inhibit_time(drive):
    drive.write(0x1800, 3, 200, 2)  # 20 ms
    command(drive, 0)
    assert command(drive, 0) == []
    assert command(drive, 0) == []
    begin = drive.now
    drive.run(0.1)
    assert [round(time - begin, 6) for time, _ in drive.of(0x185)][1:] == [0.02]


def test_synchronous_pdos(drive):
    drive.write(0x1400, 2, 1, 1)
    drive.write(0x1800, 2, 2, 1)
    assert command(drive, 0x80) == []
    assert drive.node.axes[0].control == 0
    assert drive.sync() == []
    assert drive.node.axes[0].control == 0x80, "taken with the SYNC"
    assert [frame.can_id for frame in drive.sync()] == [0x185], "every second"


@pytest.mark.parametrize("kind", [241, 252, 253, 255])
def test_transmission_types_that_are_not_to_be_set(drive, kind):
    """§8.1.2."""
    assert drive.write(0x1800, 2, kind, 1) == "06090030"


def test_a_mapping_is_changed_in_pre_operational_and_keeps_to_eight_bytes(make_drive):
    drive = make_drive()
    assert drive.write(0x1A00, 5, 0x2852_0000, 4) == WRONG_STATE
    drive.nmt(0x80)
    assert drive.write(0x1A00, 5, 0x2852_0000, 4) == "60"
    assert drive.read(0x1A00, 5) == 0x2852_0008
    assert drive.read(coordinate("A241"), 0) == 7
    assert drive.write(0x1A00, 6, 0x2808_0000, 4) == "06040042", "nine bytes"
    assert drive.write(0x1A00, 6, 0x2401_0000, 4) == "06040041", "C01 maps into no PDO"
    assert drive.write(0x1A00, 6, 0x2808_0008, 4) == "06040041", "E08 has 16 bits"
    assert drive.write(0x1600, 3, 0x5FFF_0000, 4) == "06040041"
    assert drive.write(0x1600, 3, 0x0005_0008, 4) == "06040041", "no dummy entries"
    assert drive.write(0x1A00, 0, 2, 1) == "06010002", "sub-index 0 is read only"
    assert drive.write(0x1A00, 2, 0, 4) == "60", "0 is an empty place"
    drive.nmt(1)
    assert command(drive, 0)[0].data.hex(" ") == "02 00 00 00 00 1e"


def test_a_drive_without_an_application_maps_nothing(make_drive):
    drive = make_drive(mapped=False)
    assert command(drive, ENABLE, 500) == []
    assert drive.node.axes[0].control == 0
    assert drive.node.slave.rpdos_ignored == 1


# SDO, §8.2


def test_numbers_are_written_with_their_length_or_with_four_bytes(drive):
    assert drive.write(0x2401, 0, 2500, 4) == "60"
    assert drive.write(0x2401, 0, 2400, 2) == "60"
    assert drive.read(0x2401, 0) == 2400
    assert drive.write(0x26E6, 0, -500, 4) == "60"
    assert drive.node.axes[0].setpoint == -500


@pytest.mark.parametrize(
    ("index", "sub", "value", "size", "code"),
    [
        (0x2401, 0, 0x1_0000, 4, "06070012"),
        (0x2401, 0, 1, 1, "06070013"),
        (0x2401, 0, 0, 2, "06090030"),
        (0x2401, 1, 0, 2, "06090011"),
        (0x2FFF, 0, 0, 2, "06020000"),
        (0x2808, 0, 0, 2, "06010002"),
        (0x1006, 0, 32_000_001, 4, "06090030"),
        (0x1005, 0, 0x800, 4, "06090030"),
        (0x1010, 1, 1, 4, "08000020"),
        (0x1400, 1, 0x305, 4, WRONG_STATE),
    ],
)
def test_what_is_refused_and_why(drive, index, sub, value, size, code):
    assert drive.write(index, sub, value, size) == code


def test_there_is_no_block_transfer_and_no_time(drive):
    assert drive.sdo("A4001000147F0000").startswith("80 00 10 00 01 00 04 05")
    assert drive.sdo("4012100000000000").endswith("00 00 02 06")
    assert drive.sdo("4016100001000000").endswith("00 00 02 06"), "no heartbeat consumer"


def test_the_identity(drive):
    assert [drive.read(0x1018, sub) for sub in range(5)] == [4, 0xB9, 15, 1, 8_000_000]
    assert (drive.read(0x1000, 0), drive.read(0x100B, 0)) == (0x20192, 5)


def test_save_keeps_configuration_date_and_parameters(make_drive):
    drive = make_drive(operational=False)
    drive.write(0x1020, 1, 15_000, 4)
    drive.write(0x1020, 2, 3_600_000, 4)
    assert drive.write(coordinate("A00"), 0, 1, 1) == "60"  # the same as "save" to 1010h
    drive.write(0x2401, 0, 1234, 2)
    drive.node.power_cycle()
    drive.run(0.3)
    assert (drive.read(coordinate("A211"), 0), drive.read(0x1020, 2)) == (15_000, 3_600_000)
    assert drive.read(0x2401, 0) == 3000, "written after the save"


# Supervision, §9.4


def guarded(drive) -> None:
    drive.write(0x100C, 0, 100, 2)
    drive.write(0x100D, 0, 3, 1)
    for _ in range(12):
        drive.run(0.09)
        drive.guard()


def test_life_guarding_brings_event_52_cause_1_and_pre_operational(drive):
    start(drive)
    guarded(drive)
    assert states(drive) == [AxisState.ENABLED]
    drive.run(0.29)
    assert states(drive) == [AxisState.ENABLED]
    drive.run(0.02)
    assert states(drive) == [AxisState.FAULT_REACTION]
    assert drive.node.slave.state is SlaveState.PRE_OPERATIONAL
    assert emcys(drive) == ["00 81 10 34 01 00 00 00"]
    drive.run(0.5)
    assert (states(drive), drive.node.axes[0].speed_rpm) == ([AxisState.FAULT], 0)
    assert (drive.read(0x1001, 0), drive.read(0x1002, 0)) == (0x10, 5)
    assert [drive.read(coordinate(name), 0) for name in ("E82", "E43", "E48")] == [52, 1, 5]


@pytest.mark.parametrize(("guard_ms", "factor"), [(0, 3), (100, 0)])
def test_with_either_at_zero_nothing_is_watched(drive, guard_ms, factor):
    start(drive)
    drive.write(0x100C, 0, guard_ms, 2)
    drive.write(0x100D, 0, factor, 1)
    drive.guard()
    drive.run(10.0)
    assert states(drive) == [AxisState.ENABLED]


def test_guarding_answers_with_a_toggling_bit_7(drive):
    assert [drive.guard()[0].data[0] for _ in range(3)] == [0x05, 0x85, 0x05]


def test_with_a_heartbeat_alone_a_silent_master_stops_nothing(drive):
    """There is no 1016h: that is why the mapping asks for guarding."""
    drive.write(0x1017, 0, 100, 2)
    start(drive, seconds=10.0)
    assert states(drive) == [AxisState.ENABLED]
    assert len(drive.of(0x705)) > 50


def test_a_missing_sync_is_an_event_where_1006h_says_so(drive):
    drive.write(0x1006, 0, 50_000, 4)
    start(drive)
    for _ in range(5):
        drive.sync()
        drive.run(0.04)
    assert states(drive) == [AxisState.ENABLED]
    drive.run(0.02)
    assert emcys(drive) == ["00 81 10 34 02 00 00 00"]


# Events, §9.3


@pytest.mark.parametrize(
    ("event", "sent"),
    [(31, "10 21 02"), (36, "10 31 04"), (41, "10 43 08"), (52, "00 81 10"), (67, "00 62 01")],
)
def test_events_carry_code_and_register_of_the_table(drive, event, sent):
    drive.node.fail(event)
    drive.run(0.1)
    assert emcys(drive) == [f"{sent} {event:02X} 00 00 00 00"]


def test_the_acknowledge_is_an_edge_and_works_when_the_cause_has_gone(drive):
    start(drive)
    drive.node.fail(41, lasting=True)
    drive.run(1.0)
    for control in (ACKNOWLEDGE, 0, ACKNOWLEDGE):
        command(drive, control)
    assert states(drive) == [AxisState.FAULT]
    drive.node.cause_gone()
    command(drive, ACKNOWLEDGE)
    assert states(drive) == [AxisState.FAULT], "no edge"
    command(drive, 0)
    command(drive, ACKNOWLEDGE | ENABLE)
    assert states(drive) == [AxisState.INHIBITED], "and nothing starts by it"
    assert emcys(drive)[1:] == ["00 00 00 1E 00 00 00 00"]


def test_only_the_first_event_is_told(drive):
    drive.node.fail(41)
    drive.node.fail(31)
    drive.run(0.1)
    assert len(emcys(drive)) == 1


def test_an_event_with_the_voltage_gone_does_not_brake(drive):
    start(drive)
    drive.node.fail(31)
    drive.run(0.25)
    assert states(drive) == [AxisState.FAULT]
    assert drive.node.axes[0].speed_rpm > 0


def test_the_inhibit_time_1015h_is_in_100_us(drive):
    drive.write(0x1015, 0, 1000, 4)
    drive.node.fail(41)
    drive.run(0.05)
    command(drive, ACKNOWLEDGE)
    assert len(emcys(drive)) == 1
    drive.run(0.1)
    times = [time for time, _ in drive.of(0x085)]
    assert times[1] - times[0] == pytest.approx(0.1)


def test_a_drive_with_address_0_sends_no_emergency_message(bench_of):
    drive = bench_of(Stoeber5000(0))
    drive.run(0.3)
    drive.put(0x600, "2314100080000000")
    drive.node.fail(41)
    assert [frame.can_id for frame in drive.run(0.1)] == []
    assert drive.node.device.event == 41


def test_an_unknown_event_is_refused():
    with pytest.raises(ValueError, match="no event 43"):
        Stoeber5000(5).fail(43)


# Four axes, §8.1 and §8.2.1


@pytest.fixture
def four(make_drive):
    return make_drive(axes=4)


def test_each_axis_has_its_pdo_channel(four):
    for channel in (1, 2, 3, 4):
        assert [frame.can_id for frame in command(four, 0, 0, channel)] == [0x85 + 0x100 * channel]


def test_one_axis_at_a_time(four):
    start(four, 500, channel=2)
    assert states(four) == [AxisState.INHIBITED, AxisState.ENABLED, *[AxisState.INHIBITED] * 2]
    start(four, 300, channel=3)
    assert states(four)[2] is AxisState.INHIBITED
    assert four.read(coordinate("E08"), 0) == 1500
    assert four.read(coordinate("E200"), 0) == 0x29, "axis 2 is active"
    command(four, 0, 0, 2)
    command(four, 0, 0, 3)
    assert states(four)[2] is AxisState.INHIBITED, "axis 2 still turns"
    four.run(1.0)
    assert states(four)[2] is AxisState.READY
    start(four, 300, channel=3)
    assert states(four)[2] is AxisState.ENABLED
    assert four.node.axes[2].speed_rpm == 900


def test_a11_says_which_axis_an_sdo_channel_reaches(four):
    four.nmt(0x80)
    assert [four.read(coordinate("A11"), element) for element in range(5)] == [0, 0, 1, 2, 3]
    for sub, cob_id in ((1, 0x620), (2, 0x5A0)):
        assert four.write(0x1201, sub, cob_id, 4) == "60"
    four.nmt(2)
    four.nmt(0x80)
    assert four.sdo("23012400E8030000", 0x625, 0x5A5).startswith("60")
    assert [four.node.device.parameters(axis).c01_rpm for axis in range(4)] == [3000, 1000, 3000, 3000]
    assert four.read(0x2401, 0) == 3000
    assert four.write(coordinate("A11"), 1, 1, 1) == "60"
    assert four.read(0x2401, 0) == 1000, "SDO1 works on axis 2 now"
    assert four.write(coordinate("A11"), 1, 4, 1) == "06090030"


def test_an_event_is_the_whole_inverters(four):
    start(four, 500, channel=1)
    four.node.fail(45)
    four.run(1.0)
    assert states(four) == [AxisState.FAULT] * 4
    assert len(emcys(four)) == 1
    command(four, ACKNOWLEDGE, 0, 4)
    assert AxisState.FAULT not in states(four)


def test_more_axes_than_a_posiswitch_has():
    with pytest.raises(ValueError, match="axes = 5"):
        Stoeber5000(5, axes=5)
