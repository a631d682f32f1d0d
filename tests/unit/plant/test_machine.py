"""A process of a plant: turns one after the other, which take time, stand still and end."""

from __future__ import annotations

import pytest

from bridge.master.standstill import StoodStill
from tests.plant.machine import Process
from tests.plant.world import BEGIN_S, World


class Nobody:
    def __init__(self) -> None:
        self.seen: list[str] = []

    def on_still(self, now: float) -> None:
        self.seen.append(f"still {now - BEGIN_S:.3f}")

    def on_going_on(self, since: float, now: float) -> None:
        self.seen.append(f"on {now - BEGIN_S:.3f}")

    def on_end(self, now: float) -> None:
        self.seen.append(f"end {now - BEGIN_S:.3f}")


@pytest.fixture
def world() -> World:
    return World()


def test_a_turn_takes_as_long_as_it_looks_at_the_clock(world: World) -> None:
    process = Process(world, Nobody(), [])
    process.look_s = 0.01
    seen: list[float] = []
    process.post(lambda: seen.extend(process.clock() - BEGIN_S for _ in range(3)))
    assert seen == pytest.approx([0.0, 0.01, 0.02])
    assert world.now - BEGIN_S == pytest.approx(0.03)


def test_what_happens_meanwhile_happens_in_the_middle_of_the_turn(world: World) -> None:
    process = Process(world, Nobody(), [])
    process.look_s = 0.01
    seen: list[str] = []
    world.after(0.015, lambda: seen.append("frame"))
    world.after(0.015, lambda: process.post(lambda: seen.append("next turn")))

    def turn() -> None:
        for _ in range(3):
            process.clock()
            seen.append("look")

    process.post(turn)
    assert seen == ["look", "frame", "look", "look", "next turn"]


def test_a_hang_in_a_turn_begins_with_its_next_look(world: World) -> None:
    watcher = Nobody()
    process = Process(world, watcher, [])
    process.look_s = 0.01
    process.hang(0.5, in_turn=True)
    process.post(lambda: [process.clock()].clear())
    assert watcher.seen == ["still 0.000", "on 0.500"]


def test_one_that_comes_in_the_middle_of_a_turn_is_not_lost(world: World) -> None:
    watcher = Nobody()
    process = Process(world, watcher, [])
    process.look_s = 0.01
    world.after(0.005, lambda: process.hang(0.5, in_turn=False))
    process.post(lambda: [process.clock() for _ in range(2)])  # type: ignore[func-returns-value]
    assert watcher.seen == ["still 0.010", "on 0.510"]


def test_a_process_that_is_killed_in_its_turn_does_no_more(world: World) -> None:
    watcher = Nobody()
    process = Process(world, watcher, [])
    process.look_s = 0.01
    seen: list[str] = []
    world.after(0.005, lambda: process.kill(in_turn=False))

    def turn() -> None:
        process.clock()
        seen.append("never")

    process.post(turn)
    process.post(lambda: seen.append("nor this"))
    world.run_until(BEGIN_S + 1.0)
    assert seen == []
    assert watcher.seen == ["end 0.005"]


def test_who_looks_at_the_clock_from_outside_does_not_end_the_process(world: World) -> None:
    process = Process(world, Nobody(), [])
    process.kill(in_turn=True)
    assert process.clock() == BEGIN_S
    assert not process.is_dead
    process.post(lambda: [process.clock()].clear())
    assert process.is_dead


def test_a_pause_may_come_some_looks_later(world: World) -> None:
    process = Process(world, Nobody(), [])
    process.hang(1.0, in_turn=True, skips=2)
    seen: list[float] = []
    process.post(lambda: seen.extend(process.clock() - BEGIN_S for _ in range(4)))
    assert [round(at) for at in seen] == [0, 0, 0, 1]


def test_the_signal_of_an_alarm_comes_before_anything_else(world: World) -> None:
    process = Process(world, Nobody(), [])
    seen: list[str] = []

    def turn() -> None:
        process.alarm.set(0.5)
        process.alarm.breaks_in = True
        try:
            process.clock()
            seen.append("goes on")
        except StoodStill:
            seen.append("rang")

    process.hang(1.0, in_turn=True)
    process.post(turn)
    assert seen == ["rang"]
    assert process.alarm.rang


@pytest.mark.parametrize(("seconds", "rang"), [(0.4, False), (0.6, True)])
def test_an_alarm_that_breaks_nothing_off_is_known(world: World, seconds: float, rang: bool) -> None:
    process = Process(world, Nobody(), [])
    process.alarm.set(0.5)
    process.hang(seconds, in_turn=False)
    world.run_until(BEGIN_S + seconds)
    assert process.alarm.rang is rang


def test_it_does_not_stand_still_within_a_turn_of_another(world: World) -> None:
    """The other one would stand still with it."""
    watcher = Nobody()
    one, other = Process(world, watcher, []), Process(world, Nobody(), [])
    one.look_s = other.look_s = 0.01
    one.hang(0.5, in_turn=True)
    seen: list[float] = []
    world.after(0.005, lambda: one.post(lambda: seen.append(one.clock())))
    other.post(lambda: seen.append(other.clock()))
    assert world.now - BEGIN_S < 0.1
    assert not watcher.seen
    one.post(lambda: seen.append(one.clock()))
    assert watcher.seen[0].startswith("still")
    assert world.now - BEGIN_S > 0.5
