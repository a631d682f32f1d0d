"""The simulated 8400 motec: states, ramps, supervision, codes (EDS84DMOTCAN 3.0)."""

from __future__ import annotations

import pytest

from bridge.canopen.frame import REMOTE
from bridge.sim.lenze.lenze_drive import DeviceState, Reaction
from bridge.sim.lenze.lenze_motec import LenzeMotec
from bridge.sim.lenze.lenze_settings import LenzeCodes

STOP, ENABLE, QUICK_STOP, INHIBIT, RESET = 0x0001, 0x0009, 0x000D, 0x0002, 0x0081
HALF = 0x2000
MASTER = 0x77F
C592, C593 = 0x5DAF, 0x5DAE


def words(*values: int) -> bytes:
    padded = (*values, 0, 0, 0, 0)[:4]
    return b"".join((value & 0xFFFF).to_bytes(2, "little") for value in padded)


@pytest.fixture
def make(bench_of):
    """A bench with an 8400 motec at node 5, Operational unless told otherwise."""

    def make(*, operational: bool = True, pdo_words=(4, 4), **codes):
        bench = bench_of(LenzeMotec(5, words=pdo_words, codes=LenzeCodes(5, **codes)))
        bench.run(0.3)
        if operational:
            bench.nmt(1)
        return bench

    return make


@pytest.fixture
def drive(make):
    return make()


def run_at_half(bench) -> None:
    """Started and up to speed, 50 ms between the telegrams."""
    bench.put(0x205, words(STOP))
    for _ in range(30):
        bench.put(0x205, words(ENABLE, HALF))
        bench.run(0.05)
    assert bench.node.drive.speed_rpm == 750.0


def state(bench) -> DeviceState:
    return bench.node.drive.state


def emcys(bench) -> list[str]:
    return [data.hex(" ").upper() for _, data in bench.of(0x085)]


# boot-up, identity


def test_it_boots_into_pre_operational_and_says_what_it_is(make):
    bench = make(operational=False)
    assert bench.of(0x705) == [(10.0, b"\0")]
    assert bench.read(0x1000, 0) == 0
    assert bench.read(0x1018, 1) == 0x3B
    assert bench.read(0x5E98, 0) == 1, "C00359: pre-operational"
    bench.nmt(1)
    assert bench.read(0x5E98, 0) == 0


def test_a_guard_request_is_not_answered(drive):
    assert drive.guard() == []


def test_both_pdos_are_sent_once_when_it_becomes_operational(make):
    bench = make(operational=False)
    assert {frame.can_id for frame in bench.nmt(1)} == {0x185, 0x285}


def test_a_tpdo_is_sent_on_a_remote_frame(drive):
    (answer,) = drive.put(0x185 | REMOTE)
    assert answer.can_id == 0x185
    assert len(answer.data) == 8
    drive.nmt(0x80)
    assert drive.put(0x185 | REMOTE) == []


# device control


def test_it_goes_through_its_states_and_follows_the_setpoint(drive):
    assert state(drive) is DeviceState.READY_TO_SWITCH_ON
    assert drive.answer() == (0x03C2, 0)
    drive.put(0x205, words(STOP))
    assert drive.answer() == (0x04C2, 0)
    drive.put(0x205, words(ENABLE, HALF))
    drive.run(0.5)
    assert 300 < drive.node.drive.speed_rpm < 450, "2 s from standstill to 1500 1/min"
    drive.run(1.0)
    assert drive.answer() == (0x0518, HALF)


def test_the_sign_of_the_setpoint_is_the_direction_and_c00011_the_limit(drive):
    drive.put(0x205, words(STOP))
    drive.put(0x205, words(ENABLE, -0x7000))
    drive.run(5.0)
    assert drive.node.drive.speed_rpm == -1500.0
    assert drive.answer()[1] == -0x4000 & 0xFFFF


def test_a_quick_stop_ramps_down_and_stays_enabled(drive):
    run_at_half(drive)
    drive.put(0x205, words(QUICK_STOP, HALF))
    drive.run(0.1)
    assert 0 < drive.node.drive.speed_rpm < 600
    drive.run(0.3)
    assert drive.node.drive.speed_rpm == 0.0
    assert state(drive) is DeviceState.OPERATION_ENABLED


@pytest.mark.parametrize("word", [INHIBIT, 0x0000, 0x000B, 0x0008])
def test_without_voltage_the_motor_coasts(drive, word):
    run_at_half(drive)
    drive.put(0x205, words(word, HALF))
    assert state(drive) is not DeviceState.OPERATION_ENABLED
    drive.run(0.1)
    assert 0 < drive.node.drive.speed_rpm < 750
    drive.run(2.0)
    assert drive.node.drive.speed_rpm == 0.0


@pytest.mark.parametrize("word", [0x000F, 0x0007, 0x0006])
def test_the_words_of_cia_402_do_not_move_it(drive, word):
    """In those bit 1 is 1 to lift a stop, in these it is the stop."""
    drive.put(0x205, words(STOP))
    drive.put(0x205, words(word, HALF))
    drive.run(1.0)
    assert drive.node.drive.speed_rpm == 0.0


# errors and emergencies


def test_a_fault_is_reported_and_acknowledged(drive):
    run_at_half(drive)
    drive.node.fail(0x007F_0002)
    drive.run(0.01)
    assert state(drive) is DeviceState.FAULT
    assert emcys(drive) == ["00 F0 01 00 02 00 7F 00"]
    assert drive.read(0x5F57, 0) == 0x007F_0002, "C00168"
    assert drive.read(0x1001, 0) == 0x01
    assert drive.read(0x1003, 0) == 1
    drive.run(2.0)
    drive.put(0x205, words(STOP))
    assert state(drive) is DeviceState.FAULT
    drive.put(0x205, words(RESET))
    assert state(drive) is DeviceState.SWITCHED_ON
    assert emcys(drive)[1:] == ["00 00 00 00 00 00 00 00"]
    assert drive.read(0x5F57, 0) == 0


def test_only_the_edge_of_the_reset_bit_acknowledges(drive):
    drive.put(0x205, words(RESET))
    drive.node.fail(7)
    drive.put(0x205, words(RESET))
    assert state(drive) is DeviceState.FAULT
    drive.put(0x205, words(STOP))
    drive.put(0x205, words(RESET))
    assert state(drive) is DeviceState.SWITCHED_ON


def test_a_lasting_cause_cannot_be_acknowledged(drive):
    drive.node.fail(7, lasting=True)
    drive.put(0x205, words(RESET))
    assert state(drive) is DeviceState.FAULT
    drive.node.mend(7)
    drive.put(0x205, words(STOP))
    assert state(drive) is DeviceState.FAULT
    drive.put(0x205, words(RESET))
    assert state(drive) is DeviceState.SWITCHED_ON


def test_a_trouble_ends_with_its_cause(drive):
    run_at_half(drive)
    drive.node.fail(7, Reaction.TROUBLE)
    drive.run(0.01)
    assert state(drive) is DeviceState.TROUBLE
    assert drive.answer()[0] & 0x2F80 == 0x2780
    drive.node.mend(7)
    drive.run(0.01)
    assert state(drive) is DeviceState.OPERATION_ENABLED


def test_a_locked_warning_stays_until_the_acknowledge_and_the_drive_runs_on(drive):
    run_at_half(drive)
    drive.node.fail(7, Reaction.WARNING_LOCKED)
    drive.run(0.1)
    assert drive.node.drive.speed_rpm == 750.0
    assert drive.answer()[0] & 0x1000
    drive.put(0x205, words(ENABLE | 0x80, HALF))
    assert not drive.answer()[0] & 0x1000


def test_1003h_remembers_ten_errors_and_forgets_them_on_command(drive):
    for number in range(1, 13):
        drive.node.fail(number)
        drive.run(0.01)
    assert drive.read(0x1003, 0) == 10
    assert drive.read(0x1003, 10) & 0xFFFF == 0xF000
    assert drive.write(0x1003, 0, 0, 1) == "60"
    assert drive.read(0x1003, 0) == 0


def test_one_of_several_errors_gone_leaves_the_register(drive):
    drive.node.fail(7, Reaction.TROUBLE)
    drive.node.supply(there=False)
    drive.run(0.01)
    assert emcys(drive) == ["00 31 01 00 00 00 00 00", "00 F0 01 00 07 00 00 00"]
    drive.node.mend(7)
    drive.run(0.01)
    drive.node.supply(there=True)
    drive.run(0.01)
    assert emcys(drive)[2:] == ["00 00 01 00 00 00 00 00", "00 00 00 00 00 00 00 00"]


# PDO length


def test_a_short_pdo_is_dropped_and_reported_once(make):
    bench = make()
    bench.put(0x205, words(STOP)[:6])
    bench.put(0x205, words(STOP)[:6])
    assert state(bench) is DeviceState.READY_TO_SWITCH_ON
    assert emcys(bench) == ["10 82 11 00 00 00 00 00"]
    bench.put(0x205, words(STOP))
    assert emcys(bench)[1:] == ["00 00 00 00 00 00 00 00"]
    assert state(bench) is DeviceState.SWITCHED_ON


def test_a_long_pdo_is_reported_and_its_first_bytes_count(make):
    bench = make(pdo_words=(3, 4))
    bench.put(0x205, words(STOP))
    assert emcys(bench) == ["20 82 11 00 00 00 00 00"]
    assert state(bench) is DeviceState.SWITCHED_ON


def test_the_reaction_to_a_faulty_telegram_can_be_set(make):
    bench = make(bus_reactions=[1, 0, 0, 0, 0])
    bench.put(0x205, words(STOP)[:2])
    assert state(bench) is DeviceState.FAULT


# supervision of the RPDOs


def test_at_factory_a_silent_master_lets_the_drive_run(drive):
    """§12.2: C00593/1 = 0, no reaction."""
    run_at_half(drive)
    drive.run(60.0)
    assert drive.node.drive.speed_rpm == 750.0
    assert emcys(drive) == []


@pytest.mark.parametrize(
    ("reaction", "expected"),
    [(1, DeviceState.FAULT), (2, DeviceState.TROUBLE), (4, DeviceState.OPERATION_ENABLED)],
)
def test_a_late_rpdo_has_the_reaction_of_c00593(make, reaction, expected):
    bench = make(rpdo_reactions=[reaction, 0], rpdo_time_ms=[200, 0])
    run_at_half(bench)
    bench.run(0.149)
    assert state(bench) is DeviceState.OPERATION_ENABLED
    assert emcys(bench) == []
    bench.run(0.002)
    assert state(bench) is expected
    (report,) = emcys(bench)
    assert report.startswith("00 F0 01 00 ")
    assert bool(bench.answer()[0] & 0x1000) is (reaction == 4)


def test_only_a_trouble_goes_when_the_rpdos_come_again(make):
    for reaction, expected in ((1, DeviceState.FAULT), (2, DeviceState.OPERATION_ENABLED)):
        bench = make(rpdo_reactions=[reaction, 0], rpdo_time_ms=[200, 0])
        run_at_half(bench)
        bench.run(0.3)
        bench.put(0x205, words(ENABLE, HALF))
        assert state(bench) is expected


def test_an_rpdo_that_never_comes_is_late_after_the_start(make):
    bench = make(rpdo_reactions=[0, 1])
    bench.run(2.9)
    assert state(bench) is DeviceState.READY_TO_SWITCH_ON
    bench.run(0.2)
    assert state(bench) is DeviceState.FAULT


def test_outside_operational_nothing_is_late(make):
    bench = make(operational=False, rpdo_reactions=[1, 1])
    bench.run(10.0)
    assert state(bench) is DeviceState.READY_TO_SWITCH_ON


@pytest.mark.parametrize("command", [0x80, 0x02, 0x82])
def test_what_left_operational_waits_for_no_rpdo(make, command):
    bench = make(rpdo_reactions=[1, 1])
    bench.nmt(command)
    bench.run(10.0)
    assert state(bench) is DeviceState.READY_TO_SWITCH_ON


# heartbeat


def test_the_heartbeat_time_is_rounded_down_to_5_ms(drive):
    assert drive.write(0x1017, 0, 104, 2) == "60"
    assert drive.read(0x5E82, 0) == 104, "C00381 is the same object"
    begin = drive.now
    drive.run(1.0)
    times = [time - begin for time, data in drive.of(0x705) if data == b"\x05"]
    assert times == pytest.approx([0.1 * n for n in range(1, 11)])


@pytest.fixture
def watcher(make):
    """Watches node 127 for 202 ms, which is 200, with a fault as the reaction; it runs."""
    bench = make(bus_reactions=[0, 0, 0, 0, 1])
    assert bench.write(0x1016, 1, 0x007F_00CA, 4) == "60"
    run_at_half(bench)
    bench.put(MASTER, b"\x05")
    return bench


def test_a_silent_master_leads_to_pre_operational_and_the_reaction(watcher):
    watcher.run(0.199)
    assert state(watcher) is DeviceState.OPERATION_ENABLED
    watcher.run(0.002)
    assert state(watcher) is DeviceState.FAULT
    assert watcher.read(0x5E98, 0) == 1
    assert watcher.read(0x5EA4, 1) == 250, "C00347/1: failed"
    assert emcys(watcher)[0] == "30 81 11 00 00 00 00 00"
    assert emcys(watcher)[1].startswith("00 F0 11 00 ")
    watcher.put(MASTER, b"\x05")
    assert emcys(watcher)[2:] == ["00 00 01 00 00 00 00 00"]
    assert watcher.read(0x5EA4, 1) == 5
    assert state(watcher) is DeviceState.FAULT, "a fault waits for the acknowledge"


def test_a_master_that_was_never_heard_is_not_missed(make):
    bench = make(bus_reactions=[0, 0, 0, 0, 1], watched_node=127, watched_ms=200)
    bench.run(5.0)
    assert state(bench) is DeviceState.READY_TO_SWITCH_ON
    assert bench.read(0x5EA4, 1) == 255, "no response"


def test_without_a_reaction_the_drive_runs_on_in_pre_operational(make):
    """The factory's setting: EMCY 8130h, and a motor that nobody can reach by process data."""
    bench = make(watched_node=127, watched_ms=200)
    bench.put(MASTER, b"\0")  # the boot-up message counts as the first heartbeat
    run_at_half(bench)
    assert emcys(bench) == ["30 81 11 00 00 00 00 00"]
    assert bench.read(0x5E98, 0) == 1
    assert bench.node.drive.speed_rpm > 0


def test_a_watched_node_beyond_127_is_refused(drive):
    assert drive.write(0x1016, 1, 0x0080_00C8, 4) == "06090030"


# the bus


def test_bus_errors_are_shown_and_can_stop_the_drive(make):
    bench = make(bus_reactions=[0, 1, 4, 0, 0])
    run_at_half(bench)
    bench.node.bus_error(2, 130, 12)
    bench.run(0.01)
    assert (bench.read(0x5EA6, 0), bench.read(0x5E8B, 1), bench.read(0x5E8B, 2)) == (2, 130, 12)
    assert emcys(bench)[0] == "00 81 11 00 00 00 00 00"
    assert bench.node.drive.status_word & 0x1000
    bench.node.bus_error(3)
    assert bench.run(0.5) == [], "bus-off: nothing is sent"
    assert state(bench) is DeviceState.FAULT
    bench.node.bus_error(0)
    bench.run(0.01)
    assert bench.read(0x5EA6, 0) == 0


def test_a_stop_of_its_communication_can_have_a_reaction(make):
    bench = make(bus_reactions=[0, 0, 0, 1, 0])
    run_at_half(bench)
    bench.nmt(2)
    assert state(bench) is DeviceState.FAULT


def test_telegrams_are_counted(drive):
    for _ in range(3):
        drive.put(0x205, words(STOP))
    drive.put(0x305, words())
    before = [drive.read(0x5E97, sub) for sub in (8, 9)]
    assert before == [3, 1]
    assert drive.read(0x5E97, 11) == 3, "this one is counted already"
    assert drive.read(0x5E97, 6) == 3, "its answer is not"
    assert drive.read(0x5E97, 2) == 3 + 1 + 5


def test_identifiers_that_collide_are_reported(drive):
    drive.write(0x1400, 1, 0xC000_0205, 4)
    drive.write(0x1400, 1, 0x4000_0185, 4)
    assert emcys(drive) == ["50 81 11 00 00 00 00 00"]
    drive.write(0x5E7A, 1, 1, 1)
    assert emcys(drive)[1:] == ["00 00 00 00 00 00 00 00"]


# codes and objects


def test_a_cob_id_changes_only_while_the_pdo_is_off(drive):
    assert drive.read(0x1400, 1) == 0x4000_0205
    assert drive.read(0x1800, 1) == 0x0000_0185
    assert drive.write(0x1400, 1, 0x4000_0225, 4) == "06090030"
    assert drive.write(0x1400, 1, 0xC000_0205, 4) == "60"
    assert drive.write(0x1400, 1, 0x4000_0225, 4) == "60"
    assert drive.read(0x5E9C, 1) == 0x225, "C00355/1"
    assert drive.write(0x1400, 1, 0xC000_0600, 4) == "06090030", "385 … 1407"
    drive.put(0x225, words(STOP))
    assert state(drive) is DeviceState.SWITCHED_ON


@pytest.mark.parametrize(("source", "expected"), [(0, 0x286), (1, 0x305), (2, 0x333)])
def test_the_source_of_a_cob_id_counts_after_a_reset(drive, source, expected):
    """§7.1.1, §12.2: with the Lenze base RPDO2 is at 281h, TPDO2 of the next node."""
    assert drive.write(0x5E9E, 2, source, 1) == "60"
    assert drive.write(0x5E9D, 3, 0x333, 4) == "60"
    assert drive.read(0x1401, 1) & 0x7FF == 0x305
    drive.write(0x5FFD, 26, 1, 1)  # C00002/26, CAN reset node
    drive.run(0.01)
    assert drive.of(0x705)[-1][1] == b"\0"
    assert drive.read(0x1401, 1) & 0x7FF == expected


def test_a_new_address_counts_after_a_reset(drive):
    drive.write(0x5EA1, 0, 9, 1)
    drive.nmt(0x81)
    assert drive.of(0x709) == [(drive.now, b"\0")]
    drive.put(0x609, bytes.fromhex("4000100000000000"))
    assert drive.of(0x589)
    assert drive.node.node_id == 9


def test_a_change_outlasts_a_reset_and_only_what_was_saved_the_mains(drive):
    """§7.1.2, §6.4: C00002/11."""
    drive.write(C593, 1, 1, 1)
    drive.nmt(0x81)
    assert drive.read(C593, 1) == 1
    drive.node.power_cycle()
    drive.run(0.3)
    assert drive.read(C593, 1) == 0
    drive.write(C593, 1, 1, 1)
    assert drive.write(0x5FFD, 11, 1, 1) == "60"
    drive.node.power_cycle()
    drive.run(0.3)
    assert drive.read(C593, 1) == 1


def test_a_reset_inhibits_the_drive(drive):
    run_at_half(drive)
    drive.nmt(0x82)
    assert state(drive) is DeviceState.READY_TO_SWITCH_ON


@pytest.mark.parametrize("kind", [241, 252, 253, 255])
def test_transmission_types_that_are_not_allowed_are_refused(drive, kind):
    assert drive.write(0x1800, 2, kind, 1) == "06090030"
    assert drive.write(0x5EBD, 1, kind, 1) == "06090030"


def test_a_synchronous_rpdo_waits_for_the_sync(drive):
    drive.write(0x5EBC, 1, 1, 1)  # C00323/1
    drive.put(0x205, words(STOP))
    assert state(drive) is DeviceState.READY_TO_SWITCH_ON
    drive.sync()
    assert state(drive) is DeviceState.SWITCHED_ON


def test_the_cycle_of_a_tpdo_is_c00356(drive):
    assert drive.write(0x5E9B, 5, 100, 2) == "60"
    assert drive.read(0x1800, 5) == 100
    first = len(drive.of(0x185))
    drive.run(1.0)
    assert len(drive.of(0x185)) - first == 10


def test_c00366_opens_both_sdo_channels(drive):
    assert drive.write(0x5E91, 0, 1, 1) == "60"
    assert drive.sdo("4000100000000000", 0x645, 0x5C5) == "43 00 10 00 00 00 00 00"
    assert drive.read(0x1201, 1) == 0x645
    drive.write(0x5E91, 0, 0, 1)
    assert not drive.sdo("4000100000000000", 0x645, 0x5C5)


def test_the_mapping_is_static(drive):
    assert drive.read(0x1600, 0) == 0
    assert drive.write(0x1600, 1, 0x5E66_0110, 4) == "06040041"
    assert drive.write(0x1600, 0, 0, 1) == "60"


@pytest.mark.parametrize("code", [C592, C593])
def test_a_reaction_that_is_not_in_the_list_is_refused(drive, code):
    assert drive.write(code, 1, 3, 1) == "06090030"


def test_emcy_can_be_moved_only_while_it_is_off(drive):
    assert drive.write(0x1014, 0, 0x0000_00A5, 4) == "06090030"
    assert drive.write(0x1014, 0, 0x8000_00A5, 4) == "60"
    drive.node.fail(7)
    drive.run(0.01)
    assert not drive.of(0x085)
    assert not drive.of(0x0A5)
    drive.write(0x1014, 0, 0x0000_00A5, 4)
    drive.node.fail(8)
    drive.run(0.01)
    assert len(drive.of(0x0A5)) == 1


# a drive as master


def test_a_quasi_master_starts_every_node_3_s_after_power_on(make):
    """§7.2.3."""
    bench = make(operational=False, master=1)
    bench.run(2.6)
    assert not bench.of(0x000)
    bench.run(0.2)
    assert bench.of(0x000) == [(pytest.approx(13.0), b"\x01\x00")]
    assert bench.read(0x5E98, 0) == 0


def test_a_drive_becomes_master_with_the_next_reset(drive):
    drive.write(0x5E9F, 0, 1, 1)
    drive.run(5.0)
    assert not drive.of(0x000)
    drive.nmt(0x82)
    drive.run(3.1)
    assert [data for _, data in drive.of(0x000)] == [b"\x01\x00"]


def test_a_sync_producer_keeps_its_period_and_acts_on_its_own_sync(drive):
    assert drive.write(0x1006, 0, 1500, 4) == "06090030", "steps of 1000 µs"
    drive.write(0x1006, 0, 10_000, 4)
    assert drive.read(0x5E8E, 0) == 10, "C00369"
    drive.run(0.1)
    assert not drive.of(0x080), "bit 30 is not set"
    assert drive.write(0x1005, 0, 0x4000_0080, 4) == "60"
    drive.write(0x1400, 2, 1, 1)
    drive.put(0x205, words(STOP))
    begin = drive.now
    drive.run(0.1)
    times = [time - begin for time, _ in drive.of(0x080)]
    assert times == pytest.approx([0.01 * n for n in range(1, 11)])
    assert state(drive) is DeviceState.SWITCHED_ON
