"""What the page of the dead-man chain says of fresh telegrams, to the millisecond and the last arrival."""

from __future__ import annotations

import pytest

from bridge.command import Action, Do, Request
from bridge.command.messages.freshness import NEVER, Inflow, LoopPulse, is_stale, way_ms
from tests.support.rig import PLC

BEGIN = LoopPulse(0.0, 0.0)


@pytest.mark.parametrize(
    ("control", "ms"), [("none", 0), ("modbus", 25), ("opcua", 25), ("zenoh", 125), ("lease", 125)]
)
def test_a_telegram_may_be_older_where_its_connection_cannot_be_seen(control: str, ms: int) -> None:
    assert way_ms(control) == ms


@pytest.mark.parametrize(
    ("timeout_ms", "age_s", "expected"),
    [
        (0, 0.5, False),
        (0, 0.5005, True),
        (2000, 0.5, False),
        (2000, 0.5005, True),
        (250, 0.25, False),
        (250, 0.2505, True),
        (250, 0.0, False),
        (250, None, False),
    ],
)
def test_what_may_have_waited_for_longer_than_half_a_second_or_the_time_out_is_stale(
    timeout_ms: int, age_s: float | None, expected: bool
) -> None:
    received_at = None if age_s is None else 1000.0 - age_s
    request = Request(PLC, "conveyor/fu1", Do(Action.START), received_at=received_at)
    assert is_stale(request, 1000.0, timeout_ms) is expected


@pytest.mark.parametrize(
    ("at", "came"), [(0.001, 0.001), (0.02, 0.02), (0.024, 0.024), (0.0241, 0.0), (0.025, 0.0)]
)
def test_a_wait_of_24_ms_and_one_to_be_handled_cannot_be_told_from_none(at: float, came: float) -> None:
    assert Inflow(0.0, BEGIN).arrive(at, BEGIN) == came


def test_a_look_in_the_moment_in_which_a_connection_opens_may_have_been_before_it() -> None:
    assert Inflow(5.0, LoopPulse(1.0, 0.0)).arrive(5.0625, LoopPulse(5.0, 0.0)) == 1.0
    assert Inflow(5.0, LoopPulse(1.0, 0.0)).arrive(5.0625, LoopPulse(5.03125, 0.0)) == 5.03125


# calm: fewer than 32 arrivals in 100 ms


def crowded(*, at: float = 0.0) -> Inflow:
    inflow = Inflow(at, LoopPulse(at, NEVER))
    assert inflow.arrive(at, LoopPulse(at, NEVER), crowded=True) == NEVER
    return inflow


def arrives(inflow: Inflow, count: int, begin: float, steady_since: float = NEVER) -> None:
    """So many in 90 ms, none of which counts."""
    for n in range(count):
        at = begin + 0.09 * (n + 1) / count
        assert inflow.arrive(at, LoopPulse(at, steady_since)) == NEVER


@pytest.mark.parametrize(("arrivals", "counts"), [(0, True), (1, True), (31, True), (32, False)])
def test_calm_is_fewer_than_32_arrivals_in_100_ms(arrivals: int, counts: bool) -> None:
    inflow = crowded()
    arrives(inflow, arrivals, 0.0)
    assert inflow.arrive(0.099, LoopPulse(0.099, NEVER)) == NEVER
    inflow = crowded()
    arrives(inflow, arrivals, 0.0)
    assert (inflow.arrive(0.1, LoopPulse(0.1, NEVER)) == 0.1) is counts


@pytest.mark.parametrize(("arrivals", "counts"), [(30, True), (31, False)])
def test_the_next_100_ms_are_counted_with_the_arrival_that_begins_them(arrivals: int, counts: bool) -> None:
    inflow = crowded()
    arrives(inflow, 50, 0.0)
    assert inflow.arrive(0.125, LoopPulse(0.125, NEVER)) == NEVER
    arrives(inflow, arrivals, 0.125)
    assert (inflow.arrive(0.25, LoopPulse(0.25, NEVER)) == 0.25) is counts


@pytest.mark.parametrize(("arrivals", "counts"), [(31, True), (32, False)])
def test_after_a_hang_calm_is_counted_anew(arrivals: int, counts: bool) -> None:
    inflow = crowded()
    arrives(inflow, 25, 0.0)
    arrives(inflow, arrivals, 1.0, steady_since=1.0)
    assert (inflow.arrive(1.125, LoopPulse(1.125, 1.0)) == 1.125) is counts


def test_who_is_not_read_from_has_to_be_calm_after_that() -> None:
    inflow = Inflow(0.0, BEGIN)
    assert inflow.is_open
    inflow.shut(1.0)
    assert not inflow.is_open
    assert inflow.arrive(1.01, LoopPulse(1.0, NEVER)) == NEVER, "read before, and handed on late"
    inflow.reopen(2.0)
    assert inflow.is_open
    assert inflow.arrive(2.01, LoopPulse(2.005, NEVER)) == NEVER
    assert inflow.arrive(2.125, LoopPulse(2.12, NEVER)) == 2.125


def test_only_the_first_of_several_shuts_and_reopenings_counts() -> None:
    inflow = Inflow(0.0, BEGIN)
    inflow.reopen(0.99)
    assert inflow.arrive(1.0, LoopPulse(0.99, NEVER)) == 1.0, "it was open"
    inflow.shut(1.0)
    inflow.shut(1.09)
    assert inflow.arrive(1.125, LoopPulse(1.12, NEVER)) == 1.125
    inflow.reopen(2.0)
    inflow.reopen(2.09)
    assert inflow.arrive(2.125, LoopPulse(2.12, NEVER)) == 2.125


@pytest.mark.parametrize(("after_s", "counts"), [(0.0, False), (0.9375, False), (1.0, True), (1.5, True)])
def test_whoever_is_new_within_a_second_after_a_hang_may_have_asked_before_it(
    after_s: float, counts: bool
) -> None:
    at = 5.0 + after_s
    inflow = Inflow(at, LoopPulse(at, 5.0), is_hidden=True)
    assert (inflow.arrive(at, LoopPulse(at, 5.0)) == at) is counts
