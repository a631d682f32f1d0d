"""Records of the witness from the frames that it sees."""

from __future__ import annotations

from collections import deque

from tests.proof.witness import Run, add_to


def test_the_same_frame_again_and_again_is_one_run() -> None:
    track: deque[Run] = deque()
    for at, data in ((0.0, b"a"), (0.3, b"a"), (0.9, b"a"), (1.0, b"b"), (1.1, b"a")):
        add_to(track, data, at)
    assert list(track) == [Run(0.0, 0.9, b"a"), Run(1.0, 1.0, b"b"), Run(1.1, 1.1, b"a")]


def test_an_emergency_that_comes_again_after_a_while_is_another_one() -> None:
    track: deque[Run] = deque()
    for at in (0.0, 30.0):
        add_to(track, b"\x30\x81", at)
    assert [run.first for run in track] == [0.0, 30.0]
