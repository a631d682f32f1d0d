"""Clients whose commands have waited, where only their arrival at zenoh is seen."""

from __future__ import annotations

from bridge.command.messages.freshness import NEVER, LoopPulse
from bridge.northbound.zenoh.askers import Askers

STEADY = float("-inf")


def test_who_waits_for_answers_counts_from_when_each_command_came():
    askers = Askers()
    for n in range(1000):
        at = 10.0 + n * 0.0005
        assert askers.arrival("plc", at, at + 0.0002, LoopPulse(at - 0.01, STEADY)) == at


def test_the_wait_for_the_loop_is_part_of_the_age():
    askers = Askers()
    assert askers.arrival("plc", 10.0, 10.3, LoopPulse(10.29, STEADY)) == 10.0
    assert askers.arrival("plc", 10.1, 10.3, LoopPulse(10.05, STEADY)) == 10.05


def test_too_many_under_way_count_for_nothing_and_harm_nobody_else():
    askers = Askers()
    look = LoopPulse(9.995, STEADY)
    came = [askers.arrival("flood", 10.0, 10.001 + n * 0.0001, look) for n in range(100)]
    assert came == [10.0] * 64 + [NEVER] * 36
    assert askers.arrival("plc", 10.0, 10.02, look) == 10.0
    assert askers.arrival("flood", 10.05, 10.06, LoopPulse(10.04, STEADY)) == NEVER
    assert askers.arrival("flood", 10.25, 10.26, LoopPulse(10.24, STEADY)) == 10.25


def test_only_so_many_askers_are_kept_in_mind():
    askers = Askers()
    look = LoopPulse(9.995, STEADY)
    for n in range(100):
        askers.arrival("flood", 10.0, 10.001 + n * 0.0001, look)
    for n in range(300):
        askers.arrival(f"name {n}", 10.02, 10.02, look)
    assert askers.arrival("flood", 10.03, 10.03, LoopPulse(10.02, STEADY)) == 10.03
