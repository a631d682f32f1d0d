"""NMT, heartbeat, guarding, SYNC and PDO of the slave (CiA 301; BU 2500 §6.2, §6.5.5 to §6.5.8, §8.1.1)."""

from __future__ import annotations

import pytest

from bridge.canopen.frame import EXTENDED, REMOTE, Frame

START, STOP, PRE_OP, RESET_NODE, RESET_COMMUNICATION = 0x01, 0x02, 0x80, 0x81, 0x82


def times(pairs, since: float) -> list[int]:
    return [round((time - since) * 1000) for time, _ in pairs]


# NMT


def test_power_on_says_hello_once(bench):
    bench.run(1.0)
    assert [frame for _, frame in bench.sent] == [Frame(0x705, b"\0")]


@pytest.mark.parametrize("node", [5, 0])
@pytest.mark.parametrize(
    ("command", "state"), [(START, 0x05), (STOP, 0x04), (PRE_OP, 0x7F)], ids=["start", "stop", "pre-op"]
)
def test_nmt_commands_work_addressed_and_for_all(bench, command, state, node):
    bench.nmt(START if command == PRE_OP else PRE_OP)
    bench.nmt(command, node)
    assert bench.guard()[-1].data[0] & 0x7F == state


@pytest.mark.landing(5)
@pytest.mark.parametrize("data", ["0106", "01", "010500", "0505", ""])
def test_other_nmt_frames_change_nothing(bench, data):
    bench.put(0, data)
    assert bench.guard()[-1].data == b"\x7f"


@pytest.mark.parametrize("command", [RESET_NODE, RESET_COMMUNICATION])
def test_a_reset_ends_in_pre_operational_with_a_boot_up_message(live, command):
    assert live.nmt(command)[0] == Frame(0x705, b"\0")
    assert live.guard()[-1].data == b"\x7f"


def test_a_stopped_node_answers_neither_sdo_nor_pdo(live):
    live.nmt(STOP)
    assert live.sdo("40 08 10 00 00 00 00 00") == ""
    assert live.command(0x047E) == []
    assert [frame for frame in live.run(2.0) if frame.can_id != 0x705] == []
    live.nmt(PRE_OP)
    assert live.sdo("40 08 10 00 00 00 00 00") != ""


def test_unsaved_communication_settings_are_gone_after_a_reset(bench):
    bench.write(0x1017, 0, 100, 2)
    bench.nmt(RESET_COMMUNICATION)
    assert bench.read(0x1017, 0) == 0


# Error control


def test_the_heartbeat_keeps_its_period_and_says_the_state(bench):
    bench.write(0x1017, 0, 100, 2)
    since = bench.now
    bench.run(0.35)
    bench.nmt(START)
    bench.run(0.2)
    beats = bench.of(0x705)[1:]
    assert times(beats, since) == [100, 200, 300, 400, 500]
    assert [data[0] for _, data in beats] == [0x7F, 0x7F, 0x7F, 5, 5]
    bench.write(0x1017, 0, 0, 2)
    assert [frame for frame in bench.run(1.0) if frame.can_id == 0x705] == []


def test_a_late_caller_gets_one_heartbeat_not_all_the_missed_ones(bench):
    bench.write(0x1017, 0, 100, 2)
    bench.now += 10.0
    bench.node.on_time(bench.now)
    assert len(bench.node.take_frames()) == 1


def test_guard_answers_toggle_and_begin_with_0(bench):
    answers = [bench.guard()[0].data[0] for _ in range(3)]
    assert answers == [0x7F, 0xFF, 0x7F]
    bench.nmt(RESET_COMMUNICATION)
    assert bench.guard()[0].data[0] == 0x7F


def test_with_a_heartbeat_guard_requests_are_not_answered(bench):
    bench.write(0x1017, 0, 1000, 2)
    assert bench.guard() == []


@pytest.mark.landing
def test_life_guarding_begins_with_the_first_request_and_leads_to_pre_operational(live):
    live.write(0x100C, 0, 100, 2)
    live.write(0x100D, 0, 3, 1)
    live.run(1.0)
    assert live.guard()[-1].data[0] & 0x7F == 5
    live.run(0.29)
    assert live.read(0x20AD, 1) & 7 == 2
    live.run(0.02)
    assert live.read(0x20AD, 1) & 7 == 5, "P173: pre-operational and guarding time-out"
    assert live.read(0x20AA, 1) == 5120
    assert {drive.fault_tenths for drive in live.node.drives} == {102}
    live.guard()
    assert live.read(0x20AD, 1) & 7 == 1
    assert (live.read(0x20AA, 1), live.read(0x20AA, 2)) == (0, 5120)


def test_a_life_time_factor_of_0_is_no_life_guarding(live):
    live.write(0x100C, 0, 100, 2)
    live.guard()
    live.run(5.0)
    assert live.read(0x20AD, 1) & 7 == 2


# TPDO transmission


def set_type(bench, value: int) -> None:
    assert bench.write(0x1800, 2, value, 1) == "60"


def tpdos(frames) -> list[Frame]:
    return [frame for frame in frames if frame.can_id == 0x185]


def test_becoming_operational_sends_every_active_tpdo(make_bench):
    bench = make_bench()
    assert [frame.can_id for frame in bench.nmt(START)] == [0x185, 0x285, 0x385, 0x485]


def test_without_a_change_the_event_timer_sends(live):
    since = live.now
    live.run(1.0)
    assert times(live.of(0x185), since) == [0, 250, 500, 750, 1000]
    live.write(0x1800, 5, 0, 2)
    assert tpdos(live.run(2.0)) == []


def test_a_change_is_sent_at_once_but_not_sooner_than_the_inhibit_time(live):
    live.run(0.1)
    since = live.now
    live.node.drives[0].digital_inputs = 1
    live.run(0)
    for inputs in range(2, 30):
        live.run(0.001)
        live.node.drives[0].digital_inputs = inputs
    live.run(0.02)
    sent = [(time, data) for time, data in live.of(0x185) if time >= since]
    assert times(sent, since) == [0, 10, 20, 30]
    assert sent[-1][1][6] == 29, "the newest value is sent, late as it may be"


def test_type_0_sends_at_the_sync_after_a_change(live):
    set_type(live, 0)
    live.sync()
    assert tpdos(live.sync()) == []
    live.node.drives[0].digital_inputs = 7
    assert tpdos(live.run(0.5)) == []
    assert len(tpdos(live.sync())) == 1
    assert tpdos(live.sync()) == []


@pytest.mark.parametrize("every", [1, 2, 3, 240])
def test_types_1_to_240_send_at_every_nth_sync(live, every):
    set_type(live, every)
    counts = [len(tpdos(live.sync())) for _ in range(3 * every)]
    assert counts == ([0] * (every - 1) + [1]) * 3
    assert tpdos(live.run(1.0)) == []


@pytest.mark.landing(4)
@pytest.mark.parametrize("value", [241, 251, 252, 253])
def test_reserved_transmission_types_are_refused(bench, value):
    assert bench.write(0x1800, 2, value, 1) == "06090030"


def test_sync_counts_only_in_operational_and_only_while_on(live):
    set_type(live, 1)
    assert len(tpdos(live.put(0x80, "01"))) == 1
    live.write(0x20A0, 1, 0, 2)
    assert tpdos(live.sync()) == []
    live.write(0x20A0, 1, 3, 2)
    live.nmt(PRE_OP)
    assert tpdos(live.sync()) == []


def test_a_tpdo_is_not_sent_on_request(live):
    assert live.put(0x185 | REMOTE) == []


# RPDO reception


@pytest.mark.parametrize("value", [0, 1, 240])
def test_synchronous_rpdos_wait_for_the_next_sync(live, value):
    live.write(0x1400, 2, value, 1)
    live.command(0x047E)
    live.run(0.1)
    assert live.answer()[0] & 0xFF == 0x40
    live.sync()
    live.run(0.1)
    assert live.answer()[0] & 0xFF == 0x31


def test_an_rpdo_latched_before_pre_operational_is_dropped(live):
    live.write(0x1400, 2, 1, 1)
    live.command(0x047E)
    live.nmt(PRE_OP)
    live.nmt(START)
    live.sync()
    live.run(0.1)
    assert live.answer()[0] & 0xFF == 0x40


def test_pdos_are_dead_outside_operational(bench):
    bench.run(0.3)
    bench.command(0x047E)
    assert bench.run(1.0) == []
    assert bench.read(0x3000, 1) == 0


def test_extended_frames_concern_nobody(live):
    live.run(0.1)
    assert live.put(0x205 | EXTENDED, "7E04000000000000") == []
    assert live.read(0x3000, 1) == 0


# Changing PDOs


def test_a_cob_id_changes_only_in_pre_operational(live):
    assert live.write(0x1800, 1, 0x4000_0201, 4) == "06010002"
    assert live.write(0x20A1, 10, 0x201, 2) == "06010002", "P161 [-10]"
    assert live.write(0x20A0, 6, 0, 2) == "06010002", "P160 [-06]"
    live.nmt(PRE_OP)
    assert live.write(0x1800, 1, 0x4000_0191, 4) == "60"
    assert [frame.can_id for frame in live.nmt(START)] == [0x191, 0x285, 0x385, 0x485]


def test_bit_31_switches_a_pdo_off_and_bit_30_reads_1(bench):
    assert bench.read(0x1800, 1) == 0x4000_0185
    assert bench.write(0x1800, 1, 0xC000_0185, 4) == "60"
    assert bench.read(0x1800, 1) == 0xC000_0185
    assert bench.read(0x1804, 1) == 0xC000_01C5, "PDO5 is off at the factory"
    assert [frame.can_id for frame in bench.nmt(START)] == [0x285, 0x385, 0x485]


@pytest.mark.landing(5)
@pytest.mark.parametrize("value", [0x2000_0185, 0x0000_0800, 0x4000_0000, 0x4000_0605, 0x4000_0705])
def test_forbidden_cob_ids_are_refused(bench, value):
    assert bench.write(0x1800, 1, value, 4) == "06090030"
    assert bench.read(0x1800, 1) == 0x4000_0185


def test_the_remapping_dialogue_of_the_manual(bench):
    # §6.5.8 for node 5, with the misprinted command bytes put right
    for request in (
        "2F 00 1A 00 00 00 00 00",
        "23 00 1A 01 10 01 00 30",
        "23 00 1A 02 10 03 02 30",
        "2F 00 1A 00 02 00 00 00",
        "23 00 18 01 00 00 00 80",
        "2B 00 18 03 00 00 00 00",
        "2F 00 18 02 03 00 00 00",
        "23 00 18 01 32 04 00 00",
    ):
        assert bench.sdo(request) == f"60 {request[3:11]} 00 00 00 00"
    assert bench.read(0x1800, 1) == 0x4000_0432
    bench.nmt(START)
    bench.command(0x047E, 0x1111, 0x2222, 0x3333)
    assert [len(bench.sync()) for _ in range(3)] == [0, 0, 1]
    assert bench.of(0x432)[-1][1] == bytes.fromhex("7E04 3333")


def test_a_mapping_changes_only_in_pre_operational_and_only_at_count_0(live):
    assert live.write(0x1A00, 0, 0, 1) == "06010002"
    live.nmt(PRE_OP)
    assert live.write(0x1A00, 1, 0x3001_0210, 4) == "06010000"
    assert live.write(0x1A00, 0, 0, 1) == "60"
    assert live.write(0x1A00, 1, 0x3001_0210, 4) == "60"


@pytest.mark.landing(8)
@pytest.mark.parametrize(
    ("index", "word", "code"),
    [
        (0x1600, 0x3001_0110, "06040041"),  # a status word cannot be received
        (0x1A00, 0x3001_0120, "06040041"),  # wrong length
        (0x1A00, 0x3001_0510, "06040041"),  # no such sub-index
        (0x1A00, 0x5FFF_0010, "06040041"),  # no such object
        (0x1A00, 0x1008_0008, "06040041"),  # a string
        (0x1A00, 0x0006_0010, "06040041"),  # a dummy cannot be sent
        (0x1600, 0x0006_0010, "60"),
        (0x1600, 0x3004_0010, "60"),
    ],
)
def test_only_what_exists_and_fits_can_be_mapped(bench, index, word, code):
    bench.write(index, 0, 0, 1)
    assert bench.write(index, 1, word, 4) == code


def test_a_mapping_of_more_than_eight_bytes_is_refused(bench):
    bench.write(0x1600, 0, 0, 1)
    for sub in (1, 2, 3):
        assert bench.write(0x1600, sub, 0x0007_0020, 4) == "60"
    assert bench.write(0x1600, 0, 3, 1) == "06040042"
    assert bench.write(0x1600, 0, 2, 1) == "60"
    assert bench.write(0x1600, 0, 5, 1) == "06090030"
    assert bench.read(0x1600, 0) == 2
