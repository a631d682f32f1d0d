"""When a node starts again and again, and when it only says several times that it has started."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import pytest

from bridge.node.bootloop import BootLoop

ROW = (0.0, 0.05, 0.1, 0.15)


def rows(count: int, every_s: float) -> Iterator[float]:
    """Boot-up messages in rows of four."""
    for number in range(count):
        yield from (number * every_s + at for at in ROW)


def loops(times: Sequence[float]) -> bool:
    loop = BootLoop()
    for at in times:
        loop.on_boot_up(100.0 + at)
    return loop.is_looping


@pytest.mark.parametrize(
    ("times", "is_loop"),
    [
        pytest.param((0.0,), False, id="one"),
        pytest.param(ROW, False, id="a row"),
        pytest.param((0.0, 0.0, 0.0, 0.0), False, id="a row in one moment"),
        pytest.param(tuple(rows(3, 2.0)), False, id="three rows"),
        pytest.param(tuple(rows(4, 2.0)), True, id="four rows"),
        pytest.param(tuple(rows(9, 30.0)), False, id="rows far apart"),
        pytest.param((0.0, 1.0, 2.0), False, id="three restarts"),
        pytest.param((0.0, 1.0, 2.0, 3.0), True, id="four restarts"),
        pytest.param((0.0, 0.25, 0.5, 0.75), True, id="four quick restarts"),
        pytest.param(tuple(n / 10 for n in range(100)), True, id="a row without end"),
    ],
)
def test_a_row_of_boot_up_messages_is_one_restart(times: Sequence[float], is_loop: bool) -> None:
    assert loops(times) is is_loop


def test_what_a_looping_node_says_in_a_row_prolongs_nothing() -> None:
    loop = BootLoop()
    pauses = [loop.on_boot_up(100.0 + at) for at in (0.0, 1.0, 2.0, 3.0, 3.05, 3.1, 3.15)]
    assert pauses == [0.0, 0.0, 0.0, 2.0, 2.0, 2.0, 2.0]
