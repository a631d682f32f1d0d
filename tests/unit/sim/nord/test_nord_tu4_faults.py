"""The bus interface SK TU4-CAO: drives that fail and vanish, EMCY, power (BU 2500 §6.7, §7.1)."""

from __future__ import annotations

import pytest

from bridge.canopen.frame import Frame
from bridge.sim.nord.nord_states import NordState
from bridge.sim.nord.nord_tu4 import NordTu4

P151, P160, P161, P162, P163, P164, P165, P166, P167 = 0x2097, *range(0x20A0, 0x20A8)
P170, P173, P176, P177 = 0x20AA, 0x20AD, 0x20B0, 0x20B1
P513, P700, P701 = 0x2201, 0x22BC, 0x22BD


def emcys(bench) -> list[str]:
    return [data.hex().upper() for _, data in bench.of(0x085)]


@pytest.mark.parametrize(
    ("fault", "code", "register"),
    [(30, 0x2310, 0x03), (50, 0x3210, 0x05), (20, 0x4310, 0x09), (999, 0x1000, 0x01), (180, 0xFF10, 0x81)],
)
def test_a_drives_fault_is_passed_on(live, fault, code, register):
    live.node.fail_drive("fu3", fault)
    live.run(0.1)
    assert live.of(0x085)[-1][1] == code.to_bytes(2, "little") + bytes([register, 2, 0, 0, 0, 0])
    assert live.read(0x1003, 1) == code | 2 << 16
    live.command(0x0400, drive=3)
    live.command(0x0480, drive=3)
    assert live.of(0x085)[-1][1] == bytes.fromhex("0000000200000000")
    assert live.write(0x1003, 0, 0, 1) == "60"
    assert live.read(0x1003, 0) == 0


def test_emcys_keep_their_inhibit_time(live):
    live.write(0x1015, 0, 50, 2)  # ms, §6.7.2
    since = live.now
    for drive in (1, 2, 3):
        live.node.fail_drive(drive, 30)
    live.run(0.2)
    assert [round((time - since) * 1000) for time, _ in live.of(0x085)] == [0, 50, 100]


def test_emcy_can_be_switched_off(live):
    live.write(0x1014, 0, 0x8000_0085, 4)
    live.node.fail_drive(1, 30)
    live.run(0.1)
    assert live.of(0x085) == []
    assert live.read(0x1003, 0) == 1


def test_a_stopped_node_keeps_its_emcy_for_later(live):
    live.nmt(0x02)
    live.node.fail_drive(1, 30)
    live.run(0.1)
    assert live.of(0x085) == []
    live.nmt(0x80)
    assert len(live.of(0x085)) == 1


def test_a_dropped_drive_is_lost_for_the_interface_and_misses_it_itself(live):
    live.command(0x047E, drive=2)
    live.command(0x047F, 0x2000, drive=2)
    live.run(3.0)
    assert live.read(P173, 1) >> 8 == 0b10101010
    live.node.drop_drive("fu2")
    live.run(0.1)
    assert live.read(P173, 1) >> 8 == 0b10101110
    assert live.answer(2) == (0, 0)
    assert (live.node.drives[1].fault_tenths, live.node.drives[1].output_hz) == (109, 0.0)
    live.command(0x0480, drive=2)
    assert live.node.drives[1].state is NordState.FAULT
    live.node.restore_drive("fu2")
    live.run(0.1)
    assert live.of(0x085)[-1][1] == bytes.fromhex("0010010100000000")
    live.command(0x0400, drive=2)
    live.command(0x0480, drive=2)
    assert live.node.drives[1].state is NordState.SWITCH_ON_INHIBITED


def test_a_dropped_drive_with_p513_minus_0_1_runs_on(live):
    live.node.drives[1].parameters.commission(513, -0.1)
    live.command(0x047E, drive=2)
    live.command(0x047F, 0x2000, drive=2)
    live.run(3.0)
    live.node.drop_drive("fu2")
    live.run(10.0)
    assert live.node.drives[1].output_hz == 25.0


def test_a_drive_that_was_never_there_is_offline(make_bench):
    bench = make_bench(operational=True, fitted=(1,))
    assert bench.read(P173, 1) >> 8 == 0b00000010
    assert bench.answer(2) == (0, 0)


def test_a_silent_node_hears_and_works(live):
    live.node.silence()
    live.command(0x047E)
    assert live.run(1.0) == []
    assert live.node.drives[0].state is NordState.READY
    live.node.speak()
    assert live.run(1.0) != []


@pytest.mark.landing
def test_a_power_cycle_starts_everything_anew(watched):
    watched.node.power_cycle()
    assert Frame(0x705, b"\0") in watched.run(0.01)
    assert watched.node.drives[0].state is NordState.NOT_READY
    watched.run(1.0)
    assert watched.node.drives[0].state is NordState.SWITCH_ON_INHIBITED
    assert watched.read(P173, 1) & 3 == 1


def test_without_power_nothing_is_heard_or_said(live):
    live.node.power_off()
    live.run(0)
    assert live.nmt(0x81) == []
    assert live.run(5.0) == []
    assert live.node.next_deadline() is None


def test_a_wrong_slot_is_named():
    with pytest.raises(ValueError, match="fu9"):
        NordTu4(5).fail_drive("fu9", 30)
