"""The drive profile of a bus interface SK xU4-CAO: velocity mode (BU 2500 §6.7.3, §7.1.2 P168)."""

from __future__ import annotations

import pytest

from bridge.sim.nord.nord_states import NordState
from bridge.sim.nord.nord_tu4 import NordTu4

P168 = 0x20A8
MISSING = "06020000"


@pytest.fixture
def make(bench_of):
    """Profile on, FU1 … FU4 mapped as §6.7.3 says, operational."""

    def make(**options):
        bench = bench_of(NordTu4(5, **options))
        bench.run(0.3)
        assert bench.write(P168, 1, 1, 2) == "60"
        for drive in range(4):
            for index, words in ((0x1600, (0x6040, 0x6042)), (0x1A00, (0x6041, 0x6044))):
                for sub, word in enumerate(words, start=1):
                    entry = (word + 0x800 * drive) << 16 | 0x10
                    assert bench.write(index + drive, sub, entry, 4) == "60"
                assert bench.write(index + drive, 0, 2, 1) == "60"
        bench.nmt(1)
        return bench

    return make


def command(bench, control: int, rpm: int, drive: int = 1) -> None:
    data = control.to_bytes(2, "little") + (rpm & 0xFFFF).to_bytes(2, "little")
    bench.put((0x205, 0x305, 0x405, 0x505)[drive - 1], data)


def run(bench, rpm: int, drive: int = 1, seconds: float = 3.0) -> None:
    command(bench, 0x047E, 0, drive)
    command(bench, 0x047F, rpm, drive)
    bench.run(seconds)


def test_the_profile_replaces_the_objects_of_the_words(bench):
    assert bench.sdo("4000300100000000").startswith("4B")
    assert bench.sdo("4040600000000000").endswith("00 00 02 06")
    assert bench.write(P168, 1, 1, 2) == "60"
    assert bench.read(P168, 1) == 1
    for index in (0x3000, 0x3001, 0x3002, 0x3003, 0x3004, 0x3005):
        assert bench.sdo(f"40{index.to_bytes(2, 'little').hex()}0100000000").endswith("00 00 02 06")
    assert bench.read(0x6041, 0) == 0
    assert [bench.read(0x1600, 0), bench.read(0x1A03, 0)] == [0, 0], "nothing is mapped any more"
    assert bench.write(0x1600, 1, 0x3000_0110, 4) == "06040041"
    assert bench.write(P168, 1, 0, 2) == "60"
    assert bench.read(0x1600, 2) == 0x3002_0110
    assert bench.read(0x1604, 1) == 0x3004_0010


@pytest.mark.landing(12)
@pytest.mark.parametrize("drive", [1, 2, 3, 4])
@pytest.mark.parametrize("rpm", [750, -1200, 0])
def test_speed_is_in_revolutions_per_minute_and_signed(make, drive: int, rpm: int):
    bench = make()
    run(bench, rpm, drive)
    assert bench.node.drives[drive - 1].output_hz == rpm / 30
    status, speed = bench.answer(drive)
    assert speed == rpm & 0xFFFF
    assert status & 0xFF == 0x37
    assert bool(status & 0x1000) is (rpm < 0)
    others = [one.state for place, one in enumerate(bench.node.drives) if place != drive - 1]
    assert set(others) == {NordState.SWITCH_ON_INHIBITED}


def test_bit_12_does_not_turn_the_speed_round(make):
    bench = make()
    command(bench, 0x047E, 0)
    command(bench, 0x147F, 600)
    bench.run(3.0)
    assert bench.node.drives[0].output_hz == 20.0


def test_bit_10_is_needed_here_too(make):
    bench = make()
    command(bench, 0x007E, 0)
    assert bench.node.drives[0].state is NordState.SWITCH_ON_INHIBITED


def test_p168_is_the_ramp(make):
    bench = make()
    assert [bench.read(0x6048, 1), bench.read(0x6048, 2), bench.read(P168, 4)] == [1500, 2, 1500]
    assert bench.write(0x6048, 1, 300, 4) == "60"
    assert bench.write(0x6049, 2, 4, 2) == "60"
    assert [bench.read(P168, 2), bench.read(P168, 5)] == [300, 4]
    run(bench, 600, seconds=2.0)
    assert bench.node.drives[0].output_hz == pytest.approx(10.0, abs=0.01), "300 1/min in 2 s"
    bench.run(2.0)
    command(bench, 0x047F, 0)
    bench.run(0.8)
    assert bench.node.drives[0].output_hz == pytest.approx(10.0, abs=0.01), "1500 1/min in 4 s"


def test_each_drive_has_ramps_of_its_own(make):
    bench = make()
    assert bench.write(P168, 14, 3000, 2) == "60"
    assert (bench.read(0x7848, 1), bench.read(0x6048, 1)) == (3000, 1500)
    run(bench, 600, drive=4, seconds=0.2)
    assert bench.node.drives[3].output_hz == pytest.approx(10.0, abs=0.01), "3000 1/min in 2 s"


def test_without_a_change_of_speed_the_drives_own_ramp_counts(make):
    bench = make()
    bench.write(0x6048, 1, 0, 4)
    run(bench, 750, seconds=0.5)
    assert bench.node.drives[0].output_hz == pytest.approx(12.5, abs=0.01), "P102 = 2 s"


def test_6046h_limits_the_amount(make):
    bench = make()
    bench.write(0x6046, 1, 300, 4)
    bench.write(0x6046, 2, 900, 4)
    for rpm, hz in ((-1500, -30.0), (60, 10.0), (0, 0.0)):
        run(bench, rpm, seconds=4.0)
        assert bench.node.drives[0].output_hz == hz


def test_parameter_set_1_alone_is_valid(make):
    bench = make()
    command(bench, 0x047E, 0)
    command(bench, 0xC47F, 1500)
    bench.node.drives[0].parameters._ram[105, 1, 4] = 100
    bench.run(4.0)
    assert bench.node.drives[0].output_hz == 50.0


def test_the_error_code_and_the_io_are_there(make):
    bench = make()
    bench.node.image.inputs = 0x5
    bench.node.fail_drive("fu2", 30)
    bench.run(0.1)
    assert (bench.read(0x683F, 0), bench.read(0x603F, 0)) == (0x2310, 0)
    assert bench.read(0x60FD, 0) == 0x5_0000
    assert bench.write(0x60FE, 0, 0x2_0000, 4) == "60"
    assert bench.read(0x20AF, 1) == 2, "P175"


def test_p151_watches_in_the_profile(make):
    bench = make(p151_ms=100)
    run(bench, 600, seconds=0.09)
    assert bench.node.drives[0].state is NordState.ENABLED
    bench.run(0.02)
    assert bench.node.drives[0].fault_tenths == 103


@pytest.mark.landing
def test_a_reset_of_the_communication_leaves_no_mapping_of_what_is_not_there(make):
    bench = make()
    run(bench, 600)
    bench.nmt(0x82)
    bench.run(0.1)
    assert bench.read(0x1600, 0) == 0
    bench.nmt(0x01)
    bench.run(1.0)


def test_a_saved_profile_is_there_after_power_on(make):
    bench = make()
    assert bench.write(0x1010, 1, int.from_bytes(b"save", "little"), 4) == "60"
    bench.node.power_cycle()
    bench.run(0.5)
    bench.nmt(1)
    run(bench, 600)
    assert bench.answer(1)[1] == 600
    assert bench.write(0x2098, 1, 1, 2) == "60"
    assert bench.read(P168, 1) == 0, "P152 loads the factory settings"
    bench.run(1.0)


def test_an_unsaved_profile_is_gone_after_power_off(make):
    bench = make()
    bench.node.power_cycle()
    bench.run(0.5)
    assert bench.read(P168, 1) == 0
    assert bench.read(0x1600, 1) == 0x3000_0110
    assert bench.node.drives[0].demand is None


def test_an_sk_cu4_cao_has_no_outputs(bench_of):
    bench = bench_of(NordTu4(5, kind="SK CU4-CAO"))
    assert bench.read(0x20AC, 1) == 0, "P172"
    for index in ("9620", "AF20"):
        assert bench.sdo(f"40{index}0100000000").endswith("00 00 02 06"), "P150, P175"
    assert bench.sdo("4008100000000000").startswith("41 08 10 00 0A"), "its name has ten letters"
