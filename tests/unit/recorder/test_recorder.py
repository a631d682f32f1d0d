"""The recorder writes segments, checkpoints and incidents, and ends nothing whatever fails it."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from bridge.can.interface import BusStatus
from bridge.can.virtual import VirtualWire
from bridge.command import Event, EventKind, Identity, Outcome, Request, Source
from bridge.command.messages.request import Action, command_of
from bridge.config import load_site
from bridge.project import load_project
from bridge.recorder import recorder as module
from bridge.recorder.checkpoint import load, save
from bridge.recorder.core_names import Unusable
from bridge.recorder.recorder import Recorder
from bridge.recorder.recording import read
from bridge.recorder.replay import PlayedAlarm, PlayedBus, PlayingTape, Replay
from bridge.recorder.ring import parts_of, segments_in, write_recording
from bridge.recorder.tape import facts_of
from bridge.service.bus_process import BusProcess
from bridge.text import Text
from tests.support import sites
from tests.support.core import Core, core_of
from tests.support.process import REPOSITORY

_LONGEST_S = 60.0
WHO = Identity(Source.MODBUS, "10.0.0.5")
NOWHERE = PlayedBus("can0", PlayingTape(), facts_of(BusStatus()))


class Recorded:
    """A core that is recorded."""

    def __init__(self, folder: Path, more: str = "") -> None:
        node = sites.node(sites.drive("fu1", "modbus", 200))
        self.site = sites.write(folder, sites.bus(node), sites.modbus(0), f"[recorder]\nafter_s = 0\n{more}")
        self.state = folder / "state"
        self.state.mkdir()
        self.recorder = Recorder(load_site(self.site))
        self.core: Core = core_of(self.site, self.recorder.tape, self.recorder.taped)
        self.core.master.attach(lambda at: None)

    def start(self) -> None:
        self.recorder.start(*self.core)

    def until(self, done: Callable[[], bool]) -> None:
        """Have it look again and again."""
        end = time.monotonic() + _LONGEST_S
        while not done():
            assert time.monotonic() < end
            self.recorder.look(time.monotonic())
            time.sleep(0.01)

    def asks(self) -> list[Outcome]:
        """A request that is refused; its outcome."""
        outcomes: list[Outcome] = []
        self.core.view.submit(Request(WHO, "conveyor/fu1", command_of(Action.START)), outcomes.append)
        return outcomes

    def has_state(self, number: int) -> bool:
        return (self.state / "recorder" / f"{number:06}.state").exists()


@pytest.fixture
def recorded(tmp_path: Path) -> Recorded:
    return Recorded(tmp_path)


def test_what_was_asked_and_answered_is_replayed(recorded: Recorded, tmp_path: Path) -> None:
    recorded.start()
    recorded.until(lambda: recorded.has_state(1))
    recorded.core.master.wake()
    [outcome] = recorded.asks()
    recorded.recorder.close()
    folder = recorded.state / "recorder"
    write_recording(parts_of(folder, segments_in(folder)), tmp_path / "x.recording")
    [segment] = read(tmp_path / "x.recording")
    assert segment.state
    replay = Replay(segment)
    while replay.step() is not None:
        pass
    assert (replay.turns, outcome.ok) == (2, False)
    assert replay.tape.told > 2


def test_an_incident_is_written_out(recorded: Recorded) -> None:
    recorded.start()
    recorded.until(lambda: recorded.has_state(1))
    said = Text.of("watchdog.deadline_missed")
    recorded.core.plant.report(Event(time.monotonic(), EventKind.WATCHDOG, "conveyor/fu1", 900, said))
    black_box = recorded.state / "black_box"
    recorded.until(lambda: any(black_box.glob("*.recording")))
    [file] = black_box.iterdir()
    assert file.name.endswith("-watchdog-conveyor-fu1.recording")
    assert read(file)[0].state
    recorded.recorder.close()


def test_a_look_at_what_is_no_incident_writes_nothing(recorded: Recorded) -> None:
    recorded.start()
    recorded.until(lambda: recorded.has_state(1))
    said = Text.of("watchdog.deadline_missed")
    recorded.core.plant.report(Event(time.monotonic(), EventKind.WATCHDOG, "bridge", 500, said))
    recorded.recorder.look(time.monotonic())
    recorded.recorder.close()
    assert list((recorded.state / "black_box").iterdir()) == []


def test_a_folder_that_cannot_be_written_is_told_and_stops_nothing(recorded: Recorded) -> None:
    (recorded.state / "recorder").write_text("a file where the folder should be", encoding="ascii")
    events: list[Event] = []
    recorded.core.plant.on_event(events.append)
    recorded.start()
    recorded.core.master.wake()
    assert recorded.asks()
    assert [event.kind for event in events if "nothing is recorded" in event.message]
    recorded.recorder.look(time.monotonic())
    recorded.recorder.close()


def test_another_segment_begins_where_a_checkpoint_failed(
    recorded: Recorded, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_RETRY_S", 0.01)
    started: list[int] = []
    fork = module._fork

    def forked(work: Callable[[], int]) -> int:
        started.append(fork((lambda: 1) if not started else work))
        return started[-1]

    monkeypatch.setattr(module, "_fork", forked)
    recorded.start()
    recorded.until(lambda: recorded.has_state(2))
    assert not recorded.has_state(1)
    recorded.recorder.close()


def test_why_there_is_no_checkpoint_is_told_once(recorded: Recorded, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_RETRY_S", 0.01)
    monkeypatch.setattr(module, "_LONGEST_RETRY_S", 0.01)

    def fail(root: object) -> bytes:
        raise Unusable("a Pace is neither of the core nor around it")

    monkeypatch.setattr(module.checkpoint, "save", fail)
    events: list[Event] = []
    recorded.core.plant.on_event(events.append)
    recorded.start()
    recorded.until(lambda: recorded.recorder.ring.state_path(3).with_suffix(".turns").exists())
    [said] = [event.message for event in events if event.kind is EventKind.CONFIGURATION]
    assert "a Pace is neither of the core nor around it" in said
    recorded.recorder.close()


def test_the_service_as_it_runs_can_be_recorded() -> None:
    """With everything that listens to its core: servers, mirror, audit log, page."""
    project = load_project(REPOSITORY / "bridge" / "demo" / "site.toml")
    recorder = Recorder(project.site)
    service = BusProcess(project, lambda table: VirtualWire().end(table.name), recorder=recorder)
    root = service.master, service.view, service.plant
    _, _, plant = load(save(root), PlayingTape(), lambda name: NOWHERE, PlayedAlarm())
    assert plant.drives.keys() == service.plant.drives.keys()


def test_no_process_can_be_started(recorded: Recorded, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(work: Callable[[], int]) -> int:
        raise BlockingIOError(11, "Resource temporarily unavailable")

    monkeypatch.setattr(module, "_fork", refuse)
    recorded.start()
    recorded.core.master.wake()
    assert recorded.asks()
    recorded.recorder.close()


def test_the_end_does_not_wait_for_a_checkpoint(recorded: Recorded, monkeypatch: pytest.MonkeyPatch) -> None:
    fork = module._fork
    children: list[int] = []

    def sleep() -> int:
        signal.pause()
        return 0

    monkeypatch.setattr(module, "_fork", lambda work: children.append(fork(sleep)) or children[-1])
    monkeypatch.setattr(module, "_CLOSE_S", 0.1)
    recorded.start()
    began = time.monotonic()
    recorded.recorder.close()
    assert time.monotonic() - began < 10.0
    with pytest.raises(ProcessLookupError):
        os.kill(children[0], 0)


def test_what_no_tape_can_hold_ends_the_tape_and_not_the_turn(recorded: Recorded) -> None:
    recorded.start()
    tape = recorded.recorder.tape
    assert tape.is_on
    recorded.core.view.count("modbus_refused_connections", 2**70)
    assert not tape.is_on
    assert recorded.asks()
    recorded.until(lambda: tape.is_on)
    recorded.recorder.close()


def test_a_child_has_nothing_open_but_its_own(recorded: Recorded, tmp_path: Path) -> None:
    """What it held open would keep the bursts of a dead bridge alive."""
    told = tmp_path / "open"

    def look() -> int:
        told.write_text(" ".join(path.name for path in Path("/proc/self/fd").iterdir()), encoding="ascii")
        return 0

    with (tmp_path / "held").open("w"):
        os.waitpid(module._fork(look), 0)
    assert set(told.read_text(encoding="ascii").split()) <= {"0", "1", "2", "3", "4"}
