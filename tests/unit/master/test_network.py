"""The CANopen side with a simulated SK TU4-CAO, on a virtual clock."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from bridge.can.burstend import Burst
from bridge.can.interface import ControllerState
from bridge.canopen.frame import Frame
from bridge.canopen.nmt import NmtState
from bridge.command import Action, Code, Outcome, Plant, ReadParameter, Request
from bridge.command.node import Enforcement
from bridge.image import Quality
from bridge.mapping.model import IdentityRule
from bridge.master.line import BusLine
from bridge.master.standstill import StoodStill, WatchdogTimer
from tests.support.bench import NORD, PLC, Bench, write_site

RPDO1 = 0x205
HEARTBEAT = 0x77F
TPDO1 = 0x185


@pytest.fixture
def bench(tmp_path: Path) -> Bench:
    bench = Bench(write_site(tmp_path))
    bench.run(1.0)
    return bench


def low_byte(bench: Bench) -> int:
    return bench.number("conveyor/fu1/status/status_word") & 0xFF


def test_a_node_that_is_there_is_booted_and_its_drives_are_good(bench: Bench) -> None:
    status = str(bench.value("conveyor/node/boot_status"))
    assert status.startswith(
        "ok; 1017h was 0, is 66 now; the drive runs on when the bridge falls silent: P151"
    )
    assert bench.value("conveyor/node/nmt_state") == NmtState.OPERATIONAL
    assert bench.plant.drives["conveyor/fu1"].quality is Quality.GOOD
    assert bench.value("conveyor/fu1/identity/device_name") == "SK TU4-CAO"


def test_the_first_rpdo_is_a_stopped_one_and_has_four_words(bench: Bench) -> None:
    rpdos = bench.sent(RPDO1)
    assert rpdos[0].data == bytes.fromhex("0004000000000000")
    assert {len(frame.data) for frame in rpdos} == {8}


def test_the_manuals_example(bench: Bench) -> None:
    """BU 2500 §6.8."""
    assert low_byte(bench) == 0x40
    bench.write(control_word=0x047E, setpoint_1=0)
    bench.run(0.05)
    assert low_byte(bench) == 0x31
    bench.keep_writing(4.0, control_word=0x047F, setpoint_1=0x2000)
    assert low_byte(bench) == 0x37
    assert bench.value("conveyor/fu1/actual/value_1") == 0x2000
    assert bench.value("conveyor/fu1/actual/frequency") == 25.0
    bench.keep_writing(4.0, control_word=0x047E, setpoint_1=0x2000)
    assert low_byte(bench) == 0x31
    assert bench.value("conveyor/fu1/actual/value_1") == 0
    bench.keep_writing(4.0, control_word=0x047F, setpoint_1=0x1000)
    assert low_byte(bench) == 0x37
    assert bench.value("conveyor/fu1/actual/frequency") == 12.5


def running(bench: Bench) -> None:
    bench.write(control_word=0x047E)
    bench.keep_writing(3.0, control_word=0x047F, setpoint_1=0x2000)
    assert bench.value("conveyor/fu1/actual/frequency") == 25.0


def test_a_silent_controller_stops_the_drive_within_the_published_time(bench: Bench) -> None:
    running(bench)
    last_telegram = bench.now
    bench.write(control_word=0x047F)
    bench.log.clear()
    bench.run(1.0)
    stopped = next(frame for frame in bench.sent(RPDO1) if not frame.data[0] & 2)
    published_s = bench.number("conveyor/fu1/supervision/worst_case_stop_ms") / 1000
    assert 0.2 <= stopped.time - last_telegram <= published_s
    assert stopped.data[2:] == bytes(6)
    assert bench.value("conveyor/fu1/supervision/last_fault") == 10.3
    assert low_byte(bench) & 0x4F == 0x08, "the owner sees fault"
    assert bench.value("conveyor/fu1/status/fault_text") != ""
    assert bench.value("conveyor/node/current_fault") == 102.0


def test_nothing_restarts_a_tripped_drive_without_acknowledge_and_fresh_enable(bench: Bench) -> None:
    running(bench)
    bench.run(1.0)
    bench.log.clear()
    bench.keep_writing(1.0, control_word=0x047F, setpoint_1=0x2000)
    assert all(frame.data[0] & 0x0F != 0x0F for frame in bench.sent(RPDO1))
    bench.write(control_word=0x04FE)
    bench.keep_writing(0.5, control_word=0x047F, setpoint_1=0x2000)
    assert all(frame.data[0] & 0x0F != 0x0F for frame in bench.sent(RPDO1))
    bench.write(control_word=0x047E)
    bench.keep_writing(3.0, control_word=0x047F, setpoint_1=0x2000)
    assert bench.value("conveyor/fu1/actual/frequency") == 25.0


def test_the_other_drives_of_the_node_are_not_touched_by_a_trip(bench: Bench) -> None:
    running(bench)
    bench.run(1.0)
    assert bench.value("conveyor/fu2/supervision/trips") == 0
    assert bench.value("conveyor/fu2/status/state") != 7


def test_a_lost_node_goes_lost_then_dead_and_comes_back_stopped(bench: Bench) -> None:
    running(bench)
    bench.cut = True
    bench.keep_writing(0.5, control_word=0x047F)
    drive = bench.plant.drives["conveyor/fu1"]
    assert drive.quality is Quality.LOST
    assert bench.value("conveyor/fu1/supervision/current_fault") == 10.9
    assert any(event.kind == "node_lost" for event in bench.events)
    bench.keep_writing(2.0, control_word=0x047F)
    assert drive.quality is Quality.DEAD
    bench.cut = False
    bench.log.clear()
    bench.keep_writing(3.0, control_word=0x047F, setpoint_1=0x2000)
    assert drive.quality is Quality.GOOD
    assert all(frame.data[0] & 0x0F != 0x0F for frame in bench.sent(RPDO1)), "restart interlock"
    bench.write(control_word=0x047E)
    bench.keep_writing(3.0, control_word=0x047F, setpoint_1=0x2000)
    assert bench.value("conveyor/fu1/actual/frequency") == 25.0


def test_a_node_that_restarts_is_booted_again(bench: Bench) -> None:
    running(bench)
    bench.node.power_cycle()
    bench.keep_writing(2.0, control_word=0x047F, setpoint_1=0x2000)
    assert bench.plant.drives["conveyor/fu1"].quality is Quality.GOOD
    assert bench.value("conveyor/fu1/actual/value_1") == 0


def test_a_node_that_appears_later_is_booted_then(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path), present=False)
    bench.run(3.0)
    assert bench.plant.drives["conveyor/fu1"].quality is Quality.WAITING
    assert str(bench.value("conveyor/node/boot_status")).startswith("B: 1000h:00: no valid answer")
    bench.power_on()
    bench.run(1.0)
    assert bench.plant.drives["conveyor/fu1"].quality is Quality.GOOD


def test_a_slowly_guarded_node_has_the_time_to_say_that_it_is_operational(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path, node='supervision = "guarding"\nsupervision_ms = 3000'))
    bench.run(8.0)
    assert str(bench.value("conveyor/node/boot_status")).startswith("ok")
    assert not [event.message for event in bench.events if "boot-up failed" in event.message]


def test_another_device_at_the_address_is_left_alone(tmp_path: Path) -> None:
    site = write_site(tmp_path, node="[bus.node.identity]\nvendor_id = 0x12345678")
    bench = Bench(site)
    bench.run(1.0)
    status = str(bench.value("conveyor/node/boot_status"))
    assert status.startswith("D: 1018h:01 is ")
    assert "expected 12345678h by the site file" in status
    assert bench.plant.drives["conveyor/fu1"].quality is Quality.CONFIG_ERROR
    assert Frame(0, b"\x01\x05") not in [frame._replace(time=0.0) for frame in bench.log]


def test_a_device_of_another_family_is_left_alone(tmp_path: Path) -> None:
    family = NORD.model_copy(update={"identity": IdentityRule(vendor_id=0xB9)})
    bench = Bench(write_site(tmp_path), family=family)
    bench.run(1.0)
    status = str(bench.value("conveyor/node/boot_status"))
    assert status.startswith("D: 1018h:01 is 00000000h, expected 000000B9h by the mapping")
    assert bench.plant.drives["conveyor/fu1"].quality is Quality.CONFIG_ERROR


def test_a_command_on_a_node_goes_out_at_once(bench: Bench) -> None:
    bench.log.clear()
    bench.ask(Action.RESET_COMMUNICATION, "conveyor")
    assert [frame.data for frame in bench.sent(0x000)] == [b"\x82\x05"]


def test_a_hung_bridge_falls_silent_within_the_dead_man_time(bench: Bench) -> None:
    running(bench)
    hung_at = bench.now
    bench.log.clear()
    bench.hang(1.0)
    for can_id in (0x080, RPDO1, 0x77F):
        assert max(frame.time for frame in bench.sent(can_id)) <= hung_at + 0.1
    bench.log.clear()
    bench.run(0.5)
    assert bench.master.gaps == 1
    assert all(frame.data[0] & 0x0F != 0x0F for frame in bench.sent(RPDO1))


def test_a_telegram_from_before_the_hang_saves_no_drive(bench: Bench) -> None:
    running(bench)
    bench.hang(0.5)
    outcome = bench.write(control_word=0x047F, setpoint_1=0x2000)
    assert not outcome.forwarded
    assert bench.value("conveyor/fu1/supervision/trips") == 1


def test_a_process_stopped_within_a_round_sends_nothing_that_was_right_before(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    running(bench)
    judge = bench.plant.enforcements

    def judge_and_stand_still(plant: Plant, now: float) -> Iterator[Enforcement]:
        yield from judge(now)
        bench.now += 1.0

    bench.log.clear()
    with monkeypatch.context() as patched:
        patched.setattr(Plant, "enforcements", judge_and_stand_still)
        bench.write(control_word=0x047F, setpoint_1=0x2100)
    bench.run(0.5)
    assert bench.sent(RPDO1)
    assert not [frame.data.hex() for frame in bench.sent(RPDO1) if frame.data[0] & 0x0F == 0x0F]


def test_a_process_stopped_while_it_sends_sends_nothing_that_was_right_before(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    running(bench)
    send = bench.bus.burst

    def stand_still_after(burst: Burst, now: float, **more: bool) -> None:
        send(burst, now, **more)
        if burst.can_id == HEARTBEAT:
            bench.now += 1.0

    # A telegram that comes when the heartbeat's burst begins, which is told before the RPDO's.
    (line,) = bench.master._lines
    del line.running[HEARTBEAT]
    bench.log.clear()
    with monkeypatch.context() as patched:
        patched.setattr(bench.bus, "burst", stand_still_after)
        bench.write(control_word=0x047F, setpoint_1=0x2100)
    bench.run(0.5)
    assert bench.sent(RPDO1)
    assert not [frame.data.hex() for frame in bench.sent(RPDO1) if frame.data[0] & 0x0F == 0x0F]


def test_a_process_stopped_at_the_end_of_its_last_look_at_the_clock_sends_nothing_that_was_right_before(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The time that it has read is right, and a second old."""
    running(bench)
    alarm, look = WatchdogTimer(), BusLine.stood_still

    def stand_still_after(line: BusLine, since: float) -> bool:
        found = look(line, since)
        if alarm_is_set and not alarm.rang:
            bench.now += 1.0
            alarm.rang = True
        return found

    alarm_is_set: list[float] = []
    (line,) = bench.master._lines
    bench.log.clear()
    with monkeypatch.context() as patched:
        patched.setattr(alarm, "set", alarm_is_set.append)
        patched.setattr(line, "alarm", alarm)
        patched.setattr(BusLine, "stood_still", stand_still_after)
        bench.write(control_word=0x047F, setpoint_1=0x2100)
    assert alarm_is_set == [0.1], "the dead-man time"
    bench.run(0.5)
    assert bench.sent(RPDO1)
    assert not [frame.data.hex() for frame in bench.sent(RPDO1) if frame.data[0] & 0x0F == 0x0F]


def test_a_process_stopped_as_a_bus_is_due_sends_nothing_that_was_right_before(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At the end of the look at the clock before a burst's next frame, with no round due."""
    running(bench)
    alarm, look = WatchdogTimer(), BusLine.stood_still

    def stand_still_after(line: BusLine, since: float) -> bool:
        found = look(line, since)
        bench.now += 1.0
        alarm.rang = True
        if alarm.breaks_in:
            raise StoodStill
        return found

    (line,) = bench.master._lines
    due = bench.bus.next_deadline()
    while due is None or due > (bench.master._due or 0.0) - 0.001:
        bench.run(0.002)
        bench.write(control_word=0x047F, setpoint_1=0x2000)
        due = bench.bus.next_deadline()
    bench.now = due
    bench.log.clear()
    done: list[float] = []
    with monkeypatch.context() as patched:
        patched.setattr(line, "alarm", alarm)
        patched.setattr(bench.bus, "on_time", done.append)
        patched.setattr(BusLine, "stood_still", stand_still_after)
        bench.master.take_in()
    assert alarm.rang
    assert not alarm.breaks_in
    assert not done
    bench.run(0.5)
    assert bench.sent(RPDO1)
    assert not [frame.data.hex() for frame in bench.sent(RPDO1) if frame.data[0] & 0x0F == 0x0F]


def test_a_process_stopped_on_the_way_to_the_kernel_hands_nothing_over(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Behind both looks: the alarm breaks in."""
    running(bench)
    alarm, hand_over = WatchdogTimer(), bench.bus.burst

    def stand_still_before(burst: Burst, now: float, **more: bool) -> None:
        if burst.can_id == RPDO1 and alarm.breaks_in:
            bench.now += 1.0
            alarm.rang = True
            raise StoodStill
        hand_over(burst, now, **more)

    (line,) = bench.master._lines
    bench.log.clear()
    with monkeypatch.context() as patched:
        patched.setattr(line, "alarm", alarm)
        patched.setattr(bench.bus, "burst", stand_still_before)
        bench.write(control_word=0x047F, setpoint_1=0x2100)
    assert alarm.rang
    assert not alarm.breaks_in, "nothing but the hand-over is broken into"
    bench.run(0.5)
    assert bench.sent(RPDO1)
    assert not [frame.data.hex() for frame in bench.sent(RPDO1) if frame.data[0] & 0x0F == 0x0F]


@pytest.mark.landing
def test_the_bus_going_down_loses_all_and_brings_back_stopped_drives(bench: Bench) -> None:
    running(bench)
    bench.bus.status.state = ControllerState.DOWN
    bench.bus.clear()
    bench.keep_writing(0.5, control_word=0x047F, setpoint_1=0x2000)
    assert bench.plant.drives["conveyor/fu1"].quality is Quality.LOST
    assert bench.value("bus/can0/state") == 4
    bench.bus.status.state = ControllerState.OK
    bench.log.clear()
    bench.keep_writing(3.0, control_word=0x047F, setpoint_1=0x2000)
    assert bench.plant.drives["conveyor/fu1"].quality is Quality.GOOD
    assert all(frame.data[0] & 0x0F != 0x0F for frame in bench.sent(RPDO1))


def test_a_frame_that_does_not_fit_changes_nothing_and_is_counted(bench: Bench) -> None:
    before = bench.plant.image.read("conveyor/fu1/status/status_word")
    bench.receive(Frame(TPDO1, b"\x08\x00"), Frame(0x085, b"\x00"), Frame(0x705, b""), Frame(0x585, b"\x60"))
    bench.run(0.2)
    assert bench.plant.image.read("conveyor/fu1/status/status_word") == before
    assert bench.value("conveyor/node/rejected_frames") == 4


def test_silence_as_reaction_ends_the_rpdos_of_this_drive_alone(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path, drive='on_expiry = "silence"'))
    bench.run(1.0)
    # P151 is the interface's: `check` refuses this, and the bridge would send disable voltage instead.
    bench.plant.drives["conveyor/fu1"].channel.on_own_watch("", bench.now)
    running(bench)
    bench.run(0.5)
    bench.log.clear()
    bench.run(0.5)
    assert not bench.sent(RPDO1)
    assert bench.sent(0x305)


def test_the_drives_own_p151_trips_when_the_bridge_is_gone(bench: Bench) -> None:
    running(bench)
    p151_500_ms = Frame(0x605, bytes.fromhex("2B972001F4010000"))
    bench.node.on_frame(p151_500_ms, bench.now)
    bench.hang(2.0)
    bench.run(0.3)
    assert bench.number("conveyor/fu1/status/drive_status_word") & 0x4F == 0x08
    assert bench.value("conveyor/fu1/status/emcy_code") == 0x8100


def test_a_reset_of_the_node_is_refused_to_who_does_not_control_its_drives(bench: Bench) -> None:
    running(bench)
    other = type(PLC)(PLC.source, "192.168.1.99")
    assert bench.ask(Action.RESET, "conveyor", other).code is Code.NOT_ALLOWED
    assert bench.ask(Action.RESET, "conveyor").ok
    bench.run(3.0)
    assert bench.plant.drives["conveyor/fu1"].quality is Quality.GOOD


@pytest.mark.landing
def test_a_disabled_node_is_stopped_and_stays_disabled_until_enabled(bench: Bench) -> None:
    running(bench)
    assert bench.ask(Action.DISABLE, "conveyor").ok
    bench.log.clear()
    bench.keep_writing(1.0, control_word=0x047F, setpoint_1=0x2000)
    assert bench.plant.drives["conveyor/fu1"].quality is Quality.DISABLED
    assert all(frame.data[0] & 0x0F != 0x0F for frame in bench.sent(RPDO1))
    assert bench.ask(Action.ENABLE, "conveyor").ok
    bench.run(2.0)
    assert bench.plant.drives["conveyor/fu1"].quality is Quality.GOOD


def test_guarding_supervises_by_remote_frames(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path, node='supervision = "guarding"'))
    bench.run(3.0)
    assert bench.plant.drives["conveyor/fu1"].quality is Quality.GOOD
    assert bench.sent(0x4000_0705)
    bench.cut = True
    bench.run(1.0)
    assert bench.plant.drives["conveyor/fu1"].quality is Quality.LOST


def test_a_hold_ends_with_the_bridge_that_held(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path, drive='on_expiry = "hold"'))
    bench.run(1.0)
    running(bench)
    bench.run(1.0)
    assert bench.sent(RPDO1)[-1].data[0] & 0x0F == 0x0F, "held"
    bench.hang(0.5)
    bench.log.clear()
    bench.run(0.5)
    assert all(frame.data[0] & 0x0F != 0x0F for frame in bench.sent(RPDO1))


@pytest.mark.landing(3)
@pytest.mark.parametrize("downtime", [-0.1, 0, 0.5])
def test_after_an_outage_of_the_bus_the_first_rpdos_are_stopped_ones(tmp_path: Path, downtime: float) -> None:
    bench = Bench(write_site(tmp_path, drive=f"telegram_downtime_s = {downtime}"))
    bench.run(1.0)
    running(bench)
    bench.bus.status.state = ControllerState.BUS_OFF
    bench.bus.clear()
    bench.run(5.0)
    bench.bus.status.state = ControllerState.OK
    bench.log.clear()
    bench.run(3.0)
    assert bench.sent(RPDO1)
    assert all(frame.data[0] & 0x0F != 0x0F for frame in bench.sent(RPDO1))


@pytest.mark.landing
def test_an_outage_between_two_rounds_is_no_secret(bench: Bench) -> None:
    running(bench)
    bench.bus.status.outages += 1
    bench.bus.clear()
    bench.log.clear()
    bench.keep_writing(1.0, control_word=0x047F, setpoint_1=0x2000)
    assert all(frame.data[0] & 0x0F != 0x0F for frame in bench.sent(RPDO1))


def test_a_bridge_that_is_being_stopped_takes_no_command_but_stops(bench: Bench) -> None:
    running(bench)
    bench.plant.close(bench.now)
    bench.log.clear()
    for word in (0x047E, 0x047F):
        assert bench.write(control_word=word).code is Code.NOT_READY
        bench.run(0.02)
    assert bench.ask(Action.QUICK_STOP).ok
    assert bench.sent(RPDO1)
    assert all(frame.data[0] & 0x0F != 0x0F for frame in bench.sent(RPDO1))


IGNORE = "telegram_downtime_s = -0.1"


def moves(bench: Bench) -> bool:
    return any(frame.data[0] & 0x0F == 0x0F for frame in bench.sent(RPDO1))


def test_errors_ignored_or_not_an_outage_between_two_rounds_ends_the_enable(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path, drive=IGNORE))
    bench.run(1.0)
    running(bench)
    bench.bus.status.outages += 1
    bench.bus.clear()
    bench.log.clear()
    bench.keep_writing(1.0, control_word=0x047F, setpoint_1=0x2000)
    assert not moves(bench)


def test_errors_ignored_or_not_what_is_written_while_the_bus_is_gone_does_not_go_out_first(
    tmp_path: Path,
) -> None:
    bench = Bench(write_site(tmp_path, drive=IGNORE))
    bench.run(1.0)
    running(bench)
    bench.bus.status.state = ControllerState.DOWN
    bench.bus.clear()
    bench.run(0.1)
    for word in (0x047E, 0x047F):
        bench.write(control_word=word, setpoint_1=0x2000)
    bench.run(0.1)
    bench.bus.status.state = ControllerState.OK
    bench.log.clear()
    bench.keep_writing(1.0, control_word=0x047F, setpoint_1=0x2000)
    assert bench.sent(RPDO1)
    assert not moves(bench)


@pytest.mark.landing
def test_errors_ignored_or_not_a_node_that_restarts_again_and_again_is_not_enabled(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path, drive=IGNORE))
    bench.run(1.0)
    running(bench)
    for _ in range(4):
        bench.receive(Frame(0x705, b"\x00"))
        bench.log.clear()
        bench.keep_writing(3.0, control_word=0x047F, setpoint_1=0x2000)
        assert not moves(bench)


@pytest.mark.landing(3)
@pytest.mark.parametrize("action", [Action.RESET, Action.RESET_COMMUNICATION, Action.STOP_NODE])
def test_errors_ignored_or_not_a_node_that_we_stop_is_not_enabled(tmp_path: Path, action: Action) -> None:
    bench = Bench(write_site(tmp_path, drive=IGNORE))
    bench.run(1.0)
    running(bench)
    bench.log.clear()
    assert bench.ask(action, "conveyor").ok
    bench.keep_writing(0.5, control_word=0x047F, setpoint_1=0x2000)
    assert not moves(bench)


def test_a_node_that_was_stopped_stays_so_when_the_bus_comes_back(bench: Bench) -> None:
    assert bench.ask(Action.STOP_NODE, "conveyor").ok
    bench.run(0.5)
    bench.bus.status.outages += 1
    bench.bus.clear()
    bench.run(5.0)
    assert bench.value("conveyor/node/nmt_state") != NmtState.OPERATIONAL


def test_an_empty_frame_is_no_sign_of_a_drive(bench: Bench) -> None:
    age = bench.plant.drives["conveyor/fu1"].channel.link.last_pdo
    bench.receive(Frame(TPDO1, b""))
    bench.run(0.001)
    assert bench.plant.drives["conveyor/fu1"].channel.link.last_pdo == age


def test_after_a_tpdo_that_is_too_long_the_next_right_one_counts(bench: Bench) -> None:
    ready, running_ = bytes.fromhex("310B000000000000"), bytes.fromhex("370B000000000000")
    for data, low in ((ready, 0x31), (running_ + b"\0", 0x37), (ready, 0x31)):
        bench.receive(Frame(TPDO1, data))
        bench.run(0.001)
        assert bench.number("conveyor/fu1/status/drive_status_word") & 0xFF == low


@pytest.mark.landing
def test_bursts_that_the_kernel_no_longer_takes_are_told_once_and_so_is_their_return(bench: Bench) -> None:
    for refusal in ("Cannot allocate memory", "Cannot allocate memory", "", ""):
        bench.bus.status.bursts_refused = refusal
        bench.run(0.2)
    assert [event.message for event in bench.events if "bursts" in event.message] == [
        "the kernel takes no bursts (Cannot allocate memory): the bridge sends them itself, less evenly",
        "the kernel sends the bursts again",
    ]


def test_a_server_whose_reply_fails_ends_nothing_and_keeps_no_other_waiting(bench: Bench) -> None:
    def fails(outcome: Outcome) -> None:
        told.append("failed")
        raise RuntimeError("a fault of a server")

    told: list[str] = []
    for reply in (fails, lambda outcome: told.append(outcome.code), fails):
        bench.view.submit(Request(PLC, "conveyor/fu1", ReadParameter("P102")), reply)
    bench.run(1.0)
    assert sorted(told) == ["failed", "failed", "ok"]
    assert bench.write(control_word=0x047E).ok
