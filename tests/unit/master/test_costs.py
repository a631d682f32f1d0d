"""What things cost, in calls of functions: figures that are the same on every machine.

Each bound is a tenth above what was counted. Where one is exceeded, look for what has come into the way of a
frame; where it cannot be helped, write the new figure down.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from types import FrameType

import pytest

from bridge.canopen.frame import Frame
from tests.bench.bench_nodes import Crowd

FEW, MANY = 4, 40


def calls_of(do: Callable[[], object]) -> int:
    """How many functions are called, Python's own included."""
    count = 0

    def note(frame: FrameType, event: str, argument: object) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    sys.setprofile(note)
    try:
        do()
    finally:
        sys.setprofile(None)
    return count


@pytest.fixture(scope="module")
def crowds(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[int, Crowd]]:
    made = {count: Crowd(tmp_path_factory.mktemp(f"nodes{count}"), count) for count in (FEW, MANY)}
    for crowd in made.values():
        crowd.boot()
    yield made


def after_a_round(crowd: Crowd) -> None:
    """All nodes are there, and nothing is due for a while."""
    bench = crowd.bench
    bench.receive(*(Frame(0x700 + number, b"\x05") for number in crowd.numbers))
    bench.master.pump()
    while bench.wake_at - bench.now < 0.0005:
        bench.now = max(bench.now, bench.wake_at)
        bench.master.pump()
    bench.now += 0.0001


def of_a_tpdo(crowd: Crowd, data: bytes) -> int:
    """Of one that comes alone."""
    crowd.bench.receive(Frame(0x181, data))
    return calls_of(crowd.bench.master.take_in)


@pytest.mark.landing(2)
@pytest.mark.parametrize("nodes", [FEW, MANY])
def test_a_frame_costs_what_comes_of_it_however_many_nodes_there_are(
    crowds: dict[int, Crowd], nodes: int
) -> None:
    crowd = crowds[nodes]
    after_a_round(crowd)
    of_a_tpdo(crowd, bytes(8))
    after_a_round(crowd)
    assert of_a_tpdo(crowd, bytes(8)) <= 57, "a TPDO that says what the last one said"
    assert of_a_tpdo(crowd, b"\0\0\1\0\2\0\3\0") <= 68, "one with new values"


def test_a_round_in_which_nothing_has_happened_costs_the_same_with_many_nodes(
    crowds: dict[int, Crowd],
) -> None:
    for crowd in crowds.values():
        after_a_round(crowd)
        assert calls_of(crowd.bench.master.pump) <= 85


def test_what_many_nodes_cost_grows_no_faster_than_they_do(crowds: dict[int, Crowd]) -> None:
    def costs(crowd: Crowd) -> dict[str, int]:
        after_a_round(crowd)
        of_a_tpdo(crowd, bytes(8))
        after_a_round(crowd)
        costs = {"a new status word": of_a_tpdo(crowd, b"\1" + bytes(7))}
        after_a_round(crowd)
        crowd.bench.now += 0.033
        costs["a renewal"] = calls_of(crowd.bench.master.pump)
        return costs | {"a second at rest": calls_of(lambda: crowd.bench.run(1.0))}

    few, many = (costs(crowds[count]) for count in (FEW, MANY))
    for what, calls in many.items():
        assert calls <= MANY / FEW * few[what], what
    assert few["a new status word"] <= 415
    assert many["a renewal"] <= 12_500
    assert many["a second at rest"] <= 285_000


@pytest.mark.landing
def test_the_start_of_many_nodes_costs_no_more_for_each(tmp_path: Path) -> None:
    calls: dict[int, int] = {}
    for count in (FEW, MANY):
        (tmp_path / str(count)).mkdir()
        crowd = Crowd(tmp_path / str(count), count)
        pump, spent = crowd.bench.master.pump, [0]

        def counted(pump: Callable[[], None] = pump, spent: list[int] = spent) -> None:
            spent[0] += calls_of(pump)

        crowd.bench.master.pump = counted  # type: ignore[method-assign]
        crowd.boot()
        calls[count] = spent[0]
    assert calls[MANY] <= MANY / FEW * calls[FEW]
