"""Habit files: those that come with the program, and what is wrong with one."""

from __future__ import annotations

from pathlib import Path

import pytest

from bridge.base.errors import FileFaults, OperationFailed
from bridge.canopen.frame import Frame
from bridge.sim.core.habit import Rule, load_habit, shipped_habits
from bridge.sim.nord.nord_tu4 import NordTu4

READ_1000 = Frame(0x605, bytes.fromhex("4000100000000000"))


def node(*rules: Rule) -> NordTu4:
    simulated = NordTu4(5)
    simulated.adopt_habits(rules)
    simulated.start(0.0)
    simulated.take_frames()
    return simulated


def answers(simulated: NordTu4, request: str, now: float = 1.0) -> list[str]:
    simulated.on_frame(Frame(0x605, bytes.fromhex(request)), now)
    return [frame.data.hex(" ").upper() for frame in simulated.take_frames() if frame.can_id == 0x585]


@pytest.mark.parametrize("name", sorted(shipped_habits()))
def test_every_habit_that_comes_with_the_program_says_what_it_is_and_where_it_was_seen(name: str) -> None:
    habit = load_habit(name)
    assert habit.title and habit.source


@pytest.mark.parametrize(
    ("rule", "fault"),
    [
        ('frames = "answer"', "does nothing"),
        ('frames = "answers"\nsilent = true', "must be"),
        ('frames = "answer"\ndata = "4"', "is no frame"),
        ('frames = "answer"\nlike = "("\nsilent = true', "like"),
        ('frames = "tpdo"\nabort = 1', "abort ends an SDO transfer"),
        ('frames = "request"\ndelay_ms = 1', "delay the answer"),
        ('frames = "answer"\nsize = 9', "at most 8"),
    ],
)
def test_a_file_with_a_fault_is_named_with_its_line(tmp_path: Path, rule: str, fault: str) -> None:
    path = tmp_path / "odd.toml"
    path.write_text(f'title = "t"\nsource = "s"\n[[rule]]\n{rule}\n', encoding="utf-8")
    with pytest.raises(FileFaults, match=fault) as raised:
        load_habit(str(path))
    assert raised.value.faults[0].line >= 3


def test_an_unknown_habit_is_answered_with_those_that_there_are() -> None:
    with pytest.raises(OperationFailed, match="short-answers"):
        load_habit("tall-answers")
