"""A node that is lost again and again soon after each boot-up."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.canopen.frame import Frame
from bridge.command.drive_link import NodeState
from tests.support.quick import OPERATIONAL, Quick, QuickNode, quick_site


class Flapping(QuickNode):
    """Heard once in each boot-up and once as operational, then silent."""

    beats = 0

    def on_time(self, now: float) -> None:
        if now >= self.heartbeat_at and self.beats:
            self.heartbeat_at = now + self.period_s
            return
        self.beats += now >= self.heartbeat_at
        super().on_time(now)

    def on_frame(self, frame: Frame, now: float) -> None:
        super().on_frame(frame, now)
        if frame.can_id == 0 and frame.data[0] == 0x80:
            self.beats = 0
        elif frame.can_id == 0 and frame.data[0] == 0x01:
            self.outbox.append(Frame(0x701, bytes((OPERATIONAL,))))


def flapping(tmp_path: Path) -> Quick:
    quick = Quick(quick_site(tmp_path, 1))
    quick.nodes[1] = Flapping(1)
    return quick


def starts(quick: Quick, since: float) -> list[tuple[int, int]]:
    return [command for command in quick.nmt(since) if command == (1, 1)]


@pytest.mark.landing
def test_a_flapping_node_is_booted_every_ten_seconds_in_the_end(tmp_path: Path) -> None:
    quick = flapping(tmp_path)
    quick.run(60.0)
    since = quick.now
    quick.run(600.0)
    assert 50 <= len(starts(quick, since)) <= 62, "at least every 10 s, and hardly more often"


@pytest.mark.landing
def test_a_flapping_node_is_told_of_now_and_then(tmp_path: Path) -> None:
    quick = flapping(tmp_path)
    quick.run(60.0)
    quick.events.clear()
    quick.run(600.0)
    of_the_node = [event for event in quick.events if event.source == "n1"]
    assert 9 <= len(of_the_node) <= 12, "once a minute"
    assert quick.told("lost again and again")


@pytest.mark.landing
def test_being_heard_again_does_not_shorten_the_pause(tmp_path: Path) -> None:
    quick = Quick(quick_site(tmp_path, 1))
    quick.run(3.0)
    for _ in range(60):
        quick.lose = lambda frame: frame.can_id == 0x701
        quick.run(0.5)
        quick.lose = lambda frame: False
        quick.run(9.5)
    assert len(starts(quick, quick.now - 300)) <= 31


@pytest.mark.landing
def test_after_half_a_minute_in_operation_all_is_forgotten(tmp_path: Path) -> None:
    quick = flapping(tmp_path)
    quick.run(60.0)
    quick.nodes[1] = QuickNode(1)
    quick.nodes[1].start(quick.now)
    quick.run(45.0)
    assert quick.states() == "o"
    quick.nodes[1].present = False
    quick.run(1.0)
    assert quick.core(1).state is NodeState.LOST
    quick.nodes[1].present = True
    since = quick.now
    quick.run(1.5)
    assert quick.states() == "o", f"{quick.now - since:g} s"
    assert quick.core(1).state is NodeState.OPERATIONAL
