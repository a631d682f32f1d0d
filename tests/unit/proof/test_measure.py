"""The judge of the fault injection: it sees a stop that was late, and does not see one that was none."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, cast

import pytest

from tests.proof.drives import ALL, Drive
from tests.proof.families import NORD
from tests.proof.measure import (
    Sample,
    bus_stop,
    drive_stop,
    handed_on,
    held,
    keeps_setpoint,
    last_turn_end,
    longest_turn,
    spoken_to,
    stopping,
    was_enabled,
    was_moving,
)
from tests.proof.rig import Rig
from tests.proof.witness import Run

FU1 = next(drive for drive in ALL if drive.path == "conveyor/fu1")
PUMP = next(drive for drive in ALL if drive.path == "pump_modbus/drive")
ENABLE, STOP = bytes.fromhex("7f04002000000000"), bytes.fromhex("7e04000000000000")
RUNNING, READY = bytes.fromhex("3704002000000000"), bytes.fromhex("3104000000000000")
BRAKING = bytes.fromhex("3704001000000000")


@dataclass
class Seen:
    """A witness that tells what it was given."""

    frames: dict[int, list[Run]] = field(default_factory=dict[int, list[Run]])

    def runs(self, can_id: int, since: float) -> list[Run]:
        return [run for run in self.frames.get(can_id, []) if run.last >= since]


@dataclass
class Scene:
    """Records of a round, up to ``time``."""

    told: Seen = field(default_factory=Seen)
    said: Seen = field(default_factory=Seen)
    heard: Seen = field(default_factory=Seen)
    time: float = 20.0

    def now(self) -> float:
        return self.time


def scene(*, told: list[Run] | None = None, said: list[Run] | None = None, drive: Drive = FU1) -> Any:
    return cast(Rig, Scene(Seen({drive.rpdo: told or []}), Seen({drive.tpdo: said or []})))


def test_the_stop_on_the_bus_is_the_first_word_that_does_not_enable() -> None:
    last = Run(9.0, 10.4, ENABLE)
    found = bus_stop(scene(told=[last, Run(10.45, 11.0, STOP)]), FU1, 10.0, silent=False)
    assert found == (10.45, last)


def test_a_bus_that_goes_on_enabling_has_not_stopped() -> None:
    assert bus_stop(scene(told=[Run(9.0, 20.0, ENABLE)]), FU1, 10.0, silent=False) is None
    assert bus_stop(scene(told=[Run(9.0, 20.0, ENABLE)]), FU1, 10.0, silent=True) is None


def test_a_drive_that_stops_by_silence_is_stopped_when_it_is_left_alone_beside_any_fault() -> None:
    silenced = replace(FU1, reaction="silence")
    last = Run(9.0, 10.1, ENABLE)
    left = scene(told=[last, Run(11.5, 12.0, STOP)])
    assert bus_stop(left, silenced, 10.0, silent=False) == (10.1, last)
    assert bus_stop(left, FU1, 10.0, silent=False) == (11.5, last), "no other drive is"
    at_once = scene(told=[last, Run(10.15, 12.0, STOP)])
    assert bus_stop(at_once, silenced, 10.0, silent=False) == (10.15, last)


def test_a_gap_before_the_fault_is_not_its_silence() -> None:
    last = Run(9.9, 10.3, ENABLE)
    found = bus_stop(scene(told=[Run(9.0, 9.2, ENABLE), last]), FU1, 10.0, silent=True)
    assert found == (10.3, last)


def test_a_stop_before_the_fault_is_not_its_effect() -> None:
    told = [Run(8.5, 9.0, ENABLE), Run(9.1, 9.2, STOP), Run(9.3, 20.0, ENABLE)]
    assert bus_stop(scene(told=told), FU1, 10.0, silent=False) is None


def test_where_nobody_sends_the_last_enabling_word_counts() -> None:
    last = Run(9.0, 10.03, ENABLE)
    assert bus_stop(scene(told=[last]), FU1, 10.0, silent=True) == (10.03, last)
    # It speaks again later, and stops: that ends nothing that has not ended before.
    assert bus_stop(scene(told=[last, Run(12.0, 12.5, STOP)]), FU1, 10.0, silent=True) == (10.03, last)


def test_one_that_enables_again_after_a_short_gap_was_not_silent() -> None:
    told = [Run(9.0, 10.0, ENABLE), Run(10.1, 19.99, replace_setpoint(ENABLE))]
    assert bus_stop(scene(told=told), FU1, 10.0, silent=True) is None


def replace_setpoint(data: bytes) -> bytes:
    return data[:2] + b"\x01\x20" + data[4:]


@pytest.mark.parametrize("word", [READY, BRAKING])
def test_a_drive_stops_when_it_says_so_or_gets_slower(word: bytes) -> None:
    said = [Run(9.0, 10.2, RUNNING), Run(10.3, 11.0, word)]
    assert drive_stop(scene(said=said), FU1, 10.0) == 10.3


def test_a_drive_that_runs_on_has_not_stopped() -> None:
    assert drive_stop(scene(said=[Run(9.0, 20.0, RUNNING)]), FU1, 10.0) is None


def test_an_emergency_is_a_stop_where_it_is_about_this_drive_alone() -> None:
    assert PUMP.emcy
    running = bytes.fromhex("0005002000000000")
    rig = scene(said=[Run(9.0, 12.0, running)], drive=PUMP)
    before, after = b"\x10\x81" + bytes(6), b"\x00\x81" + bytes(6)
    rig.said.frames[PUMP.emcy] = [Run(9.0, 9.0, before), Run(10.1, 10.1, after)]
    assert drive_stop(rig, PUMP, 10.0) == 10.1


def test_moving_is_enabled_on_the_bus_and_by_its_own_word() -> None:
    told, said = [Run(9.0, 12.0, ENABLE)], [Run(9.0, 12.0, RUNNING)]
    assert was_moving(scene(told=told, said=said), FU1, 10.0)
    assert not was_moving(scene(told=told, said=[Run(9.0, 12.0, READY)]), FU1, 10.0)
    assert not was_moving(scene(told=[Run(9.0, 12.0, STOP)], said=said), FU1, 10.0)


def test_an_enabling_word_or_a_turn_after_the_stop_is_a_restart() -> None:
    stopped = [Run(9.0, 10.2, RUNNING), Run(10.3, 20.0, READY)]
    told = [Run(9.0, 10.4, ENABLE), Run(10.5, 20.0, STOP)]
    assert not was_enabled(scene(told=told, said=stopped), FU1, 10.45, 10.3)
    again = [*told, Run(11.0, 11.0, ENABLE)]
    assert was_enabled(scene(told=again, said=stopped), FU1, 10.45, 10.3)
    turns = [*stopped, Run(11.0, 11.0, RUNNING)]
    assert was_enabled(scene(told=told, said=turns), FU1, 10.45, 10.3)


FAN = next(drive for drive in ALL if drive.setpoint_rpdo)
RUN, QUICK_STOP = bytes.fromhex("7f00"), bytes.fromhex("0300")


def test_where_the_setpoint_has_an_rpdo_of_its_own_the_telegram_is_told_by_that() -> None:
    rig = scene(told=[Run(9.0, 12.0, RUN)], drive=FAN)
    last = Run(11.0, 11.9, (FAN.family.setpoint + 7).to_bytes(2, "little"))
    rig.told.frames[FAN.setpoint_rpdo] = [Run(9.0, 10.9, b"\xe8\x03"), last, Run(12.1, 13.0, bytes(2))]
    found = handed_on(rig, FAN, Run(9.0, 12.0, RUN))
    assert found == last
    assert FAN.telegram(found.data) == 7


def test_a_setpoint_that_goes_on_after_the_stop_is_seen() -> None:
    rig = scene(told=[Run(9.0, 12.0, RUN), Run(12.1, 13.0, QUICK_STOP)], drive=FAN)
    rig.told.frames[FAN.setpoint_rpdo] = [Run(9.0, 12.0, b"\xe8\x03"), Run(12.1, 13.0, bytes(2))]
    assert not keeps_setpoint(rig, FAN, 12.1)
    rig.told.frames[FAN.setpoint_rpdo] = [Run(9.0, 13.0, b"\xe8\x03")]
    assert keeps_setpoint(rig, FAN, 12.1)
    assert keeps_setpoint(rig, FAN, 12.0)


def test_a_setpoint_with_the_last_enabling_word_goes_before_the_stop() -> None:
    rig = scene(told=[Run(9.0, 12.0, RUN), Run(12.1, 13.0, QUICK_STOP)], drive=FAN)
    rig.told.frames[FAN.setpoint_rpdo] = [Run(9.0, 12.001, b"\xe8\x03"), Run(12.1, 13.0, bytes(2))]
    assert not keeps_setpoint(rig, FAN, 12.0)


def test_a_setpoint_falls_silent_in_the_period_of_the_last_enabling_word() -> None:
    rig = scene(told=[Run(9.0, 12.0, RUN)], drive=FAN)
    rig.told.frames[FAN.setpoint_rpdo] = [Run(9.0, 12.09, b"\xe8\x03")]
    assert not keeps_setpoint(rig, FAN, 12.0)
    rig.told.frames[FAN.setpoint_rpdo] = [Run(9.0, 12.19, b"\xe8\x03")]
    assert keeps_setpoint(rig, FAN, 12.0)


def test_the_reaction_is_the_first_word_that_does_not_enable() -> None:
    rig = scene(told=[Run(9.0, 12.0, ENABLE), Run(12.1, 13.0, bytes.fromhex("7d04000000000000"))])
    assert stopping(rig, FU1, 12.1) == bytes.fromhex("7d04000000000000")
    assert FU1.reaction == "disable_voltage"
    assert FU1.reacts(bytes.fromhex("7d04000000000000"))
    assert not FU1.reacts(STOP), "a ramp"
    assert not FU1.reacts(bytes.fromhex("7d04010000000000")), "a setpoint"


def test_a_drive_that_is_to_hold_goes_on_all_the_time() -> None:
    told, said = [Run(9.0, 19.9, ENABLE)], [Run(9.0, 19.9, RUNNING)]
    assert held(scene(told=told, said=said), FU1, 10.0) == ""
    stopped = scene(told=[*told, Run(19.95, 20.0, STOP)], said=[*said, Run(19.97, 20.0, READY)])
    assert held(stopped, FU1, 10.0) == "the bus has stopped it"
    assert held(stopped, FU1, 10.0, 19.9) == "", "what comes after that does not count"
    assert held(scene(told=[Run(9.0, 19.0, ENABLE)], said=said), FU1, 10.0) == "the bus is silent"
    assert held(scene(told=told, said=[*said, Run(19.95, 20.0, READY)]), FU1, 10.0) == "it has stopped"


SAMPLE = Sample(
    fault="owner killed",
    family=NORD.name,
    protocol="modbus",
    drive="conveyor/fu1",
    bus_ms=500.0,
    bus_bound_ms=570.0,
    drive_ms=620.0,
    drive_bound_ms=720.0,
    way_ms=3.0,
    way_bound_ms=250.0,
    paused_ms=0.0,
    waited_ms=0.0,
    noise_ms=0.0,
)


@pytest.mark.parametrize(
    ("change", "verdict"),
    [
        ({}, "ok"),
        ({"bus_ms": 570.1}, "void"),
        ({"bus_ms": 572.1}, "failed"),
        ({"drive_ms": 723.0}, "failed"),
        ({"bus_ms": 600.0, "paused_ms": 40.0}, "void"),
        ({"bus_ms": 600.0, "paused_ms": 29.0}, "failed"),
        ({"bus_ms": 600.0, "waited_ms": 30.0}, "void"),
        ({"bus_ms": 600.0, "waited_ms": 29.0}, "failed"),
        ({"bus_ms": 600.0, "noise_ms": 150.0}, "ok"),
        ({"wrong": "it is to hold"}, "failed"),
        ({"way_ms": 253.0}, "failed"),
        ({"sent_ms": 823.0, "sent_bound_ms": 820.0}, "failed"),
        ({"way_ms": 260.0, "waited_ms": 10.0}, "void"),
        ({"drive_ms": None, "drive_bound_ms": None}, "ok"),
    ],
)
def test_what_exceeds_its_bound_by_more_than_the_machine_stood_still_has_failed(
    change: dict[str, Any], verdict: str
) -> None:
    assert replace(SAMPLE, **change).verdict == verdict


def test_a_drive_that_silence_stops_is_not_spoken_to() -> None:
    enabled = bytes.fromhex("09000d2000000000")
    rig = scene(told=[Run(9.0, 12.0, enabled), Run(14.0, 15.0, bytes(8))], drive=PUMP)
    rig.heard.frames[0x700 + PUMP.node_id] = [Run(0.0, 15.0, b"\x05")]
    assert spoken_to(rig, PUMP, 12.1, 12.5) == bytes(8)
    rig.heard.frames[0x700 + PUMP.node_id] = [Run(0.0, 14.1, b"\x05"), Run(14.2, 15.0, b"\x7f")]
    assert spoken_to(rig, PUMP, 12.1, 12.5) is None, "a boot-up of its node"
    assert spoken_to(rig, PUMP, 12.1, 14.1) == bytes(8), "before it had stopped by itself"


def test_a_drive_that_is_brought_back_has_turned_as_long_as_it_did_at_a_stretch() -> None:
    slow = bytes.fromhex("3704640000000000")
    said = [Run(9.0, 10.1, RUNNING), Run(10.2, 10.3, READY), Run(10.4, 10.7, BRAKING), Run(10.9, 11.0, slow)]
    assert longest_turn(scene(said=said), FU1, 10.0) == pytest.approx(0.5), "less than a fiftieth is none"
    assert longest_turn(scene(said=said), FU1, 11.0) == pytest.approx(0.0)
    assert longest_turn(scene(said=[*said, Run(12.0, 19.9, RUNNING)]), FU1, 10.0) == pytest.approx(8.0)


def test_a_node_that_is_not_in_operation_turns_nothing() -> None:
    rig = scene(said=[Run(9.0, 10.1, RUNNING), Run(11.0, 11.2, RUNNING), Run(11.3, 20.0, READY)])
    rig.said.frames[0x700 + FU1.node_id] = [Run(9.0, 10.2, b"\x05"), Run(10.3, 10.4, b"\x04")]
    assert longest_turn(rig, FU1, 10.0) == pytest.approx(0.3), "it is cut off while it turns"


def test_beside_one_that_speaks_on_the_end_of_the_last_turn_counts() -> None:
    said = [Run(9.0, 10.1, RUNNING), Run(10.2, 10.3, READY), Run(10.4, 10.7, RUNNING), Run(10.8, 20.0, READY)]
    assert last_turn_end(scene(said=said), FU1, 10.0) == pytest.approx(10.8)
    assert last_turn_end(scene(said=said[:2]), FU1, 10.0) == pytest.approx(10.2)
    rig = scene(said=said[:3])
    assert last_turn_end(rig, FU1, 10.0) == rig.now(), "it turns still"
