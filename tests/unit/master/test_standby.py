"""A bridge listens before it acts, gives way to one that is there, and takes over when that is gone."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridge.canopen.frame import Frame
from bridge.command import Action, Code
from bridge.config import BusTable
from bridge.master.standby import BusRole, Standby, listen_s
from tests.support.bench import Bench, write_site

HEARTBEAT, ENABLE = Frame(0x77F, b"\x05"), Frame(0x205, bytes.fromhex("7f04002000000000"))
FOREIGN_TIME = Frame(0x100, bytes(6))
FOREIGN_WRITE = Frame(0x605, bytes.fromhex("2b17100064000000"))
FOREIGN_SYNC, FOREIGN_NMT = Frame(0x080), Frame(0x000, b"\x01\x05")


def listening(tmp_path: Path, **keys: str) -> Bench:
    return Bench(write_site(tmp_path, **keys), listens=True)


def from_master(bench: Bench) -> list[Frame]:
    """What was sent that no node sends."""
    node = {0x185, 0x285, 0x705, 0x585, 0x085}
    return [frame for frame in bench.log if frame.can_id not in node]


@pytest.mark.parametrize(
    ("heartbeat_ms", "rpdo_ms", "expected_s"),
    [(100, 10, 0.2), (50, 10, 0.2), (0, 20, 0.2), (300, 10, 0.6), (100, 400, 0.8), (5000, 10, 1.0)],
)
def test_it_listens_for_two_periods_within_limits(heartbeat_ms: int, rpdo_ms: int, expected_s: float) -> None:
    table = BusTable(name="can0", interface="virtual", heartbeat_ms=heartbeat_ms, rpdo_period_ms=rpdo_ms)
    assert listen_s(table) == pytest.approx(expected_s)


def test_nothing_is_sent_while_it_listens_and_then_it_begins_stopped(tmp_path: Path) -> None:
    bench = listening(tmp_path, bus='reset_at_start = "node"\ntime_period_s = 1')
    bench.run(0.199)
    assert from_master(bench) == []
    bench.run(0.01)
    assert from_master(bench)[0][:2] == (0x77F, b"\0")
    bench.run(3.0)
    assert str(bench.value("conveyor/node/boot_status")).startswith("ok")
    assert bench.value("bus/can0/passive") is False


@pytest.mark.parametrize("sign", [HEARTBEAT, ENABLE, Frame(0x77F, b"\0"), Frame(0x305, bytes(8))])
def test_one_that_hears_another_stays_passive_and_says_so(tmp_path: Path, sign: Frame) -> None:
    bench = listening(tmp_path, bus="time_period_s = 1")
    for _ in range(40):
        bench.receive(sign, FOREIGN_NMT, FOREIGN_SYNC, FOREIGN_TIME, FOREIGN_WRITE)
        bench.run(0.1)
    assert from_master(bench) == []
    assert bench.value("bus/can0/passive") is True
    assert bench.value("bus/can0/intruders") == 0
    assert bench.value("bus/can0/second_master") is False
    assert bench.value("conveyor/node/boot_status") == "passive: another bridge is in charge of can0"
    [event] = [event for event in bench.events if "another bridge is in charge" in event.message]
    assert f"({sign.can_id:03X}h)" in event.message and event.severity >= 700
    assert bench.write(control_word=0x047E).ok
    refused = bench.ask(Action.RESET, "conveyor")
    assert refused.code is Code.NOT_READY
    bench.ask(Action.STOP_NODE, "bus/can0")
    bench.run(0.01)
    assert from_master(bench) == []


def test_its_time_begins_when_it_can_hear(tmp_path: Path) -> None:
    """On a slow machine the first round, at whose end the bus is told what to let in, takes longer."""
    bench = listening(tmp_path)
    watch = bench.bus.watch

    def watch_late(can_ids: frozenset[int]) -> None:
        bench.now += 1.0 if not bench.bus.ours else 0.0
        watch(can_ids)

    bench.bus.watch = watch_late
    for _ in range(4):
        bench.run(0.1)
        bench.receive(HEARTBEAT)
    bench.run(0.001)
    assert from_master(bench) == []
    assert bench.value("bus/can0/passive") is True


def test_sync_alone_is_no_other_bridge(tmp_path: Path) -> None:
    bench = listening(tmp_path)
    for _ in range(30):
        bench.receive(FOREIGN_SYNC)
        bench.run(0.01)
    assert bench.value("bus/can0/passive") is False


def test_it_takes_over_after_the_silence_and_everything_is_stopped(tmp_path: Path) -> None:
    bench = listening(tmp_path)
    bench.run(0.1)
    bench.receive(HEARTBEAT)
    bench.write(control_word=0x047E)
    bench.write(control_word=0x047F)
    bench.run(0.59)
    assert from_master(bench) == []
    bench.run(0.02)
    assert bench.value("bus/can0/passive") is False
    assert any("takes over" in event.message for event in bench.events)
    bench.run(2.0)
    assert str(bench.value("conveyor/node/boot_status")).startswith("ok")
    commands = [frame.data[:2] for frame in bench.sent(0x205)]
    assert commands and all(word == bytes.fromhex("7c04") or not word[0] & 1 for word in commands)
    bench.write(control_word=0x047F)
    bench.run(0.1)
    assert bench.value("conveyor/fu1/supervision/restart_interlock") is True


def test_one_that_has_just_begun_gives_way_and_sends_nothing_more(tmp_path: Path) -> None:
    bench = listening(tmp_path)
    bench.run(0.25)
    assert from_master(bench)
    bench.receive(HEARTBEAT)
    bench.run(0.0)
    begin = len(from_master(bench))
    bench.run(0.5)
    assert from_master(bench)[begin:] == []
    assert bench.value("bus/can0/passive") is True
    bench.run(3.0)
    assert str(bench.value("conveyor/node/boot_status")).startswith("ok")


def test_one_that_has_acted_for_longer_stays_and_calls_it_an_intruder(tmp_path: Path) -> None:
    bench = listening(tmp_path)
    bench.run(3.0)
    bench.receive(HEARTBEAT)
    bench.run(0.2)
    assert bench.value("bus/can0/passive") is False
    assert bench.value("bus/can0/intruders") == 1


def test_one_that_hung_gives_way_to_who_took_over_meanwhile(tmp_path: Path) -> None:
    bench = listening(tmp_path)
    bench.run(3.0)
    bench.hang(0.8)
    bench.run(0.01)
    bench.receive(HEARTBEAT)
    bench.run(0.1)
    assert bench.value("bus/can0/passive") is True


def test_a_bus_that_comes_back_is_not_listened_to_first(tmp_path: Path) -> None:
    """Stopped words must not be late; but whoever took over meanwhile is given way to."""
    bench = listening(tmp_path)
    bench.run(3.0)
    bench.network.bus_is_gone(bench.now)
    bench.run(0.5)
    bench.network.bus_is_back(bench.now)
    begin = bench.now
    bench.run(0.02)
    assert [frame for frame in from_master(bench) if frame.time >= begin]
    bench.receive(HEARTBEAT)
    bench.run(0.1)
    assert bench.value("bus/can0/passive") is True


def test_silence_is_not_counted_while_the_bus_is_down(tmp_path: Path) -> None:
    bench = listening(tmp_path)
    bench.receive(HEARTBEAT)
    bench.run(0.1)
    bench.receive(HEARTBEAT)
    bench.run(0.0)
    bench.network.bus_is_gone(bench.now)
    bench.run(5.0)
    assert bench.value("bus/can0/passive") is True
    bench.network.bus_is_back(bench.now)
    bench.run(0.59)
    assert bench.value("bus/can0/passive") is True
    bench.run(0.2)
    assert bench.value("bus/can0/passive") is False


@settings(max_examples=200, deadline=None)
@given(st.floats(0, 1), st.floats(0, 1), st.floats(0, 0.5))
def test_of_two_bridges_one_acts_in_the_end(first: float, second: float, apart_s: float) -> None:
    """Each hears the other's heartbeat within a period; the later one may begin in the same moment."""
    sides = [Standby(0.2, lambda: first), Standby(0.2, lambda: second)]
    begins, beats = [1000.0, 1000.0 + apart_s], [0.0, 0.0]
    now, both = 1000.0, 0.0
    while now < 1006.0:
        for here, there, number in ((*sides, 0), (*reversed(sides), 1)):
            if now < begins[number]:
                continue
            if here.on_time(now):
                beats[number] = now
            if here.acts and now >= beats[number]:
                beats[number] = now + 0.1
                if now >= begins[1 - number]:
                    there.heard(now)
        both += 0.005 * all(side.acts for side in sides)
        now += 0.005
    assert both <= 0.2
    acting = [side for side in sides if side.acts]
    assert len(acting) == 1 or abs(first - second) * 0.6 < 0.01
    assert all(side.part is not BusRole.LISTENING for side in sides)
