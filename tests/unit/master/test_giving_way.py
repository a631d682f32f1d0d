"""Whatever makes the bridge fall silent: the stop that it owes for what it has enabled goes out first.

Judged by the simulated drive's own motion, and by the frames on the wire.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from pathlib import Path
from typing import Final

import pytest

from bridge.can.interface import ControllerState
from bridge.canopen.frame import Frame
from bridge.command import Action, Identity, Request, Role, Source, Start
from bridge.sim.core.nmt_slave import SlaveState
from bridge.text import Text
from tests.support.bench import Bench, write_site
from tests.support.nightly import by_night
from tests.unit.master.test_farewell import FAMILIES, SLACK_S, SYNC_S, TYPES, moving, speed

TWIN: Final = Frame(0x77F, b"\x05")
"""A second bridge with the same site file says that it is operational."""
ENGINEER: Final = Identity(Source.LOCAL, "test", Role.ENGINEER)
RPDO: Final = 0x205
HANG_S: Final = 0.15
"""Longer than deadman_ms, so that another bridge is given way to."""
ENOUGH_S: Final = 0.2
LISTENS_S: Final = 0.2
ROUND_S: Final = 0.002
RENEWAL_S: Final = 0.034
"""The bench's bus wakes nobody when it is back: the next renewal finds it."""


def is_stop(bench: Bench, frame: Frame) -> bool:
    """A stopped word of the first drive."""
    drive = next(iter(bench.plant.drives.values()))
    words = drive.channel.words
    return frame.can_id == RPDO and not words.enables(int.from_bytes(frame.data[:2], "little"))


def stopped_and_left(bench: Bench, since: float) -> bool:
    """A stopped word, and after it NMT stop of the node."""
    frames = [frame for frame in bench.log if frame.time >= since]
    words = [place for place, frame in enumerate(frames) if is_stop(bench, frame)]
    nmt = [n for n, frame in enumerate(frames) if not frame.can_id and frame.data in (b"\2\5", b"\2\0")]
    return bool(words and nmt) and words[0] < nmt[-1]


def listens(bench: Bench) -> None:
    """Its bridge gives way as one on a real bus does."""
    bench.network.mastership._listening.listen_s = LISTENS_S


# what makes the bridge give way


def one_frame_after_a_hang(bench: Bench) -> None:
    bench.hang(HANG_S)
    bench.receive(TWIN)


def many_frames_after_a_hang(bench: Bench) -> None:
    bench.hang(HANG_S)
    for _ in range(20):
        bench.receive(TWIN)


def the_frame_comes_a_round_later(bench: Bench) -> None:
    bench.hang(HANG_S)
    bench.run(0.0)
    bench.receive(TWIN)


def hangs_in(bench: Bench, name: str) -> None:
    """The process has looked at the clock, and stands still as it begins to read what has come."""
    reads = getattr(bench.bus, name)

    def hangs(now: float, **how: bool) -> list[Frame]:
        setattr(bench.bus, name, reads)
        bench.hang(HANG_S)
        bench.receive(TWIN)
        frames: list[Frame] = reads(now, **how)
        return frames

    setattr(bench.bus, name, hangs)
    bench.run(0.0)


def it_hangs_as_it_reads(bench: Bench) -> None:
    hangs_in(bench, "drain")


def it_hangs_as_it_reads_what_others_sent(bench: Bench) -> None:
    hangs_in(bench, "take_foreign")


def it_hangs_as_it_reads_in_a_round(bench: Bench) -> None:
    bench.master._due = None
    hangs_in(bench, "drain")


def the_frame_comes_with_the_bus(bench: Bench) -> None:
    bench.bus.status.state = ControllerState.DOWN
    bench.run(0.05)
    bench.bus.status.state = ControllerState.OK
    bench.run(0.0)
    bench.receive(TWIN)


def the_frame_comes_after_a_short_outage(bench: Bench) -> None:
    bench.run(0.0)
    bench.bus.clear()
    bench.bus.status.outages += 1
    bench.run(0.0)
    bench.receive(TWIN)


def the_bus_goes_while_it_gives_way(bench: Bench) -> None:
    bench.hang(HANG_S)
    bench.receive(TWIN)
    bench.bus.clear()
    bench.bus.status.state = ControllerState.DOWN
    bench.run(0.05)
    bench.bus.status.state = ControllerState.OK


CAUSES: Final[dict[str, Callable[[Bench], None]]] = {
    cause.__name__.replace("_", " "): cause
    for cause in (
        one_frame_after_a_hang,
        many_frames_after_a_hang,
        the_frame_comes_a_round_later,
        it_hangs_as_it_reads,
        it_hangs_as_it_reads_what_others_sent,
        it_hangs_as_it_reads_in_a_round,
        the_frame_comes_with_the_bus,
        the_frame_comes_after_a_short_outage,
        the_bus_goes_while_it_gives_way,
    )
}


CASES: Final = [
    (mapping, kind, cause, goes_on)
    for mapping in FAMILIES
    for kind in TYPES
    for cause in (CAUSES if mapping == "lenze/8400-motec" else [next(iter(CAUSES))])
    for goes_on in (False, True)
]
"""All causes where NMT stop does nothing to the drive."""


@pytest.mark.landing(12)
@pytest.mark.parametrize(("mapping", "kind", "cause", "goes_on"), by_night(CASES))
def test_what_runs_is_stopped_before_the_bus_is_left_to_another(
    tmp_path: Path, mapping: str, kind: int, cause: str, goes_on: bool
) -> None:
    bench = moving(tmp_path, mapping, kind)
    listens(bench)
    CAUSES[cause](bench)
    begin = bench.now
    for _ in range(10):
        bench.run(ENOUGH_S / 10)
        if goes_on:
            bench.receive(TWIN)
    assert bench.value("bus/can0/passive") is True
    assert stopped_and_left(bench, begin)
    left_at = max(frame.time for frame in bench.log if not frame.can_id)
    noticed_s = RENEWAL_S if "bus" in cause else ROUND_S
    assert left_at <= begin + noticed_s + (kind * SYNC_S + SLACK_S if kind <= 240 else 0.01)
    assert not [
        f for f in bench.log if f.time > left_at + SLACK_S + 0.01 and f.can_id in (0, RPDO, 0x77F, 0x80)
    ]
    bench.run(3.0)
    assert speed(bench.node) == 0


# in whatever stage the drive is


def running(folder: Path, drive: str) -> Bench:
    bench = Bench(write_site(folder, drive=drive))
    listens(bench)
    bench.run(3.0)
    for word in (0x047E, 0x047F):
        bench.keep_writing(0.2, control_word=word, setpoint_1=0x2000)
    return bench


def stop_under_way(bench: Bench) -> None:
    bench.ask(Action.STOP)


def tripped(bench: Bench) -> None:
    bench.run(0.4)


def lost(bench: Bench) -> None:
    bench.cut = True
    bench.keep_writing(1.0, control_word=0x047F)
    bench.cut = False


def switched_off(bench: Bench) -> None:
    bench.ask(Action.DISABLE, "conveyor", ENGINEER)


def being_booted(bench: Bench) -> None:
    bench.cut = True
    bench.keep_writing(1.0, control_word=0x047F)
    bench.ask(Action.START_NODE, "conveyor", ENGINEER)
    bench.cut = False


def in_a_start(bench: Bench) -> None:
    bench.ask(Action.DISABLE_VOLTAGE)
    bench.run(0.3)
    bench.view.submit(Request(ENGINEER, "conveyor/fu1", Start(direction=0)), lambda outcome: None)
    bench.write(control_word=0x047E)
    bench.write(control_word=0x047F)


STAGES: Final[dict[str, tuple[str, Callable[[Bench], None]]]] = {
    "enabled": ("", lambda bench: None),
    "a stop is under way": ("", stop_under_way),
    "tripped": ("", tripped),
    "held": ('on_expiry = "hold"', tripped),
    "quick stop": ('on_expiry = "quick_stop"', tripped),
    "errors ignored": ("telegram_downtime_s = -0.1", lambda bench: None),
    "lost": ("", lost),
    "switched off": ("", switched_off),
    "being booted": ("", being_booted),
    "in a start": ("", in_a_start),
}


@pytest.mark.landing(14)
@pytest.mark.parametrize(("stage", "cause"), by_night(itertools.product(STAGES, CAUSES)))
def test_in_every_stage_the_drive_is_stopped_first(tmp_path: Path, stage: str, cause: str) -> None:
    keys, enter = STAGES[stage]
    bench = running(tmp_path, keys)
    enter(bench)
    drive = bench.plant.drives["conveyor/fu1"]
    CAUSES[cause](bench)
    begin = bench.now
    bench.run(ENOUGH_S)
    assert bench.value("bus/can0/passive") is True
    has_followed = drive.stop_check.last_stop.label == "followed"
    assert stopped_and_left(bench, begin) or has_followed
    bench.run(3.0)
    assert bench.node.drives[0].output_hz == 0


def test_who_has_enabled_nothing_owes_nothing(tmp_path: Path) -> None:
    bench = Bench(write_site(tmp_path))
    listens(bench)
    bench.run(3.0)
    one_frame_after_a_hang(bench)
    begin = bench.now
    bench.run(ENOUGH_S)
    assert bench.value("bus/can0/passive") is True
    assert not [frame for frame in bench.log if frame.time >= begin and frame.can_id in (0, RPDO, 0x77F)]


def test_a_drive_that_has_said_that_it_stands_is_owed_nothing(tmp_path: Path) -> None:
    bench = running(tmp_path, "")
    bench.ask(Action.DISABLE_VOLTAGE)
    bench.run(1.0)
    one_frame_after_a_hang(bench)
    begin = bench.now
    bench.run(ENOUGH_S)
    assert not [frame for frame in bench.log if frame.time >= begin and frame.can_id in (0, RPDO)]


def test_after_the_stop_it_waits_and_takes_over_as_at_any_start(tmp_path: Path) -> None:
    bench = running(tmp_path, "")
    one_frame_after_a_hang(bench)
    bench.run(5.0)
    assert bench.value("bus/can0/passive") is False
    assert bench.value("conveyor/node/nmt_state") == 5
    assert bench.value("conveyor/fu1/status/state") != 4


def test_a_node_that_was_stopped_stays_so_when_the_other_bridge_is_gone(tmp_path: Path) -> None:
    """The other one may have started it, and run its drives."""
    bench = running(tmp_path, "")
    assert bench.ask(Action.STOP_NODE, "conveyor", ENGINEER).ok
    bench.run(0.2)
    one_frame_after_a_hang(bench)
    bench.run(0.3)
    bench.node.on_frame(Frame(0, b"\1\5"), bench.now)
    bench.log.clear()
    bench.run(3.0)
    assert bench.value("bus/can0/passive") is False
    assert stopped_and_left(bench, 0.0)


# a bus that goes in the same moment


def down(bench: Bench) -> None:
    bench.bus.clear()
    bench.bus.status.state = ControllerState.DOWN
    bench.run(0.02)


@pytest.mark.landing(4)
@pytest.mark.parametrize(
    ("mapping", "kind", "when", "target"),
    by_night(
        itertools.product(
            ["lenze/8400-motec", "cia402/velocity"],
            [1, 255],
            ["while it is down", "in the round in which it goes", "before a short outage"],
            ["n", "bus/can0"],
        )
    ),
)
def test_a_node_that_is_to_stop_is_stopped_when_the_bus_is_back(
    tmp_path: Path, mapping: str, kind: int, when: str, target: str
) -> None:
    bench = moving(tmp_path, mapping, kind)
    if when == "while it is down":
        down(bench)
        bench.ask(Action.STOP_NODE, target, ENGINEER)
    elif when == "in the round in which it goes":
        bench.bus.clear()
        bench.bus.status.state = ControllerState.DOWN
        bench.ask(Action.STOP_NODE, target, ENGINEER)
    else:
        bench.bus.clear()
        bench.bus.status.outages += 1
        bench.ask(Action.STOP_NODE, target, ENGINEER)
    bench.run(0.1)
    bench.bus.status.state = ControllerState.OK
    bench.run(0.3)
    assert bench.node.slave.state is SlaveState.STOPPED
    bench.run(2.0)
    assert speed(bench.node) == 0


# a boot-up


@pytest.mark.landing(6)
@pytest.mark.parametrize(
    ("mapping", "how", "kind"),
    by_night(itertools.product(FAMILIES, ["none", "communication", "node"], TYPES)),
)
def test_a_reset_at_the_start_leaves_the_stopped_words_their_sync(
    tmp_path: Path, mapping: str, how: str, kind: int
) -> None:
    """The bridge takes over from another one, whose drives still run."""
    bench = moving(tmp_path, mapping, kind, bus=f'reset_at_start = "{how}"')
    listens(bench)
    one_frame_after_a_hang(bench)
    bench.run(0.3)
    assert bench.value("bus/can0/passive") is True
    bench.node.on_frame(Frame(0, b"\1\5"), bench.now)
    bench.log.clear()
    bench.run(4.0)
    assert bench.value("bus/can0/passive") is False
    resets = [f.time for f in bench.log if not f.can_id and f.data[0] == 0x82 and f.data[1] == 5]
    if how == "communication":
        first = next(frame.time for frame in bench.log if is_stop(bench, frame))
        assert resets[0] - first >= (kind * SYNC_S if kind <= 240 else 0.0)
    assert speed(bench.node) == 0


# the end of the service


def test_a_fault_of_our_own_while_it_gives_way_keeps_no_drive_running(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench = running(tmp_path, "")
    one_frame_after_a_hang(bench)

    def fail(now: float, why: Text) -> None:
        raise RuntimeError(f"{now} {why.code}")

    monkeypatch.setattr(bench.network, "_forget_bus", fail)
    begin = bench.now
    with pytest.raises(RuntimeError):
        bench.master.on_bus()
    assert [frame for frame in bench.log if frame.time >= begin and is_stop(bench, frame)]
