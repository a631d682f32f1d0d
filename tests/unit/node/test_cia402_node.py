"""The bridge and a CiA 402 drive on a virtual clock, mode by mode."""

from __future__ import annotations

import itertools
from pathlib import Path

import pytest

from bridge.canopen.frame import Frame
from bridge.command import Action, Code, Outcome, Request, Start
from bridge.config import load_site
from bridge.drive import DriveState
from bridge.image import Quality
from bridge.mapping import load_family
from bridge.sim.cia402.cia402_drive import Cia402Drive
from bridge.sim.cia402.cia402_settings import Cia402Mode, Cia402Settings
from bridge.sim.cia402.cia402_states import Cia402State
from tests.support.bench import PLC, Bench

DRIVE = "axis/drive"
SITE = """
[site]
name = "bench"
[[bus]]
name = "can0"
interface = "virtual"
{bus}
[[bus.node]]
name = "axis"
id = 5
mapping = "{mapping}"
{node}
[[bus.node.drive]]
slot = "drive"
control = "modbus"
fieldbus_timeout_ms = 500
{drive}
[modbus]
"""
SUPERVISED = """
configure = [
  { object = "1016:01", type = "uint32", value = 0x7F012C },
  { object = "6007:00", type = "int16", value = 3 },
]
"""
SHUTDOWN, RUN, RESET = 0x0006, 0x000F, 0x0080


@pytest.fixture
def booted(tmp_path: Path):
    def boot(mode: str, node: str = "", drive: str = "", bus: str = "", **settings) -> Bench:
        mapping = f"cia402/{mode}"
        path = tmp_path / "site.toml"
        path.write_text(SITE.format(mapping=mapping, node=node, drive=drive, bus=bus), encoding="utf-8")
        simulated = Cia402Drive(5, Cia402Settings(**settings))
        bench = Bench(load_site(path), family=load_family(mapping), mapping=mapping, node=simulated)
        bench.run(2.0)
        return bench

    return boot


def boot_status(bench: Bench) -> str:
    return str(bench.value("axis/node/boot_status"))


def state(bench: Bench) -> DriveState:
    return bench.plant.drives[DRIVE].channel.state


def word(frame: Frame) -> int:
    """Control or status word."""
    return int.from_bytes(frame.data[:2], "little")


def start(bench: Bench) -> None:
    outcomes: list[Outcome] = []
    bench.view.submit(Request(PLC, DRIVE, Start()), outcomes.append)
    bench.run(0.2)
    assert [outcome.code for outcome in outcomes] == [Code.OK]
    assert state(bench) is DriveState.OPERATION_ENABLED


def keep(bench: Bench, seconds: float, **values: float) -> None:
    """Write these every 50 ms, as a controller does."""
    for _ in range(round(seconds / 0.05)):
        assert bench.write(DRIVE, **values).code is Code.OK
        bench.run(0.05)


def keep_alive(bench: Bench, seconds: float) -> None:
    for _ in range(round(seconds / 0.05)):
        bench.ask(Action.KEEP_ALIVE, DRIVE)
        bench.run(0.05)


# boot-up


@pytest.mark.parametrize(
    ("mode", "number", "rpdo", "tpdo"),
    [
        ("velocity", 2, "6040:00/16 6042:00/16", "6041:00/16 6044:00/16 6061:00/8"),
        ("profile-velocity", 3, "6040:00/16 60FF:00/32", "6041:00/16 606C:00/32 6061:00/8"),
        ("profile-position", 1, "6040:00/16 607A:00/32", "6041:00/16 6064:00/32 6061:00/8"),
        ("homing", 6, "6040:00/16", "6041:00/16 6064:00/32 6061:00/8"),
        ("cyclic-position", 8, "6040:00/16 607A:00/32", "6041:00/16 6064:00/32 6061:00/8"),
        ("cyclic-velocity", 9, "6040:00/16 60FF:00/32", "6041:00/16 606C:00/32 6061:00/8"),
    ],
)
def test_the_boot_up_writes_mode_and_mapping(booted, mode: str, number: int, rpdo: str, tpdo: str) -> None:
    bench = booted(mode)
    assert boot_status(bench).startswith("ok"), boot_status(bench)
    communication = bench.node.slave._store.current
    for pdo, expected in ((communication.rpdo[0], rpdo), (communication.tpdo[0], tpdo)):
        mapped = " ".join(f"{word >> 16:04X}:{word >> 8 & 0xFF:02X}/{word & 0xFF}" for word in pdo.mapping)
        assert mapped == expected
        assert pdo.transmission_type == (1 if mode.startswith("cyclic") else 255)
    assert bench.node.settings.mode == number
    assert bench.value("axis/drive/actual/mode") == number
    assert state(bench) is DriveState.SWITCH_ON_INHIBITED
    assert bench.plant.drives[DRIVE].quality is Quality.GOOD


def test_a_second_boot_up_writes_nothing(booted) -> None:
    bench = booted("profile-velocity")
    bench.log.clear()
    bench.node.slave.boot()
    bench.run(2.0)
    writes = [frame.data.hex() for frame in bench.sent(0x605) if frame.data[0] >> 5 == 1]
    assert writes == []
    assert boot_status(bench).startswith("ok")


def test_a_drive_whose_mapping_lacks_the_position_is_not_enabled_cyclically(booted) -> None:
    """Its target could not follow it: enabling might make it jump."""
    bench = booted("cyclic-position", drive='tpdo = { mapping = ["6041:00/16"] }')
    assert "command/position has to follow actual/position" in boot_status(bench)
    assert bench.plant.drives[DRIVE].quality is not Quality.GOOD


def test_a_drive_without_the_mode_says_so(booted) -> None:
    bench = booted("profile-velocity")
    bench.node.objects.find(0x6060, 0)  # it is there, and takes no torque mode
    assert bench.node.objects.find(0x6502, 0).read() == 0b1_1010_0111


# velocities


def test_vl_follows_the_setpoint_in_revolutions_and_stops_on_the_ramp(booted) -> None:
    bench = booted("velocity")
    start(bench)
    keep(bench, 1.0, velocity=-1500.0)
    assert bench.value("axis/drive/actual/velocity") == -1500.0
    assert bench.value("axis/drive/actual/target_reached") is True
    assert bench.write(DRIVE, velocity=3000).code is Code.OK
    assert bench.write(DRIVE, velocity=32768).code is Code.OUT_OF_RANGE
    bench.ask(Action.STOP, DRIVE)
    bench.run(0.3)
    assert -1500 < bench.node.axis.actual_rpm < 0
    assert state(bench) is DriveState.OPERATION_ENABLED, "605Ch = 1: first the ramp"
    keep_alive(bench, 1.5)
    assert (bench.node.axis.actual_rpm, state(bench)) == (0, DriveState.SWITCHED_ON)


def test_pv_is_32_bits_in_increments(booted) -> None:
    bench = booted("profile-velocity")
    start(bench)
    assert bench.value("axis/drive/actual/standstill") is True
    keep(bench, 1.0, velocity=123_456)
    assert bench.value("axis/drive/actual/velocity") == 123_456
    assert bench.value("axis/drive/actual/standstill") is False
    bench.write(DRIVE, velocity=-2_000_000_000)
    bench.run(0.1)
    assert bench.value("axis/drive/actual/internal_limit") is True, "6080h"


def test_csv_goes_by_sync_without_a_ramp(booted) -> None:
    bench = booted("cyclic-velocity")
    start(bench)
    bench.write(DRIVE, velocity=50_000)
    bench.run(0.03)
    assert bench.value("axis/drive/actual/velocity") == 50_000
    assert bench.value("axis/drive/actual/follows_command") is True
    begin = bench.now
    bench.run(0.4)
    times = [frame.time for frame in bench.sent(0x185) if frame.time > begin]
    assert len(times) == pytest.approx(40, abs=1), "one to each SYNC of 10 ms"


# positions


def test_pp_a_written_position_is_handed_over_and_reached(booted) -> None:
    bench = booted("profile-position")
    start(bench)
    assert bench.write(DRIVE, position=50_000).code is Code.OK
    begin = bench.now
    keep_alive(bench, 1.5)
    assert bench.value("axis/drive/actual/position") == 50_000
    assert bench.value("axis/drive/actual/target_reached") is True
    words = [word(frame) for frame in bench.sent(0x205) if frame.time >= begin]
    assert words[0] & 0x10, "with the position itself"
    edges = sum(1 for one, two in itertools.pairwise(words) if two & ~one & 0x10)
    assert not words[-1] & 0x10
    assert edges == 0, "raised once, and lowered when bit 12 said so"


def test_pp_the_same_position_written_cyclically_moves_nothing_twice(booted) -> None:
    bench = booted("profile-position")
    start(bench)
    keep(bench, 1.5, control_word=0x002F, position=20_000)
    assert bench.value("axis/drive/actual/position") == 20_000
    words = [word(frame) for frame in bench.sent(0x205)]
    assert sum(1 for one, two in itertools.pairwise(words) if two & ~one & 0x10) == 1
    keep(bench, 1.5, control_word=0x002F, position=-20_000)
    assert bench.value("axis/drive/actual/position") == -20_000


def test_pp_a_new_position_counts_at_once(booted) -> None:
    bench = booted("profile-position")
    start(bench)
    bench.write(DRIVE, position=1_000_000)
    keep_alive(bench, 0.5)
    bench.write(DRIVE, position=0)
    keep_alive(bench, 2.5)
    assert bench.value("axis/drive/actual/position") == 0


def test_pp_one_after_the_other_where_the_owner_leaves_bit_5_at_0(booted) -> None:
    bench = booted("profile-position")
    start(bench)
    goals = (30_000, 60_000, 40_000)
    seen = []
    for goal in goals:  # the third waits until the drive has a place for it
        bench.write(DRIVE, control_word=RUN, position=goal)
        bench.run(0.02)
    for _ in range(60):
        keep_alive(bench, 0.05)
        seen.append(bench.node.axis.profile_position.goal)
    assert [goal for n, goal in enumerate(seen) if n == 0 or goal != seen[n - 1]] == list(goals)
    assert bench.value("axis/drive/actual/position") == 40_000


def test_pp_a_position_written_before_the_start_is_gone_to_after_it(booted) -> None:
    bench = booted("profile-position")
    bench.write(DRIVE, control_word=SHUTDOWN, position=10_000)
    bench.run(0.1)
    start(bench)
    keep_alive(bench, 1.0)
    assert bench.value("axis/drive/actual/position") == 10_000


def test_pp_a_stop_forgets_the_position(booted) -> None:
    bench = booted("profile-position")
    start(bench)
    bench.write(DRIVE, position=1_000_000)
    keep_alive(bench, 0.5)
    bench.ask(Action.STOP, DRIVE)
    keep_alive(bench, 1.0)
    stopped_at = bench.value("axis/drive/actual/position")
    start(bench)
    keep_alive(bench, 1.0)
    assert bench.value("axis/drive/actual/position") == stopped_at
    bench.write(DRIVE, position=1_000_000)
    keep_alive(bench, 0.2)
    assert bench.node.axis.motor.velocity > 0, "the same position again, but after a stop"


def test_pp_by_raw_words_the_owner_does_the_handshake(booted) -> None:
    bench = booted("profile-position")
    start(bench)
    bench.write(DRIVE, control_word=0x002F, setpoint_1=0x2710, setpoint_2=0)
    keep_alive(bench, 0.5)
    assert bench.value("axis/drive/actual/position") == 0
    bench.write(DRIVE, control_word=0x003F)
    keep_alive(bench, 1.0)
    assert bench.value("axis/drive/actual/position") == 10_000
    assert bench.node.axis.status_word & 0x1000, "bit 12 stays as long as bit 4 does"
    bench.write(DRIVE, control_word=0x002F)
    bench.run(0.05)
    assert not bench.node.axis.status_word & 0x1000


def test_hm_start_begins_homing_once_enabled(booted) -> None:
    bench = booted("homing", homing_method=17, home_offset=500)
    start(bench)
    begin = next(frame for frame in bench.sent(0x205) if word(frame) == 0x001F)
    enabled = next(frame for frame in bench.sent(0x185) if word(frame) & 0x6F == 0x27)
    assert begin.time >= enabled.time
    assert bench.value("axis/drive/actual/homing_attained") is False
    keep_alive(bench, 3.5)
    assert bench.value("axis/drive/actual/homing_attained") is True
    assert bench.value("axis/drive/actual/position") == 500
    assert bench.value("axis/drive/actual/homing_error") is False
    bench.run(1.0)
    assert bench.value("axis/node/digital_inputs") == 1, "60FDh, bit 0: at the negative limit switch"


def test_hm_without_switches_fails(booted) -> None:
    bench = booted("homing", homing_method=18)
    bench.node.axis.homing.switches = False
    start(bench)
    keep_alive(bench, 10.0)
    assert bench.value("axis/drive/actual/homing_error") is True
    assert bench.value("axis/drive/actual/homing_attained") is False


def turned(bench: Bench, to: float) -> None:
    """Somebody turns the shaft of the drive that is off."""
    bench.node.axis.motor.position = to
    bench.run(0.1)


def test_csp_enabling_moves_nothing(booted) -> None:
    """The target is the drive's own position until it is enabled, whatever was written before."""
    bench = booted("cyclic-position")
    turned(bench, 123_456.0)
    assert bench.value("axis/drive/command/position") == 123_456
    bench.write(DRIVE, control_word=SHUTDOWN, position=0)
    bench.run(0.1)
    assert bench.write(DRIVE, control_word=RUN, position=0).code is Code.OK
    bench.run(0.2)
    assert state(bench) is DriveState.OPERATION_ENABLED
    assert bench.node.axis.motor.position == 123_456
    keep(bench, 0.5, position=123_000)
    assert bench.value("axis/drive/actual/position") == 123_000


def test_csp_a_stop_and_a_start_move_nothing(booted) -> None:
    bench = booted("cyclic-position")
    start(bench)
    for step in range(1, 41):
        bench.write(DRIVE, position=step * 1000)
        bench.run(0.02)
    assert bench.value("axis/drive/actual/position") == 40_000
    bench.ask(Action.STOP, DRIVE)
    bench.run(0.2)
    turned(bench, -70_000.0)
    start(bench)
    keep_alive(bench, 0.3)
    assert bench.node.axis.motor.position == -70_000
    assert state(bench) is DriveState.OPERATION_ENABLED


def test_csp_another_owner_inherits_no_position_and_makes_no_jump(booted) -> None:
    bench = booted("cyclic-position")
    turned(bench, 50_000.0)
    start(bench)
    bench.run(0.6)  # silent: tripped
    bench.ask(Action.RESET_FAULT, DRIVE)
    bench.run(0.3)
    start(bench)
    assert bench.node.axis.motor.position == 50_000


def test_csp_a_jump_is_a_following_error(booted) -> None:
    bench = booted("cyclic-position")
    start(bench)
    bench.write(DRIVE, position=500_000)
    bench.run(0.3)
    assert state(bench) is DriveState.FAULT
    assert bench.value("axis/drive/status/fault_text") == "8611h following error"
    assert bench.value("axis/drive/supervision/current_fault") == 0x8611


# faults, supervision


def test_a_fault_is_shown_in_words_and_reset(booted) -> None:
    bench = booted("velocity")
    start(bench)
    keep(bench, 0.5, velocity=600.0)
    bench.node.fail(0x4310)
    keep_alive(bench, 1.5)
    assert state(bench) is DriveState.FAULT
    assert bench.node.axis.actual_rpm == 0
    channel = bench.plant.drives[DRIVE].channel
    assert (channel.emcy_code, channel.fault_text) == (0x4310, "4310h drive temperature too high")
    bench.ask(Action.RESET_FAULT, DRIVE)
    keep_alive(bench, 1.0)
    assert state(bench) in (DriveState.SWITCH_ON_INHIBITED, DriveState.READY, DriveState.SWITCHED_ON)
    assert channel.current_fault == 0
    start(bench)
    keep(bench, 0.5, velocity=600.0)
    assert bench.value("axis/drive/actual/velocity") == 600


def test_a_silent_controller_lets_the_motor_coast(booted) -> None:
    bench = booted("velocity")
    start(bench)
    keep(bench, 1.0, velocity=600.0)
    bench.run(1.2)
    assert bench.node.axis.state is Cia402State.SWITCH_ON_DISABLED
    assert bench.node.axis.actual_rpm == 0


def test_configured_it_stops_when_the_bridge_falls_silent(booted) -> None:
    bench = booted("velocity", SUPERVISED)
    start(bench)
    keep(bench, 1.0, velocity=600.0)
    bench.cut = True
    bench.hang(1.5)  # the bursts end after the dead-man time, then 300 ms, then the ramp
    assert bench.node.axis.state is Cia402State.SWITCH_ON_DISABLED
    assert bench.node.axis.actual_rpm == 0
    assert [frame.data[:2].hex() for frame in bench.sent(0x085)] == ["3081"]


def test_guarding_stops_it_too(booted) -> None:
    bench = booted("velocity", 'supervision = "guarding"\nsupervision_ms = 100', abort_connection=1)
    start(bench)
    keep(bench, 1.0, velocity=600.0)
    bench.cut = True
    bench.hang(2.5)
    assert bench.node.axis.state is Cia402State.FAULT


def test_the_mode_can_be_another_for_a_while(booted) -> None:
    """Homing before positioning: 6060h by hand, then the mode's bits."""
    bench = booted("profile-position", homing_method=37, home_offset=-7)
    bench.node.settings.mode = Cia402Mode.HOMING
    bench.node.axis.set_mode()
    start(bench)
    assert bench.value("axis/drive/actual/mode") == 6
    bench.write(DRIVE, control_word=RUN)
    bench.run(0.05)
    bench.write(DRIVE, control_word=0x001F)
    bench.run(0.1)
    assert bench.value("axis/drive/actual/position") == -7


@pytest.mark.landing(2)
@pytest.mark.parametrize("option", [2, 6])
def test_a_start_after_a_quick_stop_enables_again(booted, option: int) -> None:
    """605Ah = 6 stays in *quick stop active* at standstill."""
    bench = booted("velocity", options={0x605A: option, 0x605B: 0, 0x605C: 1, 0x605D: 1, 0x605E: 2})
    start(bench)
    keep(bench, 0.5, velocity=600.0)
    bench.ask(Action.QUICK_STOP, DRIVE)
    keep_alive(bench, 2.0)
    outcomes: list[Outcome] = []
    bench.view.submit(Request(PLC, DRIVE, Start()), outcomes.append)
    keep_alive(bench, 2.0)
    assert [outcome.code for outcome in outcomes] == [Code.OK]
    assert state(bench) is DriveState.OPERATION_ENABLED


def test_pp_a_position_that_the_drive_does_not_take_is_told_and_the_next_has_its_edge(booted) -> None:
    bench = booted("profile-position")
    start(bench)
    bench.node.settings.mode = Cia402Mode.VELOCITY  # no bit 12 there
    bench.node.axis.set_mode()
    bench.write(DRIVE, position=10_000)
    keep_alive(bench, 1.5)
    untaken = [event.message for event in bench.events if "has not taken" in event.message]
    assert untaken == ["the drive has not taken the position that was written: no answer within 1 s"]
    assert not word(bench.sent(0x205)[-1]) & 0x10
    bench.node.settings.mode = Cia402Mode.PROFILE_POSITION
    bench.node.axis.set_mode()
    assert bench.write(DRIVE, position=20_000).code is Code.NOT_CONFIGURED, "the mode has to be seen first"
    keep_alive(bench, 1.5)
    assert bench.write(DRIVE, position=20_000).code is Code.OK
    keep_alive(bench, 1.5)
    assert bench.value("axis/drive/actual/position") == 20_000


@pytest.mark.landing(6)
@pytest.mark.parametrize("mode", ["cyclic-position", "cyclic-velocity"])
@pytest.mark.parametrize("period_ms", [4, 10, 40])
def test_the_interpolation_time_is_the_period_of_sync(booted, mode: str, period_ms: int) -> None:
    bench = booted(mode, bus=f"sync_period_ms = {period_ms}")
    assert boot_status(bench).startswith("ok"), boot_status(bench)
    assert bench.node.settings.interpolation == [period_ms, -3]
