"""The bus interface SK TU4-CAO: four-word rule, process data, P16x, memory (BU 2500 §6.4, §8)."""

from __future__ import annotations

import pytest

from bridge.canopen.frame import Frame
from bridge.sim.nord.nord_states import NordState

P151, P160, P161, P162, P163, P164, P165, P166, P167 = 0x2097, *range(0x20A0, 0x20A8)
P170, P173, P176, P177 = 0x20AA, 0x20AD, 0x20B0, 0x20B1
P513, P700, P701 = 0x2201, 0x22BC, 0x22BD


# Four words


@pytest.mark.parametrize("length", [0, 2, 4, 6, 7])
def test_a_telegram_of_less_than_four_words_is_not_evaluated(live, length):
    live.put(0x205, bytes.fromhex("7E04000000000000")[:length])
    assert live.node.drives[0].state is NordState.SWITCH_ON_INHIBITED
    assert live.node.slave.rpdos_ignored == 1


def test_a_mapping_of_less_than_four_words_is_not_evaluated(live):
    live.nmt(0x80)
    live.write(0x1600, 0, 0, 1)
    live.write(0x1600, 0, 2, 1)
    live.nmt(0x01)
    live.command(0x047E)
    assert live.node.drives[0].state is NordState.SWITCH_ON_INHIBITED
    assert live.node.slave.rpdos_ignored == 1


@pytest.mark.landing
def test_dummy_words_fill_a_telegram(live):
    live.nmt(0x80)
    live.write(0x1600, 0, 0, 1)
    live.write(0x1600, 3, 0x0006_0010, 4)
    live.write(0x1600, 4, 0x0006_0010, 4)
    live.write(0x1600, 0, 4, 1)
    live.nmt(0x01)
    live.command(0x047E, 1, 2, 3)
    assert live.node.drives[0].setpoints[:3] == (1, 0, 0)


# Process data


@pytest.mark.parametrize("drive", [1, 2, 3, 4])
def test_each_pdo_moves_its_drive_and_no_other(live, drive):
    live.command(0x047E, 0x0111, 0x0222, 0x0333, drive=drive)
    states = [one.state for one in live.node.drives]
    assert states.pop(drive - 1) is NordState.READY
    assert set(states) == {NordState.SWITCH_ON_INHIBITED}
    assert live.node.drives[drive - 1].setpoints == (0x0111, 0x0222, 0x0333, 0, 0)
    assert live.read(P176, 4 * drive - 2) == 0x047E
    assert live.read(P177, 4 * drive - 2) == 0x0B31


@pytest.mark.parametrize(("layout", "per_drive"), [("three", 3), ("five", 5)])
def test_both_layouts_of_the_setpoints_are_mapped_by_default(make_bench, layout, per_drive):
    bench = make_bench(operational=True, layout=layout)
    for drive in (1, 2, 3, 4):
        first = (drive - 1) * per_drive + 1
        values = [first, first + 1, first + 2]
        words = [0x3000_0010 | drive << 8, *(0x3002_0010 | sub << 8 for sub in values)]
        assert [bench.read(0x1600 + drive - 1, sub) for sub in (1, 2, 3, 4)] == words
        words = [0x3001_0010 | drive << 8, *(0x3003_0010 | sub << 8 for sub in values)]
        assert [bench.read(0x1A00 + drive - 1, sub) for sub in (1, 2, 3, 4)] == words
    assert bench.read(0x3002, 0) == 4 * per_drive
    bench.command(0x047E, 1, 2, 3, drive=4)
    assert bench.node.drives[3].setpoints[:3] == (1, 2, 3)


def test_pdo5_carries_the_interfaces_inputs_and_outputs(bench):
    assert bench.write(P160, 10, 3, 2) == "60"
    bench.node.image.inputs = 0x0005
    assert Frame(0x1C5, b"\x05\x00") in bench.nmt(0x01)
    bench.put(0x245, "0200")
    assert bench.read(0x3004, 0) == 2
    assert bench.read(0x20AF, 1) == 2, "P175"


# P160…P167 and the objects they stand for


@pytest.mark.landing(18)
@pytest.mark.parametrize(
    ("parameter", "sub", "size", "value", "index", "object_sub", "expected"),
    [
        (P160, 6, 2, 1, 0x1800, 1, 0xC000_0185),
        (P160, 6, 2, 2, 0x1400, 1, 0xC000_0205),
        (P160, 3, 2, 3, 0x1201, 1, 0x345),
        (P161, 1, 2, 0x90, 0x1005, 0, 0x90),
        (P161, 4, 2, 0x2C6, 0x1201, 2, 0x8000_02C6),
        (P161, 9, 2, 0x546, 0x1203, 1, 0x8000_0546),
        (P161, 12, 2, 0x290, 0x1801, 1, 0x4000_0290),
        (P161, 19, 2, 0x250, 0x1404, 1, 0xC000_0250),
        (P162, 3, 2, 10, 0x1801, 2, 10),
        (P162, 4, 2, 1, 0x1401, 2, 1),
        (P163, 5, 2, 300, 0x1804, 3, 300),
        (P164, 2, 2, 500, 0x1801, 5, 500),
        (P165, 2, 4, 0x3002_0310, 0x1600, 2, 0x3002_0310),
        (P165, 14, 4, 0x3003_0610, 0x1A01, 2, 0x3003_0610),
        (P165, 33, 4, 0x3001_0110, 0x1A04, 1, 0x3001_0110),
        (P166, 1, 2, 200, 0x100C, 0, 200),
        (P166, 2, 2, 150, 0x1017, 0, 150),
        (P167, 1, 2, 3, 0x100D, 0, 3),
    ],
)
def test_a_parameter_and_its_object_are_one(bench, parameter, sub, size, value, index, object_sub, expected):
    assert bench.write(parameter, sub, value, size) == "60"
    assert bench.read(parameter, sub) == value
    assert bench.read(index, object_sub) == expected


def test_the_factory_values_are_those_of_the_manual(bench):
    assert [bench.read(P160, sub) for sub in range(1, 11)] == [3, 3, 0, 0, 0, 3, 3, 3, 3, 0]
    bases = [0x580, 0x600, 0x2C0, 0x340, 0x3C0, 0x440, 0x4C0, 0x540]
    bases += [0x180, 0x200, 0x280, 0x300, 0x380, 0x400, 0x480, 0x500, 0x1C0, 0x240]
    assert [bench.read(P161, sub) for sub in range(1, 20)] == [0x80, *(base + 5 for base in bases)]
    assert {bench.read(P162, sub) for sub in range(1, 11)} == {255}
    assert {bench.read(P163, sub) for sub in range(1, 6)} == {100}
    assert {bench.read(P164, sub) for sub in range(1, 6)} == {250}
    printed = {1: 0x3000_0110, 4: 0x3002_0310, 5: 0x3001_0110, 8: 0x3003_0310, 9: 0x3000_0210}
    printed |= {12: 0x3002_0610, 28: 0x3002_0C10, 32: 0x3003_0C10, 33: 0x3005_0010, 34: 0x3004_0010}
    assert {sub: bench.read(P165, sub) for sub in printed} == printed
    assert bench.read(0x20B4, 1) == 5, "P180"


def test_the_first_sdo_channel_is_read_only_in_p160_and_p161(bench):
    assert bench.write(P160, 2, 0, 2) == "06010002"
    assert bench.write(P161, 3, 0x620, 2) == "06010002"


# Memory


def test_settings_survive_only_when_saved(bench):
    bench.write(P151, 1, 200, 2)
    bench.write(P161, 10, 0x190, 2)
    assert bench.write(0x1010, 1, int.from_bytes(b"save", "little"), 4) == "60"
    bench.write(P151, 1, 300, 2)
    bench.node.power_cycle()
    bench.run(0.01)
    assert (bench.read(P151, 1), bench.read(P161, 10)) == (200, 0x190)
    assert bench.write(0x1011, 1, int.from_bytes(b"load", "little"), 4) == "60"
    assert bench.read(P151, 1) == 200, "not before the next power-on"
    bench.node.power_cycle()
    bench.run(0.01)
    assert (bench.read(P151, 1), bench.read(P161, 10)) == (0, 0x185)


def test_p152_loads_the_factory_settings_and_returns_to_0(make_bench):
    bench = make_bench(p151_ms=500)
    assert bench.write(0x2098, 1, 1, 2) == "60"
    assert (bench.read(P151, 1), bench.read(0x2098, 1)) == (0, 0)


# Clockwork


def test_an_idle_node_is_not_called_for_nothing(live):
    before = live.calls
    live.run(10.0)
    assert live.calls - before <= 45, "four event timers of 250 ms, together"


def test_a_turning_drive_is_looked_at_every_10_ms_and_only_while_its_frequency_changes(live):
    live.command(0x047E)
    live.command(0x047F, 0x2000)
    before = live.calls
    live.run(1.0)
    assert 100 <= live.calls - before <= 250
    before = live.calls
    live.run(1.0)
    assert live.calls - before <= 10


def test_frames_with_stamps_from_before_the_last_timer_do_no_harm(live):
    live.run(1.0)
    live.node.on_frame(Frame(0x205, bytes.fromhex("7E04000000000000")), live.now - 0.5)
    assert live.node.drives[0].state is NordState.READY


@pytest.mark.landing
def test_with_ripple_the_current_moves_and_the_seed_repeats_it(make_bench):
    def currents(seed: int) -> list[bytes]:
        bench = make_bench(operational=True, ripple=0.02, seed=seed)
        bench.command(0x047E)
        bench.command(0x047F, 0x2000)
        bench.run(2.0)
        return [data for _, data in bench.of(0x185)]

    assert currents(1) == currents(1)
    assert currents(1) != currents(2)
