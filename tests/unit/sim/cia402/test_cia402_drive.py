"""The simulated CiA 402 drive on the wire: modes, ramps, faults, supervision, objects."""

from __future__ import annotations

import pytest

from bridge.sim.cia402.cia402_drive import Cia402Drive
from bridge.sim.cia402.cia402_settings import Cia402Mode, Cia402Settings
from bridge.sim.cia402.cia402_states import Cia402State

MASTER = 0x77F
STATUS_ENTRIES = (0x60410010, 0x60640020)


def control(word: int, target: int | None = None, size: int = 4) -> bytes:
    data = word.to_bytes(2, "little")
    return data if target is None else data + (target & ((1 << 8 * size) - 1)).to_bytes(size, "little")


@pytest.fixture
def make(bench_of):
    """A bench with a drive in this mode at node 5; RPDO1 carries the control word and ``target``."""

    def make(mode: Cia402Mode, target: int = 0, *, operational: bool = True, kind: int = 255, **settings):
        bench = bench_of(Cia402Drive(5, Cia402Settings(mode=mode, **settings)))
        bench.run(0.2)
        remap(bench, 0x1400, [0x60400010, *([target] if target else [])], kind)
        remap(bench, 0x1800, list(STATUS_ENTRIES), kind)
        if operational:
            bench.nmt(1)
        return bench

    return make


def remap(bench, communication: int, entries: list[int], kind: int) -> None:
    cob_id = bench.read(communication, 1)
    mapping = communication + 0x200
    assert bench.write(communication, 1, cob_id | 0x8000_0000, 4) == "60"
    assert bench.write(mapping, 0, 0, 1) == "60"
    for sub, entry in enumerate(entries, 1):
        assert bench.write(mapping, sub, entry, 4) == "60"
    assert bench.write(mapping, 0, len(entries), 1) == "60"
    assert bench.write(communication, 2, kind, 1) == "60"
    assert bench.write(communication, 1, cob_id, 4) == "60"


def state(bench) -> Cia402State:
    return bench.node.axis.state


def enable(bench, *target: int, bits: int = 0, size: int = 4) -> None:
    for word in (0x06, 0x07, 0x0F | bits):
        bench.put(0x205, control(word, *target, size=size))
    assert state(bench) is Cia402State.ENABLED


def emcys(bench) -> list[str]:
    return [data.hex(" ").upper() for _, data in bench.of(0x085)]


def status(bench) -> int:
    return bench.read(0x6041, 0)


# boot-up, objects


def test_it_says_what_it_is(make):
    bench = make(Cia402Mode.NONE, operational=False)
    assert bench.read(0x1000, 0) & 0xFFFF == 0x0192
    assert bench.read(0x6502, 0) == 0b1_1010_0111
    assert state(bench) is Cia402State.SWITCH_ON_DISABLED
    assert status(bench) & 0x6F == 0x40


def test_the_name_comes_in_segments_and_in_a_block(make):
    bench = make(Cia402Mode.NONE)
    assert bench.sdo("4008100000000000")[:2] == "41"
    assert bench.sdo("6000000000000000") == "00 43 69 41 20 34 30 32"
    assert bench.sdo("A40810007F000000")[:2] == "C6"
    answers = [frame.data for frame in bench.put(0x605, "A300000000000000")]
    text = b"".join(data[1:] for data in answers)
    assert text.rstrip(b"\0") == b"CiA 402 simulation"
    assert answers[-1][0] & 0x80


@pytest.mark.parametrize(
    ("index", "sub", "value", "size"),
    [
        (0x6060, 0, 4, 1),
        (0x605A, 0, 9, 2),
        (0x6007, 0, 4, 2),
        (0x6098, 0, 1, 1),
        (0x6083, 0, 0, 4),
        (0x60C2, 2, 1, 1),
    ],
)
def test_a_value_out_of_range_is_refused(make, index: int, sub: int, value: int, size: int):
    bench = make(Cia402Mode.NONE)
    assert bench.write(index, sub, value, size) == "06090030"


def test_what_is_read_only_is_refused(make):
    bench = make(Cia402Mode.NONE)
    assert bench.write(0x6041, 0, 0, 2) == "06010002"
    assert bench.write(0x6061, 0, 1, 1) == "06010002"
    assert bench.write(0x6999, 0, 1, 1) == "06020000"
    assert bench.write(0x6046, 3, 1, 4) == "06090011"


def test_only_what_was_saved_outlasts_the_mains(make):
    bench = make(Cia402Mode.NONE)
    assert bench.write(0x6083, 0, 1234, 4) == "60"
    bench.node.power_cycle()
    bench.run(0.2)
    assert bench.read(0x6083, 0) == 500_000
    bench.write(0x6083, 0, 1234, 4)
    assert bench.write(0x1010, 1, int.from_bytes(b"save", "little"), 4) == "60"
    bench.node.power_cycle()
    bench.run(0.2)
    assert bench.read(0x6083, 0) == 1234
    assert bench.write(0x1011, 1, int.from_bytes(b"load", "little"), 4) == "60"
    bench.node.power_cycle()
    bench.run(0.2)
    assert bench.read(0x6083, 0) == 500_000


def test_it_can_be_commanded_by_sdo_too(make):
    bench = make(Cia402Mode.PROFILE_VELOCITY)
    for word in (6, 7, 15):
        assert bench.write(0x6040, 0, word, 2) == "60"
    assert state(bench) is Cia402State.ENABLED
    bench.write(0x60FF, 0, 10_000, 4)
    bench.run(0.1)
    assert bench.read(0x606C, 0) == 10_000


# velocities


def test_vl_runs_on_its_ramp_within_its_limits(make):
    bench = make(Cia402Mode.VELOCITY, 0x60420010, vl_limits=[100, 1500], vl_acceleration=[1500, 1])
    enable(bench, 1000, bits=0x70, size=2)
    bench.run(0.3)
    assert bench.read(0x6044, 0) == pytest.approx(450, abs=20)
    bench.run(0.7)
    assert bench.read(0x6044, 0) == 1000
    bench.put(0x205, control(0x7F, 3000, size=2))
    bench.run(1.0)
    assert bench.read(0x6044, 0) == 1500
    assert status(bench) & 0x0C00 == 0x0C00, "target reached, at the limit"
    bench.put(0x205, control(0x7F, 20, size=2))
    bench.run(2.0)
    assert bench.read(0x6044, 0) == 100


def test_vl_bits_4_to_6_decide_what_the_ramp_does(make):
    bench = make(Cia402Mode.VELOCITY, 0x60420010)
    enable(bench, 1000, bits=0x70, size=2)
    bench.run(0.4)
    bench.put(0x205, control(0x5F, 1000, size=2))  # locked
    locked = bench.read(0x6044, 0)
    bench.run(0.5)
    assert 0 < bench.read(0x6044, 0) == locked
    bench.put(0x205, control(0x3F, 1000, size=2))  # input 0
    bench.run(2.0)
    assert bench.read(0x6044, 0) == 0


def test_pv_says_when_it_is_there_and_when_it_stands(make):
    bench = make(Cia402Mode.PROFILE_VELOCITY, 0x60FF0020, acceleration=100_000)
    enable(bench, 50_000)
    assert status(bench) & 0x1400 == 0x1000
    bench.run(0.25)
    assert bench.read(0x606C, 0) == pytest.approx(25_000, abs=1500)
    assert status(bench) & 0x1400 == 0
    bench.run(0.3)
    assert status(bench) & 0x1400 == 0x0400


@pytest.mark.parametrize(
    ("word", "after"), [(0x0007, Cia402State.SWITCHED_ON), (0x010F, Cia402State.ENABLED)]
)
def test_disable_and_halt_brake_on_the_ramp(make, word: int, after: Cia402State):
    bench = make(Cia402Mode.PROFILE_VELOCITY, 0x60FF0020, deceleration=100_000)
    enable(bench, 50_000)
    bench.run(0.5)
    bench.put(0x205, control(word, 50_000))
    bench.run(0.25)
    assert bench.read(0x606C, 0) == pytest.approx(25_000, abs=1500)
    bench.run(0.5)
    assert (bench.read(0x606C, 0), state(bench)) == (0, after)


def test_the_quick_stop_brakes_harder_and_ends_in_switch_on_disabled(make):
    bench = make(Cia402Mode.PROFILE_VELOCITY, 0x60FF0020, quick_stop_deceleration=500_000)
    enable(bench, 50_000)
    bench.run(0.5)
    bench.put(0x205, control(0x0002, 50_000))
    assert state(bench) is Cia402State.QUICK_STOP_ACTIVE
    bench.run(0.05)
    assert bench.read(0x606C, 0) == pytest.approx(25_000, abs=3000)
    bench.run(0.2)
    assert (bench.read(0x606C, 0), state(bench)) == (0, Cia402State.SWITCH_ON_DISABLED)


def test_without_voltage_it_coasts(make):
    bench = make(Cia402Mode.PROFILE_VELOCITY, 0x60FF0020)
    enable(bench, 300_000)
    bench.run(1.0)
    bench.put(0x205, control(0, 300_000))
    assert state(bench) is Cia402State.SWITCH_ON_DISABLED
    bench.run(0.2)
    assert 0 < bench.read(0x606C, 0) < 300_000
    bench.run(1.0)
    assert bench.read(0x606C, 0) == 0


# positions


def test_pp_takes_a_setpoint_at_the_edge_and_not_before(make):
    bench = make(Cia402Mode.PROFILE_POSITION, 0x607A0020)
    enable(bench, 20_000)
    bench.run(0.5)
    assert bench.read(0x6064, 0) == 0
    bench.put(0x205, control(0x1F, 20_000))
    assert status(bench) & 0x1400 == 0x1000
    bench.put(0x205, control(0x0F, 20_000))
    assert not status(bench) & 0x1000
    bench.run(1.0)
    assert bench.read(0x6064, 0) == 20_000
    assert status(bench) & 0x0400


def test_pp_keeps_its_speed_and_never_passes_its_goal(make):
    bench = make(Cia402Mode.PROFILE_POSITION, 0x607A0020, profile_velocity=50_000)
    enable(bench, 0)
    bench.put(0x205, control(0x1F, 100_000))
    seen, speeds = [], []
    for _ in range(300):
        bench.run(0.01)
        seen.append(bench.node.axis.motor.position)
        speeds.append(bench.node.axis.motor.velocity)
    assert max(seen) == seen[-1] == 100_000
    assert max(speeds) == 50_000
    assert 2.0 < next(n for n, place in enumerate(seen) if place == 100_000) / 100 < 2.3


def test_pp_one_setpoint_may_wait(make):
    bench = make(Cia402Mode.PROFILE_POSITION, 0x607A0020)
    enable(bench, 0)
    for position in (20_000, 40_000, 60_000):
        bench.put(0x205, control(0x1F, position))
        bench.put(0x205, control(0x0F, position))
    assert status(bench) & 0x1000, "no place: it is kept until the second begins"
    bench.run(3.0)
    assert bench.read(0x6064, 0) == 40_000, "the third found no place"


def test_pp_relative(make):
    bench = make(Cia402Mode.PROFILE_POSITION, 0x607A0020)
    enable(bench, 0)
    for _ in range(3):
        bench.put(0x205, control(0x5F, -5000))
        bench.put(0x205, control(0x4F, -5000))
        bench.run(1.0)
    assert bench.node.axis.motor.position == -15_000


def test_pp_halt_interrupts_and_goes_on(make):
    bench = make(Cia402Mode.PROFILE_POSITION, 0x607A0020)
    enable(bench, 0)
    bench.put(0x205, control(0x1F, 100_000))
    bench.run(0.4)
    bench.put(0x205, control(0x11F, 100_000))
    bench.run(0.5)
    assert status(bench) & 0x0400, "halted: bit 10 says that it stands still"
    assert 0 < bench.node.axis.motor.position < 100_000
    bench.put(0x205, control(0x1F, 100_000))
    bench.run(2.0)
    assert bench.node.axis.motor.position == 100_000


def test_pp_within_the_software_limits(make):
    bench = make(Cia402Mode.PROFILE_POSITION, 0x607A0020, position_limits=[-1000, 1000])
    enable(bench, 0)
    bench.put(0x205, control(0x1F, 5000))
    bench.run(1.0)
    assert bench.node.axis.motor.position == 1000
    assert status(bench) & 0x0800


@pytest.mark.parametrize(
    ("method", "from_", "to"),
    [
        (17, 0, -100_000),
        (18, 0, 100_000),
        (33, 25_000, 20_000),
        (34, 25_000, 30_000),
        (35, 123, 123),
        (37, 123, 123),
    ],
)
def test_hm_finds_its_place(make, method: int, from_: int, to: int):
    bench = make(Cia402Mode.HOMING, homing_method=method, home_offset=7)
    bench.node.axis.motor.position = from_
    enable(bench)
    assert status(bench) & 0x3400 == 0x0400, "not started"
    bench.put(0x205, control(0x1F))
    if from_ != to:
        assert status(bench) & 0x3400 == 0, "in progress"
    bench.run(4.0)
    assert status(bench) & 0x3400 == 0x1400, "completed"
    assert bench.node.axis.motor.position == 7
    assert bench.node.axis.homing._shift == to - 7


@pytest.mark.parametrize(("position", "inputs"), [(-100_001, 1), (-100_000, 1), (0, 0), (100_000, 2)])
def test_60fd_tells_the_limit_switches(make, position: int, inputs: int):
    bench = make(Cia402Mode.HOMING)
    bench.node.axis.motor.position = position
    assert bench.read(0x60FD, 0) == inputs
    bench.node.axis.homing.switches = False
    assert bench.read(0x60FD, 0) == 0


def test_hm_is_interrupted_when_bit_4_falls(make):
    bench = make(Cia402Mode.HOMING, homing_method=17)
    enable(bench)
    bench.put(0x205, control(0x1F))
    bench.run(0.5)
    bench.put(0x205, control(0x0F))
    bench.run(0.5)
    assert status(bench) & 0x3400 == 0x0400
    assert bench.node.axis.motor.stands_still


def test_csp_goes_to_each_target_within_the_cycle(make):
    bench = make(Cia402Mode.CYCLIC_POSITION, 0x607A0020, kind=1, interpolation=[10, -3])
    for word in (0x06, 0x07, 0x0F):
        bench.put(0x205, control(word, 0))
        bench.sync()
    for step in range(1, 51):
        bench.put(0x205, control(0x0F, 500 * step))
        bench.sync()
        bench.run(0.01)
    assert bench.node.axis.motor.position == pytest.approx(25_000)
    assert bench.read(0x606C, 0) == 50_000
    assert status(bench) & 0x3000 == 0x1000
    places = [int.from_bytes(data[2:6], "little") for _, data in bench.of(0x185)]
    assert places[-3:] == [23_500, 24_000, 24_500], "sampled with the SYNC"


def test_csp_without_sync_takes_nothing(make):
    bench = make(Cia402Mode.CYCLIC_POSITION, 0x607A0020, kind=1)
    bench.put(0x205, control(0x06, 0))
    bench.run(0.1)
    assert state(bench) is Cia402State.SWITCH_ON_DISABLED
    bench.sync()
    assert state(bench) is Cia402State.READY


def test_csp_too_far_behind_is_a_fault(make):
    bench = make(Cia402Mode.CYCLIC_POSITION, 0x607A0020, following_window=1000)
    enable(bench, 0)
    bench.put(0x205, control(0x0F, 400_000))
    bench.run(0.5)
    assert (state(bench), bench.read(0x603F, 0)) == (Cia402State.FAULT, 0x8611)
    assert emcys(bench) == ["11 86 21 00 00 00 00 00"]


# faults


def test_a_fault_brakes_and_is_reset_by_the_edge(make):
    bench = make(Cia402Mode.PROFILE_VELOCITY, 0x60FF0020)
    enable(bench, 100_000)
    bench.run(1.0)
    bench.node.fail(0x4310)
    bench.run(0.01)
    assert state(bench) is Cia402State.FAULT_REACTION
    bench.run(0.5)
    assert (state(bench), bench.read(0x606C, 0), bench.read(0x603F, 0)) == (Cia402State.FAULT, 0, 0x4310)
    assert (bench.read(0x1001, 0), bench.read(0x1003, 1)) == (0x09, 0x4310)
    bench.put(0x205, control(0x80, 0))
    assert state(bench) is Cia402State.SWITCH_ON_DISABLED
    assert emcys(bench) == ["10 43 09 00 00 00 00 00", "00 00 00 00 00 00 00 00"]
    assert bench.read(0x1001, 0) == 0


def test_a_lasting_fault_waits_until_it_is_mended(make):
    bench = make(Cia402Mode.NONE)
    bench.node.fail(0x3210, lasting=True)
    bench.put(0x205, control(0x80))
    assert state(bench) is Cia402State.FAULT
    bench.node.mend()
    bench.put(0x205, control(0x00))
    bench.put(0x205, control(0x80))
    assert state(bench) is Cia402State.SWITCH_ON_DISABLED


def test_there_is_no_fault_without_a_code():
    with pytest.raises(ValueError, match="0h"):
        Cia402Drive(5).fail(0)


# supervision


@pytest.mark.parametrize(
    ("option", "after"),
    [
        (0, Cia402State.ENABLED),
        (1, Cia402State.FAULT),
        (2, Cia402State.SWITCH_ON_DISABLED),
        (3, Cia402State.SWITCH_ON_DISABLED),
    ],
)
@pytest.mark.parametrize("by", ["heartbeat", "guarding"])
def test_a_silent_master_has_the_reaction_of_6007h(make, option: int, after: Cia402State, by: str):
    bench = make(Cia402Mode.PROFILE_VELOCITY, 0x60FF0020, abort_connection=option, acceleration=1_000_000)
    if by == "heartbeat":
        bench.write(0x1016, 1, 0x7F << 16 | 300, 4)
    else:
        bench.write(0x100C, 0, 100, 2)
        bench.write(0x100D, 0, 3, 1)
    enable(bench, 50_000)
    if by == "heartbeat":
        bench.put(MASTER, b"\x05")
    else:
        bench.guard()
    bench.run(0.299)
    assert (state(bench), emcys(bench)) == (Cia402State.ENABLED, [])
    bench.run(0.5)
    assert state(bench) is after
    assert emcys(bench) == ["30 81 11 00 00 00 00 00"]
    assert bench.node.slave.state == 127, "pre-operational"
    assert (bench.read(0x606C, 0) == 50_000) is (option == 0)
    if by == "heartbeat":
        bench.put(MASTER, b"\x05")
    else:
        bench.guard()
    assert len(emcys(bench)) == (1 if option == 1 else 2), "a fault waits for its reset"


def test_a_master_that_was_never_heard_is_not_missed(make):
    bench = make(Cia402Mode.NONE)
    bench.write(0x1016, 1, 0x7F << 16 | 300, 4)
    bench.run(3.0)
    assert emcys(bench) == []
    assert bench.write(0x1016, 1, 0x80 << 16 | 300, 4) == "06090030"


@pytest.mark.parametrize("command", [2, 0x82])
def test_a_stop_of_the_node_stops_the_drive(make, command: int):
    bench = make(Cia402Mode.PROFILE_VELOCITY, 0x60FF0020, abort_connection=3)
    enable(bench, 50_000)
    bench.run(0.5)
    bench.nmt(command)
    bench.run(0.5)
    assert bench.node.axis.motor.stands_still
    assert state(bench) is Cia402State.SWITCH_ON_DISABLED


def test_a_reset_of_the_node_begins_anew(make):
    bench = make(Cia402Mode.PROFILE_VELOCITY, 0x60FF0020)
    enable(bench, 50_000)
    bench.nmt(0x81)
    assert state(bench) is Cia402State.NOT_READY
    bench.run(0.2)
    assert (state(bench), bench.read(0x1600, 0)) == (Cia402State.SWITCH_ON_DISABLED, 1)
