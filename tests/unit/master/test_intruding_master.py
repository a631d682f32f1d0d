"""An intruder that is a master: it starts a node and enables its drives again and again, and is answered as
often. Judged by what the simulated drives report and do."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Final

import pytest

from bridge.canopen.frame import Frame
from bridge.command import Action, EventKind, Identity, Role, Source
from bridge.drive import DriveState, StatusWords
from bridge.master.answers import SHARE, Answers, answer_bits
from tests.support.bench import Bench
from tests.support.nightly import by_night
from tests.support.quick import Quick, quick_site
from tests.unit.master.test_farewell import FAMILIES, LastWords, moving, speed

ENGINEER: Final = Identity(Source.LOCAL, "test", Role.ENGINEER)
START, STOP, PRE_OPERATIONAL = b"\1\5", b"\2\5", b"\x80\5"
RPDO_EVERY_S: Final = 0.02
WIRE_S: Final = 0.001
"""Until a frame of the intruder's has been received and is in the inbox."""
LOOK_S: Final = 0.01
"""How often a bus looks at the identifiers that are ours (``bridge/can/foreignwatch.py``)."""
STEP_S: Final = 0.002
EPSILON_S: Final = 1e-9
SETTLED_S: Final = 1.5
ENDURES_S: Final = 2.0
SLOW: Final = 0.02
"""Of the speed that it had: what a drive gains in the moments in which it is enabled."""
MOST_ENABLED: Final = 0.6
"""Of its reports: it reports at the moment in which it is enabled, and not at all while it is stopped."""


class Intruder:
    """It repeats the frames by which the bridge has commanded the node last, and NMT start before them."""

    def __init__(self, bench: LastWords, start_every_s: float) -> None:
        self.bench = bench
        is_rpdo = re.compile("0x[2345]05").fullmatch
        ids = sorted({frame.can_id for frame in bench.log if is_rpdo(hex(frame.can_id))})
        self.frames = [bench.sent(can_id)[-1] for can_id in ids]
        self.start_every_s = start_every_s
        self.fastest = 0.0
        self._coming: list[tuple[float, Frame]] = []

    def goes_on(self, seconds: float) -> None:
        bench, begin = self.bench, self.bench.now
        start_at = rpdo_at = begin
        while bench.now < begin + seconds or self._coming:
            now = bench.now
            is_on = now < begin + seconds
            if is_on and now >= start_at - EPSILON_S:
                start_at += self.start_every_s
                self._send(Frame(0, START), WIRE_S)
            if is_on and now >= rpdo_at - EPSILON_S:
                rpdo_at += RPDO_EVERY_S
                for frame in self.frames:
                    self._send(frame, LOOK_S)
            bench.receive(*(frame for at, frame in self._coming if at <= now + EPSILON_S))
            self._coming = [(at, frame) for at, frame in self._coming if at > now + EPSILON_S]
            bench.run(STEP_S)
            self.fastest = max(self.fastest, speed(bench.node))

    def _send(self, frame: Frame, delay_s: float) -> None:
        self.bench.node.on_frame(frame, self.bench.now)
        self._coming.append((self.bench.now + delay_s, frame))


def reports(bench: Bench, since: float) -> list[bool]:
    """Whether each report of the first drive says that it is enabled."""
    drive = next(iter(bench.plant.drives.values()))
    words = StatusWords(drive.family.status_word)
    said = [f.data for f in bench.log if f.can_id == 0x185 and f.time >= since]
    return [words.state(int.from_bytes(data[:2], "little")) is DriveState.OPERATION_ENABLED for data in said]


CASES: Final = [
    (mapping, kind, every_s)
    for mapping in FAMILIES
    for kind, every_s in ((255, 0.02), (255, 0.1), (255, 0.5), (1, 0.02), (1, 0.5))
]


@pytest.mark.landing(7)
@pytest.mark.parametrize(("mapping", "kind", "start_every_s"), by_night(CASES))
def test_an_intruder_that_is_a_master_keeps_no_drive_running(
    tmp_path: Path, mapping: str, kind: int, start_every_s: float
) -> None:
    bench = moving(tmp_path, mapping, kind)
    bench.run(0.5)
    before = speed(bench.node)
    intruder = Intruder(bench, start_every_s)
    intruder.goes_on(SETTLED_S)
    begin, intruder.fastest = bench.now, 0.0
    intruder.goes_on(ENDURES_S)
    said = reports(bench, begin)
    figures = f"{sum(said)} of {len(said)} reports enabled, {intruder.fastest:.1f} of {before:.1f}"
    print(mapping, kind, start_every_s, figures)
    assert intruder.fastest <= SLOW * before, figures
    assert sum(said) <= MOST_ENABLED * len(said), figures
    bench.run(0.5)
    assert speed(bench.node) == 0


# who is answered, and how often


def held(tmp_path: Path, bus: str = "") -> Quick:
    """n2 is held stopped, because of an intruder."""
    quick = Quick(quick_site(tmp_path, ["", "", ""], bus=bus))
    quick.run(3.0)
    quick.receive(Frame(0x202, bytes.fromhex("7f04002000000000")))
    quick.run(2.0)
    assert quick.states() == "oso"
    quick.events.clear()
    return quick


@pytest.mark.parametrize("data", [b"\1\2", b"\1\0", b"\x80\2", b"\x80\0"])
def test_who_brings_a_held_node_back_is_answered_at_once(tmp_path: Path, data: bytes) -> None:
    quick = held(tmp_path)
    for node in quick.nodes.values():
        node.on_frame(Frame(0, data), quick.now)
    begin = quick.now
    quick.receive(Frame(0, data))
    quick.run(0.0)
    assert quick.nmt(begin) == [(2, 2)]
    assert quick.nodes[2].state == 4
    assert quick.told("intruder: NMT") and quick.told("intruder: NMT")[0].severity == 900


@pytest.mark.landing(7)
@pytest.mark.parametrize("data", [b"\1\1", b"\2\2", b"\1", b"", b"\1\7", b"\x77\2", b"\x81\1"])
def test_who_brings_no_held_node_back_is_only_told(tmp_path: Path, data: bytes) -> None:
    quick = held(tmp_path)
    begin = quick.now
    before = quick.network._intruders.count
    quick.receive(Frame(0, data))
    quick.run(0.0)
    assert (2, 2) not in quick.nmt(begin) and (2, 1) not in quick.nmt(begin)
    assert quick.network._intruders.count == before + 1
    assert quick.told("(000h)")


def test_with_report_a_foreign_start_is_only_told(tmp_path: Path) -> None:
    quick = Quick(quick_site(tmp_path, ["", ""], bus='on_intruder = "report"'))
    quick.run(3.0)
    assert quick.ask(Action.STOP_NODE, "n2", ENGINEER).ok
    quick.run(0.5)
    begin = quick.now
    quick.receive(Frame(0, b"\1\2"))
    quick.run(0.1)
    assert quick.nmt(begin) == [] and quick.told("intruder: NMT")


def test_a_node_that_an_operator_has_set_pre_operational_is_put_back_there(tmp_path: Path) -> None:
    quick = Quick(quick_site(tmp_path, ["", ""]))
    quick.run(3.0)
    assert quick.ask(Action.ENTER_PRE_OPERATIONAL, "n2", ENGINEER).ok
    quick.run(0.5)
    begin = quick.now
    quick.receive(Frame(0, b"\1\2"))
    quick.run(0.0)
    assert quick.nmt(begin) == [(0x80, 2)]


def test_a_twin_that_answers_each_answer_raises_no_storm(tmp_path: Path) -> None:
    """It sends its heartbeat, and for each NMT stop of ours a stopped word and an NMT stop."""
    quick = held(tmp_path)
    begin, seen = quick.now, 0
    for step in range(500):
        answers = quick.nmt(begin)[seen:]
        seen += len(answers)
        for _ in answers:
            quick.receive(Frame(0x202, bytes(8)), Frame(0, b"\2\2"), Frame(0, b"\2\0"))
        if step % 10 == 0:
            quick.receive(Frame(0x77F, b"\5"))
        quick.run(0.01)
    assert seen <= 3 * 6 + 3, "each of three nodes once a second"


def test_the_answers_stay_within_their_share_and_none_is_forgotten(tmp_path: Path) -> None:
    quick = held(tmp_path)
    answers, node, now = Answers(250_000), quick.core(2), 0.0
    sent = 0
    for _ in range(10_000):
        now += 0.0005
        answers.ask(node, 4)
        sent += len(answers.take(now))
    assert sent * answer_bits(4) <= SHARE * 250_000 * (now + 0.1)
    assert sent * answer_bits(4) >= 0.9 * SHARE * 250_000 * now
    answers.ask(node, 4)
    at = answers.next_deadline()
    assert at is not None and answers.take(at + 0.02) == [node]
    assert answers.next_deadline() is None


@pytest.mark.landing(2)
@pytest.mark.parametrize(("mapping", "is_reset"), [("lenze/8400-motec", True), ("cia402/velocity", False)])
def test_a_drive_that_answers_do_not_stop_is_reset_and_stays_stopped(
    tmp_path: Path, mapping: str, is_reset: bool
) -> None:
    """No word of the bridge reaches it; NMT stop leaves a Lenze running (§7.2.1)."""
    bench = moving(tmp_path, mapping, 255)
    bench.run(0.5)
    intruder = Intruder(bench, 0.02)
    bench.node_is_deaf = True
    intruder.goes_on(3.0)
    resets = [frame for frame in bench.log if not frame.can_id and frame.data == b"\x81\5"]
    assert bool(resets) == is_reset and len(resets) <= 2
    bench.run(3.0)
    assert speed(bench.node) == 0
    assert str(bench.value("n/node/boot_status")).startswith("stopped by the bridge, because of an intruder")
    told = [
        event for event in bench.events if event.kind is EventKind.INTRUDER and "reset node" in event.message
    ]
    assert bool(told) == is_reset and len(told) <= 3


@pytest.mark.landing
def test_a_node_that_was_reset_so_is_started_by_command(tmp_path: Path) -> None:
    bench = moving(tmp_path, "lenze/8400-motec", 255)
    bench.run(0.5)
    intruder = Intruder(bench, 0.02)
    bench.node_is_deaf = True
    intruder.goes_on(3.0)
    bench.node_is_deaf = False
    bench.run(1.0)
    assert bench.ask(Action.START_NODE, "n", ENGINEER).ok
    bench.run(5.0)
    assert bench.value("n/node/nmt_state") == 5
