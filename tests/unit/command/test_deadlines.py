"""Which drives have something to do: nobody else is asked, and nobody is forgotten."""

from __future__ import annotations

import random
from math import inf

import pytest

from bridge.catalogue import Catalogue
from bridge.command.deadlines import Deadlines
from bridge.command.drive_channel import DriveChannel
from bridge.command.drive_link import NodeState
from bridge.command.messages.event import Event, EventKind
from bridge.command.plant import Plant
from bridge.command.stop_check.drive_check import DriveStopCheck
from bridge.config import load_site
from tests.support import sites
from tests.support.node_states import node_goes
from tests.support.rig import ENABLED, INHIBITED, READY, Rig


class Owner:
    def __init__(self, name: int) -> None:
        self.name = name
        self.at = inf
        self.asked = 0

    def next_deadline(self, now: float) -> float | None:
        self.asked += 1
        return None if self.at == inf else max(self.at, now)


class Several:
    def __init__(self, count: int) -> None:
        self.owners = [Owner(name) for name in range(count)]
        self.deadlines = Deadlines[Owner]()
        for owner in self.owners:
            self.deadlines.add(owner)

    def put(self, place: int, at: float, *, told: bool = True) -> None:
        self.owners[place].at = at
        if told:
            self.deadlines.touch(self.owners[place])

    def due(self, now: float) -> list[int]:
        return [owner.name for owner in self.deadlines.take_due(now)]

    @property
    def asked(self) -> int:
        asked = sum(owner.asked for owner in self.owners)
        for owner in self.owners:
            owner.asked = 0
        return asked


@pytest.fixture
def several() -> Several:
    several = Several(40)
    assert several.deadlines.next(0.0) is None
    several.put(3, 5.0)
    several.put(7, 2.0)
    assert several.deadlines.next(0.0) == 2.0
    assert several.asked == 42
    return several


def test_nobody_is_asked_while_nothing_is_due(several: Several) -> None:
    assert several.due(1.9) == []
    assert several.deadlines.next(1.9) == 2.0
    assert several.asked == 0


def test_those_that_are_due_come_in_their_order(several: Several) -> None:
    several.put(3, 2.0)
    assert several.due(2.0) == [3, 7]
    assert several.due(2.0) == [3, 7], "until they have done something about it"
    several.put(3, inf)
    several.put(7, 3.0)
    assert several.due(2.0) == []
    assert several.deadlines.next(2.0) == 3.0


def test_what_was_put_off_is_noticed_when_the_old_time_comes(several: Several) -> None:
    several.put(7, 4.0, told=False)
    assert several.due(2.0) == []
    assert several.asked == 1
    assert several.deadlines.next(2.0) == 4.0
    assert several.due(4.0) == [7]


def test_nobody_has_to_wake_up_for_what_was_put_off_a_moment_before_it(several: Several) -> None:
    several.put(7, 4.0, told=False)
    assert several.deadlines.next(1.9) == 2.0
    assert several.deadlines.next(1.996) == 4.0


def test_who_is_brought_forward_alone_is_asked_anew(several: Several) -> None:
    several.asked  # noqa: B018 - from zero
    several.owners[7].at = 1.5
    several.deadlines.touch(several.owners[7])
    assert several.deadlines.next(1.0) == 1.5
    assert several.asked == 1


@pytest.mark.parametrize("seed", range(20))
def test_each_comes_at_its_time_however_often_all_were_brought_forward(seed: int) -> None:
    several, chance = Several(8), random.Random(seed)
    at = dict.fromkeys(range(8), 1e6)
    for _ in range(chance.randrange(300)):
        place = chance.randrange(8)
        at[place] -= chance.randrange(1, 1000)
        several.put(place, at[place])
        several.deadlines.next(0.0)
    expected = sorted((when, place) for place, when in at.items() if when < 1e6)
    come: list[tuple[float, int]] = []
    while (when := several.deadlines.next(0.0)) is not None:
        for place in several.due(when):
            come.append((when, place))
            several.put(place, inf, told=False)
    assert come == expected


def test_it_holds_no_more_than_a_few_entries_each() -> None:
    several = Several(3)
    for step in range(10_000):
        several.put(step % 3, 1e6 - step)
        several.deadlines.next(0.0)
    assert len(several.deadlines._heap) <= 24
    assert several.deadlines.next(0.0) == 1e6 - 9999
    assert several.due(1e6) == [0, 1, 2]


@pytest.mark.landing(20)
@pytest.mark.parametrize("seed", range(20))
def test_it_finds_whatever_is_due_and_nothing_else(seed: int) -> None:
    chance, several, now = random.Random(seed), Several(6), 0.0
    for _ in range(3000):
        place = chance.randrange(6)
        owner = several.owners[place]
        at = now + chance.choice((0.001, 0.01, 0.3, 5.0, inf))
        several.put(place, at, told=at < owner.at or chance.random() < 0.3)
        if chance.random() < 0.5:
            earliest, planned = min(owner.at for owner in several.owners), several.deadlines.next(now)
            assert planned is None or planned <= max(earliest, now)
            assert planned is not None or earliest == inf
        now += chance.choice((0.0, 0.0004, 0.002, 0.1, 1.0))
        expected = [owner.name for owner in several.owners if owner.at <= now]
        assert several.due(now) == expected
        for name in expected:
            several.put(name, now + chance.choice((0.002, 0.4, inf)), told=False)


def test_what_nobody_told_of_is_found_by_looking_at_a_few_each_time(several: Several) -> None:
    several.put(20, 1.0, told=False)
    several.asked  # noqa: B018 - from zero
    found = [[owner.name for owner in several.deadlines.sweep(0.0)] for _ in range(10)]
    assert several.asked == 40, "each one once"
    assert found == [[20] if step == 5 else [] for step in range(10)]
    assert several.deadlines.missed == 1
    assert not any(several.deadlines.sweep(0.0) for _ in range(10)), "it is known now"
    assert several.deadlines.next(0.0) == 1.0


def test_what_was_told_of_is_not_missed(several: Several) -> None:
    several.put(20, 1.0)
    assert not any(several.deadlines.sweep(0.0) for _ in range(10))
    assert several.deadlines.missed == 0


def test_of_nobody_nothing_is_due() -> None:
    nobody = Several(0).deadlines
    assert (nobody.take_due(1.0), nobody.next(1.0), nobody.sweep(1.0)) == ([], None, [])


def test_a_drive_of_which_nobody_told_is_reported(tmp_path) -> None:
    whole = sites.bus(sites.node(sites.drive("fu1", "modbus", 200)))
    site = load_site(sites.write(tmp_path, whole, sites.modbus()))
    plant = Plant(Catalogue.of(site, {sites.FAMILY: sites.family(sites.FAMILY)}), "0")
    events: list[Event] = []
    plant.on_event(events.append)
    (drive,) = plant.drives.values()
    node_goes(plant, plant.nodes["conveyor"], NodeState.OPERATIONAL, 10.0)
    assert plant.next_deadline(10.0) is None
    drive.channel.link.pdo_deadline_s = 0.1
    events.clear()
    for _ in range(10):
        plant.refresh(10.0)
    assert [(event.kind, event.severity, event.source) for event in events] == [
        (EventKind.WATCHDOG, 700, "conveyor/fu1")
    ]
    assert plant.image.read("bridge/missed_deadlines").value == 1
    assert plant.next_deadline(10.0) == pytest.approx(10.1)
    for step in range(1, 6):
        drive.channel.link.pdo_deadline_s = 0.1 - step / 1000
        plant.refresh(10.0)
        plant.next_deadline(10.0)
    assert plant.image.read("bridge/missed_deadlines").value == 6
    assert len(events) == 3, "not for ever"


class Told:
    """What a channel and what follows it tell of their deadlines."""

    def __init__(self) -> None:
        self.rig = Rig(pdo_deadline_s=0.05)
        self.channel: DriveChannel = self.rig.channel
        self.stop_check = DriveStopCheck(self.channel)

    def earliest(self, now: float) -> float:
        times = self.channel.link.next_deadline(), self.stop_check.next_deadline()
        return min((max(at, now) for at in times if at is not None), default=inf)


@pytest.mark.landing(30)
@pytest.mark.parametrize("seed", range(30))
def test_whoever_brings_a_deadline_forward_tells(seed: int) -> None:
    """Of the drive's link and of its stops; what changes the leg settles."""
    chance, told = random.Random(seed), Told()
    channel, following, now = told.channel, told.stop_check, 100.0
    channel.on_node(NodeState.OPERATIONAL, now)
    words = (INHIBITED, READY, ENABLED, 0x0B17)

    def pdo(at: float) -> None:
        following.before_pdo(at)
        channel.on_pdo(at)
        channel.on_status_word(chance.choice(words), at)
        following.after_pdo(at)

    for _ in range(1500):
        now += chance.choice((0.001, 0.02, 0.06, 0.3))
        before = told.earliest(now)
        told.rig.effects.due.clear()
        match chance.randrange(9):
            case 0:
                following.on_handed_over(now, 20, None)
            case 1:
                following.on_cut_off(now, 20, None)
            case 2:
                following.on_node_stopped(now)
            case 3:
                following.on_restart()
            case 4 | 5 | 6:
                pdo(now - chance.choice((0.0, 0.0, 0.03)))
            case 7:
                channel.link.on_time(now)
                following.on_time(now)
                continue
            case _:
                channel._show = lambda at: following.on_settled()
                told.rig.now = now
                channel.on_node(chance.choice((NodeState.OPERATIONAL, NodeState.LOST)), now)
                channel.on_bridge_gap(now)
                continue
        after = told.earliest(now)
        assert after >= before or told.rig.effects.due, "nobody was told"
