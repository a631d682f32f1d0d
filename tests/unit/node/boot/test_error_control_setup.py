"""1017h as the node keeps it, guarding answers that prove nothing, and what is asked for on the wire."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path

import pytest

from bridge.can import bcm
from bridge.canopen.frame import REMOTE, Frame
from bridge.canopen.nmt import NmtState
from bridge.command import Action
from tests.support.quick import OPERATIONAL, STOPPED, Quick, QuickNode, quick_site, state_of


class Keeps(QuickNode):
    """``kept`` makes its heartbeat period of the one that is written."""

    def __init__(self, kept: Callable[[int], int]) -> None:
        super().__init__(1)
        self.kept = kept

    def _on_sdo(self, data: bytes, now: float) -> None:
        super()._on_sdo(data, now)
        if data[0] == 0x2B and data[1:3] == b"\x17\x10":
            period_ms = self.kept(int.from_bytes(self.objects[0x1017, 0], "little"))
            self.objects[0x1017, 0] = struct.pack("<H", period_ms)
            self.heartbeat_at = now + self.period_s if period_ms else float("inf")


class Sizeless(QuickNode):
    """Answers expedited, without saying how many bytes count."""

    def _answer(self, data: bytes) -> None:
        super()._answer(b"\x42" + data[1:] if data[0] & 0xE0 == 0x40 else data)


def writes(quick: Quick) -> int:
    return len([write for write in quick.nodes[1].writes if write[0] == 0x1017])


def booted_again(quick: Quick, times: int) -> None:
    """Boot-ups without a start of the node itself."""
    for _ in range(times):
        quick.lose = lambda frame: frame.can_id == 0x701
        quick.run(1.0)
        quick.lose = lambda frame: False
        quick.run(11.0)
        assert quick.states() == "o"


def quick_with(tmp_path: Path, node: QuickNode, supervision_ms: int = 200) -> Quick:
    quick = Quick(quick_site(tmp_path, 1, common=f"supervision_ms = {supervision_ms}"))
    quick.nodes[1] = node
    return quick


def test_an_answer_without_a_size_is_compared_by_what_counts(tmp_path: Path) -> None:
    quick = quick_with(tmp_path, Sizeless(1))
    quick.run(3.0)
    assert writes(quick) == 1
    booted_again(quick, 3)
    assert writes(quick) == 1


def test_a_period_that_the_node_rounds_is_adopted_and_not_written_again(tmp_path: Path) -> None:
    """Lenze rounds down to 5 ms."""
    quick = quick_with(tmp_path, Keeps(lambda period_ms: period_ms // 5 * 5))
    quick.run(3.0)
    assert quick.states() == "o"
    assert "1017h was 0, is 65 now (66 was written)" in quick.status(1)
    booted_again(quick, 3)
    assert writes(quick) == 1
    quick.run(60.0)
    assert quick.value("bus/can0/duplicate_ids") == ""


def test_a_node_that_beats_faster_than_asked_is_no_duplicate(tmp_path: Path) -> None:
    quick = quick_with(tmp_path, Keeps(lambda period_ms: period_ms * 6 // 10))
    quick.run(60.0)
    assert quick.states() == "o"
    assert quick.value("bus/can0/duplicate_ids") == ""


@pytest.mark.landing(4)
@pytest.mark.parametrize("kept_ms", [0, 101, 1000, 5])
def test_a_period_that_does_not_do_is_told(tmp_path: Path, kept_ms: int) -> None:
    quick = quick_with(tmp_path, Keeps(lambda period_ms: kept_ms if period_ms else 0))
    quick.run(60.0)
    assert quick.status(1).startswith(f"J: 1017h is {kept_ms} after 66 was written")
    assert writes(quick) == 2, "again after the reset that follows the first attempt"
    assert quick.states() == "s"


def test_an_operators_reset_writes_it_again(tmp_path: Path) -> None:
    quick = quick_with(tmp_path, Keeps(lambda period_ms: period_ms // 5 * 5))
    quick.run(3.0)
    quick.ask(Action.RESET, "n1")
    quick.run(3.0)
    assert quick.states() == "o"
    assert writes(quick) == 2


# node guarding

GUARDED = 'supervision = "guarding"'
QUESTION = Frame(0x701 | REMOTE, b"\0")


class Stuck(QuickNode):
    """Its toggle bit never changes once ``is_stuck``."""

    is_stuck = False

    def on_frame(self, frame: Frame, now: float) -> None:
        if self.is_stuck and frame.can_id == QUESTION.can_id:
            self.outbox.append(Frame(0x701, bytes((self.state | self.toggle,))))
            return
        super().on_frame(frame, now)


def guarded(tmp_path: Path) -> tuple[Quick, Stuck]:
    node = Stuck(1)
    quick = Quick(quick_site(tmp_path, [GUARDED], common="supervision_ms = 100"))
    quick.nodes[1] = node
    quick.run(3.0)
    assert quick.states() == "o"
    return quick, node


def test_the_remote_frame_asks_for_one_byte(tmp_path: Path) -> None:
    """ISO 11898-1: the DLC of a remote frame is that of the frame that is asked for."""
    quick, _ = guarded(tmp_path)
    asked = [frame for frame in quick.log if frame.can_id == QUESTION.can_id]
    assert {frame.data for frame in asked} == {b"\0"}


@pytest.mark.parametrize("length", [0, 1, 8])
def test_a_remote_frame_reaches_the_kernel_with_its_own_length(length: int) -> None:
    assert bcm.frame_bytes(Frame(0x185 | REMOTE, bytes(length)))[4] == length


def test_an_answer_with_the_wrong_toggle_says_nothing_of_the_state(tmp_path: Path) -> None:
    quick, node = guarded(tmp_path)
    wrong = bytes((STOPPED | (node.toggle ^ 0x80),))
    quick.receive(Frame(0x701, wrong))
    quick.run(0.05)
    assert state_of(quick, 1) is NmtState.OPERATIONAL
    assert node.state == OPERATIONAL


def test_toggle_errors_are_shown(tmp_path: Path) -> None:
    quick, node = guarded(tmp_path)
    assert quick.value("n1/node/supervision_state") == "guarding: operational"
    quick.receive(Frame(0x701, bytes((OPERATIONAL | (node.toggle ^ 0x80),))))
    quick.run(0.05)
    assert quick.value("n1/node/supervision_state") == "guarding: operational, 1 wrong toggle bit"


def test_a_node_that_is_lost_by_its_toggle_bit_is_said_so(tmp_path: Path) -> None:
    quick, node = guarded(tmp_path)
    node.is_stuck = True
    seen: set[str] = set()
    for _ in range(60):
        quick.run(0.01)
        seen.add(quick.status(1))
    assert [text for text in seen if text.startswith("F: lost: no correct answer to node guarding, ")]
