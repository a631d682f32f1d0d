"""A round judges what is due: the same comes of it as of a round that looks at every drive."""

from __future__ import annotations

import random
from collections.abc import Callable, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from bridge.can.interface import ControllerState
from bridge.canopen.frame import Frame
from bridge.command import Action, Drive, Identity, Role, Source
from bridge.config import Site, load_site
from bridge.image import Reading
from bridge.master.line import Repeated
from tests.support import sites
from tests.support.bench import PLC, Bench
from tests.support.nightly import by_night_of

SEEDS = 24
MOVES = 150
EXACT_S = 1e-9
ANN = Identity(Source.OPCUA, "ann", Role.ENGINEER)
BOB = Identity(Source.ZENOH, "bob")
TPDOS = (0x185, 0x1C5, 0x1A5, 0x1E5)
WORDS = (0x0000, 0x047E, 0x047F, 0x04FE, 0x04FF, 0x047D, 0x007F, 0x040F)
STATES = (0x0B40, 0x0B31, 0x0B33, 0x0B37, 0x0B17, 0x0B08, 0x0B0F, 0x0300)
STOPS = (Action.STOP, Action.QUICK_STOP, Action.DISABLE_VOLTAGE, Action.RELEASE_CONTROL, Action.RESET_FAULT)
ON_NODE = (Action.RESET, Action.STOP_NODE, Action.START_NODE, Action.ENTER_PRE_OPERATIONAL)


class Everything:
    """In place of ``Deadlines``: looks at every drive, each time."""

    missed = 0
    is_touched = True
    """So that each frame has a whole round."""

    def __init__(self, drives: Sequence[Drive]) -> None:
        self._drives = drives

    def take_due(self, now: float) -> list[Drive]:
        return [drive for drive in self._drives if (at := drive.next_deadline(now)) is not None and at <= now]

    def next(self, now: float) -> float | None:
        times = (drive.next_deadline(now) for drive in self._drives)
        return min((at for at in times if at is not None), default=None)

    def touch(self, owner: Drive) -> None: ...

    def sweep(self, now: float) -> list[Drive]:
        return []


def site(folder: Path) -> Site:
    drives = (
        sites.drive("fu1", "modbus", 200, f"{sites.SCALED}\nthen_silence_ms = 70\ntpdo_deadline_ms = 40"),
        sites.drive("fu2", "lease", 150, 'on_expiry = "quick_stop"\nfieldbus_timeout_writable = true'),
        sites.drive("fu3", "modbus", 90, 'on_expiry = "stop"\ntelegram_downtime_s = 0.3'),
        sites.drive("fu4", "zenoh", 0),
    )
    whole = sites.bus(sites.node(*drives), more="rpdo_period_ms = 20")
    return load_site(sites.write(folder, whole, sites.modbus(), sites.zenoh(), sites.opcua(), name="due"))


class Nothing:
    """A plant of which nothing is known to have changed."""

    def take_changed(self, bus: str) -> set[str]:
        return set()


class Play:
    """Random traffic. After each round the timer is set to the earliest deadline, or to an earlier time."""

    def __init__(self, folder: Path, seed: int) -> None:
        self.bench = Bench(site(folder))
        self.drives = tuple(self.bench.plant.drives.values())
        self._random = random.Random(seed)
        self.rounds = self.short = 0

    def check_rounds(self, *, takes_in: bool) -> None:
        """``takes_in``: as when a bus or the timer wakes the master, not a request."""
        bench, master = self.bench, self.bench.master

        def checked() -> None:
            due = master._due
            if takes_in:
                master.take_in()
                self.short += master._due is due
            else:
                master.pump()
            self.rounds += 1
            (line,) = bench.master._lines
            if not bench.plant._changed["can0"]:
                anew = Repeated(bench.network, Nothing())  # type: ignore[arg-type]
                assert line.repeated._repetitions == anew.repetitions(), "what is repeated is not up to date"
            armed = bench.wake_at
            for drive in self.drives:
                at = drive.next_deadline(bench.now)
                assert at is None or armed <= at, f"{drive.name} is due at {at}, the timer set to {armed}"

        bench.turn = checked  # type: ignore[method-assign]

    def play(self, moves: int) -> None:
        self.bench.run(3.0)
        for _ in range(moves):
            self._random.choice(self._moves)(self)
            self.bench.run(self._random.choice((0.0, 0.0003, 0.004, 0.011, 0.05, 0.13)))
        self.bench.run(2.0)

    def _drive(self) -> str:
        return self._random.choice(self.drives).name

    def _who(self) -> Identity:
        return self._random.choice((PLC, PLC, ANN, BOB))

    def _ask(self, action: Action, target: str, **more: Any) -> None:
        self.bench.ask(action, target, self._who(), **more)

    def _write(self) -> None:
        word, setpoint = self._random.choice(WORDS), self._random.choice((0, 0x1000))
        self._ask(Action.WRITE, self._drive(), values={"control_word": word, "setpoint_1": setpoint})

    def _command(self) -> None:
        self._ask(self._random.choice(STOPS), self._drive())

    def _enable(self) -> None:
        """As a controller does it, and then a word for each 50 ms."""
        drive, who = self._random.choice((("fu1", PLC), ("fu2", ANN), ("fu3", PLC), ("fu4", BOB)))
        bench, name = self.bench, f"conveyor/{drive}"
        bench.ask(Action.TAKE_CONTROL, name, who, ttl_ms=self._random.choice((100, 400, 5000)))
        bench.ask(Action.RESET_FAULT, name, who)
        for word in (0x047E, 0x047F, *[0x047F] * self._random.randrange(8)):
            bench.ask(Action.WRITE, name, who, values={"control_word": word, "setpoint_1": 0x1000})
            bench.run(0.05)

    def _timeout(self) -> None:
        timeout_ms = self._random.choice((20, 60, 5000))
        self._ask(Action.SET_TIMEOUT, "conveyor/fu2", timeout_ms=timeout_ms)

    def _tpdo(self) -> None:
        """A telegram that the drive itself would not send."""
        data = self._random.choice(STATES).to_bytes(2, "little") + self._random.randbytes(6)
        self.bench.receive(Frame(self._random.choice(TPDOS), data[: self._random.choice((8, 8, 8, 7))]))

    def _tpdo_of_before(self) -> None:
        """Its time stamp is from before the last round."""
        frame = Frame(
            self._random.choice(TPDOS), bytes(8), self.bench.now - self._random.choice((0.001, 0.03))
        )
        if frame.can_id in self.bench.bus.accepted:
            self.bench.bus.inbox.append(frame)

    def _emergency(self) -> None:
        code = self._random.choice((0x0000, 0x2310, 0x8130))
        self.bench.receive(Frame(0x085, code.to_bytes(2, "little") + bytes(6)))

    def _heartbeat(self) -> None:
        self.bench.receive(Frame(0x705, bytes((self._random.choice((0x00, 0x04, 0x05, 0x7F)),))))

    def _on_node(self) -> None:
        self.bench.ask(self._random.choice(ON_NODE), "conveyor", ANN)

    def _cut(self) -> None:
        self.bench.cut = not self.bench.cut

    def _deaf(self) -> None:
        self.bench.deaf_to = frozenset(self._random.sample(TPDOS, self._random.randrange(4)))

    def _hang(self) -> None:
        self.bench.hang(self._random.choice((0.03, 0.09, 0.3)))

    def _bus(self) -> None:
        status = self.bench.bus.status
        is_up = status.state is ControllerState.OK
        status.state = ControllerState.DOWN if is_up else ControllerState.OK
        status.outages += is_up

    def _connection(self) -> None:
        self.bench.view.on_connection(self._who(), is_there=self._random.random() < 0.5)

    _moves: tuple[Callable[[Play], None], ...]


Play._moves = (
    *[Play._write] * 4,
    *[Play._enable] * 8,
    *[Play._command] * 2,
    Play._timeout,
    *[Play._tpdo] * 4,
    *[Play._tpdo_of_before] * 2,
    Play._emergency,
    Play._heartbeat,
    Play._on_node,
    *[Play._cut] * 2,
    *[Play._deaf] * 2,
    Play._hang,
    Play._bus,
    Play._connection,
)


def outcome_of(play: Play) -> SimpleNamespace:
    """Without how late a round was: a round that is left out does not put off what the timer was set to."""
    bench = play.bench
    image: list[tuple[str, Reading]] = [
        (p.name, bench.plant.image.read(p.name)) for p in bench.plant.image.points
    ]
    image = [one for one in image if one[0] != "bridge/worst_round_lateness_ms"]
    events = [event for event in bench.events if "a round came" not in event.message]
    return SimpleNamespace(log=bench.log, events=events, image=image)


@pytest.mark.landing
@pytest.mark.parametrize("seed", by_night_of(range(SEEDS), 4))
def test_nothing_is_missed_and_the_same_comes_of_it(tmp_path: Path, seed: int) -> None:
    play, other = Play(tmp_path, seed), Play(tmp_path, seed)
    other.bench.plant._deadlines = Everything(other.drives)  # type: ignore[assignment]
    takes_in = bool(seed % 2)
    play.check_rounds(takes_in=takes_in)
    play.play(MOVES)
    other.play(MOVES)
    found, expected = outcome_of(play), outcome_of(other)
    assert found.events == expected.events
    assert found.log == expected.log
    assert found.image == expected.image
    assert play.rounds > MOVES
    assert (play.short > 20) is takes_in
    assert play.bench.plant._deadlines.missed == 0


class Never(Everything):
    """No deadline is ever judged."""

    is_touched = False

    def take_due(self, now: float) -> list[Drive]:
        return []

    def next(self, now: float) -> float | None:
        return None


def test_a_silent_owners_drive_is_stopped_although_no_deadline_is_judged(tmp_path: Path) -> None:
    """With each renewal its burst gets the end that its owner's time gives it."""
    play = Play(tmp_path, 0)
    bench = play.bench
    bench.run(3.0)
    bench.write(control_word=0x047E)
    bench.keep_writing(1.0, control_word=0x047F, setpoint_1=0x1000)
    bench.plant._deadlines = Never(play.drives)  # type: ignore[assignment]
    last_telegram = bench.now
    bench.write(control_word=0x047F, setpoint_1=0x1000)
    bench.log.clear()
    bench.run(1.0)
    enabling = [frame.time for frame in bench.sent(0x205) if frame.data[0] & 0x0F == 0x0F]
    assert enabling
    assert max(enabling) < last_telegram + 0.2
    assert bench.sent(0x205)[-1].time > last_telegram + 0.9, "stopped words go on"
