"""Somebody else sends what only the bridge may send: told in words, counted, and the node is stopped."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.canopen.frame import Frame
from bridge.command import Action, Event, EventKind, Identity, Role, Source
from bridge.master.answers import SHARE, answer_bits
from tests.support.bench import Bench, write_site
from tests.support.quick import Quick, quick_site

ENGINEER = Identity(Source.LOCAL, "test", Role.ENGINEER)
ENABLE, STOP = bytes.fromhex("7f04002000000000"), bytes.fromhex("7e04000000000000")
READ, WRITE = bytes.fromhex("4000100000000000"), bytes.fromhex("2b17100064000000")
SEGMENT, ABORT = bytes.fromhex("0011223344556677"), bytes.fromhex("8017100000000408")
NMT_STOP = b"\x02"


def running(tmp_path: Path, bus: str = "", node: str = "", drive: str = "") -> Bench:
    """fu1 runs, commanded by its owner."""
    bench = Bench(write_site(tmp_path, bus=bus, node=node, drive=drive))
    bench.run(3.0)
    for word in (0x047E, 0x047F):
        bench.keep_writing(0.2, control_word=word, setpoint_1=0x2000)
    assert bench.value("conveyor/fu1/status/state") == 4
    bench.events.clear()
    return bench


def told(bench: Bench) -> list[Event]:
    return [event for event in bench.events if event.kind is EventKind.INTRUDER]


def nmt(bench: Bench, since: float = 0.0) -> list[bytes]:
    return [frame.data for frame in bench.sent(0x000) if frame.time >= since]


# RPDOs


def test_an_enabling_rpdo_of_another_is_told_and_the_node_is_stopped(tmp_path: Path) -> None:
    bench = running(tmp_path)
    begin = bench.now
    bench.receive(Frame(0x205, ENABLE))
    bench.keep_writing(0.15, control_word=0x047F)
    [event] = told(bench)
    assert event.severity == 900 and event.source == "can0"
    assert "RPDO of conveyor/fu1 (205h)" in event.message
    assert "control word 047Fh, which enables" in event.message
    assert "NMT stop of conveyor" in event.message
    assert nmt(bench, begin) == [NMT_STOP + b"\x05"]
    before_nmt = [frame for frame in bench.log if begin <= frame.time and frame.can_id in (0x205, 0x305, 0)]
    stopped = next(n for n, frame in enumerate(before_nmt) if frame.can_id == 0)
    assert not before_nmt[stopped - 2].data[0] & 1 and not before_nmt[stopped - 1].data[0] & 1
    assert bench.value("bus/can0/intruders") == 1
    assert "RPDO of conveyor/fu1" in str(bench.value("bus/can0/last_intruder"))
    assert str(bench.value("conveyor/node/boot_status")).startswith(
        "stopped by the bridge, because of an intr"
    )


def test_a_frame_that_was_there_before_the_node_has_started_does_not_stop_it(tmp_path: Path) -> None:
    """What others send comes by a socket of its own, and later than the node's boot-up message."""
    bench = running(tmp_path)
    bench.receive(Frame(0x205, ENABLE))
    bench.run(0.5)
    late = Frame(0x205, ENABLE, bench.now)
    bench.powered = False
    bench.power_on()
    bench.run(0.005)
    bench.bus.foreign.append(late)
    bench.run(5.0)
    assert bench.value("bus/can0/intruders") == 2
    assert bench.value("conveyor/node/nmt_state") == 5


def test_what_came_with_its_boot_up_message_is_before_it(tmp_path: Path) -> None:
    """A late bridge cannot tell which was first. So it is taken in with the message: what it finds later has
    come later."""
    bench = running(tmp_path)
    bench.receive(Frame(0x205, ENABLE))
    bench.run(0.5)
    bench.bus.is_looking = False
    bench.bus.foreign.append(Frame(0x205, ENABLE, bench.now + 0.004))
    bench.powered = False
    bench.power_on()
    bench.run(0.005)
    bench.bus.is_looking = True
    bench.run(5.0)
    assert bench.value("bus/can0/intruders") == 2
    assert bench.value("conveyor/node/nmt_state") == 5
    bench.receive(Frame(0x205, ENABLE))
    bench.run(0.5)
    assert bench.value("conveyor/node/nmt_state") == 4


def test_each_stop_of_a_node_is_told(tmp_path: Path) -> None:
    """Also where the same intruder was told a moment ago, and the node has started since."""
    bench = running(tmp_path)
    bench.receive(Frame(0x205, ENABLE))
    bench.run(0.5)
    bench.powered = False
    bench.power_on()
    bench.run(3.0)
    assert bench.value("conveyor/node/nmt_state") == 5
    bench.receive(Frame(0x205, ENABLE), Frame(0x205, ENABLE))
    bench.run(0.5)
    assert bench.value("conveyor/node/nmt_state") == 4
    assert ["NMT stop of conveyor" in event.message for event in told(bench)] == [True, True]


def test_it_is_not_started_again_by_itself_but_by_command(tmp_path: Path) -> None:
    bench = running(tmp_path)
    bench.receive(Frame(0x205, ENABLE))
    bench.keep_writing(5.0, control_word=0x047F)
    assert bench.value("conveyor/node/nmt_state") == 4
    assert bench.ask(Action.START_NODE, "conveyor", ENGINEER).ok
    bench.keep_writing(3.0, control_word=0x047F)
    assert bench.value("conveyor/node/nmt_state") == 5
    assert bench.value("conveyor/fu1/status/state") != 4, "the restart is interlocked"


@pytest.mark.landing(4)
@pytest.mark.parametrize("can_id", [0x205, 0x305, 0x405, 0x505])
def test_every_rpdo_of_the_node_is_watched_also_of_drives_that_the_site_leaves_out(
    tmp_path: Path, can_id: int
) -> None:
    bench = running(tmp_path)
    bench.receive(Frame(can_id, STOP))
    bench.run(0.15)
    [event] = told(bench)
    assert f"({can_id:03X}h)" in event.message and "does not enable" in event.message
    assert nmt(bench)[-1] == NMT_STOP + b"\x05"


def test_it_is_watched_where_the_site_file_puts_it_before_the_node_is_there(tmp_path: Path) -> None:
    site = write_site(tmp_path, drive="rpdo = { cob_id = 0x385 }")
    bench = Bench(site, present=False)
    bench.run(1.0)
    bench.receive(Frame(0x385, ENABLE), Frame(0x205, ENABLE))
    bench.run(0.2)
    assert bench.value("bus/can0/intruders") == 2


def test_one_who_goes_on_is_counted_told_now_and_then_and_answered_within_a_share_of_the_bus(
    tmp_path: Path,
) -> None:
    bench = running(tmp_path)
    begin = bench.now
    for _ in range(1200):
        bench.receive(Frame(0x205, ENABLE))
        bench.run(0.01)
    assert bench.number("bus/can0/intruders") >= 1190
    assert len(told(bench)) == 2 and "frames since the last message" in told(bench)[1].message
    answers = len(nmt(bench, begin))
    assert 600 <= answers <= 1200
    assert answers * answer_bits(4) <= (12 * SHARE + 0.05) * 250_000


def test_that_it_enables_now_is_told_at_once(tmp_path: Path) -> None:
    bench = running(tmp_path, bus='on_intruder = "report"')
    bench.receive(Frame(0x205, STOP))
    bench.run(0.1)
    bench.receive(Frame(0x205, ENABLE))
    bench.run(0.1)
    assert ["which enables" in event.message for event in told(bench)] == [False, True]


def test_with_report_it_is_only_told(tmp_path: Path) -> None:
    bench = running(tmp_path, bus='on_intruder = "report"')
    begin = bench.now
    bench.receive(Frame(0x205, ENABLE), Frame(0x77F, b"\x7f"), Frame(0x080), Frame(0x605, WRITE))
    bench.keep_writing(1.0, control_word=0x047F)
    assert len(told(bench)) == 4 and bench.value("bus/can0/intruders") == 4
    assert nmt(bench, begin) == []
    assert bench.value("conveyor/fu1/status/state") == 4


def test_a_short_frame_is_one_too(tmp_path: Path) -> None:
    bench = running(tmp_path)
    bench.receive(Frame(0x205, b"\x7f"), Frame(0x205))
    bench.run(0.2)
    assert bench.value("bus/can0/intruders") == 2


# several nodes


def crowd(tmp_path: Path, bus: str = "") -> Quick:
    quick = Quick(quick_site(tmp_path, ["", "", ""], bus=bus))
    quick.run(3.0)
    assert quick.states() == "ooo"
    quick.events.clear()
    return quick


def test_only_the_node_that_it_is_about_is_stopped(tmp_path: Path) -> None:
    quick = crowd(tmp_path)
    quick.receive(Frame(0x202, ENABLE))
    quick.run(0.1)
    assert quick.states() == "oso"


@pytest.mark.landing(4)
@pytest.mark.parametrize(
    "frame", [Frame(0x202, ENABLE), Frame(0x602, WRITE), Frame(0x080), Frame(0x100, bytes(6))]
)
def test_stop_all_stops_them_all_with_one_frame(tmp_path: Path, frame: Frame) -> None:
    quick = crowd(tmp_path, 'on_intruder = "stop_all"\ntime_period_s = 60')
    begin = quick.now
    quick.network._intruders.routes(quick.network._routes)
    quick.receive(frame)
    quick.run(0.1)
    assert quick.states() == "sss"
    assert quick.nmt(begin) == [(2, 0)]


def test_a_second_bridge_has_all_nodes_stopped(tmp_path: Path) -> None:
    quick = crowd(tmp_path)
    quick.receive(Frame(0x77F, b"\x05"))
    quick.run(0.1)
    assert quick.states() == "sss"


def test_a_bus_where_a_node_was_stopped_does_not_start_it_when_it_comes_back(tmp_path: Path) -> None:
    quick = crowd(tmp_path)
    quick.receive(Frame(0x202, ENABLE))
    quick.run(0.1)
    quick.network.bus_is_gone(quick.now)
    quick.network.bus_is_back(quick.now)
    quick.run(3.0)
    assert quick.states() == "oso"


# SYNC and TIME


def test_a_foreign_sync_stops_who_goes_by_it(tmp_path: Path) -> None:
    bench = running(tmp_path, drive="rpdo = { transmission_type = 1 }")
    bench.receive(Frame(0x080))
    bench.run(0.2)
    assert "SYNC (080h)" in told(bench)[0].message
    assert nmt(bench)[-1] == NMT_STOP + b"\x05"


def test_who_does_not_go_by_sync_is_left_alone(tmp_path: Path) -> None:
    quick = crowd(tmp_path)
    quick.receive(Frame(0x080))
    quick.run(0.1)
    assert quick.states() == "ooo"
    assert quick.told("SYNC (080h)")


@pytest.mark.parametrize(
    ("keys", "frame"), [("sync_period_ms = 0", Frame(0x080)), ("", Frame(0x100, bytes(6)))]
)
def test_where_the_bridge_sends_none_another_may(tmp_path: Path, keys: str, frame: Frame) -> None:
    quick = crowd(tmp_path, keys)
    quick.receive(frame)
    quick.run(0.1)
    assert quick.value("bus/can0/intruders") == 0


def test_a_foreign_time_is_told(tmp_path: Path) -> None:
    bench = running(tmp_path, bus="time_period_s = 60")
    bench.receive(Frame(0x100, bytes(6)))
    bench.keep_writing(0.2, control_word=0x047F)
    assert "TIME (100h)" in told(bench)[0].message
    assert bench.value("conveyor/fu1/status/state") == 4


# SDO


@pytest.mark.landing(5)
@pytest.mark.parametrize("data", [READ, ABORT, b"", bytes(3), b"\xff" * 8])
def test_who_only_reads_is_told_and_stops_nobody(tmp_path: Path, data: bytes) -> None:
    quick = crowd(tmp_path)
    quick.receive(Frame(0x602, data))
    quick.run(0.15)
    assert quick.states() == "ooo"
    [event] = [event for event in quick.events if event.kind is EventKind.INTRUDER]
    assert event.severity == 500 and "SDO request to n2 (602h)" in event.message
    assert quick.value("bus/can0/intruders") == 1


@pytest.mark.parametrize(
    "data", [WRITE, bytes.fromhex("2117100002000000"), bytes.fromhex("c617100002000000"), SEGMENT]
)
def test_who_writes_an_object_is_an_intruder(tmp_path: Path, data: bytes) -> None:
    quick = crowd(tmp_path)
    quick.receive(Frame(0x602, READ), Frame(0x602, data))
    quick.run(0.15)
    assert quick.states() == "oso"
    event = quick.told("write" if data != SEGMENT else "segment")[0]
    assert event.severity == 900


def test_the_further_sdo_channels_of_a_node_are_watched_too(tmp_path: Path) -> None:
    quick = crowd(tmp_path)
    quick.receive(Frame(0x342, WRITE))
    quick.run(0.15)
    assert quick.states() == "oso"


# whose identifier it is


def test_an_identifier_on_which_a_node_of_the_site_speaks_is_not_watched(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path, drive="tpdo = { cob_id = 0x405 }"))
    bench.run(3.0)
    assert 0x405 in bench.network._routes
    assert 0x405 not in bench.network.ours and 0x205 in bench.network.ours


def test_what_the_node_no_longer_listens_to_is_not_watched(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path, drive="rpdo = { cob_id = 0x387 }"), present=False)
    bench.run(0.1)
    assert {0x205, 0x387} <= bench.network.ours
    bench.power_on()
    bench.run(3.0)
    assert 0x387 in bench.network.ours and 0x205 not in bench.network.ours
