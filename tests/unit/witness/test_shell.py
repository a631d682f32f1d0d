"""The witness at work: answers before frames, findings in the order of their time, each to its bus."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from types import SimpleNamespace

import pytest

from bridge.witness import shell
from bridge.witness.findings import Alarm, AlarmKind, Finding
from bridge.witness.numbers import UnitReading
from bridge.witness.output_plan import Values
from bridge.witness.plan import EnableWord, WatchedBus, WatchedDrive, WatchedOutputs
from bridge.witness.shell import CannotListen, Witness

FU1 = WatchedDrive(
    "conveyor/fu1",
    1,
    0x205,
    0x185,
    EnableWord(0, 2, 0x0F, 0x0F),
    EnableWord(0, 2, 0x7F, 0x37),
    200,
    40,
    600,
    1500,
)
FU2 = replace(FU1, name="lift/fu1", unit_id=2)
IO = WatchedOutputs("io", 3, 21, {0x215: Values(1, 0xFF, 0)}, timeout_ms=200, beside_ms=40)
BUSES = (
    WatchedBus("can0", "vcan0", (FU1,), {}),
    WatchedBus("can1", "vcan1", (FU2,), {}, outputs=(IO, replace(IO, name="other", why_unknown="no file"))),
)
RUN, ENABLED = bytes.fromhex("7F 04"), bytes.fromhex("37 0B")


class World:
    """The interfaces, the bridge that tells numbers, and the clock. ``waits`` has what was waited for."""

    def __init__(self) -> None:
        self.now = 100.0
        self.missing: set[str] = set()
        self.listeners: dict[str, Listener] = {}
        self.readings: list[UnitReading] = []
        self.is_lost = False
        self.number: int | None = 9
        self.deadline = 1e9
        self.waits: list[tuple[list[int], float]] = []
        self.order: list[str] = []
        self.closed: list[str] = []
        self.why = "gone"

    # what Numbers has

    def fileno(self) -> int | None:
        return self.number

    def close(self) -> None:
        self.closed.append("numbers")

    def next_deadline(self) -> float:
        return self.deadline

    def receive(self, now: float) -> list[UnitReading]:
        self.order.append("answers")
        found, self.readings = self.readings, []
        return found

    def on_time(self, now: float) -> None:
        self.order.append("time")

    def take_lost(self) -> bool:
        lost, self.is_lost = self.is_lost, False
        return lost


class Listener:
    def __init__(self, world: World, channel: str, can_ids: Sequence[int]) -> None:
        if channel in world.missing:
            raise OSError(19, "No such device")
        self.world, self.channel, self.can_ids = world, channel, can_ids
        self.came: list[tuple[int, bytes, float]] = []
        world.listeners[channel] = self

    def fileno(self) -> int:
        return int(self.channel.removeprefix("vcan"))

    def close(self) -> None:
        self.world.closed.append(self.channel)

    def frames(self) -> Iterator[tuple[int, bytes, float]]:
        self.world.order.append(self.channel)
        came, self.came = self.came, []
        yield from came


@pytest.fixture
def world(monkeypatch: pytest.MonkeyPatch) -> World:
    world = World()

    def wait(read: list[int], write: list[int], error: list[int], timeout_s: float) -> None:
        world.waits.append((read, timeout_s))

    monkeypatch.setattr(shell, "CanSocket", lambda channel, can_ids: Listener(world, channel, can_ids))
    monkeypatch.setattr(shell, "select", SimpleNamespace(select=wait))
    monkeypatch.setattr(shell, "time", SimpleNamespace(monotonic=lambda: world.now))
    return world


def turns(world: World, witness: Witness, *seconds: float) -> None:
    """One turn at each of these times."""
    left = list(seconds)

    def over(now: float) -> bool:
        if not left:
            return True
        world.now = left.pop(0)
        return False

    witness.run_until(over)


def witnessing(world: World, told: list[Finding], *, asks: bool = True) -> Witness:
    return Witness(BUSES, world if asks else None, told.append)  # pyright: ignore[reportArgumentType]


def test_each_bus_has_its_interface_and_identifiers(world: World) -> None:
    witnessing(world, [])
    assert {name: list(one.can_ids) for name, one in world.listeners.items()} == {
        "vcan0": [0x185, 0x205],
        "vcan1": [0x185, 0x205, 0x215, 0x715],
    }


def test_all_interfaces_that_are_missing_are_named_and_the_others_let_go(world: World) -> None:
    world.missing = {"vcan1"}
    with pytest.raises(CannotListen, match=r"^cannot listen on vcan1: No such device$"):
        witnessing(world, [])
    assert world.closed == ["vcan0", "numbers"]


@pytest.mark.parametrize("asks", [True, False])
def test_it_lets_go_of_everything(world: World, asks: bool) -> None:
    witnessing(world, [], asks=asks).close()
    assert world.closed == ["vcan0", "vcan1", *["numbers"] * asks]


@pytest.mark.parametrize(
    ("asks", "number", "deadline", "waited"),
    [
        (True, 9, 1e9, ([0, 1, 9], 0.05)),
        (True, None, 1e9, ([0, 1], 0.05)),
        (True, 9, 100.02, ([0, 1, 9], 0.02)),
        (True, 9, 99.0, ([0, 1, 9], 0.0)),
        (False, 9, 99.0, ([0, 1], 0.05)),
    ],
)
def test_it_waits_for_frames_and_answers_and_no_longer_than_a_tick(
    world: World, asks: bool, number: int | None, deadline: float, waited: tuple[list[int], float]
) -> None:
    world.number, world.deadline = number, deadline
    turns(world, witnessing(world, [], asks=asks), 100.0)
    ((read, timeout_s),) = world.waits
    assert (read, timeout_s) == (waited[0], pytest.approx(waited[1]))


def test_answers_are_taken_before_frames(world: World) -> None:
    turns(world, witnessing(world, []), 100.0)
    assert world.order == ["answers", "time", "vcan0", "vcan1"]


@pytest.mark.parametrize(("unit", "name"), [(1, "conveyor/fu1"), (2, "lift/fu1"), (3, "io")])
def test_a_reading_reaches_its_owner(world: World, unit: int, name: str) -> None:
    told: list[Finding] = []
    witness = witnessing(world, told)
    world.readings = [UnitReading(unit, 5, None, 100.0, 100.0)]
    turns(world, witness, 100.0)
    channel, can_id, data = {
        1: ("vcan0", 0x205, RUN),
        2: ("vcan1", 0x205, RUN),
        3: ("vcan1", 0x215, b"\x01"),
    }[unit]
    world.listeners[channel].came = [(can_id, data, 100.3)]
    world.readings = [UnitReading(unit, 5, None, 100.4, 100.4)]
    turns(world, witness, 100.4, 100.5)
    (alarm,) = told
    assert isinstance(alarm, Alarm)
    assert (alarm.source, alarm.kind) == (name, AlarmKind.LATE)


def test_lost_numbers_are_lost_to_every_bus(world: World) -> None:
    told: list[Finding] = []
    witness = witnessing(world, told)
    world.is_lost = True
    turns(world, witness, 100.0, 106.0)
    assert [(one.source, "gone" in one.message) for one in told if isinstance(one, Alarm)] == [
        ("can0", True),
        ("can1", True),
    ]


def test_a_witness_that_does_not_ask_is_not_blind(world: World) -> None:
    told: list[Finding] = []
    turns(world, witnessing(world, told, asks=False), 100.0, 106.0)
    assert not told


def test_findings_of_all_buses_are_told_in_the_order_of_their_time(world: World) -> None:
    told: list[Finding] = []
    witness = witnessing(world, told, asks=False)
    world.listeners["vcan0"].came = [(0x185, ENABLED, 100.0), (0x185, bytes(2), 100.3)]
    world.listeners["vcan1"].came = [(0x185, ENABLED, 100.0), (0x185, bytes(2), 100.2)]
    turns(world, witness, 100.4)
    assert [one.time for one in told] == [100.2, 100.3]
