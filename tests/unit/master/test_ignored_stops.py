"""A drive that does not do what its last stop asked: named, and its node stopped. On a virtual clock."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.canopen.frame import Frame
from bridge.canopen.nmt import NmtState
from bridge.command import Action, Event, EventKind, Identity, Role, Source
from bridge.command.audit import AuditEntry
from bridge.command.drive_link import NodeState
from bridge.command.stop_check.state import LastStop
from bridge.image import Quality
from bridge.master.ending import waits_for
from tests.support.bench import Bench, write_site

RPDO1, RPDO2 = 0x205, 0x305
TPDO1 = 0x185
NMT_STOP, NMT_RESET = b"\x02\x05", b"\x81\x05"
FU1 = "conveyor/fu1"
ENGINEER = Identity(Source.OPCUA, "eve", Role.ENGINEER)


class DeafBench(Bench):
    """Whose node no longer gets frames with these identifiers."""

    node_is_deaf_to: frozenset[int] = frozenset()

    def _from_master(self, frame: Frame) -> None:
        if frame.can_id in self.node_is_deaf_to:
            self.log.append(frame)
        else:
            super()._from_master(frame)


def a_bench(tmp_path: Path, **more: str) -> DeafBench:
    bench = DeafBench(write_site(tmp_path, **more))
    bench.run(1.0)
    return bench


def enabled(bench: DeafBench) -> DeafBench:
    bench.write(control_word=0x047E)
    bench.keep_writing(1.0, control_word=0x047F, setpoint_1=0x2000)
    assert bench.number(f"{FU1}/status/drive_status_word") & 0x7F == 0x37
    bench.log.clear()
    return bench


@pytest.fixture
def bench(tmp_path: Path) -> DeafBench:
    return enabled(a_bench(tmp_path))


def worst(bench: Bench) -> list[Event]:
    return [event for event in bench.events if event.severity == 1000]


def commands(bench: Bench) -> list[bytes]:
    return [frame.data for frame in bench.sent(0)]


def follows(bench: Bench) -> tuple[object, LastStop]:
    return bench.value(f"{FU1}/supervision/follows"), LastStop(bench.number(f"{FU1}/supervision/last_stop"))


def test_a_drive_that_follows(bench: DeafBench) -> None:
    assert follows(bench) == (True, LastStop.NONE)
    bench.ask(Action.STOP)
    assert follows(bench) == (True, LastStop.FORWARDED)
    bench.run(5.0)
    assert follows(bench) == (True, LastStop.FOLLOWED)
    assert not worst(bench)
    assert commands(bench) == []


def test_a_deaf_drive_is_named_and_its_node_stopped(bench: DeafBench) -> None:
    bench.node_is_deaf_to = frozenset({RPDO1})
    bench.ask(Action.DISABLE_VOLTAGE)
    began = bench.now
    bench.run(10.0)
    (event,) = worst(bench)
    assert event.kind is EventKind.WATCHDOG
    assert event.source == FU1
    assert "ignores its stop: " in event.message
    assert "0474h is sent" in event.message
    assert "operation enabled; NMT stop of conveyor, which stops fu2, too" in event.message
    assert event.time - began < 2.0
    assert commands(bench) == [NMT_STOP], "once"
    assert follows(bench) == (False, LastStop.IGNORED)
    assert bench.plant.nodes["conveyor"].drives[0].channel.link.node is NodeState.STOPPED
    assert str(bench.value("conveyor/node/boot_status")).startswith("stopped by the bridge: conveyor/fu1")


@pytest.mark.landing(2)
@pytest.mark.parametrize(("deaf", "code"), [(False, "ok"), (True, "ignored")])
def test_the_audit_log_has_the_end_of_a_stop(bench: DeafBench, deaf: bool, code: str) -> None:
    entries: list[AuditEntry] = []
    bench.plant.audit.tell_to(entries.append)
    if deaf:
        bench.node_is_deaf_to = frozenset({RPDO1})
    bench.ask(Action.DISABLE_VOLTAGE)
    bench.run(2.0)
    asked, ended = entries
    assert asked.action == "disable_voltage"
    assert asked.ending.forwarded
    assert (ended.action, ended.target, ended.ending.code) == ("stop_ended", FU1, code)


def test_the_node_stays_stopped_until_somebody_asks(bench: DeafBench) -> None:
    bench.node_is_deaf_to = frozenset({RPDO1})
    bench.ask(Action.DISABLE_VOLTAGE)
    bench.run(12.0)
    assert len(worst(bench)) == 1
    assert bench.value("conveyor/node/nmt_state") == NmtState.STOPPED
    bench.node_is_deaf_to = frozenset()
    bench.ask(Action.START_NODE, "conveyor", ENGINEER)
    bench.run(5.0)
    assert follows(bench) == (True, LastStop.FOLLOWED)
    assert len(worst(bench)) == 1


@pytest.mark.landing
def test_a_drive_that_is_still_deaf_is_named_again(bench: DeafBench) -> None:
    bench.node_is_deaf_to = frozenset({RPDO1})
    bench.ask(Action.DISABLE_VOLTAGE)
    bench.run(5.0)
    bench.ask(Action.START_NODE, "conveyor", ENGINEER)
    bench.run(5.0)
    assert len(worst(bench)) == 2
    assert commands(bench)[-1] == NMT_STOP


def test_found_enabled_at_the_start_of_the_bridge(bench: DeafBench, tmp_path: Path) -> None:
    """The node goes on as it was; a new bridge boots it."""
    new = DeafBench(write_site(tmp_path), present=False, node=bench.node)
    new.now, new.powered = bench.now, True
    new.node_is_deaf_to = frozenset({RPDO1})
    new.run(5.0)
    (event,) = worst(new)
    assert "0400h is sent" in event.message
    assert commands(new)[-1] == NMT_STOP


def test_somebody_else_enables_it(tmp_path: Path) -> None:
    bench = a_bench(tmp_path)
    bench.run(2.0)
    for _ in range(20):
        for word in (0x047E, 0x047F, 0x047F):
            bench.node.on_frame(Frame(RPDO1, word.to_bytes(2, "little") + bytes(6)), bench.now)
            bench.run(0.0004)
        bench.run(0.0087)
    bench.run(0.5)
    (event,) = worst(bench)
    assert "is enabled although nothing that enables was sent: 0400h is sent" in event.message
    assert commands(bench)[-1] == NMT_STOP


@pytest.mark.landing
def test_report_only(tmp_path: Path) -> None:
    bench = enabled(a_bench(tmp_path, drive='on_ignored_stop = "report"'))
    bench.node_is_deaf_to = frozenset({RPDO1})
    bench.ask(Action.DISABLE_VOLTAGE)
    bench.run(10.0)
    (event,) = worst(bench)
    assert event.message.endswith("reported only (on_ignored_stop)")
    assert commands(bench) == []
    assert follows(bench) == (False, LastStop.IGNORED)
    bench.node_is_deaf_to = frozenset()
    bench.run(5.0)
    assert follows(bench) == (True, LastStop.FOLLOWED)
    assert any("follows its stop after all" in event.message for event in bench.events)


def test_reset_node_and_then_stop(tmp_path: Path) -> None:
    bench = enabled(a_bench(tmp_path, drive='on_ignored_stop = "reset_node"'))
    bench.node_is_deaf_to = frozenset({RPDO1})
    bench.ask(Action.DISABLE_VOLTAGE)
    bench.run(2.0)
    assert NMT_RESET in commands(bench)
    assert NMT_STOP not in commands(bench)


def test_the_time_of_the_site_counts(tmp_path: Path) -> None:
    bench = enabled(a_bench(tmp_path, drive="ignored_stop_ms = 3000"))
    bench.node_is_deaf_to = frozenset({RPDO1})
    bench.ask(Action.DISABLE_VOLTAGE)
    bench.run(2.9)
    assert not worst(bench)
    bench.run(0.6)
    assert len(worst(bench)) == 1


@pytest.mark.landing
def test_a_node_that_is_lost_is_not_judged(bench: DeafBench) -> None:
    bench.node_is_deaf_to = frozenset({RPDO1})
    bench.cut = True
    bench.ask(Action.DISABLE_VOLTAGE)
    bench.run(10.0)
    assert not worst(bench)
    reading = bench.plant.image.read(f"{FU1}/supervision/follows")
    assert reading.value is True
    assert reading.quality is Quality.DEAD
    bench.cut = False
    bench.run(15.0)
    assert len(worst(bench)) == 1, "back, and still enabled"


@pytest.mark.landing
def test_a_bridge_that_hung_accuses_nobody(bench: DeafBench) -> None:
    for seconds in (0.05, 0.15, 0.4, 3.0):
        bench.hang(seconds)
        bench.run(5.0)
    assert not worst(bench)


def test_the_end_waits_for_ramps_and_names_who_does_not_follow(bench: DeafBench) -> None:
    bench.plant.close(bench.now)
    bench.run(0.1)
    assert waits_for(bench.plant), "on its ramp"
    bench.run(3.0)
    assert not waits_for(bench.plant)
    ending = bench.end()
    assert ending.is_good
    assert ending.lines == ["all drives are stopped"]


def test_the_end_names_a_deaf_drive(bench: DeafBench) -> None:
    bench.node_is_deaf_to = frozenset({RPDO1})
    bench.plant.close(bench.now)
    bench.run(5.0)
    assert waits_for(bench.plant)
    ending = bench.end()
    bench.run(0.1)
    assert ending.lines == [
        "NOT STOPPED: conveyor/fu1 did not follow the stop; NMT stop was sent to conveyor",
        "1 of 2 drives are stopped",
    ]
    assert commands(bench)[-1] == NMT_STOP


def test_the_end_knows_nothing_of_a_drive_that_is_not_heard(bench: DeafBench) -> None:
    bench.cut = True
    bench.run(5.0)
    bench.plant.close(bench.now)
    bench.run(0.1)
    assert not waits_for(bench.plant)
    assert bench.end().lines == [
        "not heard, may be running or not: conveyor/fu1, conveyor/fu2",
        "0 of 2 drives are stopped",
    ]
